# SPDX-License-Identifier: BSD-3-Clause
"""Every deck of inputs/, shortened, through the command itself ($CAROM).

Each must end well, keep its energy, leave a sound file, and not care how it is observed.
"""

import math
import sys
import tomllib

import pytest

from runs import ROOT, needs_carom

sys.path.insert(0, str(ROOT / "tools"))

import check_h5md
import compare
from carom_files import Trajectory, find_carom, read_thermo, run_carom

DECKS = sorted((ROOT / "inputs").glob("*.toml"))
# Largest |H − H₁| / E_ref allowed over the shortened run: rounding for the exact methods; the other methods are of
# first and second order, with suitable steps in their decks.
EXACT, APPROXIMATE = 1e-12, 1e-2
EXACT_METHODS = {"free-flight", "cdda", "edda"}
# Decks of ten thousand particles with forces are run with fewer particles.
FEWER = {"yukawa-fluid": ["particles.count=256"], "charged-mixture": ["particles.0.count=128", "particles.1.count=128"]}

pytestmark = needs_carom


def shortened(file):
    """Overrides that shorten a run to about a second with several frames."""
    deck = tomllib.loads(file.read_text())
    if deck["integrator"]["type"] == "free-flight":
        return ["run.end_time=1.0", "output.frame_interval=0.25", "output.thermo_interval=0.25"]
    steps = 80 if deck["particles"][0].get("count") else 1000
    end = steps * deck["integrator"].get("step", 0.02)
    plan = f"run.end_time={end}" if "end_time" in deck["run"] else f"run.steps={steps}"
    return FEWER.get(file.stem, []) + [plan, f"output.frame_interval={end / 5}", f"output.thermo_interval={end / 5}"]


def test_there_are_decks():
    assert len(DECKS) >= 9


@pytest.mark.parametrize("file", DECKS, ids=lambda file: file.stem)
def test_deck(file, tmp_path):
    deck = tomllib.loads(file.read_text())
    assert deck["title"] and len(deck["description"]) > 60
    summary = run_carom(find_carom(), file, tmp_path, shortened(file))
    assert summary["status"] == "done"
    method, energy = deck["integrator"]["type"], summary["energy"]
    assert energy["reference"] > 0
    assert energy["max_abs_error"] <= (EXACT if method in EXACT_METHODS else APPROXIMATE) * energy["reference"]
    assert summary["max_overlap"] <= 1e-12 and not any("overlap" in warning for warning in summary["warnings"])
    assert method == "verlet" or summary["events"]["sphere_sphere"] > 0
    assert check_h5md.violations(tmp_path) == []
    assert len(read_thermo(tmp_path)["time"]) >= 4
    with Trajectory(tmp_path) as trajectory:
        assert len(trajectory) >= 4
        assert trajectory.title == deck["title"]


def test_a_patch_of_a_ring_cools_and_clumps(tmp_path):
    """A quarter of planetary-ring. At first ln T falls per collision and disc as in a Maxwellian gas, by the mean of (1 - e^2) v^2/4T
    over v exp(-v^2/4T), 0.92; then ever more slowly, while the discs gather."""
    deck = ROOT / "inputs" / "planetary-ring.toml"
    summary = run_carom(find_carom(), deck, tmp_path, ["particles.count=100", "run.end_time=25.0", "output.frame_interval=0.0"])
    assert summary["energy"]["max_abs_error"] < 1e-12 * summary["energy"]["reference"] and summary["momentum"]["max_abs_error"] < 1e-12
    rows = read_thermo(tmp_path)
    temperature, potential, turns = rows["temperature"], rows["potential"], rows["collisions"] / 100
    early = int((temperature < 0.5).argmax())
    rate = -math.log(temperature[early]) / turns[early]
    assert abs(rate - 0.92) < 3 * rate / math.sqrt(100 * turns[early])  # the loss of a collision has a standard deviation of its mean
    assert -math.log(temperature[-1] / temperature[early]) < 0.5 * rate * (turns[-1] - turns[early])
    assert temperature[-1] < 0.03 and potential[-1] < 1.5 * potential[0] < 0
    assert summary["energy"]["dissipated"] == pytest.approx(summary["energy"]["initial"] - summary["energy"]["final"], abs=1e-11)


@pytest.mark.parametrize("file", DECKS, ids=lambda file: file.stem)
def test_observing_changes_nothing(file, tmp_path):
    overrides = shortened(file)
    overrides.append('output.start="first"')  # another start needs rows of thermo.csv
    run_carom(find_carom(), file, tmp_path / "often", overrides + ["output.events=true"])
    run_carom(find_carom(), file, tmp_path / "seldom", overrides + ["output.frame_interval=0.0", "output.thermo_interval=0.0"])
    assert compare.compare(tmp_path / "often", tmp_path / "seldom", last=True) == []
