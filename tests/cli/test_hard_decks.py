# SPDX-License-Identifier: BSD-3-Clause
"""Decks on which an earlier version hung, failed, or gave wrong results: contacts at rest, unequal masses, long steps, loose tolerances.

Each keeps its energy and overlaps to rounding, but for one that cannot run and says why.
"""

import subprocess

import pytest

from runs import ROOT, command, needs_carom, summary, thermo

pytestmark = needs_carom

DECKS = sorted((ROOT / "tests" / "data" / "hard").glob("*.toml"))
assert DECKS
TIME_LIMIT = 60  # [s], against hangs


JAMMED = "edda-heap-hang"  # its spheres fall onto rows that fill the box from wall to wall


@pytest.mark.parametrize("deck", [deck for deck in DECKS if deck.stem != JAMMED], ids=lambda deck: deck.stem)
def test_energy_and_overlaps_are_right_to_rounding(deck, tmp_path):
    done = subprocess.run(command(deck, tmp_path / "out"), capture_output=True, text=True, timeout=TIME_LIMIT)
    assert done.returncode == 0, done.stderr
    end, rows = summary(tmp_path / "out"), thermo(tmp_path / "out")
    energy = end["energy"]
    scale = max(energy["reference"], (rows["kinetic"] + abs(rows["potential"])).max())
    warned = any("rounding has added up" in warning for warning in end["warnings"])  # a step of 80 periods, a million sweeps
    assert energy["max_abs_error"] <= (1e-11 if warned and deck.stem == "edda-mass-ratio-jump" else 1e-12) * scale
    assert abs(energy["after_first_step"] - energy["initial"]) <= 1e-12 * scale
    assert end["max_overlap"] <= 1e-12


def test_spheres_without_room_are_an_error(tmp_path):
    deck = ROOT / "tests" / "data" / "hard" / f"{JAMMED}.toml"
    done = subprocess.run(command(deck, tmp_path / "out"), capture_output=True, text=True, timeout=TIME_LIMIT)
    assert done.returncode == 4
    assert "collide without end at one instant: they touch on all sides and have no room to part; leave gaps" in done.stderr
