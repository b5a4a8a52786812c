# SPDX-License-Identifier: BSD-3-Clause
"""Sheared boxes in Python."""

import numpy as np
import pytest

import carom


def fluid(rate, **more):
    sim = carom.Simulation(dimension=3, boundary="periodic", **more)
    sim.add_particles(count=256, temperature=1.0, radius=0.5)
    sim.place("fcc", packing_fraction=0.3, seed=1)
    sim.shear_rate = rate
    sim.integrator("free-flight", step=0.9)
    return sim


def test_a_flow_begins_and_ends():
    sim = fluid(1.0)
    rows = []
    sim.run(time=2.0, every=0.5, callback=lambda s: rows.append((s.time, s.shear_stress, s.work, s.tilt, s.unwrapped)))
    edge, (times, stress, work, tilt, places) = sim.box[0], zip(*rows)
    assert sim.shear_rate == 1 and np.abs((np.array(times) * edge - tilt + edge / 2) % edge - edge / 2).max() < 1e-12
    assert np.allclose(np.diff(work), np.array(stress[1:]) * 0.5 * edge**3) and min(stress[1:]) > 0
    assert sim.means["shear_stress"]["mean"] == pytest.approx(work[-1] / (2 * edge**3))
    moved = np.diff(places, axis=0)
    moved[..., 0] -= 0.25 * (np.array(places[1:]) + np.array(places[:-1]))[..., 1]
    assert np.abs(moved).max() < 3 and sim.energy_error < 1e-12

    hot, tilted = sim.temperature, sim.tilt
    sim.shear_rate = 0
    assert sim.tilt == tilted > 0
    sim.run(time=1.0)
    assert sim.temperature == pytest.approx(hot, rel=1e-13) and sim.tilt == tilted and sim.work == 0
    sim.integrator("cva", step=0.01)
    with pytest.raises(carom.UsageError, match="'cva' knows no shear yet"):
        sim.run(time=1.0)
    with pytest.raises(carom.UsageError, match="tilt is not between 0 and the edge"):
        sim.tilt = -1


def test_a_flow_that_changes_during_runs(tmp_path):
    sim = fluid([[0.5, 1.0], [1.5, 0.0], [4.0, -2.0]])
    edge = sim.box[0]
    sim.write_deck(tmp_path / "start.toml", time=2.0)
    assert "rate = [[0.5, 1.0], [1.5, 0.0], [4.0, -2.0]]" in (tmp_path / "start.toml").read_text() and sim.shear_rate == 0
    sim.run(time=1.0)
    assert sim.shear_rate == 1 and sim.tilt == pytest.approx(edge / 2, rel=1e-12)
    sim.write_deck(tmp_path / "later.toml", time=2.0)
    assert "rate = [[0.0, 1.0], [0.5, 0.0], [3.0, -2.0]]" in (tmp_path / "later.toml").read_text()
    assert carom.Simulation.from_deck(tmp_path / "later.toml").shear_rate == 1
    sim.run(time=2.0)
    assert sim.shear_rate == 0 and min(sim.tilt, edge - sim.tilt) < 1e-12 and sim.energy_error < 1e-12
    sim.integrator("free-flight", step=0.7)  # a new run, whose time begins at 0
    sim.run(time=2.25)
    assert sim.shear_rate == -2 and sim.tilt == pytest.approx(edge / 2, rel=1e-12) and sim.energy_error < 1e-12
    sim.shear_rate = 0.5
    sim.write_deck(tmp_path / "constant.toml", time=2.0)
    assert "shear = { rate = 0.5 }" in (tmp_path / "constant.toml").read_text()
    for wrong in ([[1.0, 1.0], [0.5, 2.0]], [], [[0.0, np.nan]]):
        with pytest.raises(carom.UsageError, match="shear"):
            sim.shear_rate = wrong


def test_files_of_a_box_that_was_sheared_before(tmp_path):
    """A run from a tilted lattice writes a deck and files that have the tilt, and goes on."""
    sim = fluid(0.7)
    sim.run(time=1.1)
    sim.shear_rate = 0
    tilted = sim.tilt
    sim.output(tmp_path / "after", frame_interval=0.5, thermo_interval=0.5)
    sim.run(time=1.0)
    sim.run(time=2.0)
    assert sim.energy_error < 1e-12
    run = carom.open(tmp_path / "after")
    assert f"tilt = {tilted!r}" in (tmp_path / "after/deck.toml").read_text()
    assert run.summary["max_overlap"] < 1e-11 and np.allclose(run.frames[-1].unwrapped, sim.unwrapped)


def test_the_deck_of_a_sheared_simulation(tmp_path):
    sim = fluid(-0.4)
    sim.write_deck(tmp_path / "sheared.toml", time=1.0)
    again = carom.Simulation.from_deck(tmp_path / "sheared.toml")
    assert again.shear_rate == -0.4
