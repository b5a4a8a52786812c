# SPDX-License-Identifier: BSD-3-Clause
"""A regression test must fail if and only if a result deviates."""

import copy
import sys
import pathlib

import pytest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))

import regression

STORED = {
    "sha256": "ab",
    "values": {"steps": 10, "end_time": 1.0, "sphere_sphere": 3, "energy_final": 2.0, "energy_reference": 2.0,
               "energy_error": 1e-3, "shadow_energy_error": None},
    "summary": {"pressure": 0.5, "sweeps": 7, "momentum.max_abs_error": None, "status": "done"},
    "thermo": {"temperature": 1.5, "shadow": None},
    "state": {"x": [[0.0, 1.0], [2.0, 3.0]], "v": [[0.5, 0.5], [0.1, 0.2]]},
}


def changed(**changes):
    """The stored result with some entries changed: sha256, a value by its name, or x of particle 1."""
    new = copy.deepcopy(STORED)
    for name, value in changes.items():
        if name == "x":
            new["state"]["x"][1][0] += value
        else:
            next(part for part in (new, new["values"], new["summary"], new["thermo"]) if name in part)[name] = value
    return new


def test_the_same_is_the_same():
    assert regression.differences(STORED, changed()) == []


@pytest.mark.parametrize("deviation", [
    {"sha256": "cd"}, {"x": 1e-15}, {"steps": 11}, {"sphere_sphere": 4}, {"end_time": 1.0 + 1e-15},
    {"energy_final": 2.0 + 1e-15}, {"energy_error": 1.00001e-3}, {"shadow_energy_error": 1e-3},
    {"pressure": 0.5 + 1e-15}, {"sweeps": 8}, {"momentum.max_abs_error": 0.0}, {"status": "failed"}, {"temperature": 1.6}, {"shadow": 1.0}])
def test_a_deviation_is_noticed(deviation):
    assert len(regression.differences(STORED, changed(**deviation))) == 1


def test_a_new_entry_is_no_deviation_but_a_lost_one_is():
    new = changed()
    new["summary"]["colour"] = 1
    assert regression.differences(STORED, new) == []
    assert regression.differences(new, STORED) == ["colour: is no more"]


def test_every_deck_has_a_result():
    decks = {deck.stem for deck in (regression.HERE / "decks").glob("*.toml")}
    assert decks and decks == {result.stem for result in (regression.HERE / "results").glob("*.json")}


def test_bits_are_those_of_the_stored_state(capsys):
    writes_the_state = [sys.executable, "-c", "import json, sys; import numpy as np; deck = sys.argv[1]\n"
                        "state = json.load(open(deck.replace('/decks/', '/results/').replace('.toml', '.json')))['state']\n"
                        "sys.stdout.buffer.write(np.array([state['x'], state['v']]).tobytes() + b'0' * int('2d' not in deck))"]
    assert regression.check_bits(writes_the_state, "cva-2d") == 0
    assert regression.check_bits(writes_the_state, "cva-3d") == 1  # one byte more
    assert capsys.readouterr().out == "cva-2d: the stored bits\ncva-3d: other bits\n"
