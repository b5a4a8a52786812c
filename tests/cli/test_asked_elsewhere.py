# SPDX-License-Identifier: BSD-3-Clause
"""The decks of inputs/asked/, which do what was asked for in the trackers of other programs (inputs/guide/asked-elsewhere.md)."""

import sys

import numpy as np
import pytest
from scipy.optimize import fsolve

from runs import ROOT, needs_carom

sys.path.insert(0, str(ROOT / "tools"))

from carom_files import Trajectory, find_carom, open_hdf5, read_thermo, run_carom

pytestmark = needs_carom


def run(name, directory):
    """The summary of a deck of inputs/asked, whose ledger must be closed to rounding."""
    summary = run_carom(find_carom(), ROOT / "inputs/asked" / f"{name}.toml", directory, [])
    energy = summary["energy"]
    assert summary["warnings"] == [] and summary["max_overlap"] < 1e-12
    balance = energy["final"] + energy["dissipated"] - energy["work"] - energy["heat"] - energy["initial"]
    assert abs(balance) < 1e-12 * max(energy["reference"], abs(energy["work"]))
    return summary


def events_of(directory):
    with open_hdf5(directory / "events.h5") as file:
        return {name: rows[:] for name, rows in file["events"].items()}


def test_what_contacts_lose_is_counted(tmp_path):
    """LAMMPS 3928, 4666."""
    summary, rows = run("rough-grains", tmp_path), read_thermo(tmp_path)
    assert summary["energy"]["final"] < 0.02 * summary["energy"]["initial"] and summary["energy"]["rotational"] > 0
    assert np.ptp(rows["total"] + rows["dissipated"]) < 1e-12 * rows["total"][0] and np.diff(rows["dissipated"]).min() > 0


def test_bodies_at_rest_do_not_sink(tmp_path):
    """REBOUND 865: they touch for nine tenths of the run, after bounces that each return half of the speed."""
    summary = run("two-bodies-at-rest", tmp_path)
    with Trajectory(tmp_path) as trajectory:
        distance = np.array([np.linalg.norm(np.subtract(*trajectory.position(k))) for k in range(len(trajectory))])
        speed = abs(trajectory.velocity(-1)).max()
    at_rest = trajectory.time > 150
    assert abs(distance[at_rest] - 4).max() < 1e-12 and speed < 1e-12 and summary["end_time"] == 400
    assert 5 < summary["events"]["sphere_sphere"] < 30 and summary["energy"]["final"] == pytest.approx(-1 / 4, abs=1e-12)


def test_restitution_is_an_input_at_every_size_and_angle(tmp_path):
    """LAMMPS 3025, 5007."""
    assert run("oblique-impacts", tmp_path)["events"]["sphere_wall"] == 18
    with Trajectory(tmp_path) as trajectory:
        before, after, spin = trajectory.velocity(0), trajectory.velocity(-1), trajectory.spin(-1)
        inertia = trajectory.radius**2 / 2  # of the mass 1
    assert after[:, 1] == pytest.approx(-0.8 * before[:, 1], rel=1e-14)
    energy = (after**2).sum(1) + inertia * spin**2
    assert energy.max() < (before**2).sum(1).min() and (after[:, 0] <= before[:, 0]).all()
    assert energy.reshape(3, 6).std(0).max() < 1e-14  # the same of all sizes
    # At 76 degrees the surfaces slide: the impulse along the wall is half of that along its normal.
    assert (before - after)[3::6, 0] == pytest.approx(0.5 * (after - before)[3::6, 1], rel=1e-12)


def test_loads_on_inelastic_and_moving_walls(tmp_path):
    """LAMMPS 2085, 3172, OpenMM 3684: the load on the piston is that of a shock, by Rankine, Hugoniot, Carnahan and Starling."""
    summary, rows, events = run("shock-tube", tmp_path), read_thermo(tmp_path), events_of(tmp_path)
    walls, end = summary["walls"], summary["end_time"]
    assert summary["energy"]["work"] == pytest.approx(3 * walls["x-"]["force"] * end, rel=1e-12)
    assert (walls["x-"]["force"] - walls["x+"]["force"]) * end == pytest.approx(rows["momentum_x"][-1], rel=1e-11)
    impulse = abs(events["impulse"][(events["kind"] == 1) & (events["hi"] == 1), 0])
    assert summary["energy"]["dissipated"] == pytest.approx((impulse**2).sum() * (1 - 0.5) / (1 + 0.5) / 2, rel=1e-12)

    def pressure(density, temperature):
        eta = np.pi / 6 * density
        return density * temperature * (1 + eta + eta**2 - eta**3) / (1 - eta)**3

    def jump(unknown):
        shock, temperature = unknown
        density = start * shock / (shock - 3)
        p, p0 = pressure(density, temperature), pressure(start, 1)
        return p - p0 - start * 3 * shock, 1.5 * (temperature - 1) - (p + p0) / 2 * (1 / start - 1 / density)

    start = 4000 / (99 * 20 * 20)  # the centres have a length of 99
    shock, temperature = fsolve(jump, [5, 4])
    measured = rows["pressure_x-"][rows["time"] > 5]
    assert measured.mean() == pytest.approx(pressure(start * shock / (shock - 3), temperature), rel=0.05)


def test_paths_follow_from_the_events(tmp_path):
    """DynamO 75: the events alone carry the first frame to the last."""
    summary = run("every-event", tmp_path)
    events = events_of(tmp_path)
    with Trajectory(tmp_path) as trajectory:
        x, v, length = trajectory.unwrapped(0), trajectory.velocity(0), trajectory.edges()
        last, end = trajectory.unwrapped(-1), trajectory.velocity(-1)
    t, flights = np.zeros(len(x)), []
    for time, lo, hi, impulse in zip(events["time"], events["lo"], events["hi"], events["impulse"]):
        for i, change in (lo, impulse), (hi, -impulse):
            flights.append(time - t[i])
            x[i], v[i], t[i] = x[i] + v[i] * (time - t[i]), v[i] + change, time
        apart = x[lo] - x[hi]
        assert abs(np.linalg.norm(apart - length * np.round(apart / length)) - 1) < 1e-9
    x += v * (summary["end_time"] - t)[:, None]
    assert len(events["time"]) == 20000 and abs(x - last).max() < 1e-9 and abs(v - end).max() < 1e-11
    assert np.mean(flights) == pytest.approx(summary["mean_free_time"], rel=0.02)
