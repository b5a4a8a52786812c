# SPDX-License-Identifier: BSD-3-Clause
"""Every room includes only what stands below it."""

import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parents[2]
# From the ground up. A room of one line stands beside the others in it, and includes none of them.
FLOORS = """
engine/base
engine/search
engine/events
engine/ranks
engine/forces
engine/setup engine/slabs
engine/integrators
engine/run
engine/carom.h engine/examples
parallel
io/deck
io/files
io/view
io/command
io/python
"""
FLOOR = {room: n for n, line in enumerate(FLOORS.split("\n")) for room in line.split()}


def room(path):
    """The room of a file: engine/forces of engine/forces/potentials/wca.cc."""
    parts = path.split("/")
    return parts[0] if parts[0] == "parallel" else "/".join(parts[:2])


def includes():
    for folder in ("engine", "parallel", "io"):
        for file in sorted((ROOT / folder).rglob("*")):
            if file.suffix not in (".h", ".cc", ".cpp"):
                continue
            for included in re.findall(r'#include "((?:engine|parallel|io)/[^"]+)"', file.read_text()):
                yield file.relative_to(ROOT).as_posix(), included


def test_includes_run_downwards():
    pairs = list(includes())
    assert len(pairs) > 500
    upwards = [f"{file} includes {included}" for file, included in pairs
               if room(file) != room(included) and FLOOR[room(file)] <= FLOOR[room(included)]]
    assert not upwards, "\n".join(upwards)
