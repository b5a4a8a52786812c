# SPDX-License-Identifier: BSD-3-Clause
"""`carom run --continue`: after any interruption, the final files are those of an undisturbed run, bit for bit."""

import os
import re
import shlex
import shutil
import signal
import subprocess
import time

import pytest

from going_on import ALL_OUTPUT, CHECKPOINTS, INTERRUPTED, box, compare, expect_same, go_on, toml_text, wait_for_rows
from runs import (CAROM, ROOT, SPHERES, SPRINGS, command, mpi_environment, mpirun, needs_carom, needs_compiler, run, signalled,
                  summary, thermo, wait_until_stopped, write_deck)

pytestmark = needs_carom


def on_ranks(ranks, deck, output, overrides):
    if ranks > 1:
        mpirun(ranks, command(deck, output, overrides))
    else:
        run(deck, output, overrides)


METHODS = [("free-flight", {}), ("verlet", {}), ("psa", {}), ("cva", {}), ("mcva", {}), ("mcva", {"variant": "restart"}),
           ("cdda", {}), ("cdda", {"order": 4}), ("edda", {}), ("cdda", {"accuracy": 1e-4}), ("edda", {"accuracy": 1e-4})]
RANKS = [(1, 1), (1, 2), (2, 3), (1, 1), (3, 1)]
CASES = [(method, more, dimension, *RANKS[(len(METHODS) * dimension + n) % len(RANKS)])
         for dimension in (2, 3) for n, (method, more) in enumerate(METHODS)]


@pytest.mark.parametrize("method, more, dimension, before, after", CASES)
def test_twice_half_a_run_is_a_whole_one(method, more, dimension, before, after, tmp_path):
    steps = 8 if method == "free-flight" else 60
    deck = write_deck(tmp_path, box(method, dimension, steps, **more))
    run(deck, tmp_path / "whole", ALL_OUTPUT)
    on_ranks(before, deck, tmp_path / "halves", [*ALL_OUTPUT, f"run.steps={steps // 2}"])
    half = summary(tmp_path / "halves")
    go_on(tmp_path / "halves", ["--set", f"run.steps={steps}"], ranks=after)
    expect_same(tmp_path / "whole", tmp_path / "halves")
    assert summary(tmp_path / "halves")["deck"] == half["deck"] == str(deck)
    assert (tmp_path / "halves" / "run.log").read_text().count("max |ΔE|") == 1  # the head of the table
    assert (tmp_path / "whole" / "deck.toml").read_text().replace(str(tmp_path / "whole"), str(tmp_path / "halves")) == (
        tmp_path / "halves" / "deck.toml").read_text()


@needs_compiler
def test_the_time_of_both_parts_counts(killer, tmp_path):
    """The first part of the run is stopped for half a second."""
    deck, out = write_deck(tmp_path, box("psa", 3, 200)), tmp_path / "parts"
    job = subprocess.Popen(command(deck, out, ["run.steps=199"]), env=signalled(killer, out, signal.SIGSTOP, 5))
    wait_until_stopped(job)
    time.sleep(0.5)
    job.send_signal(signal.SIGCONT)
    assert job.wait() == 0
    go_on(out, ["--set", "run.steps=200"])
    assert summary(out)["wall_seconds"] > 0.5


def test_warnings_and_the_last_collision_are_kept(tmp_path):
    """Continues a run with a stiff spring, and a run that ends because its spheres fly apart long after their collision."""
    stiff = write_deck(tmp_path, SPRINGS.replace("stiffness = 1.0", "stiffness = 1e4"))
    run(stiff, tmp_path / "whole", ["run.steps=20"])
    run(stiff, tmp_path / "halves", ["run.steps=10"])
    go_on(tmp_path / "halves", ["--set", "run.steps=20"])
    expect_same(tmp_path / "whole", tmp_path / "halves")
    assert "is long for the shortest period" in summary(tmp_path / "halves")["warnings"][0]
    apart, out = write_deck(tmp_path, toml_text({
        "format": 1, "system": {"dimension": 2, "box": [60.0, 12.0], "boundary": ["open", "wall"]},
        "particles": [{"name": "disc", "radius": 0.5, "position": [[20.0, 2.0], [40.0, 2.0], [50.0, 8.0]],
                       "velocity": [[0.005, 0.0], [-0.005, 0.0], [10.0, 0.0]]}],
        "integrator": {"type": "free-flight", "step": 100.0}, "run": {"collisions": 1000}, "output": {"directory": "unused"}})), tmp_path / "apart"
    assert "no two spheres have met for" in run(apart, out, CHECKPOINTS, code=4).stderr
    steps = summary(out)["steps"]
    go_on(out, code=4)
    assert summary(out)["steps"] == steps
    assert int(re.search(r"continued at step (\d+)", (out / "run.log").read_text())[1]) > 20  # they collided in step 19


@pytest.mark.parametrize("end", ["run.end_time", "run.collisions"])
@pytest.mark.parametrize("method", ["free-flight", "psa"])
def test_a_later_end(end, method, tmp_path):
    ends = {"run.end_time": [0.7301, 1.9], "run.collisions": [150, 400]}[end]
    text = box(method, 3, 1).replace("[run]\nsteps = 1\n", "[run]\n")
    deck = write_deck(tmp_path, text)
    run(deck, tmp_path / "whole", [*ALL_OUTPUT, f"{end}={ends[1]}"])
    run(deck, tmp_path / "parts", [*ALL_OUTPUT, f"{end}={ends[0]}"])
    go_on(tmp_path / "parts", ["--set", f"{end}={ends[1]}"])
    expect_same(tmp_path / "whole", tmp_path / "parts")


def test_a_finished_run_ends_at_once(tmp_path):
    """Its files are those of an undisturbed run, whether it ended within an epoch or between steps."""
    for n, (text, change) in enumerate([(box("free-flight", 3, 5), []), (box("free-flight", 2, 50), ["run.collisions=200"]),
                                        (box("edda", 3, 21), []), (box("verlet", 2, 21), ["run.end_time=0.333"])]):
        deck, whole, again = write_deck(tmp_path, text), tmp_path / f"whole{n}", tmp_path / f"again{n}"
        run(deck, whole, [*ALL_OUTPUT, *change])
        shutil.copytree(whole, again)
        for ranks in (1, 2):
            go_on(again, ranks=ranks)
            expect_same(whole, again)


def spheres(tmp_path, collisions, step=200.0):
    """A deck of free flight with long epochs of two million collisions and frequent rows. It can stop within an epoch, after half a
    million collisions."""
    text = SPHERES.replace("end_time = 3.0", f"collisions = {collisions}").replace('type = "free-flight"', f'type = "free-flight"\nstep = {step}')
    for old, new in [("count = 108", "count = 2048"), ("thermo_interval = 0.1", "thermo_interval = 1.0"), ("frame_interval = 0.5", "frame_interval = 2.5")]:
        assert old in text
        text = text.replace(old, new)
    return write_deck(tmp_path, text)


@needs_compiler
@pytest.mark.parametrize("before, after", [(1, 1), (1, 2), (2, 1)])
def test_within_an_epoch(before, after, killer, tmp_path):
    deck, whole, out = spheres(tmp_path, 600000), tmp_path / "whole", tmp_path / "out"
    run(deck, whole)
    assert summary(whole)["steps"] == 1
    launcher = ["mpirun", "-n", str(before)] if before > 1 else []
    done = subprocess.run(launcher + command(deck, out), env=signalled(killer, out, signal.SIGUSR2, 5), capture_output=True, text=True)
    assert done.returncode == INTERRUPTED, done.stderr
    assert summary(out)["status"] == "interrupted" and summary(out)["steps"] == 0
    go_on(out, ranks=after)
    expect_same(whole, out)


@needs_compiler
@pytest.mark.parametrize("name", ["TERM", "INT", "HUP", "USR2", "USR1"])
def test_signals(name, killer, tmp_path):
    deck, out = spheres(tmp_path, 2500000), tmp_path / "out"
    done = subprocess.run(command(deck, out), env=signalled(killer, out, getattr(signal, "SIG" + name), 5), capture_output=True, text=True)
    assert (out / "checkpoint.h5").exists() and not (out / "carom.lock").exists()
    assert (out / "checkpoint.previous.h5").exists() == (name == "USR1")  # after which the run continues, and writes another one at its end
    assert done.returncode == (0 if name == "USR1" else INTERRUPTED), done.stderr
    assert summary(out)["status"] == ("done" if name == "USR1" else "interrupted")
    assert (f"stopped by SIG{name}; carom run --continue {out} goes on" in (out / "run.log").read_text()) == (name != "USR1")


@pytest.mark.parametrize("ends", [True, False])
def test_signals_to_mpirun(ends, tmp_path):
    """A run without end gets USR1, writes a checkpoint and goes on, and ends after USR2."""
    deck, out = spheres(tmp_path, 10**12), tmp_path / "out"
    job = subprocess.Popen(["mpirun", "-n", "2", *command(deck, out)], env=mpi_environment(), stderr=subprocess.PIPE, text=True)
    wait_for_rows(job, out)
    if not ends:
        job.send_signal(signal.SIGUSR1)
        while not (out / "checkpoint.h5").exists():
            assert job.poll() is None, job.stderr.read()
            time.sleep(0.01)
    job.send_signal(signal.SIGUSR2)
    assert job.wait(600) == INTERRUPTED, job.stderr.read()
    assert (out / "checkpoint.h5").exists() and (out / "checkpoint.previous.h5").exists() == (not ends)
    assert summary(out)["status"] == "interrupted"


@needs_compiler
def test_a_second_interrupt_ends_at_once(killer, tmp_path):
    """The process gets a second signal while it writes the checkpoint that is due to the first one."""
    out = tmp_path / "out"
    job = subprocess.Popen(command(write_deck(tmp_path, SPHERES), out, ["run.end_time=1e7"]), stderr=subprocess.PIPE, text=True,
                           env=signalled(killer, out, signal.SIGSTOP, name="checkpoint.h5"))
    wait_for_rows(job, out, 1)
    job.send_signal(signal.SIGINT)
    wait_until_stopped(job)
    job.send_signal(signal.SIGINT)
    job.send_signal(signal.SIGCONT)
    assert job.wait(600) == -signal.SIGINT
    assert not (out / "checkpoint.h5").exists()


def test_max_wall_again_and_again(tmp_path):
    """A run without end is continued with a wall time limit on different numbers of ranks, and then comes to an end."""
    deck, whole, out = write_deck(tmp_path, box("edda", 3, 10**9)), tmp_path / "whole", tmp_path / "out"
    run(deck, out, ALL_OUTPUT, arguments=("--quiet", "--max-wall", "0.1"), code=INTERRUPTED)
    for ranks in (1, 2, 1):
        go_on(out, ["--max-wall", "0.3"], code=INTERRUPTED, ranks=ranks)
    end = f"run.steps={summary(out)['steps'] + 10}"
    run(deck, whole, [*ALL_OUTPUT, end])
    go_on(out, ["--set", end])
    expect_same(whole, out)


def test_the_script_for_slurm(tmp_path):
    """With stand-ins for Slurm and mpirun: it asks to be queued again until the run is done, but not where it was cancelled."""
    deck, whole, out, queue = spheres(tmp_path, 10**12), tmp_path / "whole", tmp_path / "out", tmp_path / "queue"
    for name, text in {"mpirun": 'exec "$@"', "scontrol": f'echo "$@" >>{queue}', "sbatch": f'echo "$@" >>{queue}'}.items():
        (tmp_path / name).write_text(f"#!/bin/sh\n{text}\n")
        (tmp_path / name).chmod(0o755)
    environment = os.environ | {"PATH": f"{tmp_path}:{os.environ['PATH']}", "SLURM_JOB_ID": "17"}
    script = ROOT / "tools" / "slurm-run"
    for number, code, continued in [(signal.SIGUSR2, 0, 0), (signal.SIGTERM, INTERRUPTED, 1)]:
        job = subprocess.Popen([script, deck, out], env=environment, stderr=subprocess.PIPE, text=True)
        wait_for_rows(job, out)
        while (out / "run.log").read_text().count("continued") < continued:
            assert job.poll() is None
        job.send_signal(number)
        assert job.wait(600) == code, job.stderr.read()
        assert queue.read_text().count("requeue 17\n") == 1
    end = f"run.collisions={summary(out)['events']['sphere_sphere'] + 1000}"
    go_on(out, ["--set", end])
    subprocess.run([script, deck, out], env=environment, check=True)
    assert queue.read_text().count("requeue 17\n") == 1
    run(deck, whole, [end])
    expect_same(whole, out)
    subprocess.run([script, "deck", "there", "--nodes=2"], env={k: v for k, v in environment.items() if k != "SLURM_JOB_ID"}, check=True)
    assert queue.read_text().endswith(f"--nodes=2 {script} deck there\n")


@pytest.mark.parametrize("arguments, code, words", [
    (["--set", "integrator.step=0.1"], 2, "keeps its deck"),
    (["--set", "output.events=false"], 2, "keeps its deck"),
    (["--set", "run.nothing=1"], 2, "nothing"),
    (["-o", "elsewhere"], 2, "excludes"),
    (["deck.toml"], 2, "excludes"),
])
def test_what_cannot_be_changed(arguments, code, words, tmp_path):
    out = tmp_path / "out"
    run(write_deck(tmp_path, SPRINGS), out, ["run.steps=20"])
    before = contents(out)
    assert words in go_on(out, arguments, code=code).stderr
    assert contents(out) == before


def contents(directory):
    return {path.name: path.read_bytes() for path in directory.iterdir()}


def test_an_end_that_lies_behind_is_refused(tmp_path):
    """Steps, time and collisions are checked, on any number of ranks. No file changes, and the command in the message works."""
    text = box("psa", 3, 60).replace("steps = 60", "steps = 60\nend_time = 50.0\ncollisions = 100000")
    deck, done, short = write_deck(tmp_path, text), tmp_path / "done", tmp_path / "short"
    run(deck, done, ALL_OUTPUT)
    account = summary(done)
    reached = {"steps": 60, "end_time": account["end_time"], "collisions": account["events"]["sphere_sphere"]}
    run(deck, short, [*ALL_OUTPUT, "run.end_time=1.1937"])  # the last step is a short one: the checkpoint comes before it
    for out, key, end, least in [(done, "steps", 59, 60), (done, "end_time", 1.19, reached["end_time"]), (done, "collisions", 1, reached["collisions"]),
                                 (done, "steps", 1, 60), (short, "end_time", 1.19, 1.1937), (short, "steps", 59, 60)]:
        before = contents(out)
        for ranks in (1, 2):
            refused = go_on(out, ["--set", f"run.{key}={end}"], code=2, ranks=ranks).stderr
            assert f"--set run.{key}={end}: the run has come to" in refused and f"give that or more (--set run.{key}={least})" in refused, refused
            assert contents(out) == before
    for key, end in reached.items():
        same = tmp_path / key
        shutil.copytree(done, same)
        go_on(same, ["--set", f"run.{key}={end}"])
        assert compare(done, same) == [] and (same / "thermo.csv").read_bytes() == (done / "thermo.csv").read_bytes()
        assert summary(same)["status"] == "done" and summary(same)["steps"] == 60
    line = re.search("or start anew: (carom run .*)$", go_on(done, ["--set", "run.steps=30"], code=2).stderr.strip())[1]
    subprocess.run([CAROM, *shlex.split(line)[1:], "--quiet"], check=True)
    assert summary(tmp_path / "done-earlier")["steps"] == 30


@needs_compiler
def test_an_end_that_lies_behind_within_an_epoch(killer, tmp_path):
    deck, out, whole = spheres(tmp_path, 4000000), tmp_path / "out", tmp_path / "whole"
    run(deck, out, env=signalled(killer, out, signal.SIGUSR2, 5), code=INTERRUPTED)
    before, collisions = contents(out), summary(out)["events"]["sphere_sphere"]
    assert summary(out)["steps"] == 0
    refused = go_on(out, ["--set", "run.end_time=1.0"], code=2).stderr
    reached = float(re.search(r"has come to time (\S+) already", refused)[1])
    assert reached >= thermo(out)["time"][-1] > 20
    assert f"come to collision {collisions + 1} " in go_on(out, ["--set", f"run.collisions={collisions}"], code=2).stderr
    assert contents(out) == before
    for key, end in [("end_time", reached), ("collisions", collisions + 1)]:
        same, whole = tmp_path / f"same-{key}", tmp_path / f"whole-{key}"
        shutil.copytree(out, same)
        go_on(same, ["--set", f"run.{key}={end}"])
        run(deck, whole, [f"run.{key}={end}"])
        expect_same(whole, same)


def test_a_file_of_another_run_is_named(tmp_path):
    """An error names a file that is missing, cut off or not a file. No file is written on any number of ranks."""
    deck, out, other = write_deck(tmp_path, box("psa", 3, 30)), tmp_path / "out", tmp_path / "other"
    run(deck, out, ALL_OUTPUT)
    run(deck, other, [*ALL_OUTPUT, "placement.seed=6"])
    own = contents(out)
    for name in ("thermo.csv", "trajectory.h5md", "events.h5", "run.log"):
        for ranks, bytes_ in [(1, (other / name).read_bytes()), (2, (other / name).read_bytes()), (1, own[name][: len(own[name]) // 4]), (1, b""), (2, None)]:
            (out / name).unlink()
            if bytes_ is not None:
                (out / name).write_bytes(bytes_)
            before = contents(out)
            refused = go_on(out, ["--set", "run.steps=60"], code=5, ranks=ranks).stderr
            assert f"{out / name}: " in refused and "put back the file that the run has written, or start a new run" in refused
            assert "check free space" not in refused and refused.count(str(out / name)) == 1
            assert contents(out) == before
        (out / name).unlink(missing_ok=True)
        os.mkfifo(out / name)
        assert f"{out / name}: " in go_on(out, code=5).stderr and (out / name).is_fifo()
        (out / name).unlink()
        (out / name).write_bytes(own[name])
    whole = tmp_path / "whole"
    run(deck, whole, [*ALL_OUTPUT, "run.steps=60"])
    go_on(out, ["--set", "run.steps=60"])
    expect_same(whole, out)


def test_mistakes(tmp_path):
    assert "DECK, or --continue DIR, is required" in subprocess.run([CAROM, "run"], capture_output=True, text=True).stderr
    assert "there is no checkpoint.h5 to go on from" in go_on(tmp_path, code=5).stderr
    assert "there is no checkpoint.h5 to go on from" in go_on(tmp_path / "missing", code=5).stderr
    assert not (tmp_path / "missing").exists() and not list(tmp_path.iterdir())


def test_a_ramp_keeps_its_end_in_a_longer_run(tmp_path):
    """A bath that heats from 1 to 2 over the run; the run is continued to twice its end, where the temperature stays 2."""
    deck = write_deck(tmp_path, box("edda", 2, 100) + '[[bath]]\ntype = "andersen"\ntemperature = [1.0, 2.0]\nrate = 5.0\n')
    run(deck, tmp_path / "longer", ["run.steps=50"])
    assert "ramp_time = [0.0, 1.0]" in (tmp_path / "longer" / "deck.toml").read_text()
    go_on(tmp_path / "longer", ["--set", "run.steps=100"])
    run(deck, tmp_path / "whole", ["bath.0.ramp_time=[0.0, 1.0]"])
    expect_same(tmp_path / "whole", tmp_path / "longer")
