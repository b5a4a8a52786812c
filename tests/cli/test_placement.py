# SPDX-License-Identifier: BSD-3-Clause
"""Initial states through the command: compression to high density, its errors, mixtures on lattices and at random."""

import pathlib
import signal
import subprocess
import time
import tomllib

import numpy as np
import pytest

from runs import CAROM, SPHERES, data_sets, needs_carom, run, summary, write_deck

pytestmark = needs_carom

# A mixture of two sizes with one radius per particle, and discs between walls.
RADII = [0.5 if i % 2 else 0.6 + 0.01 * (i % 7) for i in range(60)]
MIXTURE = SPHERES.replace("count = 108", "count = 60").replace("radius = 0.5", f"radius = {RADII}").replace(
    'type = "fcc"\npacking_fraction = 0.3', 'type = "compressed"\npacking_fraction = 0.58') + """
[[particles]]
name = "large"
count = 20
temperature = 2.0
radius = 1.0
mass = 8.0
"""


def start(output):
    """Positions, radii and box of the first frame."""
    sets = data_sets(output / "trajectory.h5md")
    group = "particles/trajectory/"
    box = np.diag(sets[group + "box/edges/value"][0])
    return sets[group + "position/value"][0], sets[group + "radius"], box


def smallest_gap(x, radius, box, periodic):
    """Distances of all pairs, with nearest images along the periodic axes."""
    d = x[:, None] - x[None, :]
    d -= np.where(periodic, box * np.round(d / box), 0)
    gap = np.sqrt((d ** 2).sum(axis=2)) - radius[:, None] - radius[None, :]
    return gap[np.triu_indices(len(x), 1)].min()


def test_a_mixture_is_compressed_to_the_sizes_of_the_deck(tmp_path):
    deck = write_deck(tmp_path, MIXTURE)
    run(deck, tmp_path / "out", ["run.end_time=0.5", "output.frame_interval=0.1"])
    x, radius, box = start(tmp_path / "out")
    assert radius.tolist() == RADII + [1.0] * 20
    assert abs((4 / 3 * np.pi * radius ** 3).sum() / box.prod() - 0.58) < 1e-12
    assert smallest_gap(x, radius, box, True) >= -1e-15
    s = summary(tmp_path / "out")
    assert s["max_overlap"] <= 1e-12 and s["energy"]["max_abs_error"] <= 1e-12 * s["energy"]["reference"]
    # The resolved deck, which names box and growth rate, gives the same start; another seed gives another.
    resolved = tmp_path / "out" / "deck.toml"
    assert tomllib.loads(resolved.read_text())["placement"]["growth_rate"] == 0.1
    run(resolved, tmp_path / "again", ["run.end_time=0.5"])
    assert np.array_equal(start(tmp_path / "again")[0], x)
    run(deck, tmp_path / "other", ["run.end_time=0.5", "placement.seed=8"])
    assert not np.array_equal(start(tmp_path / "other")[0], x)


def test_discs_between_walls(tmp_path):
    deck = write_deck(tmp_path, MIXTURE)
    run(deck, tmp_path / "out", [
        "system.dimension=2", 'system.boundary=["wall", "periodic"]', "placement.packing_fraction=0.78",
        "run.end_time=0.5"])
    x, radius, box = start(tmp_path / "out")
    assert smallest_gap(x, radius, box, [False, True, False]) >= -1e-15
    assert (x[:, 0] >= radius).all() and (x[:, 0] <= box[0] - radius).all()


def validate(deck, overrides):
    sets = [part for override in overrides for part in ("--set", override)]
    return subprocess.run([CAROM, "validate", str(deck), *sets], capture_output=True, text=True, timeout=1200)


@pytest.mark.parametrize("overrides, words", [
    (["placement.packing_fraction=0.8", "placement.growth_rate=1"],
     ["the spheres jammed at packing fraction 0.6", "short of 0.8", "growth_rate"]),
    (["placement.max_collisions=10"], ["compression gave up at packing fraction 0.", "short of 0.58", "max_collisions"]),
    (["placement.packing_fraction=0.95", "particles.0.count=1", "particles.0.radius=0.1", "particles.1.count=1"],
     ["no room", "the largest diameter is 2", "enlarge the box"]),
    (["placement.type=random"], ["random insertion found no place", 'type = "compressed"']),
])
def test_states_out_of_reach(overrides, words, tmp_path):
    done = validate(write_deck(tmp_path, MIXTURE), overrides)
    assert done.returncode == 3, (done.returncode, done.stderr)
    assert done.stderr.startswith(str(tmp_path)) and ":12:1: error: " in done.stderr
    for word in words:
        assert word in done.stderr


@pytest.mark.parametrize("dimension, lattice", [(3, "fcc"), (3, "simple-cubic"), (2, "hexagonal"), (2, "square")])
def test_mixtures_on_lattices_and_at_random(dimension, lattice, tmp_path):
    common = [f"system.dimension={dimension}", "run.end_time=0.1", "placement.packing_fraction=0.1",
              f"system.boundary={['periodic', 'wall', 'periodic'][:dimension]}"]
    for kind in (lattice, "random"):
        out = tmp_path / kind
        run(write_deck(tmp_path, MIXTURE), out, common + [f"placement.type={kind}"])
        x, radius, box = start(out)
        assert smallest_gap(x, radius, box, [True, False, True]) >= -1e-15
        assert (x[:, 1] >= radius).all() and (x[:, 1] <= box[1] - radius).all()
        large = x[radius == 1.0]
        assert np.ptp(large, axis=0)[:dimension].min() > 0.4 * box[:dimension].min()  # mixed, not in one corner


# Argon in SI units; a picture of it has the radius 0.5.
ARGON = """
format = 1
[system]
dimension = 3
box = [8e-9, 8e-9, 8e-9]
boundary = ["periodic", "periodic", "periodic"]
[[particles]]
name = "argon"
count = 40
mass = 6.6e-26
temperature = 1.2e-21
[placement]
type = "random"
[[interaction]]
type = "lennard-jones"
epsilon = 1.65e-21
sigma = 3.4e-10
cutoff = 1e-9
[integrator]
type = "verlet"
step = 1e-15
[run]
steps = 100
"""


@pytest.mark.parametrize("overrides, distance", [
    ([], (0.5 * 0.384 * 6 / np.pi / 40) ** (1 / 3) * 8e-9),  # 40 spheres of this diameter fill half of 0.384
    (["particles.0.count=300", "particles.0.display_radius=1.0", "system.box=[5, 5, 5]", "interaction.sigma=0.4", "interaction.cutoff=1",
      "interaction.epsilon=1", "particles.0.temperature=1", "particles.0.mass=1", "integrator.step=0.001"],
     (0.5 * 0.384 * 6 / np.pi / 300) ** (1 / 3) * 5),
    (["placement.distance=1e-9"], 1e-9)])
def test_points_keep_a_distance_that_fits_into_the_box(overrides, distance, tmp_path):
    """Whatever radius pictures show."""
    run(write_deck(tmp_path, ARGON), tmp_path / "out", overrides)
    x, _, box = start(tmp_path / "out")
    closest = smallest_gap(x, np.zeros(len(x)), box, True)
    assert distance <= closest < 1.5 * distance
    resolved = tomllib.loads((tmp_path / "out" / "deck.toml").read_text())["placement"]["distance"]
    assert abs(resolved / distance - 1) < 1e-12
    s = summary(tmp_path / "out")
    assert s["status"] == "done" and s["warnings"] == []


# Far more work than a test has time for.
CROWD = SPHERES.replace("count = 108", "count = 300000").replace('type = "fcc"\npacking_fraction = 0.3', 'type = "random"\npacking_fraction = 0.375')
STOPPED = ": stopped by {} while the particles were placed; no file was written: start it again\n"


@pytest.mark.parametrize("deck, overrides", [(CROWD, []), (CROWD, ["placement.type=simple-cubic"]), (MIXTURE, [])],
                         ids=["random", "lattice", "compressed"])
def test_a_wall_time_ends_a_placement(deck, overrides, tmp_path):
    done = run(write_deck(tmp_path, deck), tmp_path / "out", overrides, ("--max-wall", "0"), code=75)
    assert done.stderr.endswith(STOPPED.format("--max-wall")) and not (tmp_path / "out").exists()


@pytest.mark.parametrize("overrides", [[], ["placement.type=compressed", "placement.packing_fraction=0.6"]], ids=["random", "compressed"])
def test_a_signal_ends_a_placement(overrides, tmp_path):
    sets = [part for override in overrides for part in ("--set", override)]
    with subprocess.Popen([CAROM, "run", write_deck(tmp_path, CROWD), "-o", tmp_path / "out", "--quiet", *sets],
                          stderr=subprocess.PIPE, text=True) as process:
        try:
            while not handles(process, signal.SIGTERM):
                time.sleep(0.01)
            process.terminate()
            said = process.communicate(timeout=1000)[1]
        finally:
            process.kill()
    assert process.returncode == 75 and said.endswith(STOPPED.format("SIGTERM")) and not (tmp_path / "out").exists()


def handles(process, number):
    status = pathlib.Path(f"/proc/{process.pid}/status").read_text()
    mask = int(next(line for line in status.splitlines() if line.startswith("SigCgt")).split()[1], 16)
    return mask >> (number - 1) & 1
