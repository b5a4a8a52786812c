# SPDX-License-Identifier: BSD-3-Clause
"""Decks on which an earlier version hung, failed, or gave wrong results: contacts at rest, unequal masses, long steps, loose tolerances,
extreme numbers.

Each keeps its energy and overlaps to rounding, or it cannot run and says why.
"""

import signal
import subprocess

import pytest

from going_on import INTERRUPTED, wait_for_rows
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
@pytest.mark.parametrize("step", [0.005, 0.02])
def test_a_pile_does_not_overlap(tmp_path, ranks, step):
    """Earlier versions let these spheres sink into each other by 1e-6 of their contact distance."""
    deck, sets = write_deck(tmp_path, PILE), [f"integrator.step={step}"]
    if ranks > 1:
        mpirun(ranks, command(deck, tmp_path / "out", sets))
    else:
        run(deck, tmp_path / "out", sets)
    end = summary(tmp_path / "out")
    assert end["max_overlap"] <= 1e-11 and end["warnings"] == []
    assert end["energy"]["dissipated"] > 0.1


def test_spheres_without_room_are_an_error(tmp_path):
    deck = ROOT / "tests" / "data" / "hard" / f"{JAMMED}.toml"
    done = subprocess.run(command(deck, tmp_path / "out"), capture_output=True, text=True, timeout=TIME_LIMIT)
    assert done.returncode == 4
    assert "collide without end at one instant: they touch on all sides and have no room to part; leave gaps" in done.stderr


@pytest.mark.parametrize("method", ["cdda", "cva", "mcva", "edda"])
@pytest.mark.parametrize("restitution", [0.0, 0.1, 0.3, 0.8])
@pytest.mark.parametrize("step", [0.05, 0.01])
def test_a_bouncing_ball_comes_to_rest(step, restitution, method, tmp_path):
    """It falls from a height of 2 and lies on the floor at the end, with a gap of at most a quarter of the height from which a fall gives
    the rest speed. What it takes to stop, less than ½ rest_speed², is dissipated, too."""
    out = tmp_path / "out"
    run(ROOT / "tests" / "data" / "hard" / "ball-stops-cdda.toml", out,
        [f"integrator.type={method}", f"integrator.step={step}", f"contact.0.restitution={restitution}"])
    end = summary(out)
    assert end["energy"]["max_abs_error"] < 1e-12
    lifted = end["energy"]["final"] - 0.5
    assert -1e-12 < lifted < 0.125 * 0.01**2 + 1e-12 and abs(end["energy"]["dissipated"] + lifted - 2) < 1e-12
    assert end["events"]["sphere_wall"] <= 24  # 2 restitution^n > rest_speed for so many bounces at most


# Discs between walls in free flight; changes of one number each make them extreme.
DISCS = """
format = 1
[system]
dimension = 2
box = [10.0, 10.0]
boundary = ["wall", "wall"]
[[particles]]
name = "disc"
position = [[2.0, 3.0], [5.0, 6.0], [8.0, 2.0]]
velocity = [[0.1, -1.0], [0.3, 0.2], [-1.0, 0.3]]
radius = 0.5
[[wall]]
name = "y-"
velocity = { amplitude = 0.01, frequency = 1.0 }
[[bath]]
type = "andersen"
temperature = 1.0
rate = 0.1
[[interaction]]
type = "uniform-field"
acceleration = [0.0, -1.0]
[integrator]
type = "free-flight"
step = 10.0
[run]
end_time = 10.0
"""

EXTREME = {
    "wall": (4, [], "wall.0.velocity={amplitude=0.01,frequency=1e12}", "would oscillate 1e+13 times until time 10"),
    "kicks": (4, ["integrator.type=edda", "integrator.step=0.01"], "bath.0.rate=1e9", "take a rate of at most 10000"),
    "kicks in free flight": (4, [], "bath.0.rate=1e70", "the bath would kick each particle 1e+71 times in 10 units of time"),
    "infinite speed": (2, [], "interaction.0.acceleration=[0.0,1e300]", "take units in which it is between 1e-75 and 1e+75"),
    "far wall": (4, [], "wall.0.velocity={amplitude=1e12,frequency=1.0}", "leave no room"),
}


@pytest.mark.parametrize("case", EXTREME)
def test_extreme_numbers_are_one_error(case, tmp_path):
    code, others, extreme, message = EXTREME[case]
    deck = write_deck(tmp_path, DISCS)
    done = subprocess.run(command(deck, tmp_path / "out", [*others, extreme]), capture_output=True, text=True, timeout=TIME_LIMIT)
    assert done.returncode == code and message in done.stderr, done.stderr
    assert done.stderr.count("\n") == 1


SLOW = {
    "collisions with walls": ["particles.0.velocity=[[0.0, 1e9], [1e9, 0.0], [1e9, 1.0]]"],
    "kicks": ["bath.0.rate=1e9"],
}


@pytest.mark.parametrize("case", SLOW)
def test_a_slow_epoch_without_pair_collisions_can_be_stopped(case, tmp_path):
    """Each epoch would have 10¹⁰ contacts, with walls or with the bath; a run stops within it, and goes on from there."""
    out = tmp_path / "out"
    overrides = ["integrator.max_events_per_step=100000000000", *SLOW[case]]
    job = subprocess.Popen(command(write_deck(tmp_path, DISCS), out, overrides), stderr=subprocess.PIPE, text=True)
    wait_for_rows(job, out, 1)
    job.send_signal(signal.SIGTERM)
    assert job.wait(TIME_LIMIT) == INTERRUPTED, job.stderr.read()
    end = summary(out)
    assert end["status"] == "interrupted" and end["steps"] == 0
