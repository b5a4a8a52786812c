# SPDX-License-Identifier: BSD-3-Clause
"""`mpirun carom run`: equal files on any number of ranks."""

import filecmp
import math
import os
import pathlib
import signal
import subprocess
import sys
import tomllib

import h5py
import numpy as np
import pytest

from going_on import go_on
from runs import CAROM, ROOT, ROUGH, SPHERES, SPRINGS, command, mpirun, needs_carom, run, signalled, summary, thermo, write_deck

sys.path.insert(0, str(ROOT / "tools"))
import compare
from carom_files import toml_text

pytestmark = needs_carom


def chained_positions(count, edge):
    """Places on a cubic lattice between walls, in an order in which neighbours of the list are neighbours in space."""
    cells = math.ceil(count**(1 / 3))
    cells += cells**3 < count
    rows = [(x, y, z) for x in range(cells) for y in (range(cells) if x % 2 == 0 else reversed(range(cells)))
            for z in (range(cells) if (x + y) % 2 == 0 else reversed(range(cells)))]
    return [[(each + 0.5) * edge / cells for each in row] for row in rows[:count]]


def differences(one, other):
    """Compares two runs, except for the machine's part of their summaries."""
    return compare.compare(one, other) + compare.summary_differences(one, other)


# A prefix of the command: only rank 0 finds files by relative names.
RANK_0_AT_HOME = ["sh", "-c", 'if [ $OMPI_COMM_WORLD_RANK != 0 ]; then cd /; fi; exec "$@"', "sh"]

# Discs of two sizes between walls, falling.
DISCS = toml_text(tomllib.loads(SPHERES) | {
    "title": "discs",
    "system": {"dimension": 2, "box": [30.0, 20.0], "boundary": ["periodic", "wall"]},
    "particles": [{"name": "large", "count": 120, "temperature": 1.0, "radius": 0.6, "mass": 2.0},
                  {"name": "small", "count": 80, "temperature": 1.0, "radius": 0.4}],
    "placement": {"type": "random", "seed": 3},
    "interaction": [{"type": "uniform-field", "acceleration": [0.0, -0.2]}],
    "integrator": {"type": "free-flight", "step": 2.0},
    "run": {"collisions": 1500},
    "output": {"directory": "unused", "frame_interval": 0.7, "thermo_interval": 0.3}})


# Every law at once: rough and inelastic discs, some of ice, between a ramp, a shaken floor, a piston that stops, a thermal wall, a circle
# and a post, in a bath.
LAWS = tomllib.loads(DISCS) | {
    "title": "laws",
    "system": {"dimension": 2, "box": [30.0, 20.0], "boundary": ["wall", "wall"]},
    "contact": [{"between": ["*", "*"], "restitution": 0.95, "tangential": 0.5, "friction": 0.3},
                {"between": ["large", "large"], "restitution": {"form": "power", "v0": 0.5, "exponent": 0.25}, "tangential": -0.2}],
    "wall": [{"name": "x+", "velocity": 0.1, "until": 1.1}, {"name": "x-", "temperature": 2.0},
             {"name": "ramp", "normal": [1.0, 2.0], "offset": 8.0},
             {"name": "post", "shape": "sphere", "centre": [15.0, 10.0], "radius": 2.0, "inside": False},
             {"name": "tank", "shape": "sphere", "centre": [15.0, 10.0], "radius": 17.5},
             {"name": "y-", "velocity": {"amplitude": 0.2, "frequency": 0.5}}],
    "particles": [{"name": "large", "count": 120, "temperature": 1.0, "rotational_temperature": 0.5, "radius": 0.6, "mass": 2.0},
                  {"name": "small", "count": 80, "temperature": 1.0, "radius": 0.4, "inertia": 0.9}],
    "run": {"end_time": 1.5}}
WIDTHS = [width for width, flag in (("sse2", "sse2"), ("avx2", "avx2"), ("avx512", "avx512f"))
          if flag in pathlib.Path("/proc/cpuinfo").read_text().split()]


def expect_same_anywhere(deck, output, plain, killer, all_ranks):
    """The run in `plain` has the bits of runs on these numbers of ranks, in all vector widths, and after a kill in the middle."""
    folder, killed = plain.parent, plain.parent / "killed"
    for ranks in all_ranks:
        assert mpirun(ranks, command("input.toml", folder / str(ranks), output), cwd=folder).stderr == ""
        assert differences(plain, folder / str(ranks)) == []
    for width in WIDTHS[:-1]:
        run(deck, folder / width, output, env=os.environ | {"CAROM_SIMD": width})
        assert differences(plain, folder / width) == []
    run(deck, killed, output, env=signalled(killer, killed, signal.SIGKILL, len(thermo(plain)["time"]) // 2), code=-signal.SIGKILL)
    go_on(killed, ranks=2)
    assert differences(plain, killed) == []
    assert filecmp.cmp(plain / "thermo.csv", killed / "thermo.csv", shallow=False)


@pytest.mark.parametrize("method, bath, accuracy",
                         [(method, "andersen", 0) for method in ("free-flight", "psa", "edda", "cva", "mcva", "cdda")] +
                         [(method, "rescaling", 0) for method in ("free-flight", "psa", "edda")] +
                         [("edda", "rescaling", 1e-4), ("cdda", "andersen", 1e-4)])
def test_every_law_on_ranks_at_all_vector_widths_and_after_a_kill(method, bath, accuracy, killer, tmp_path):
    heated = LAWS | {"bath": [{"type": bath, "temperature": [1.0, 2.0], "rate": 0.5}]}
    deck, plain = write_deck(tmp_path, toml_text(heated)), tmp_path / "plain"
    output = ["output.events=true", "output.checkpoint_wall=\"0\"", f"integrator.type={method}",
              "integrator.step=" + ("0.25" if method == "free-flight" else "0.02")]
    if accuracy:
        output.append(f"integrator.accuracy={accuracy}")
    run(deck, plain, output)
    energy = summary(plain)["energy"]
    assert energy["dissipated"] > 1 and abs(energy["work"]) > 0.3 and abs(energy["heat"]) > 1 and energy["rotational"] > 1
    if method in ("free-flight", "edda", "cdda"):
        assert energy["max_abs_error"] < 1e-12 * energy["reference"]
    by_place = method in ("free-flight", "psa", "edda")  # the other methods share the forces only
    expect_same_anywhere(deck, output, plain, killer, (2, 3, 4) if by_place else (3,))


# Wells, a shoulder and tethered pairs in a mixture, with a Langevin bath and, except in free flight, with charges.
STEPS = tomllib.loads(SPHERES) | {
    "title": "steps",
    "system": {"dimension": 3, "box": [12.0, 12.0, 12.0], "boundary": ["periodic", "wall", "periodic"]},
    "particles": [{"name": "large", "count": 120, "temperature": 1.0, "radius": 0.5, "charge": 1.0},
                  {"name": "small", "count": 120, "temperature": 1.0, "radius": 0.4, "mass": 0.5, "charge": -1.0}],
    "placement": {"type": "random", "seed": 3},
    "step": [{"between": ["large", "*"], "range": [1.3, 1.6], "depth": [1.0, 0.4]},
             {"between": ["small", "small"], "range": 1.5, "depth": -0.3},
             {"pairs": [[2 * k, 2 * k + 1] for k in range(20)], "range": 1.5, "unit": "length", "depth": 0.1, "tether": 1.8}],
    "bath": [{"type": "langevin", "temperature": [1.0, 2.0], "friction": [0.5, 1.5]}],
    "run": {"end_time": 1.2},
    "output": {"directory": "unused", "frame_interval": 0.2, "thermo_interval": 0.05}}


@pytest.mark.parametrize("method", ["free-flight", "psa", "edda", "cdda"])
def test_steps_on_ranks_at_all_vector_widths_and_after_a_kill(method, killer, tmp_path):
    charges = [] if method == "free-flight" else [{"type": "coulomb", "form": "damped-shifted", "damping": 0.8, "cutoff": 2.5}]
    plain = tmp_path / "plain"
    position = chained_positions(240, 12.0)
    tied = STEPS | {"interaction": charges, "placement": {"type": "file", "file": "places.csv"}}
    (tmp_path / "places.csv").write_text("".join(",".join(map(repr, each)) + "\n" for each in position))
    deck = write_deck(tmp_path, toml_text(tied))
    output = ["output.events=true", "output.checkpoint_wall=\"0\"", f"integrator.type={method}",
              "integrator.step=" + ("0.25" if method == "free-flight" else "0.02")]
    run(deck, plain, output)
    found = summary(plain)
    assert min(found["events"][name] for name in ("entered", "left", "bounced", "sphere_sphere")) > 50 and abs(found["energy"]["heat"]) > 1
    if method != "psa":
        assert found["energy"]["max_abs_error"] < 1e-12 * found["energy"]["reference"]
    expect_same_anywhere(deck, output, plain, killer, (2, 3, 4))


# Tethered chains that fall on a floor; each hangs from a fixed disc at one end.
CHAINS = {
    "format": 1,
    "title": "chains",
    "system": {"dimension": 2, "box": [16.0, 64.0], "boundary": ["periodic", "wall"]},
    "particles": [{"name": "links", "radius": 0.5,
                   "position": [[1.5 + 1.15 * k + 0.03 * math.sin(7 * k + row), 2.0 + 2.5 * row + 0.02 * k] for row in range(24) for k in range(9)],
                   "velocity": [[0.0, 0.0] for row in range(24) for k in range(9)]},
                  {"name": "nails", "radius": 0.5, "fixed": True, "position": [[1.5 + 1.15 * 9, 2.2 + 2.5 * row] for row in range(24)]}],
    "contact": [{"between": ["*", "*"], "restitution": 0.4}],
    "step": [{"pairs": [[9 * row + k, 9 * row + k + 1 if k < 8 else 216 + row] for row in range(24) for k in range(9)], "tether": 1.25}],
    "interaction": [{"type": "uniform-field", "acceleration": [0.0, -1.0]}],
    "run": {"end_time": 3.0},
    "output": {"directory": "unused", "frame_interval": 0.5, "thermo_interval": 0.25}}


@pytest.mark.parametrize("method", ["psa", "edda", "cdda"])
def test_steps_that_hold_chains_on_ranks_and_after_a_kill(method, killer, tmp_path):
    deck, plain = write_deck(tmp_path, toml_text(CHAINS)), tmp_path / "plain"
    output = ["output.events=true", "output.checkpoint_wall=\"0\"", f"integrator.type={method}", "integrator.step=0.02"]
    run(deck, plain, output)
    found = summary(plain)
    assert found["events"]["bounced"] > 500 and found["energy"]["dissipated"] > 0.01 * found["energy"]["reference"]
    if method != "psa":
        assert found["energy"]["max_abs_error"] < 1e-12 * found["energy"]["reference"]
    expect_same_anywhere(deck, output, plain, killer, (2, 3))


@pytest.mark.parametrize("method", ["free-flight", "edda"])
def test_tethers_between_the_neighbours_in_a_lattice(method, killer, tmp_path):
    repelling = {"type": "yukawa", "amplitude": 1.0, "kappa": 2.0, "cutoff": 2.0, "cut": "force-shifted", "exclude": "bonded"}
    tied = tomllib.loads(DISCS) | {
        "title": "tethered discs", "interaction": [] if method == "free-flight" else [repelling],
        "system": {"dimension": 2, "boundary": ["periodic", "periodic"]},
        "particles": [{"name": "disc", "count": 144, "temperature": 1.0, "radius": 0.4}],
        "placement": {"type": "square", "packing_fraction": 0.3, "seed": 2}, "step": [{"within": 1.4, "tether": 1.7}]}
    deck, plain = write_deck(tmp_path, toml_text(tied)), tmp_path / "plain"
    output = ["output.events=true", "output.checkpoint_wall=\"0\"", "run.end_time=2.0", f"integrator.type={method}",
              "integrator.step=" + ("0.25" if method == "free-flight" else "0.02")]
    run(deck, plain, output)
    assert summary(plain)["events"]["bounced"] > 300
    with h5py.File(plain / "trajectory.h5md") as file:
        ends = np.concatenate([file[f"parameters/vmd_structure/bond_{end}"][:] for end in ("from", "to")])
    ids, bonds = np.unique(ends, return_counts=True)
    assert len(ids) == 144 and np.all(bonds == 4)  # the neighbours of each disc
    expect_same_anywhere(deck, output, plain, killer, (2, 3))
    again = subprocess.run([CAROM, "branch", plain, "-o", tmp_path / "branch", "--set", "step.0.within=1.3"], capture_output=True, text=True)
    assert again.returncode == 2 and "bonds are given twice" in again.stderr


def test_a_number_of_collisions_next_to_steps(tmp_path):
    """Events at steps do not count as collisions."""
    deck = write_deck(tmp_path, toml_text({key: value for key, value in STEPS.items() if key != "step"} |
                                          {"step": STEPS["step"][:2], "bath": [], "run": {"collisions": 300}}))
    run(deck, tmp_path / "plain", ["integrator.type=free-flight", "integrator.step=4.0"])
    assert summary(tmp_path / "plain")["events"]["sphere_sphere"] == 300
    for ranks in 2, 3:
        mpirun(ranks, command("input.toml", tmp_path / str(ranks), ["integrator.type=free-flight", "integrator.step=4.0"]), cwd=tmp_path)
        assert differences(tmp_path / "plain", tmp_path / str(ranks)) == []


# Discs that fall on a floor and come to rest there; the large ones are of ice.
GRAINS = toml_text(tomllib.loads(DISCS) | {
    "title": "grains",
    "system": {"dimension": 2, "box": [30.0, 16.0], "boundary": ["wall", "wall"]},
    "contact": [{"between": ["*", "*"], "restitution": 0.4, "rest_speed": 0.02},
                {"between": ["large", "large"], "restitution": {"form": "power", "v0": 0.1, "exponent": 0.25}, "rest_speed": 0.02}],
    "interaction": [{"type": "uniform-field", "acceleration": [0.1, -1.0]}],
    "particles": [{"name": "large", "count": 120, "temperature": 1.0, "radius": 0.6, "mass": 2.0},
                  {"name": "small", "count": 80, "temperature": 1.0, "radius": 0.4}],
    "run": {"end_time": 1.0}})


@pytest.mark.parametrize("method", ["free-flight", "psa", "edda", "cdda", "cva", "mcva"])
def test_inelastic_contacts_are_those_of_one_rank_and_continue(method, tmp_path):
    output = ["output.events=true", f"integrator.type={method}", "integrator.step=" + ("0.5" if method == "free-flight" else "0.02")]
    end = 1.0
    deck = write_deck(tmp_path, GRAINS)
    run(deck, tmp_path / "plain", output)
    energy = summary(tmp_path / "plain")["energy"]
    assert energy["dissipated"] > 0.05 * energy["reference"]
    for ranks in 2, 3:
        assert mpirun(ranks, command("input.toml", tmp_path / str(ranks), output), cwd=tmp_path).stderr == ""
        assert differences(tmp_path / "plain", tmp_path / str(ranks)) == []
    run(deck, tmp_path / "half", output + [f"run.end_time={end / 2}"])
    subprocess.run([CAROM, "run", "--continue", tmp_path / "half", "--quiet", "--set", f"run.end_time={end}"], check=True)
    assert filecmp.cmp(tmp_path / "plain" / "thermo.csv", tmp_path / "half" / "thermo.csv", shallow=False)


@pytest.mark.parametrize("text", [ROUGH, DISCS], ids=["rough spheres", "discs"])
def test_any_number_of_ranks_gives_the_same_files(text, tmp_path):
    output = ["output.events=true", "output.rdf_interval=0.17", "output.msd_interval=0.11", "output.profile_interval=0.13", "output.profile_pressure=true",
              "output.sample_start=0.05"]
    if text is ROUGH:
        output += ["particles.0.count=500", "run.end_time=1.0", "output.sk_interval=0.12", "output.pressure_tensor_interval=0.09"]
    run(write_deck(tmp_path, text), tmp_path / "plain", output)
    assert summary(tmp_path / "plain")["events"]["sphere_sphere"] >= 1500
    for ranks in 1, 2, 3, 4, 8:
        out = tmp_path / str(ranks)
        done = mpirun(ranks, RANK_0_AT_HOME + command("input.toml", out, output), cwd=tmp_path)
        assert done.stderr == ""
        assert differences(tmp_path / "plain", out) == []
        assert (out / "events.h5").exists()
        for name in ["thermo.csv", "rdf.csv", "msd.csv", "profile.csv"] + (["sk.csv", "pressure_tensor.csv"] if text is ROUGH else []):
            assert filecmp.cmp(tmp_path / "plain" / name, out / name, shallow=False)
        assert sorted(path.name for path in out.iterdir()) == sorted(path.name for path in (tmp_path / "plain").iterdir())
        assert summary(out)["ranks"] == ranks
        assert ("least        mean" in (out / "run.log").read_text()) == (ranks > 1)


NODES = ROOT / "tools" / "simulated-nodes"
can_simulate = subprocess.run([NODES, "1", "1", "true"], capture_output=True).returncode == 0 if CAROM else False


@pytest.mark.skipif(not can_simulate, reason="may not make network namespaces here (not root, no user namespaces)")
def test_nodes(tmp_path):
    deck = write_deck(tmp_path, SPHERES)
    run(deck, tmp_path / "plain", ["output.events=true"])
    job = ["timeout", "-k", "10", "100", NODES, "3", "2"] + command(deck, tmp_path / "nodes", ["output.events=true"])
    done = subprocess.run(job, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "host node1, " in (tmp_path / "nodes" / "run.log").read_text()
    assert summary(tmp_path / "nodes")["ranks"] == 6
    assert differences(tmp_path / "plain", tmp_path / "nodes") == []


def test_positions_from_a_file_that_rank_0_sees(tmp_path):
    (tmp_path / "places").write_text("".join(f"{2 * n} 1 1\n" for n in range(9)))
    deck = SPHERES.replace("[placement]", "[placement]\nfile = \"places\"").replace("packing_fraction = 0.3\n", "")
    deck = deck.replace("fcc", "file").replace("108", "9").replace("3\nboundary", "3\nbox = [18.0, 3.0, 3.0]\nboundary")
    run(write_deck(tmp_path, deck), tmp_path / "plain")
    mpirun(2, RANK_0_AT_HOME + command("input.toml", tmp_path / "two"), cwd=tmp_path)
    assert differences(tmp_path / "plain", tmp_path / "two") == []


@pytest.mark.parametrize("method", ["psa", "cva", "mcva", "cdda", "edda"])
def test_forces_are_shared(method, tmp_path):
    deck = ROOT / "inputs" / "yukawa-fluid.toml"
    shorter = ["particles.count=256", "interaction.0.cutoff=2.5", "run.steps=20", "output.events=true", f"integrator.type={method}", "integrator.step=0.01",
               "output.frame_interval=0.1", "output.rdf_interval=0.07", "output.sk_interval=0.09", "output.profile_interval=0.05",
               "output.profile_pressure=true",
               "output.transport_interval=0.02", "output.transport_longest=0.1", "output.pressure_tensor_interval=0.03", "output.sample_start=0.05"]
    run(deck, tmp_path / "plain", shorter)
    assert summary(tmp_path / "plain")["events"]["sphere_sphere"] > 0
    for ranks in 2, 3:
        done = mpirun(ranks, command(deck, tmp_path / str(ranks), shorter))
        assert done.stderr == ""
        assert differences(tmp_path / "plain", tmp_path / str(ranks)) == []
        for name in "rdf.csv", "sk.csv", "profile.csv", "transport.csv", "pressure_tensor.csv":
            assert filecmp.cmp(tmp_path / "plain" / name, tmp_path / str(ranks) / name, shallow=False)


def test_the_fluxes_of_an_ewald_sum_are_shared(tmp_path):
    before, after = (ROOT / "inputs" / "one-component-plasma.toml").read_text().split("[[bath]]")
    text = before + "[integrator]" + after.split("[integrator]")[1].replace("start = \"equilibrated\"\n", "")
    deck = write_deck(tmp_path, text)
    shorter = ["run.steps=20", "output.transport_interval=0.036", "output.transport_longest=0.18", "output.pressure_tensor_interval=0.09"]
    run(deck, tmp_path / "plain", shorter)
    assert summary(tmp_path / "plain")["transport"]["thermal_conductivity"]["mean"] > 0
    for ranks in 2, 3:
        mpirun(ranks, command(deck, tmp_path / str(ranks), shorter))
        assert differences(tmp_path / "plain", tmp_path / str(ranks)) == []
        for name in "transport.csv", "pressure_tensor.csv":
            assert filecmp.cmp(tmp_path / "plain" / name, tmp_path / str(ranks) / name, shallow=False)


@pytest.mark.parametrize("fluid", ["hard-sphere-fluid", "yukawa-fluid", "square-well"])
def test_an_equilibrated_run_on_ranks_and_after_a_kill(fluid, killer, tmp_path):
    tables = tomllib.loads((ROOT / "inputs" / f"{fluid}.toml").read_text())
    tables.pop("bath", None)
    deck = write_deck(tmp_path, toml_text(tables))
    plain, killed = tmp_path / "plain", tmp_path / "killed"
    output = ["particles.0.count=108", "output.start=\"equilibrated\"", "output.frame_interval=0",
              "output.rdf_interval=0.1", "output.sk_interval=0.2", "output.sk_bins=5", "output.checkpoint_wall=\"0\"",
              "output.transport_interval=0.08", "output.pressure_tensor_interval=0.05",
              *(["integrator.step=0.03", "run.end_time=5.6", "output.thermo_interval=0.04", "interaction.0.cutoff=2.0"] if fluid == "yukawa-fluid"
                else ["integrator.step=0.2", "output.thermo_interval=0.03", f"run.end_time={9 if fluid == 'square-well' else 6}"])]
    run(deck, plain, output)
    found = summary(plain)["equilibration"]
    assert 0 < found["transient_end"] <= found["start"] / 2 + 0.25 and 3 <= found["start"] < 5.5
    assert summary(plain)["means"]["pressure"]["standard_error"] > 0
    assert summary(plain)["transport"]["shear_viscosity"]["mean"] > 0
    mpirun(2, command("input.toml", tmp_path / "two", output), cwd=tmp_path)
    assert differences(plain, tmp_path / "two") == []
    assert filecmp.cmp(plain / "transport.csv", tmp_path / "two" / "transport.csv", shallow=False)
    for part in 0.2, 0.7:  # before and after the end of the transient
        row = int(part * len(thermo(plain)["time"]))
        run(deck, killed, output, env=signalled(killer, killed, signal.SIGKILL, row), code=-signal.SIGKILL)
        go_on(killed, ranks=1 if fluid == "yukawa-fluid" else 2)
        assert differences(plain, killed) == []
        assert filecmp.cmp(plain / "transport.csv", killed / "transport.csv", shallow=False)


@pytest.mark.parametrize("method", ["psa", "edda"])
def test_ewald_sums_are_those_of_one_rank(method, tmp_path):
    deck = ROOT / "inputs" / "electrolyte-ewald.toml"
    shorter = ["particles.0.count=54", "particles.1.count=54", "run.steps=20", "output.events=true", "output.frame_interval=0.2",
               f"integrator.type={method}", "integrator.step=0.05", "interaction.0.surface=\"vacuum\""]
    run(deck, tmp_path / "plain", shorter)
    assert summary(tmp_path / "plain")["events"]["sphere_sphere"] > 0
    for ranks in 2, 3, 4:
        assert mpirun(ranks, command(deck, tmp_path / str(ranks), shorter)).stderr == ""
        assert differences(tmp_path / "plain", tmp_path / str(ranks)) == []


def test_bonds_across_ranks(tmp_path):
    deck = ROOT / "inputs" / "spring-lattice.toml"
    stiff = ["particles.count=2500", "interaction.0.stiffness=60.0", "integrator.step=0.05", "run.steps=20",
             "output.events=true", "output.frame_interval=0.2", "output.msd_interval=0.15"]
    plain = run(deck, tmp_path / "plain", stiff)
    assert "is long for the shortest period at the start" in plain.stderr
    for ranks in 2, 4:
        done = mpirun(ranks, command(deck, tmp_path / str(ranks), stiff))
        assert done.stderr == plain.stderr
        assert differences(tmp_path / "plain", tmp_path / str(ranks)) == []


def test_bonded_pairs_left_out_and_tables_across_ranks(tmp_path):
    (tmp_path / "potential.csv").write_text("r,V\n0.9,3.0\n1.2,0.8\n1.5,0.3\n2.0,0.0\n")
    bonds = {"type": "harmonic-bond", "chain": True, "chain_length": 8, "stiffness": 50.0, "rest_length": 1.1}
    table = {"type": "table", "file": "potential.csv", "exclude": "bonded"}
    attraction = {"type": "lennard-jones", "epsilon": 0.5, "sigma": 1.0, "cutoff": 2.0, "exclude": "bonded", "tail": True}
    chains = tomllib.loads(SPHERES) | {
        "particles": [{"name": "bead", "count": 512, "temperature": 1.0, "radius": 0.5}],
        "placement": {"type": "simple-cubic", "packing_fraction": 0.3},
        "interaction": [table, attraction, bonds],
        "integrator": {"type": "psa", "step": 0.005},
        "run": {"steps": 40},
        "output": {"directory": "unused", "frame_interval": 0.1, "thermo_interval": 0.05, "events": True}}
    run(write_deck(tmp_path, toml_text(chains)), tmp_path / "plain")
    done = summary(tmp_path / "plain")
    assert done["events"]["sphere_sphere"] > 0 and done["tail"]["energy"] < 0
    for ranks in 2, 3:
        mpirun(ranks, RANK_0_AT_HOME + command("input.toml", tmp_path / str(ranks)), cwd=tmp_path)
        assert differences(tmp_path / "plain", tmp_path / str(ranks)) == []
        assert summary(tmp_path / str(ranks))["tail"] == done["tail"]
    run(tmp_path / "input.toml", tmp_path / "narrow", env=os.environ | {"CAROM_SIMD": "sse2"})
    assert differences(tmp_path / "plain", tmp_path / "narrow") == []
    chains["interaction"] = [dict(table, exclude="none"), attraction, bonds]
    run(write_deck(tmp_path, toml_text(chains)), tmp_path / "all")
    assert summary(tmp_path / "all")["energy"]["initial"] > done["energy"]["initial"]  # bonded particles repel each other


def test_too_few_particles_to_share(tmp_path):
    deck = write_deck(tmp_path, SPRINGS)
    run(deck, tmp_path / "one")
    done = mpirun(3, command(deck, tmp_path / "three"))
    assert "4 particles under forces are too few to be shared; one rank works, the other 2 wait" in done.stderr
    assert summary(tmp_path / "three")["ranks"] == 3
    assert differences(tmp_path / "one", tmp_path / "three") == []


def test_more_ranks_than_there_is_work_for(tmp_path):
    done = mpirun(3, command(write_deck(tmp_path, SPHERES), tmp_path / "three", ["particles.0.count=20"]))
    assert "there is work for 2 of 3 ranks only" in done.stderr


# Decks with fewer spheres than ranks.
FEW = {
    "one": ([[2.0, 2.0, 2.0]], [[1.0, 0.5, 0.25]]),
    "three": ([[1.0, 1.0, 1.0], [3.5, 3.5, 3.5], [1.0, 3.5, 1.0]], [[1.0, 0.5, 0.25], [-1.0, 0.3, 0.2], [0.2, 1.0, 0.3]])}


@pytest.mark.parametrize("boundary", ["periodic", "wall"])
@pytest.mark.parametrize("which", FEW)
def test_fewer_spheres_than_ranks(which, boundary, tmp_path):
    position, velocity = FEW[which]
    few = tomllib.loads(SPHERES) | {
        "system": {"dimension": 3, "box": [5.0, 5.0, 5.0], "boundary": ["periodic", boundary, "periodic"]},
        "particles": [{"name": "sphere", "position": position, "velocity": velocity, "radius": 0.5}],
        "run": {"end_time": 20.0},
        "output": {"directory": "unused", "frame_interval": 1.0, "thermo_interval": 1.0, "events": True,
                   "msd_interval": 0.5}}
    del few["placement"]
    run(write_deck(tmp_path, toml_text(few)), tmp_path / "plain")
    for ranks in 2, 4:
        mpirun(ranks, command("input.toml", tmp_path / str(ranks)), cwd=tmp_path)
        assert differences(tmp_path / "plain", tmp_path / str(ranks)) == []
        assert filecmp.cmp(tmp_path / "plain" / "msd.csv", tmp_path / str(ranks) / "msd.csv", shallow=False)


def light_and_heavy(boundary):
    """Light spheres fly through many boxes while heavy spheres move by a diameter."""
    deck = tomllib.loads(SPHERES) | {
        "system": {"dimension": 3, "box": [6.0, 6.0, 6.0], "boundary": ["periodic", boundary, "periodic"]},
        "particles": [
            {"name": "heavy", "radius": 0.5, "mass": 1000.0, "temperature": 1.0,
             "position": [[1.0, 1.0, 1.0], [1.0, 3.0, 3.0], [3.0, 1.0, 5.0], [5.0, 5.0, 5.0], [5.0, 3.0, 1.0]]},
            {"name": "light", "radius": 0.1, "mass": 0.001, "temperature": 1.0,
             "position": [[2.0, 2.0, 2.0], [4.0, 4.0, 4.0], [2.5, 4.5, 2.5]]}],
        "run": {"collisions": 1000}}
    del deck["placement"]
    return deck


# Heavy discs that fill the height of the box, and a light one between them: unlimited collisions in any time.
WEDGED = {
    "format": 1, "system": {"dimension": 2, "boundary": ["periodic", "periodic"], "box": [5.141516051556095, 1.7138386838520316]},
    "particles": [{"name": "disc", "radius": 0.4284596709630079, "temperature": 0.2665408484358747,
                   "mass": [0.007280965091287921, 208.83535954699647, 0.0020785470182544726],
                   "position": [[1.2853790128890237, 1.2853790128890237], [0.4284596709630079, 1.2853790128890237],
                                [0.4284596709630079, 0.4284596709630079]]}],
    "integrator": {"type": "free-flight"}, "run": {"collisions": 30000},
    "output": {"directory": "unused", "frame_interval": 0.0, "thermo_interval": 0.0}}


@pytest.mark.parametrize("deck", [light_and_heavy("periodic"), light_and_heavy("wall"), WEDGED], ids=["light", "light-walled", "wedged"])
def test_what_one_rank_can_fly_so_can_several(deck, tmp_path):
    path = write_deck(tmp_path, toml_text(deck))
    run(path, tmp_path / "plain")
    for ranks in 2, 3:
        mpirun(ranks, command(path, tmp_path / str(ranks)))
        assert differences(tmp_path / "plain", tmp_path / str(ranks)) == []


def test_too_many_collisions_in_a_window(tmp_path):
    path, limit = write_deck(tmp_path, toml_text(WEDGED)), ["integrator.max_events_per_step=9000"]
    plain = run(path, tmp_path / "plain", limit, code=4)
    done = mpirun(2, command(path, tmp_path / "two", limit), code=4)
    for text in plain.stderr, done.stderr:
        assert "more than max_events_per_step = 27000 collisions in one step" in text


# A sheared mixture of rough and inelastic spheres between two walls, one of them thermal, with a bath and a field.
SHEARED = tomllib.loads(SPHERES) | {
    "title": "sheared",
    "system": {"dimension": 3, "box": [9.0, 10.0, 8.0], "boundary": ["periodic", "periodic", "wall"], "shear": {"rate": 1.2}},
    "particles": [{"name": "large", "count": 120, "temperature": 1.0, "radius": 0.6, "mass": 2.0},
                  {"name": "small", "count": 160, "temperature": 1.0, "rotational_temperature": 0.5, "radius": 0.4}],
    "contact": [{"between": ["*", "*"], "restitution": 0.9, "tangential": 0.5, "friction": 0.3}],
    "wall": [{"name": "z-", "temperature": 2.0}],
    "bath": [{"type": "andersen", "temperature": 1.0, "rate": 0.2}],
    "interaction": [{"type": "uniform-field", "acceleration": [0.0, 0.0, -0.2]}],
    "placement": {"type": "random", "seed": 4},
    "integrator": {"type": "free-flight"},
    "run": {"end_time": 4.0},
    "output": {"directory": "unused", "frame_interval": 0.7, "thermo_interval": 0.3}}
# Equal elastic spheres.
SHEARED_SIMPLY = SHEARED | {
    "system": {"dimension": 3, "boundary": ["periodic"] * 3, "shear": {"rate": -0.7}}, "contact": [], "wall": [], "bath": [], "interaction": [],
    "particles": [{"name": "sphere", "count": 500, "temperature": 1.0, "radius": 0.5}],
    "placement": {"type": "fcc", "packing_fraction": 0.3, "seed": 4}}


# Few collisions in a box that is much higher than long, and in a flat one.
SHEARED_THIN = SHEARED_SIMPLY | {
    "system": {"dimension": 3, "box": [8.0, 80.0, 10.0], "boundary": ["periodic"] * 3, "shear": {"rate": 2.0}},
    "placement": {"type": "random", "seed": 4}, "run": {"end_time": 8.0}}
SHEARED_DISCS = SHEARED_SIMPLY | {
    "system": {"dimension": 2, "box": [60.0, 12.0], "boundary": ["periodic"] * 2, "shear": {"rate": 0.5}},
    "placement": {"type": "random", "seed": 4}, "particles": [{"name": "disc", "count": 300, "temperature": 1.0, "radius": 0.5}]}


@pytest.mark.parametrize("deck", [SHEARED, SHEARED_SIMPLY, SHEARED_THIN, SHEARED_DISCS])
def test_shear_on_ranks_at_all_vector_widths_and_after_a_kill(deck, killer, tmp_path):
    plain = tmp_path / "plain"
    output = ["output.events=true", "output.checkpoint_wall=\"0\"", "output.pressure_tensor_interval=0.25", "output.sample_start=0.5"]
    deck = write_deck(tmp_path, toml_text(deck))
    run(deck, plain, output)
    found = summary(plain)
    assert found["events"]["sphere_sphere"] > 1000 and found["energy"]["max_abs_error"] < 1e-12 * found["energy"]["reference"]
    expect_same_anywhere(deck, output, plain, killer, (2, 3, 4))
