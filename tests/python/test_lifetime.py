# SPDX-License-Identifier: BSD-3-Clause
"""The study of lifetimes (tools/lifetime_study.py): its starts, its criterion of evaporation, and its statistics of lifetimes."""

import csv
import pathlib
import sys

import carom
import numpy as np
import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))

import lifetime_study

DECK = ROOT / "inputs" / "evaporating-cluster.toml"


def test_starts_have_the_energy_and_no_momentum():
    sim = carom.Simulation.from_deck(DECK)
    assert sim.energy == pytest.approx(-25, abs=1e-5)
    x = sim.position - sim.position.mean(axis=0)
    first, second = (lifetime_study.random_velocities(sim.position, 7.5, np.random.default_rng([1, start])) for start in (0, 1))
    assert np.abs(first - second).max() > 0.1
    for v in (sim.velocity, first, second):
        assert np.abs(v.sum(axis=0)).max() < 1e-5 and np.abs(np.cross(x, v).sum(axis=0)).max() < 1e-5
    assert 0.5 * (first**2).sum() == pytest.approx(7.5)


def test_a_cluster_is_apart_when_it_falls_into_two_groups():
    line = np.arange(13.0)[:, None] * [4.9, 0, 0]
    assert not lifetime_study.is_apart(line)  # long, but one group
    line[11:] += [0.2, 0, 0]
    assert lifetime_study.is_apart(line)      # two particles have left together


def test_lifetimes_count_the_time_of_those_that_live():
    row = {"temperature": "0.3", "energy_change": "1.0", "collisions": "5", "seconds": "0.5"}
    lives = lifetime_study.Lives([row | {"lifetime": f"{time}", "evaporated": f"{evaporated}"}
                                  for time, evaporated in ((100, 1), (200, 1), (300, 1), (600, 0))])
    assert (lives.mean, lives.error) == pytest.approx((400, 400 / 3**0.5))
    assert (lives.heating, lives.cost) == pytest.approx((4 / 1200, 2000 / 1200))
    times, alive = lives.survival(600)
    assert (list(times), list(alive)) == ([100, 200, 300, 600], [0.75, 0.5, 0.25, 0.25])


def test_the_study_shows_that_psa_heats_and_goes_on_with_its_table(tmp_path, capsys):
    arguments = [str(DECK), "--starts", "3", "--end-time", "60", "-o", str(tmp_path)]
    lifetime_study.main([*arguments, "--runs", "edda:0.02,psa:0.02,soft:0.002:1"])
    assert (tmp_path / "lifetimes.png").stat().st_size > 10000
    first = (tmp_path / "lifetimes.csv").read_text()
    rows = {(row["run"], row["start"]): row for row in csv.DictReader(first.splitlines())}
    assert len(rows) == 7
    for start in "012":
        assert abs(float(rows["edda:0.02", start]["energy_change"])) < 1e-10 < 2 < float(rows["psa:0.02", start]["energy_change"])
    assert 0 < abs(float(rows["soft:0.002", "0"]["energy_change"])) < 0.1
    lifetime_study.main([*arguments, "--runs", "edda:0.02,psa:0.02:4"])
    then = (tmp_path / "lifetimes.csv").read_text()
    assert then.startswith(first) and then.count("\n") == first.count("\n") + 1
    assert "edda:0.02           3" in capsys.readouterr().out
    with pytest.raises(SystemExit):
        lifetime_study.main([*arguments, "--runs", "edda"])
