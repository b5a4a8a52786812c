# SPDX-License-Identifier: BSD-3-Clause
"""Decks on which an earlier version hung, failed, or gave wrong results: contacts at rest, unequal masses, long steps, loose tolerances.

Each keeps its energy and overlaps to rounding, but for one that cannot run and says why.
"""

import subprocess

import pytest

from runs import ROOT, command, mpirun, needs_carom, run, summary, thermo, write_deck

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


# Three discs fall onto each other; at this step they sink into each other by 3.2e-7 diameters.
PILE = """
format = 1
[system]
dimension = 2
box = [5.3, 10.0]
boundary = ["wall", "wall"]
[[particles]]
name = "a"
position = [[4.323, 1.303], [3.183, 2.956], [4.309, 2.451]]
velocity = [[0.4, 0.0], [0.4, 0.0], [0.18, 0.0]]
radius = 0.5
[[contact]]
between = ["*", "*"]
restitution = 0.0
[[interaction]]
type = "uniform-field"
acceleration = [0.0, -1.0]
[integrator]
type = "cva"
step = 0.005
[run]
end_time = 2.1
"""


@pytest.mark.parametrize("ranks", [1, 2])
def test_a_pile_that_overlaps_is_a_warning(tmp_path, ranks):
    deck = write_deck(tmp_path, PILE)
    done = mpirun(ranks, command(deck, tmp_path / "out")) if ranks > 1 else run(deck, tmp_path / "out")
    end = summary(tmp_path / "out")
    assert end["max_overlap"] == pytest.approx(3.20273e-07, rel=1e-5)
    [warning] = end["warnings"]
    assert "particles 0 and 2 overlap, by 3.20273e-07 of their contact distance, at time 2.00257, which is more than rounding" in warning
    assert warning in done.stderr and warning in (tmp_path / "out" / "run.log").read_text()


def test_an_overlap_before_a_failure_is_in_the_summary(tmp_path):
    done = run(write_deck(tmp_path, PILE), tmp_path / "out", ["integrator.step=0.02"], code=4)
    assert "particles 0 and 2 overlap, by 1.07492e-06 of their contact distance, at step 73, time 1.46" in done.stderr
    [warning] = summary(tmp_path / "out")["warnings"]
    assert "particles 0 and 2 overlap, by 7.44347e-07 of their contact distance, at time 1.44" in warning and warning in done.stderr


def test_spheres_without_room_are_an_error(tmp_path):
    deck = ROOT / "tests" / "data" / "hard" / f"{JAMMED}.toml"
    done = subprocess.run(command(deck, tmp_path / "out"), capture_output=True, text=True, timeout=TIME_LIMIT)
    assert done.returncode == 4
    assert "collide without end at one instant: they touch on all sides and have no room to part; leave gaps" in done.stderr
