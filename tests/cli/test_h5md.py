# SPDX-License-Identifier: BSD-3-Clause
"""The trajectory in MDAnalysis, and `carom info`."""

import pathlib
import subprocess
import sys
import warnings

import h5py
import numpy as np
import pytest

sys.path.insert(0, str(pathlib.Path(__file__).parents[2] / "tools"))
from runs import CAROM, SPHERES, SPRINGS, needs_carom, run, thermo, write_deck

warnings.filterwarnings("ignore", category=DeprecationWarning)
MDAnalysis = pytest.importorskip("MDAnalysis")
pytestmark = needs_carom


@pytest.fixture(scope="module", params=["2-D", "3-D"])
def output(request, tmp_path_factory):
    directory = tmp_path_factory.mktemp(request.param)
    text = SPRINGS if request.param == "2-D" else SPHERES
    run(write_deck(directory, text), directory / "out", ["output.thermo_interval=0.5", "output.events=true"])
    return directory / "out"


def universe(path):
    """Reduced units have no names: MDAnalysis must not convert them, which in 2.4 only load_new allows."""
    with h5py.File(path) as file:
        n = file["particles/trajectory/position/value"].shape[1]
    u = MDAnalysis.Universe.empty(n, trajectory=True, velocities=True)
    return u.load_new(str(path), convert_units=False)


def test_mdanalysis_reads_what_was_written(output):
    u, rows = universe(output / "trajectory.h5md"), thermo(output)
    flat = "2-D" in str(output)
    dimension = 2 if flat else 3
    with h5py.File(output / "trajectory.h5md") as file:
        mass = file["particles/trajectory/mass"][()]
        edges = file["particles/trajectory/box/edges/value"][0].diagonal()
        x = file["particles/trajectory/position/value"][()]
    assert u.trajectory.n_frames == len(rows["time"]) == len(x)
    for frame, ts in enumerate(u.trajectory):
        assert ts.time == rows["time"][frame]
        assert ts.data["step"] == rows["step"][frame]
        assert np.array_equal(ts.positions, x[frame].astype(np.float32))  # MDAnalysis keeps single precision
        assert np.allclose(ts.dimensions, [*edges, 90, 90, 90])
        assert (ts.positions[:, :dimension] >= 0).all() and (ts.positions[:, :dimension] <= edges[:dimension] * (1 + 1e-6)).all()
        kinetic = 0.5 * (mass[:, None] * ts.velocities.astype(float) ** 2).sum()
        assert kinetic == pytest.approx(rows["kinetic"][frame], rel=1e-6)
        assert ts.data["kinetic_energy"] == rows["kinetic"][frame]
        assert ts.data["total_energy"] == rows["total"][frame]
        momentum = (mass[:, None] * ts.velocities.astype(float)).sum(axis=0)
        assert np.allclose(momentum, ts.data["momentum"], atol=1e-5)
        assert ts.data["momentum"][0] == rows["momentum_x"][frame]
        if flat:
            assert (ts.positions[:, 2] == 0).all() and edges[2] == 1
    if flat:
        assert np.allclose(x[0][:, :2], [[1.5, 2.5], [3.5, 2.5], [5.5, 2.6], [7.5, 2.5]], rtol=0, atol=0)
        assert np.array_equal(edges, [9, 5, 1]) and np.array_equal(mass, [1, 2, 1.5, 1])


def test_images_unwrap_the_path(output):
    if "2-D" in str(output):
        pytest.skip("no periodic axis")
    with h5py.File(output / "trajectory.h5md") as file:
        g = file["particles/trajectory"]
        edge = g["box/edges/value"][0].diagonal()
        x = g["position/value"][()] + g["image/value"][()] * edge
        assert (g["image/value"][-1] != 0).any()
    # No sphere flies far between frames: an image that is off by one would show as a jump of half an edge or more.
    assert np.abs(np.diff(x, axis=0)).max() < edge.min() / 2


def info(path):
    return subprocess.run([CAROM, "info", str(path)], capture_output=True, text=True)


def test_info(output):
    flat = "2-D" in str(output)
    done = info(output / "trajectory.h5md")
    assert done.returncode == 0, done.stderr
    shown = dict(line.split(None, 1) for line in done.stdout.splitlines())
    assert shown["frames"] == ("17" if flat else "7") and shown["particles"] == ("4" if flat else "108")
    assert shown["times"] == ("0 to 8" if flat else "0 to 3") and shown["dimension"] == ("2" if flat else "3")
    assert shown["boundary"] == ("wall, wall" if flat else "periodic, periodic, periodic")
    assert shown["title"] == ("four discs on springs" if flat else "periodic hard spheres")
    if flat:
        assert shown["box"] == "9, 5"
    done = info(output / "events.h5")
    with h5py.File(output / "events.h5") as file:
        assert f"collisions    {len(file['events/time'])}" in done.stdout
    assert done.returncode == 0


def test_info_of_other_files(tmp_path):
    (tmp_path / "text").write_text("not HDF5")
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["x"] = [1, 2]
    with h5py.File(tmp_path / "strange.h5md", "w") as file:  # looks like a trajectory, but is incomplete
        file["particles/trajectory/position/value"] = np.zeros((1, 2, 3))
        file.create_group("h5md")
    for name, words in (("text", "HDF5"), ("other.h5", "no trajectory of carom"), ("strange.h5md", "cannot read"), ("missing", "No such")):
        done = info(tmp_path / name)
        assert done.returncode == 5, name
        assert str(tmp_path / name) in done.stderr and words in done.stderr, done.stderr
        assert done.stdout == ""
