# SPDX-License-Identifier: BSD-3-Clause
"""Sheared boxes with pair forces: the energy and the work of the flow, against another program, on ranks, after a kill."""

import filecmp
import math
import sys

import numpy as np
import pytest

from runs import ROOT, needs_carom, run, summary, thermo, write_deck
from test_ranks import expect_same_anywhere

sys.path.insert(0, str(ROOT / "tools"))
from carom_files import toml_text

pytestmark = needs_carom

# Hard spheres that attract each other, with sliding images on all sides: the box is small, and the strain of the run is 4.
YUKAWA = {
    "format": 1,
    "title": "sheared Yukawa fluid",
    "system": {"dimension": 3, "box": [7.0, 6.0, 6.5], "boundary": ["periodic"] * 3, "shear": {"rate": 2.0}},
    "particles": [{"name": "sphere", "count": 130, "radius": 0.5, "temperature": 1.5}],
    "interaction": [{"type": "yukawa", "amplitude": -6.049647464412946, "kappa": 1.8, "cutoff": 2.5, "cut": "force-shifted"}],
    "placement": {"type": "random", "seed": 1},
    "integrator": {"type": "edda", "step": 0.01},
    "run": {"end_time": 2.0},
    "output": {"directory": "unused", "thermo_interval": 0.1, "frame_interval": 0.5}}
SOFT = YUKAWA | {"particles": [{"name": "point", "count": 130, "temperature": 1.5}],
                 "interaction": [{"type": "lennard-jones", "epsilon": 1.0, "sigma": 1.0, "cutoff": 2.5, "cut": "switch", "switch_from": 2.0}],
                 "placement": {"type": "fcc", "seed": 1}, "integrator": {"type": "verlet", "step": 0.004}}
BONDED = YUKAWA | {
    "system": {"dimension": 2, "box": [18.0, 16.0], "boundary": ["periodic"] * 2, "shear": {"rate": -1.5}, "tilt": 4.0},
    "particles": [{"name": "disc", "radius": 0.4, "position": [[1.5 * k + 0.3, 1.6 * row + 0.3] for row in range(10) for k in range(12)],
                   "temperature": 1.0}],
    "interaction": [{"type": "harmonic-bond", "stiffness": 30.0, "rest_length": 1.5,
                     "pairs": [[12 * row + k, 12 * row + k + 1] for row in range(10) for k in range(11)]},
                    YUKAWA["interaction"][0]]}
BONDED.pop("placement")


def ran(tmp_path, deck, settings=(), name="out", **environment):
    run(write_deck(tmp_path, toml_text(deck)), tmp_path / name, list(settings), **environment)
    return tmp_path / name


@pytest.mark.parametrize("deck", [YUKAWA, BONDED])
def test_the_ledger_of_edda_closes(deck, tmp_path):
    """Energy less the work of the flow is constant to rounding at any step, though images carry bonds and pairs along."""
    for step in (0.02, 0.005):
        output = ran(tmp_path, deck, [f"integrator.step={step}"], f"step {step}")
        energy, rows = summary(output)["energy"], thermo(output)
        assert energy["work"] > 20 and energy["max_abs_error"] < 1e-12 * (energy["reference"] + energy["work"])
        # The work is that of the stress.
        volume = math.prod(deck["system"]["box"])
        rate = deck["system"]["shear"]["rate"]
        assert np.diff(rows["work"]) == pytest.approx(rows["shear_stress"][1:] * np.diff(rows["time"]) * volume * rate, rel=1e-10)


def test_the_error_of_the_ledger_is_of_the_order_of_the_method(tmp_path):
    def error(deck, step):
        return summary(ran(tmp_path, deck, [f"integrator.step={step}", "run.end_time=0.5"], f"{deck['integrator']['type']} {step}"))["energy"]["max_abs_error"]
    coarse, fine = error(SOFT, 0.004), error(SOFT, 0.002)
    assert 3.4 < coarse / fine < 4.6
    first = YUKAWA | {"integrator": {"type": "psa", "step": 0.001}}
    errors = [error(first, step) for step in (0.004, 0.0005)]
    assert errors[1] < 0.4 * errors[0] < 1


def test_the_stress_by_the_work_is_that_of_the_pressure_tensor(tmp_path):
    """The integral of -P_xy from the motion, from contacts and from forces is the work: to 1e-4 where contacts matter most, which need no
    samples, and to the scatter of samples in every other step where forces do."""
    for deck, within in ((YUKAWA, 1e-4), (SOFT, 4e-3)):
        output = ran(tmp_path, deck, ["output.pressure_tensor_interval=0.01", "run.end_time=4", "output.sample_start=1"], deck["integrator"]["type"])
        rows = thermo(output)
        start = np.argmin(np.abs(rows["time"] - 1))
        stress = (rows["work"][-1] - rows["work"][start]) / (3 * 2.0 * math.prod(deck["system"]["box"]))
        tensor = np.genfromtxt(output / "pressure_tensor.csv", delimiter=",", names=True)
        xy = tensor[(tensor["a"] == 0) & (tensor["b"] == 1)][0]
        assert stress == pytest.approx(-xy["pressure"], rel=within), deck["integrator"]


def test_a_repulsive_fluid_as_another_program_has_it(tmp_path):
    """LAMMPS (29 Sep 2021): 864 points with the repulsive part of Lennard-Jones, density 0.8442, temperature 0.722 by rescaling relative to the
    flow in every step of 0.002 (compute temp/deform, fix temp/rescale), fix nve and fix deform at the erate 1 with remap v."""
    fluid = SOFT | {"system": {"dimension": 3, "box": [10.077577148295044] * 3, "boundary": ["periodic"] * 3, "shear": {"rate": 1.0}},
                    "particles": [{"name": "point", "count": 864, "temperature": 0.722}], "interaction": [{"type": "wca", "epsilon": 1.0, "sigma": 1.0}],
                    "bath": [{"type": "rescaling", "temperature": 0.722, "rate": 500.0}], "integrator": {"type": "verlet", "step": 0.002}}
    rows = thermo(ran(tmp_path, fluid, ["run.end_time=25", "output.thermo_interval=0.1", "output.frame_interval=0"]))
    late = rows["time"] > 5
    for column, wanted, error in (("shear_stress", 1.8091, 0.0034), ("pressure", 7.1412, 0.0033)):
        parts = np.array_split(rows[column][late], 10)
        means = np.array([part.mean() for part in parts])
        assert means.mean() == pytest.approx(wanted, abs=4 * math.hypot(error, means.std(ddof=1) / 10**0.5)), column
        assert means.std(ddof=1) / 10**0.5 < 0.01 * wanted


def test_a_rate_of_zero_is_no_shear(tmp_path):
    for deck in (SOFT, YUKAWA, YUKAWA | {"integrator": {"type": "psa", "step": 0.005}}):
        still = deck | {"system": deck["system"] | {"shear": {"rate": 0.0}}}
        plain = deck | {"system": {key: value for key, value in deck["system"].items() if key != "shear"}}
        name = deck["integrator"]["type"]
        one, other = ran(tmp_path, still, ["run.end_time=0.5"], name + " still"), ran(tmp_path, plain, ["run.end_time=0.5"], name)
        assert filecmp.cmp(one / "thermo.csv", other / "thermo.csv", shallow=False)


CHANGES = [[0.2, 2.0], [0.6, -1.0], [0.8, 0.0]]


@pytest.mark.parametrize("deck", [YUKAWA, SOFT])
def test_a_flow_that_begins_turns_and_ends(deck, tmp_path):
    """The ledger of edda closes over changes of the rate, at fixed steps and at steps of its own; that of verlet has its error."""
    changing = deck | {"system": deck["system"] | {"shear": {"rate": CHANGES}}}
    edda = deck["integrator"]["type"] == "edda"
    for k, integrator in enumerate([deck["integrator"], {"type": "edda"}] if edda else [deck["integrator"]]):
        output = ran(tmp_path, changing | {"integrator": integrator}, ["run.end_time=1", "output.thermo_interval=0.1"], f"out{k}")
        rows, found = thermo(output), summary(output)["energy"]
        assert found["max_abs_error"] < (1e-12 if edda else 1e-3) * found["reference"]
        assert (rows["work"][:3] == 0).all() and np.ptp(rows["work"][8:]) == 0 and np.ptp(rows["work"]) > 10
        assert np.isnan(rows["shear_stress"][[1, 2, 9, 10]]).all() and np.isfinite(rows["shear_stress"][3:9]).all()


@pytest.mark.parametrize("deck", [YUKAWA, BONDED, SOFT, YUKAWA | {"integrator": {"type": "psa", "step": 0.005}},
                                  YUKAWA | {"system": YUKAWA["system"] | {"shear": {"rate": CHANGES}}}])
def test_forces_in_shear_on_ranks_at_all_vector_widths_and_after_a_kill(deck, killer, tmp_path):
    plain = tmp_path / "plain"
    output = ["output.checkpoint_wall=\"0\"", "output.rdf_interval=0.25", "output.pressure_tensor_interval=0.25", "output.sample_start=0.5", "run.end_time=1"]
    written = write_deck(tmp_path, toml_text(deck))
    run(written, plain, output)
    expect_same_anywhere(written, output, plain, killer, (2, 3))


BAD = {"field": ({"system": YUKAWA["system"] | {"boundary": ["periodic", "periodic", "wall"]},
                  "interaction": [{"type": "uniform-field", "acceleration": [0.0, 0.0, -1.0]}]}, "not with fields"),
       "long cutoff": ({"interaction": [YUKAWA["interaction"][0] | {"cutoff": 6.2}]}, "shorter than each periodic edge"),
       "laws": ({"contact": [{"between": ["sphere", "sphere"], "restitution": 0.9}]}, "'shear' goes with [[contact]] in free-flight only"),
       "long range": ({"interaction": [{"type": "gravity", "constant": 1.0}]}, "acts between all pairs, which a periodic box does not allow"),
       "thermal wall": ({"system": YUKAWA["system"] | {"boundary": ["periodic", "periodic", "wall"]}, "wall": [{"name": "z+", "temperature": 1.0}]},
                        "'shear' goes with thermal walls in free-flight only"),
       "charges": ({"particles": [{"name": "ion", "count": 64, "radius": 0.4, "temperature": 1.0, "charge": 1.0},
                                  {"name": "other", "count": 64, "radius": 0.4, "temperature": 1.0, "charge": -1.0}],
                    "interaction": [{"type": "coulomb", "constant": 1.0, "form": "ewald", "accuracy": 1e-3}]}, "not with fields, Ewald sums"),
       "mcva": ({"integrator": {"type": "mcva", "step": 0.01}}, "'mcva' knows no shear yet"),
       "within a step": ({"system": YUKAWA["system"] | {"shear": {"rate": [[0.5, 1.0], [0.755, 2.0]]}}, "integrator": {"type": "edda", "step": 0.01}},
                         "changes at the time 0.755, within a step of this method; give a time at which a step of 0.01 starts, such as 0.76"),
       "cva": ({"integrator": {"type": "cva", "step": 0.01}}, "'cva' knows no shear yet")}


@pytest.mark.parametrize("name", BAD)
def test_what_does_not_go_with_shear_is_refused(name, tmp_path):
    changes, message = BAD[name]
    done = run(write_deck(tmp_path, toml_text(YUKAWA | changes)), tmp_path / "out", [], code=2)
    assert message in done.stderr and "input.toml:" in done.stderr, done.stderr
