# SPDX-License-Identifier: BSD-3-Clause
"""Energy-stepping (tools/energy_stepping.py), with which the page about edda compares: its invariants, its convergence, its contacts."""

import pathlib
import sys
import tomllib

import carom
import numpy as np
import pytest

assert carom.Simulation  # before the tools, which would import its sources without the compiled part
ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))

import energy_stepping


def two_discs(distance, speed):
    """A deck with two discs on a spring of length 2, which move along it."""
    return {"system": {"boundary": ["wall", "wall"], "box": [20.0, 20.0]},
            "particles": [{"position": [[10 - distance / 2, 10.0], [10 + distance / 2, 10.0]], "velocity": [[speed, 0.0], [-speed, 0.0]],
                           "radius": 0.5, "mass": 1.0}],
            "interaction": [{"type": "harmonic-bond", "pairs": [[0, 1]], "stiffness": 1.0, "rest_length": 2.0}]}


def test_the_terraced_energy_is_conserved_through_collisions():
    deck = tomllib.loads((ROOT / "inputs" / "five-springs.toml").read_text())
    height = 0.01
    discs = energy_stepping.Discs(deck, 1)
    start = discs.kinetic() + discs.potential()[0]
    before = discs.kinetic() + height * (discs.potential()[0] // height)
    largest, crossings, passes = energy_stepping.energy_stepping(discs, height, 6.0)
    assert discs.kinetic() + height * (discs.potential()[0] // height) == pytest.approx(before, abs=1e-12)
    assert 0.5 * height < largest * start < 1.001 * height and passes > crossings > 100


def test_positions_converge_to_an_oscillation():
    root, end, errors = np.sqrt(2), 6.0, []
    distance = 2 + 0.3 * np.cos(root * end) - 0.6 / root * np.sin(root * end)
    for height in (1.0123e-2, 1.0123e-3, 1.0123e-4):  # no level is a turning point
        discs = energy_stepping.Discs(two_discs(2.3, 0.3), 0)
        energy_stepping.energy_stepping(discs, height, end)
        errors.append(abs(discs.x - [[10 - distance / 2, 10], [10 + distance / 2, 10]]).max())
        assert np.abs(discs.v.sum(0)).max() < 1e-12
    assert errors[0] < 0.2 and errors[2] < errors[0] / 50


def test_on_one_terrace_discs_fly_straight_and_collide():
    discs = energy_stepping.Discs(two_discs(3.0, 0.5), 0)
    largest, crossings, _ = energy_stepping.energy_stepping(discs, 1000.0, 4.0)
    assert crossings == 0 and largest == 0
    assert discs.x == pytest.approx(np.array([[8.5, 10.0], [11.5, 10.0]]), abs=1e-12)  # they met at time 2
    assert discs.v == pytest.approx(np.array([[-0.5, 0.0], [0.5, 0.0]]), abs=1e-12)
    energy_stepping.energy_stepping(discs, 1000.0, 18.0)  # to the walls and half of the way back
    assert discs.x == pytest.approx(np.array([[1.5, 10.0], [18.5, 10.0]]), abs=1e-12)


def test_other_decks_are_refused():
    deck = tomllib.loads((ROOT / "inputs" / "nine-gravity.toml").read_text())
    with pytest.raises(SystemExit, match="harmonic bonds in a hard box"):
        energy_stepping.Discs(deck, 0)
