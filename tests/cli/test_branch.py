# SPDX-License-Identifier: BSD-3-Clause
"""`carom branch`: a new run from the particles of a checkpoint, with a changed deck."""

import shlex
import shutil
import signal
import subprocess

import numpy as np
import pytest

from going_on import INTERRUPTED, box, expect_same, go_on
from runs import CAROM, command, data_sets, mpi_environment, mpirun, needs_carom, needs_compiler, run, signalled, summary, thermo, write_deck
from test_continue import CASES, spheres

pytestmark = needs_carom

EVENTS = ["output.events=true"]


def branch(start, output, overrides=(), code=0, ranks=1, arguments=()):
    sets = [part for override in overrides for part in ("--set", override)]
    what = [CAROM, "branch", str(start), "-o", str(output), "--quiet", *sets, *arguments]
    if ranks > 1:
        return mpirun(ranks, what, code)
    done = subprocess.run(what, capture_output=True, text=True, timeout=1200)
    assert done.returncode == code, done.stderr
    return done


def contents(directory):
    return {path.name: path.read_bytes() for path in directory.iterdir()}


def expect_later_part(whole, later, step, start=0):
    """The frames, rows and events of a run after a step, and a time within it, are those of the branch, bit for bit."""
    frames = [data_sets(run / "trajectory.h5md") for run in (whole, later)]
    steps = [sets["particles/trajectory/position/step"] for sets in frames]
    times = [sets["particles/trajectory/position/time"] for sets in frames]
    common = np.intersect1d(*times)
    assert len(common) > 2 and steps[1][0] >= step
    assert len(common) >= len(times[1]) - 1  # the first may be between two times of the whole run
    for name in ("position", "velocity", "image"):
        one, other = (sets[f"particles/trajectory/{name}/value"][np.isin(time, common)] for sets, time in zip(frames, times))
        assert one.tobytes() == other.tobytes(), name
    for name in ("total", "temperature", "momentum_x"):
        one, other = ({row["time"]: row[name] for row in rows} for rows in (table_rows(whole), table_rows(later)))
        assert len(one.keys() & other.keys()) > 2 and all(one[time] == other[time] for time in list(other)[1:])
    events = [data_sets(run / "events.h5") for run in (whole, later)]
    slab = events[0]["events/slab"]
    after = (slab >= step) & (slab < summary(later)["steps"]) & (events[0]["events/time"] > start)
    for name in ("time", "slab", "lo", "hi", "image", "x_lo", "impulse"):
        assert events[0][f"events/{name}"][after].tobytes() == events[1][f"events/{name}"].tobytes(), name


def table_rows(directory):
    table = thermo(directory)
    return [dict(zip(table, values)) for values in zip(*table.values())]


@pytest.mark.parametrize("method, more, dimension, before, after", CASES[:9])
def test_without_a_change_the_bits_are_those_of_the_run(method, more, dimension, before, after, tmp_path):
    steps = 8 if method == "free-flight" else 60
    deck, whole, half, out = write_deck(tmp_path, box(method, dimension, steps, **more)), *(tmp_path / name for name in ("whole", "half", "out"))
    run(deck, whole, EVENTS)
    (run(deck, half, [*EVENTS, f"run.steps={steps // 2}"]) if before == 1 else
     mpirun(before, command(deck, half, [*EVENTS, f"run.steps={steps // 2}"])))
    kept = contents(half)
    branch(half, out, [f"run.steps={steps}"], ranks=after)
    assert contents(half) == kept
    expect_later_part(whole, out, steps // 2)
    account = summary(out)
    assert account["branched_from"] == {"checkpoint": str(half / "checkpoint.h5"), "step": steps // 2, "time": thermo(half)["time"][-1]}
    assert account["steps"] == steps and "branched_from" not in summary(half)
    assert account["events"]["sphere_sphere"] == np.sum(data_sets(out / "events.h5")["events/kind"] == 0)
    assert account["energy"]["initial"] == table_rows(out)[0]["total"]


@needs_compiler
@pytest.mark.parametrize("after", [1, 2])
def test_within_an_epoch(after, killer, tmp_path):
    text = spheres(tmp_path, 700000, step=60.0).read_text()
    deck, whole, out, later = write_deck(tmp_path, text + "events = true\n"), *(tmp_path / name for name in ("whole", "out", "later"))
    run(deck, whole)
    assert summary(whole)["steps"] > 1
    run(deck, out, env=signalled(killer, out, signal.SIGUSR2, 5), code=INTERRUPTED)
    step = summary(out)["steps"]
    last = summary(whole)["steps"] - 1  # the end of an epoch
    assert step < last
    branch(out, later, [f"run.steps={last}"], ranks=after)
    start = thermo(later)["time"][0]
    assert start == summary(out)["end_time"] > step * 60.0
    expect_later_part(whole, later, step, start)


@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("method, end", [("free-flight", "run.end_time=0.7301"), ("free-flight", "run.collisions=150"),
                                         ("edda", "run.end_time=0.7301")])
def test_a_run_that_has_ended_is_left_at_its_end(method, end, ranks, tmp_path):
    """The checkpoint is from before the last epoch or step; a branch off this file starts there."""
    ended, out, earlier = (tmp_path / name for name in ("ended", "out", "earlier"))
    text = box(method, 3, 1).replace("[run]\nsteps = 1\n", "[run]\n")
    run(write_deck(tmp_path, text), ended, [end])
    kept = contents(ended)
    later = ["run.end_time=2"] + ["run.collisions=100000"] * ("collisions" in end)
    branch(ended, out, later, ranks=ranks)
    branch(ended / "checkpoint.h5", earlier, later, ranks=ranks)
    assert contents(ended) == kept
    last, first = (data_sets(each / "trajectory.h5md") for each in (ended, out))
    assert thermo(out)["time"][0] == summary(out)["branched_from"]["time"] == summary(ended)["end_time"] > thermo(earlier)["time"][0]
    for name in ("position", "velocity", "image"):
        name = f"particles/trajectory/{name}/value"
        assert first[name][0].tobytes() == last[name][-1].tobytes(), name
    account = summary(out)
    assert account["energy"]["initial"] == summary(ended)["energy"]["final"] and account["end_time"] == 2
    go_on(out, ["--set", "run.end_time=2.5"])
    branch(ended, tmp_path / "longer", ["run.end_time=2.5", *later[1:]])
    expect_same(tmp_path / "longer", out)


@pytest.fixture(scope="module")
def half(tmp_path_factory):
    """A complete run of cdda with 30 steps of 0.02 and two checkpoints."""
    place = tmp_path_factory.mktemp("half")
    run(write_deck(place, box("cdda", 2, 20)), place / "half")
    go_on(place / "half", ["--set", "run.steps=30"])
    return place / "half"


@pytest.mark.parametrize("changes", [
    ["integrator.step=0.01"], ["integrator.type=edda"], ["integrator.type=mcva", "integrator.variant=restart"], ["integrator.order=4"],
    ["interaction.1.amplitude=0.5"], ["interaction.1.type=lennard-jones", "interaction.1.epsilon=0.1", "interaction.1.sigma=1.0"],
    ["output.frame_interval=0.01", "output.rdf_interval=0.02", "output.msd_interval=0.02"]])
def test_changes(changes, half, tmp_path):
    """Time and steps continue; energies, sums and averages start again; and the branch itself can be continued."""
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    for ranks, out in ((1, whole), (2, parts)):
        branch(half, out, [*changes, "run.steps=" + ("60" if out == whole else "45")], ranks=ranks)
    rows, account = table_rows(whole), summary(whole)
    step = 0.01 if "integrator.step=0.01" in changes else 0.02
    assert rows[0]["time"] == account["branched_from"]["time"] == 0.6 and rows[0]["step"] == account["branched_from"]["step"] == 30
    assert rows[0]["collisions"] == 0 and rows[-1]["step"] == account["steps"] == 60
    assert rows[-1]["time"] == pytest.approx(0.6 + 30 * step, rel=1e-14)
    if "restart" not in changes[-1] and "mcva" not in changes[0]:
        assert account["energy"]["max_abs_error"] < 1e-10 * account["energy"]["reference"]
    go_on(parts, ["--set", "run.steps=60"])
    expect_same(whole, parts)
    assert (whole / "deck.toml").read_text().startswith(f"# A branch of {half}/checkpoint.h5")
    run(whole / "deck.toml", tmp_path / "again", ["run.steps=2"])  # it is a deck


@pytest.mark.parametrize("method", ["cdda", "free-flight"])
def test_smooth_contacts_become_rough_and_smooth_again(method, tmp_path):
    """Without spin at first; with tangential = -1 contacts change no spin, and spins stay."""
    half, rough, parts, smooth = (tmp_path / name for name in ("half", "rough", "parts", "smooth"))
    start = 6 if method == "free-flight" else 20
    run(write_deck(tmp_path, box(method, 3, start) + '\n[[contact]]\nbetween = ["*", "*"]\nrestitution = 0.95\n'), half)
    branch(half, rough, ["contact.0.tangential=0.5", f"run.steps={2 * start}"])
    branch(half, parts, ["contact.0.tangential=0.5", f"run.steps={start + 2}"], ranks=2)
    go_on(parts, ["--set", f"run.steps={2 * start}"])
    expect_same(rough, parts)
    spin = data_sets(rough / "trajectory.h5md")["particles/trajectory/angular_velocity/value"]
    energy = summary(rough)["energy"]
    assert not spin[0].any() and spin[-1].any()
    assert energy["dissipated"] > 0 and energy["rotational"] > 0 and energy["max_abs_error"] < 1e-12 * energy["reference"]
    branch(rough, smooth, ["contact.0.tangential=-1", f"run.steps={3 * start}"])
    after = data_sets(smooth / "trajectory.h5md")["particles/trajectory/angular_velocity/value"]
    assert (after == spin[-1]).all() and summary(smooth)["energy"]["rotational"] == pytest.approx(energy["rotational"], rel=1e-14)


def test_continue_names_the_command(half, tmp_path):
    """Runs the command that the message names, which must succeed."""
    mine = tmp_path / "a run"
    shutil.copytree(half, mine)
    refused = go_on(mine, ["--set", "integrator.step=0.01", "--set", "run.steps=40"], code=2).stderr.strip()
    line = refused[refused.index("carom branch"):]
    assert line == f"carom branch '{mine}' --set integrator.step=0.01 --set run.steps=40 -o '{mine}-branch'"
    subprocess.run([CAROM, *shlex.split(line)[1:]], check=True, capture_output=True)
    assert summary(tmp_path / "a run-branch")["steps"] == 40


def test_the_checkpoint_before(half, tmp_path):
    mine, out = tmp_path / "mine", tmp_path / "out"
    shutil.copytree(half, mine)
    good = (mine / "checkpoint.h5").read_bytes()
    (mine / "checkpoint.h5").write_bytes(good[:5000] + bytes([good[5000] ^ 1]) + good[5001:])
    for ranks in (1, 2):
        done = branch(mine, out, ["run.steps=40"], ranks=ranks)
        assert "its checksum is not that of its contents" in done.stderr and "going on from checkpoint.previous.h5" in done.stderr
        assert summary(out)["branched_from"]["step"] == 20
    assert (mine / "checkpoint.h5").exists() and (mine / "checkpoint.previous.h5").exists()
    assert "damaged" in branch(mine / "checkpoint.h5", out, ["run.steps=40"], code=5).stderr
    branch(mine / "checkpoint.previous.h5", out, ["run.steps=40"])


@pytest.mark.parametrize("changes, code, words", [
    (["system.box=[9.0,9.0]"], 2, "--set system.box: error: a branch has the particles and the box of its checkpoint"),
    (["wall.0.velocity=0.1"], 2, "--set wall.0.velocity: error: a branch has the particles and the box of its checkpoint"),
    (["particles.0.radius=0.4"], 2, "--set particles.0.radius: error"),
    (["placement.seed=3", "particles.0.count=9"], 2, "--set particles.0.count: error"),
    (["interaction.2.within=1.5"], 2, "--set interaction.2.within: error"),
    (["integrator.stpe=0.1"], 2, "--set integrator.stpe: error: unknown key"),
    (["integrator.type=rk4"], 2, "unknown integrator 'rk4'"),
    (["integrator.type=free-flight"], 2, "free-flight knows no forces but a uniform-field"),
    ([], 2, "run.steps = 30: the branch starts at step 30"),
    (["run.steps=100", "run.end_time=0.5"], 2, "run.end_time = 0.5: the branch starts at step 30, time 0.6"),
])
def test_mistakes(changes, code, words, half, tmp_path):
    kept = contents(half)
    assert words in branch(half, tmp_path / "out", changes, code).stderr
    assert contents(half) == kept and not (tmp_path / "out").exists()


def test_places(half, tmp_path):
    kept = contents(half)
    assert "is the directory of the run to branch off" in branch(half, half, ["run.steps=40"], 2).stderr
    assert "is the directory of the run to branch off" in branch(half / "checkpoint.h5", half, ["run.steps=40"], 2).stderr
    assert "there is no checkpoint.h5" in branch(tmp_path, tmp_path / "out", code=5).stderr
    assert "No such file" in branch(tmp_path / "missing.h5", tmp_path / "out", code=5).stderr
    assert "No such file" in branch(tmp_path / "missing.h5", tmp_path / "out", code=5, ranks=2).stderr
    done = subprocess.run([CAROM, "branch", str(half)], capture_output=True, text=True)
    assert done.returncode == 2 and "--output is required" in done.stderr
    assert contents(half) == kept and not (tmp_path / "out").exists()
    assert subprocess.run(["mpirun", "-n", "2", CAROM, "branch", "--help"], env=mpi_environment(), capture_output=True).returncode == 0


def test_a_ramp_goes_on_in_a_branch_and_another_ramp_needs_its_times(tmp_path):
    deck = write_deck(tmp_path, box("psa", 2, 50) + '[[bath]]\ntype = "andersen"\ntemperature = [1.0, 2.0]\nrate = 5.0\n')
    run(deck, tmp_path / "run", ["run.steps=20", "bath.0.ramp_time=[0.0, 1.0]"])
    branch(tmp_path / "run", tmp_path / "same", ["run.steps=50"])
    go_on(tmp_path / "run", ["--set", "run.steps=50"])
    assert thermo(tmp_path / "same")["temperature"][-1] == thermo(tmp_path / "run")["temperature"][-1]
    refused = branch(tmp_path / "run", tmp_path / "other", ["bath.0.temperature=[2.0, 3.0]", "run.steps=90"], code=2)
    assert "set bath.0.ramp_time, too" in refused.stderr
    branch(tmp_path / "run", tmp_path / "other", ["bath.0.temperature=[2.0, 3.0]", "bath.0.ramp_time=[1.0, 1.8]", "run.steps=90"])
    branch(tmp_path / "run", tmp_path / "constant", ["bath.0.temperature=2.0", "run.steps=60"])
