# SPDX-License-Identifier: BSD-3-Clause
"""Sheared boxes in free flight: the work of the flow, a granular fluid as another program has it, trajectories, continued runs."""

import csv
import filecmp
import math
import signal
import subprocess
import sys

import h5py
import numpy as np
import pytest

from going_on import go_on
from runs import CAROM, ROOT, needs_carom, run, signalled, summary, thermo, write_deck
from test_ranks import expect_same_anywhere

sys.path.insert(0, str(ROOT / "tools"))
import plot_msd
from carom_files import Trajectory, toml_text

pytestmark = needs_carom

FLUID = {
    "format": 1,
    "title": "sheared granular fluid",
    "system": {"dimension": 3, "boundary": ["periodic"] * 3, "shear": {"rate": 1.0}},
    "particles": [{"name": "grain", "count": 500, "radius": 0.5, "temperature": 1.0}],
    "contact": [{"between": ["grain", "grain"], "restitution": 0.9}],
    "placement": {"type": "fcc", "packing_fraction": math.pi / 12, "seed": 1},
    "integrator": {"type": "free-flight"},
    "run": {"end_time": 10.0},
    "output": {"directory": "unused", "thermo_interval": 0.5, "frame_interval": 1.0}}


def ran(tmp_path, deck, settings=(), name="out", **environment):
    run(write_deck(tmp_path, toml_text(deck)), tmp_path / name, list(settings), **environment)
    return tmp_path / name


def test_a_granular_fluid_as_another_program_has_it(tmp_path):
    """DynamO 1.7 (packing mode 4), 500 spheres, restitution 0.9, density 0.5, rate 1, 4,000,000 collisions: the mean free time, and the
    parts of the pressure tensor that impulses have. Its other parts include the velocity of the flow along x."""
    output = ran(tmp_path, FLUID, ["run.end_time=250", "output.pressure_tensor_interval=0.2", "output.sample_start=10", "output.frame_interval=0"])
    found = summary(output)
    assert found["collision_rate"] == pytest.approx(1 / 0.113728, rel=2e-3)
    with open(output / "pressure_tensor.csv") as file:
        rows = {(row["a"], row["b"]): row for row in csv.DictReader(file)}
    for axes, wanted in {("0", "0"): 1.48863, ("1", "1"): 1.44677, ("2", "2"): 1.39316, ("0", "1"): -0.40927}.items():
        row = rows[axes]
        assert float(row["collisions"]) == pytest.approx(wanted, abs=4 * float(row["error_collisions"]))
    for axis, wanted in (("1", 2.08062), ("2", 2.01762)):
        row = rows[axis, axis]
        assert float(row["pressure"]) == pytest.approx(wanted, abs=4 * float(row["error_pressure"]))
    assert max(float(row["error_collisions"]) for row in rows.values()) < 0.012
    # The stress by the work of the flow is that of the tensor.
    stress = found["shear"]["stress"]
    row = rows["0", "1"]
    assert stress["mean"] == pytest.approx(-float(row["pressure"]), abs=4 * math.hypot(stress["standard_error"], float(row["error_pressure"])))
    assert found["shear"]["viscosity"]["mean"] == stress["mean"]


def test_the_ledger_closes(tmp_path):
    """Energy, what contacts lose, and the work of the flow, in a mixture between walls, one of them thermal, with a bath."""
    mixed = FLUID | {"system": {"dimension": 3, "box": [9.0, 7.0, 8.0], "boundary": ["periodic", "periodic", "wall"], "shear": {"rate": -0.8}},
                     "particles": [{"name": "large", "count": 80, "radius": 0.6, "temperature": 1.0, "mass": 2.0},
                                   {"name": "small", "count": 120, "radius": 0.4, "temperature": 1.0, "rotational_temperature": 1.0}],
                     "contact": [{"between": ["*", "*"], "restitution": 0.9, "tangential": 0.3, "friction": 0.5}],
                     "wall": [{"name": "z+", "temperature": 1.5}, {"name": "z-", "velocity": {"amplitude": 0.1, "frequency": 0.3}}],
                     "bath": [{"type": "andersen", "temperature": 1.0, "rate": 0.3}],
                     "interaction": [{"type": "uniform-field", "acceleration": [0.0, 0.0, -0.5]}], "placement": {"type": "random", "seed": 2}}
    found = summary(ran(tmp_path, mixed))["energy"]
    assert found["dissipated"] > 1000 and found["work"] > 500 and abs(found["heat"]) > 100
    assert found["max_abs_error"] < 1e-12 * found["reference"]

    # In each interval the work is that of the stress.
    rows = thermo(ran(tmp_path, FLUID, name="fluid"))
    work = np.diff(rows["work"])
    assert work == pytest.approx(rows["shear_stress"][1:] * np.diff(rows["time"]) * 1000, rel=1e-11) and rows["shear_stress"][0] == 0
    assert np.abs(rows["conserved"] - rows["conserved"][0]).max() < 1e-12 * rows["conserved"][0]


def test_twice_the_rate_is_a_faster_film(tmp_path):
    """Hard spheres have no time of their own: at twice the rate, with twice the velocities, everything happens in half the time, and the
    temperature is that of the rate squared (Bagnold). Factors of two are exact."""
    slow = thermo(ran(tmp_path, FLUID, ["integrator.step=2.0"]))
    fast = FLUID | {"system": FLUID["system"] | {"shear": {"rate": 2.0}}, "particles": [FLUID["particles"][0] | {"temperature": 4.0}]}
    quick = thermo(ran(tmp_path, fast, ["integrator.step=1.0", "run.end_time=5", "output.thermo_interval=0.25"], "fast"))
    for column, factor in (("time", 0.5), ("temperature", 4), ("pressure", 4), ("shear_stress", 4), ("collisions", 1)):
        assert (quick[column] == factor * slow[column]).all(), column


def test_a_rate_of_zero_is_no_shear(tmp_path):
    still = FLUID | {"system": FLUID["system"] | {"shear": {"rate": 0.0}}}
    plain = FLUID | {"system": {key: value for key, value in FLUID["system"].items() if key != "shear"}}
    one, other = ran(tmp_path, still, name="still"), ran(tmp_path, plain, name="plain")
    assert filecmp.cmp(one / "thermo.csv", other / "thermo.csv", shallow=False)
    with h5py.File(one / "trajectory.h5md") as a, h5py.File(other / "trajectory.h5md") as b:
        assert (a["particles/trajectory/position/value"][:] == b["particles/trajectory/position/value"][:]).all()


def test_two_spheres_meet_through_an_image_that_slides(tmp_path):
    """Both are at rest relative to the flow, at y = 0.5 and y = 3.7 in a box of 4. The image of the first disc above the second one starts at
    x = 1 with the velocity of the flow at y = 4.5, and the second disc has the velocity of the flow at 3.7."""
    rate, x, y = 0.5, 2.2, 3.7
    pair = FLUID | {"system": {"dimension": 2, "box": [6.0, 4.0], "boundary": ["periodic", "periodic"], "shear": {"rate": rate}},
                    "particles": [{"name": "disc", "radius": 0.5, "position": [[1.0, 0.5], [x, y]], "velocity": [[0.0, 0.0], [0.0, 0.0]]}],
                    "contact": [], "run": {"collisions": 1}, "output": FLUID["output"] | {"events": True}}
    pair.pop("placement")
    output = ran(tmp_path, pair)
    apart = 4.5 - y
    when = (x - 1.0 - math.sqrt(1 - apart**2)) / (rate * apart)   # the image has the relative velocity rate * apart along x
    with h5py.File(output / "events.h5") as file:
        event = {name: file[f"events/{name}"][0] for name in ("time", "impulse")}
    assert event["time"] == pytest.approx(when, rel=1e-13)
    d = np.array([math.sqrt(1 - apart**2), -apart])               # from the image to the second disc
    wanted = d * (rate * apart * d[0])                            # equal masses exchange the normal component
    assert np.abs(event["impulse"][:2]) == pytest.approx(np.abs(wanted), rel=1e-12)
    # Each got half of the impulse times the velocity of the flow at its place: the energy relative to the flow has grown by the work.
    found = summary(output)["energy"]
    assert found["final"] == pytest.approx(found["work"], rel=1e-12)
    assert found["final"] > 0.1 * rate**2


def test_trajectories_have_the_tilt_of_the_box(tmp_path):
    output = ran(tmp_path, FLUID, ["output.frame_interval=0.3"])
    with h5py.File(output / "trajectory.h5md") as file:
        group = file["particles/trajectory"]
        time, cells = group["position/time"][:], group["box/edges/value"][:]
        places, velocities, images = (group[f"{name}/value"][:] for name in ("position", "velocity", "image"))
    edge = cells[0, 0, 0]
    assert np.abs((cells[:, 1, 0] - edge * time + edge / 2) % edge - edge / 2).max() < 1e-11
    for cell, x in zip(cells, places):
        d = x[:, None] - x
        for k in (2, 1, 0):
            d -= np.round(d[..., k, None] / cell[k, k]) * cell[k]
        distance = np.linalg.norm(d, axis=2)[np.triu_indices(len(x), 1)]
        assert distance.min() > 1 - 1e-12
    # Velocities are relative to the flow, whose temperature they have; unwrapped positions go on through all boundaries.
    rows = thermo(output)
    assert (velocities**2).sum(axis=(1, 2)) / 1500 == pytest.approx(np.interp(time, rows["time"], rows["temperature"]), rel=0.1)
    unwrapped = places + np.einsum("fik,fkl->fil", images.astype(float), cells)
    moved, height = np.diff(unwrapped, axis=0), 0.5 * (unwrapped[1:, :, 1] + unwrapped[:-1, :, 1])
    moved[..., 0] -= np.diff(time)[:, None] * height
    assert np.abs(moved).max() < 0.3 * 6 and np.abs(images[-1, :, 0]).max() > 5    # 6: faster than all


def test_displacements_are_those_across_the_flow(tmp_path):
    """msd.csv against a sum over frames, and the same diffusion coefficient from both."""
    output = ran(tmp_path, FLUID, ["run.end_time=40", "output.frame_interval=0.5", "output.msd_interval=0.5"])
    columns = np.genfromtxt(output / "msd.csv", delimiter=",", names=True)
    assert columns.dtype.names == ("time", "origins", "msd_across", "error_msd_across", "samples_msd_across")
    with Trajectory(output) as trajectory:
        x = np.stack([trajectory.unwrapped(frame) for frame in range(len(trajectory))])[:, :, 1:]
        lag = 5  # the origins of the first decade are ten samples apart
        assert columns["msd_across"][lag - 1] == pytest.approx(np.mean([np.sum((x[k + lag] - x[k])**2, 1) for k in range(0, 76, 10)]), rel=1e-12)
        lags, windows, msd, _ = plot_msd.mean_squared_displacement(trajectory)
    one = plot_msd.diffusion_coefficient(lags, windows, msd, 2, (4, 20))
    other = plot_msd.diffusion_coefficient(columns["time"], columns["origins"], columns["msd_across"], 2, (4, 20))
    assert one == pytest.approx(other, rel=0.1) and 0.1 < one < 1


def test_converted_frames_are_of_a_tilted_box(tmp_path):
    ase_io, gsd_hoomd = pytest.importorskip("ase.io"), pytest.importorskip("gsd.hoomd")
    output = ran(tmp_path, FLUID, ["run.end_time=0.7", "output.frame_interval=0.7"])
    for form, name in (("extxyz", "frames.xyz"), ("gsd", "frames.gsd"), ("lammps-data", "frame.data")):
        subprocess.run([CAROM, "convert", str(output), "--to", form, "-o", str(tmp_path / name)], check=True, capture_output=True)
    atoms = ase_io.read(tmp_path / "frames.xyz", index=-1)
    assert atoms.cell[1, 0] == pytest.approx(7.0, abs=1e-12)
    distances = atoms.get_all_distances(mic=True)
    nearest = distances[np.triu_indices(500, 1)].min()
    assert nearest > 1 - 1e-12
    with gsd_hoomd.open(tmp_path / "frames.gsd") as file:
        frame = file[-1]
    assert frame.configuration.box[3] == pytest.approx(0.7)
    y = frame.particles.position[:, 1]
    assert np.abs(frame.particles.position[:, 0] - 0.7 * y).max() <= 5 + 1e-5
    again = atoms.copy()
    again.set_positions(frame.particles.position)
    assert again.get_all_distances(mic=True)[np.triu_indices(500, 1)].min() == pytest.approx(nearest, abs=1e-5)
    tilt = [line.split() for line in (tmp_path / "frame.data").read_text().splitlines() if line.endswith("xy xz yz")]
    assert [float(number) for number in tilt[0][:3]] == pytest.approx([-3.0, 0.0, 0.0])


CHANGES = FLUID | {"system": FLUID["system"] | {"shear": {"rate": [[1.3, 1.0], [3.6, -0.5], [4.0, 0.0], [5.2, 2.0]]}}, "contact": [],
                   "run": {"end_time": 6.0}, "output": FLUID["output"] | {"thermo_interval": 0.4, "frame_interval": 0.4}}


def strain_of(time):
    """The strain since the start at the rates of CHANGES."""
    ends = np.array([1.3, 3.6, 4.0, 5.2, np.inf])
    return sum(rate * np.clip(time - begin, 0, end - begin) for rate, begin, end in zip((1.0, -0.5, 0.0, 2.0), ends, ends[1:]))


def test_a_flow_that_begins_turns_and_ends(killer, tmp_path):
    output = ran(tmp_path, CHANGES)
    rows, found = thermo(output), summary(output)
    time, work = rows["time"], rows["work"]
    edge = 1000 ** (1 / 3)
    assert found["shear"] == {"rates": CHANGES["system"]["shear"]["rate"], "work": work[-1]}
    assert found["energy"]["max_abs_error"] < 1e-12 * found["energy"]["reference"] and found["max_overlap"] < 1e-11
    rests = (time < 1.3) | ((time > 4.0) & (time < 5.2))
    flows = (time > 1.3) & (time < 3.61) | (time > 5.5)
    before = np.flatnonzero(rests)[0:4]
    assert np.abs(rows["temperature"][before] / rows["temperature"][0] - 1).max() < 1e-13 and (work[before] == 0).all()
    assert np.isnan(rows["shear_stress"][rests][1:]).all()
    assert np.diff(work)[flows[1:]] == pytest.approx(rows["shear_stress"][flows] * np.diff(strain_of(time))[flows[1:]] * 1000, rel=1e-11)
    with Trajectory(output) as trajectory:
        slides = strain_of(trajectory.time) * edge - [trajectory.tilt(frame) for frame in range(len(trajectory))]
    assert np.abs(slides / edge - np.round(slides / edge)).max() < 1e-12
    settings = ["output.checkpoint_wall=\"0\""]
    run(deck := write_deck(tmp_path, toml_text(CHANGES)), tmp_path / "whole", settings)
    expect_same_anywhere(deck, settings, tmp_path / "whole", killer, (2, 3))


def test_one_rate_from_the_start_is_a_constant_rate(tmp_path):
    listed = FLUID | {"system": FLUID["system"] | {"shear": {"rate": [[0.0, 1.0]]}}}
    outputs = [ran(tmp_path, deck, ["run.end_time=3"], name) for deck, name in ((FLUID, "number"), (listed, "listed"))]
    assert filecmp.cmp(outputs[0] / "thermo.csv", outputs[1] / "thermo.csv", shallow=False)


def test_a_killed_run_goes_on(killer, tmp_path):
    settings = ["output.checkpoint_wall=\"0\"", "output.events=true", "output.rdf_interval=0.7", "output.pressure_tensor_interval=0.3",
                "output.profile_interval=0.4", "run.end_time=6.0"]
    deck = write_deck(tmp_path, toml_text(FLUID))
    run(deck, tmp_path / "whole", settings)
    killed = tmp_path / "killed"
    run(deck, killed, settings, env=signalled(killer, killed, signal.SIGKILL, 6), code=-signal.SIGKILL)
    go_on(killed)
    for name in ("thermo.csv", "rdf.csv", "pressure_tensor.csv", "profile.csv"):
        assert filecmp.cmp(tmp_path / "whole" / name, killed / name, shallow=False), name


def test_a_branch_starts_with_the_tilt(tmp_path):
    """A branch goes on as its parent, with the parent's bits, or with another epoch, which changes the rounding."""
    dense = FLUID | {"placement": FLUID["placement"] | {"packing_fraction": 0.45}, "contact": []}
    first = ran(tmp_path, dense, ["run.end_time=1.4", "integrator.step=0.7"], "first")
    whole = thermo(ran(tmp_path, dense, ["run.end_time=2.5", "integrator.step=0.7"], "whole"))
    for name, settings in (("same", []), ("other", ["--set", "integrator.step=0.31"])):
        subprocess.run([CAROM, "branch", str(first), "--quiet", "-o", str(tmp_path / name), "--set", "run.end_time=2.5", *settings], check=True,
                       capture_output=True)
        branch = thermo(tmp_path / name)
        assert summary(tmp_path / name)["max_overlap"] < 1e-11
        assert branch["temperature"][-1] == pytest.approx(whole["temperature"][-1], rel=0.15)
        if name == "same":
            assert branch["temperature"][-1] == whole["temperature"][-1]


def test_a_dense_start_is_compressed_before_it_is_sheared(tmp_path):
    compressed = FLUID | {"placement": {"type": "compressed", "packing_fraction": 0.5, "seed": 3}, "contact": [], "run": {"end_time": 0.5},
                          "particles": [FLUID["particles"][0] | {"count": 200}]}
    assert summary(ran(tmp_path, compressed))["max_overlap"] < 1e-11


BAD = {
    "wall along y": ({"system": FLUID["system"] | {"boundary": ["periodic", "wall", "periodic"]}}, "'shear' needs an axis 1 that is periodic"),
    "open box": ({"system": FLUID["system"] | {"boundary": ["open", "periodic", "periodic"]}, "placement": FLUID["placement"] | {"type": "random"}},
                 "'shear' needs an axis 0 that is periodic"),
    "slope": ({"system": {"dimension": 3, "box": [12.0, 12.0, 12.0], "boundary": ["periodic", "periodic", "wall"], "shear": {"rate": 1.0}},
               "placement": {"type": "random", "seed": 1},
               "wall": [{"name": "ball", "shape": "sphere", "centre": [6.0, 6.0, 6.0], "radius": 1.5, "inside": False}]},
              "parallel to the axis"),
    "method": ({"contact": [], "integrator": {"type": "cdda", "step": 0.01}}, "'cdda' knows no shear yet; take free-flight"),
    "field": ({"interaction": [{"type": "uniform-field", "acceleration": [0.0, -1.0, 0.0]}]}, "'acceleration' has a component along axis 1, which is periodic"),
    "steps": ({"step": [{"between": ["grain", "grain"], "range": 1.5, "depth": 1.0}]}, "'shear' does not go with [[step]] yet"),
    "no number": ({"system": FLUID["system"] | {"shear": {"rate": math.inf}}}, "'rate' must be finite"),
    "far too fast": ({"system": FLUID["system"] | {"shear": {"rate": 1e12}}}, "give a smaller rate"),
    "cold and far too fast": ({"system": FLUID["system"] | {"shear": {"rate": 1e12}}, "particles": [FLUID["particles"][0] | {"temperature": 0.0}]},
                              "give a smaller rate"),
    "fast and cold": ({"system": FLUID["system"] | {"shear": {"rate": 1e300}}, "particles": [FLUID["particles"][0] | {"temperature": 0.0}]},
                      "products with it would be infinite"),
    "no order": ({"system": FLUID["system"] | {"shear": {"rate": [[1.0, 1.0], [1.0, 0.0]]}}}, "no list of pairs with increasing times"),
    "no pairs": ({"system": FLUID["system"] | {"shear": {"rate": [[1.0], [2.0]]}}}, "no list of pairs with increasing times"),
    "no times": ({"system": FLUID["system"] | {"shear": {"rate": [1.0, 2.0]}}}, "'rate' has the wrong type"),
    "thrice": ({"system": FLUID["system"] | {"shear": {"rate": [[1.0, 1.0], [2.0, math.nan]]}}}, "'rate' must be finite"),
    "no rate": ({"system": FLUID["system"] | {"shear": {}}}, "'rate'"),
    "tilt": ({"system": FLUID["system"] | {"box": [12.0, 12.0, 12.0], "tilt": 12.0}, "placement": {"type": "random", "seed": 1}},
             "'tilt' is not between 0 and the edge along x"),
    "tilt without free flight": ({"system": {"dimension": 3, "boundary": ["periodic"] * 3, "tilt": 1.0},
                                  "integrator": {"type": "cva", "step": 0.01}}, "'cva' knows no shear yet"),
    "waves": ({"output": FLUID["output"] | {"sk_interval": 1.0}}, "sk does not go with 'shear' yet"),
    "transport": ({"output": FLUID["output"] | {"transport_interval": 1.0}, "contact": []}, "transport does not go with 'shear' yet")}


@pytest.mark.parametrize("name", BAD)
def test_what_does_not_go_with_shear_is_refused(name, tmp_path):
    changes, message = BAD[name]
    done = run(write_deck(tmp_path, toml_text(FLUID | changes)), tmp_path / "out", [], code=2)
    assert message in done.stderr and "input.toml:" in done.stderr, done.stderr
