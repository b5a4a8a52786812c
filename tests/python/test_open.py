# SPDX-License-Identifier: BSD-3-Clause
"""carom.open() on the files of the command, also without the compiled part."""

import copy
import pickle
import subprocess
import sys
import warnings

import numpy as np
import pytest

import carom
from scenes import ROOT, run_command


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs")
    sim = carom.Simulation(box=[8, 8, 8], boundary="periodic")
    sites = np.stack(np.meshgrid([1, 3, 5, 7], [1, 3, 5, 7], [1, 3, 5, 7]), -1).reshape(-1, 3)
    v = np.random.default_rng(1).normal(size=sites.shape)
    sim.add_particles(sites[:32], v[:32], charge=1, species="cation")
    sim.add_particles(sites[32:], v[32:], charge=-1, mass=2, species="anion")
    sim.add_force("coulomb", form="damped-shifted", cutoff=3.9, damping=0.2)
    sim.integrator("psa", step=0.01)
    sim.write_deck(folder / "deck.toml", steps=100, every=0.02)
    return run_command(folder / "deck.toml", folder / "run", "--set", "output.events=true", "--set", "output.rdf_interval=0.02")


def test_everything_of_a_run_is_there(run):
    assert run.summary["status"] == "done" and run.summary["steps"] == 100
    assert run.deck["run"]["steps"] == 100 and run.deck["output"]["rdf_interval"] == 0.02
    assert len(run.thermo["time"]) > 10 and np.allclose(run.thermo["total"], run.thermo["kinetic"] + run.thermo["potential"])
    assert run.averages["rdf"]["r"][0] > 0
    assert len(run.events["time"]) == sum(run.summary["events"].values()) > 0
    n = run.summary["particles"]
    assert run.frames[-1].position.shape == run.frames[0].velocity.shape == (n, run.summary["dimension"])
    assert [frame.time for frame in run.frames[1:3]] == list(run.trajectory.time[1:3])
    with pytest.raises(IndexError):
        run.frames[len(run.frames)]


@pytest.mark.parametrize("way", [copy.copy, copy.deepcopy, lambda one: pickle.loads(pickle.dumps(one))])
def test_copies_read_for_themselves(run, way):
    run.trajectory.time, run.thermo  # cached data are not copied
    other, trajectory, frame = way(run), way(run.trajectory), way(run.frames[-1])
    run.trajectory.time[0] = 7
    try:
        assert other.trajectory.time[0] == trajectory.time[0] == 0 and other.summary == run.summary
    finally:
        run.trajectory.time[0] = 0
    for each in (frame, other.frames[-1]):
        assert each.time == run.frames[-1].time and np.array_equal(each.position, run.frames[-1].position)


def test_a_run_without_events_says_so(tmp_path):
    run = run_command(ROOT / "inputs/five-springs.toml", tmp_path / "run", "--set", "run.steps=2")
    assert run.events is None and run.averages == {}


def test_mdanalysis_needs_neither_units_nor_flags(run):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        universe = run.universe()
        positions = [step.positions.copy() for step in universe.trajectory]
    assert len(positions) == len(run.frames)
    for mine, frame in zip(positions, run.frames):
        assert np.array_equal(mine[:, : run.trajectory.dimension], frame.position.astype("f4"))
    assert set(universe.atoms.names) == set(run.trajectory.species_names)
    assert np.array_equal(universe.atoms.masses, run.trajectory.mass)
    assert np.array_equal(universe.atoms.charges, run.trajectory.charge)


def test_the_sources_open_runs_without_the_compiled_part(run):
    script = f"""
import sys
sys.path.insert(0, {str(ROOT / 'io/python')!r})
import carom
print(len(carom.open({str(run.directory)!r}).frames))
try:
    carom.Simulation
except ImportError as error:
    print(error)
"""
    out = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True,
                         env={"PATH": "/usr/bin"}).stdout.splitlines()
    assert int(out[0]) == len(run.frames) and "the compiled part of carom is missing" in out[1] and "tools/python" in out[1]


def test_a_damaged_file_is_a_file_error(run, tmp_path):
    (tmp_path / "deck.toml").write_text("format = 1\n")
    (tmp_path / "summary.json").write_text("{")
    (tmp_path / "trajectory.h5md").write_bytes(b"x" * 100)
    bad = carom.open(tmp_path)
    for look in (lambda: bad.summary, lambda: bad.frames, lambda: bad.thermo, lambda: bad.universe()):
        with pytest.raises(carom.FileError, match=str(tmp_path)):
            look()
