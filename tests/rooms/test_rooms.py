# SPDX-License-Identifier: BSD-3-Clause
"""Every room includes only lower rooms, and no result of the engine depends on the C library."""

import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parents[2]
# From the ground up. A room of one line stands beside the others in it, and includes none of them.
FLOORS = """
engine/base
engine/laws
engine/search
engine/events
engine/ranks
engine/forces
engine/setup engine/stepping
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


def sources(*folders):
    return [file for folder in folders for file in sorted((ROOT / folder).rglob("*"))
            if file.suffix in (".h", ".cc", ".cpp")]


def includes():
    for file in sources("engine", "parallel", "io"):
        for included in re.findall(r'#include "((?:engine|parallel|io)/[^"]+)"', file.read_text()):
            yield file.relative_to(ROOT).as_posix(), included


def test_includes_run_downwards():
    pairs = list(includes())
    assert len(pairs) > 500
    upwards = [f"{file} includes {included}" for file, included in pairs
               if room(file) != room(included) and FLOOR[room(file)] <= FLOOR[room(included)]]
    assert not upwards, "\n".join(upwards)


def test_no_result_depends_on_the_c_library():
    """The last bits of these functions, and the type long double, differ between processors and libraries: the functions
    of elementary.h always have equal bits."""
    functions = ("pow exp exp2 expm1 log log2 log10 log1p sin cos tan asin acos atan atan2 sinh cosh tanh asinh acosh atanh cbrt "
                 "hypot tgamma lgamma erf erfc fma normal_distribution exponential_distribution")
    banned = re.compile(rf"(?:std::|\b__builtin_)(?:{functions.replace(' ', '|')})f?\b|long double")
    found = [f"{file.relative_to(ROOT)}: {use}" for file in sources("engine", "parallel", "io/deck")
             for use in banned.findall(file.read_text())]
    assert not found, "\n".join(found)
