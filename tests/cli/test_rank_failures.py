# SPDX-License-Identifier: BSD-3-Clause
"""`mpirun carom run`: how ranks wait, stop and end, and what happens when one of them fails."""

import copy
import os
import pathlib
import re
import resource
import signal
import subprocess
import sys
import time

import pytest

from runs import (CAROM, MPIRUN, ROOT, SPHERES, SPRINGS, command, data_sets, frames_are_sound, mpi_environment, mpirun, needs_carom,
                  needs_compiler, run, running, summary, thermo, write_deck)

sys.path.insert(0, str(ROOT / "tools"))
from carom_files import toml_text

pytestmark = needs_carom

# A run without end and with little output.
ENDLESS = ["run.end_time=1e7", "integrator.step=1.0", "output.frame_interval=10.0", "output.thermo_interval=10.0"]


def start(ranks, arguments):
    return subprocess.Popen(MPIRUN + [str(ranks)] + [str(argument) for argument in arguments], env=mpi_environment(),
                            stderr=subprocess.PIPE, text=True)


def when_it_has_ended(output):
    """mpirun does not wait for processes that it kills."""
    for _ in range(6000):
        if not running(output):
            return
        time.sleep(0.01)
    raise AssertionError("processes are left")


def when_it_runs(job, output):
    """The processes, by rank, once three frames are written: the fourth row comes after the third frame."""
    while not (output / "thermo.csv").exists() or len((output / "thermo.csv").read_text().splitlines()) < 5:
        assert job.poll() is None, job.stderr.read()
        time.sleep(0.01)
    return running(output)


def idle_seconds(output):
    """Processor time so far of each rank except 0 of the run that writes to this directory."""
    seconds = []
    for rank, pid in running(output).items():
        times = pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[11:13]
        if rank > 0:
            seconds.append(sum(map(int, times)) / os.sysconf("SC_CLK_TCK"))
    return seconds


@pytest.mark.kills_mpirun
def test_idle_ranks_sleep_and_share_the_exit_code(tmp_path):
    deck, out = write_deck(tmp_path, SPRINGS), tmp_path / "out"
    endless = command(deck, out, ["run.steps=100000000", "output.frame_interval=0.0"])
    job = start(4, endless)
    when_it_runs(job, out)
    before = idle_seconds(out)
    time.sleep(2)
    after = idle_seconds(out)
    job.terminate()
    job.wait()
    assert len(before) == len(after) == 3
    assert sum(after) - sum(before) < 0.3  # in total; spinning ranks would use the whole cores
    mpirun(4, endless + ["--max-wall", "00:00:01"], code=75)


def test_rank_0_stops_all(tmp_path):
    out = tmp_path / "out"
    # mpirun reports one exit code only: each rank notes its own.
    noted = ["sh", "-c", '"$@"; echo $? >"$0.$OMPI_COMM_WORLD_RANK"', tmp_path / "code"]
    mpirun(3, noted + command(write_deck(tmp_path, SPHERES), out, ENDLESS, ("--quiet", "--max-wall", "00:00:01")))
    assert [(tmp_path / f"code.{rank}").read_text() for rank in range(3)] == 3 * ["75\n"]
    assert summary(out)["status"] == "interrupted"
    assert frames_are_sound(out) > 0


@pytest.mark.parametrize("change, code, words", [
    ("integrator.stpe=0.1", 2, "stpe"),
    ("placement.packing_fraction=0.9", 3, "overlap"),
    ("integrator.max_events_per_step=1", 4, "max_events_per_step"),
])
def test_an_error_of_all_ranks_is_reported_once(change, code, words, tmp_path):
    deck, out = write_deck(tmp_path, SPHERES), tmp_path / "out"
    errors = run(deck, tmp_path / "plain", [change], code=code).stderr
    done = mpirun(3, command(deck, out, [change]), code=code)
    assert words in errors
    # One rank may report more about a failed step than several ranks.
    assert code == 4 or done.stderr.count(errors.strip()) == 1
    assert done.stderr.count(words) == errors.count(words)
    assert "carom: rank" not in done.stderr and "MPI_ABORT" not in done.stderr
    assert out.exists() == (tmp_path / "plain").exists() == (code == 4)
    assert code != 4 or summary(out)["status"] == "failed"


# 800 discs far from each other, and each rank has half of the box. The error is at the right end.
APART = {
    "format": 1, "title": "an error that one rank meets",
    "system": {"dimension": 2, "box": [80.0, 40.0], "boundary": ["periodic", "periodic"]},
    "particles": [{"name": "disc", "display_radius": 0.5, "velocity": [[0.0, 0.0]] * 800,
                   "position": [[1 + 2.0 * (k // 20), 1 + 2.0 * (k % 20)] for k in range(800)]}],
    "interaction": [{"type": "lennard-jones", "epsilon": 1.0, "sigma": 1.0, "cutoff": 1.5}],
    "integrator": {"type": "verlet", "step": 0.01},
    "run": {"steps": 10},
    "output": {"directory": "unused", "frame_interval": 0.05, "thermo_interval": 0.05}}


def spheres(deck):
    """Gives the points of the deck a core."""
    disc = deck["particles"][0]
    disc["radius"] = disc.pop("display_radius")
    return deck


def on_each_other(deck):
    deck["particles"][0]["position"][797] = deck["particles"][0]["position"][796][:]


def far_apart(deck):
    spheres(deck)["integrator"]["type"] = "edda"
    deck["particles"][0]["velocity"][785:795] = [[0.0, -8.0]] + 8 * [[0.0, 0.0]] + [[0.0, 8.0]]
    deck["interaction"] = [{"type": "harmonic-bond", "pairs": [[785, 794]], "stiffness": 1e-3, "rest_length": 18.0}]


def too_many_collisions(deck):
    spheres(deck)["integrator"] = {"type": "edda", "step": 0.5, "max_events_per_step": 1}
    deck["particles"][0]["velocity"][794:798] = 2 * [[0.0, 3.0], [0.0, -3.0]]


@pytest.mark.parametrize("spoil, words, of_one", [
    (on_each_other, "the force between particles 796 and 797, 0 apart, is too large or no number", True),
    (far_apart, "the bond of particles 785 and 794 spans nearly half the periodic box", True),
    (too_many_collisions, "more than max_events_per_step = 1 collisions in one step, the last between", False),
])
def test_an_error_of_one_rank_ends_all(spoil, words, of_one, tmp_path):
    deck = copy.deepcopy(APART)
    spoil(deck)
    path = write_deck(tmp_path, toml_text(deck))
    assert words in run(path, tmp_path / "plain", code=4).stderr
    for ranks in 2, 4:
        done = mpirun(ranks, command(path, tmp_path / str(ranks)), code=4)
        assert done.stderr.count(words) == 1
        assert ("carom: rank" in done.stderr) == of_one


def test_an_epoch_is_too_long_on_any_number_of_ranks(tmp_path):
    """64 spheres cross more boxes than an image on ranks has room for, although one core has room for more."""
    deck = write_deck(tmp_path, SPHERES.replace("108", "64").replace("fcc", "simple-cubic"))
    sets = ["placement.packing_fraction=0.001", "placement.seed=1", "integrator.step=2e5", "run.end_time=2e5",
            "output.frame_interval=0.0", "output.thermo_interval=20000"]
    words = "too many periodic boxes in one epoch"
    assert words in run(deck, tmp_path / "plain", sets, code=4).stderr
    assert words in mpirun(2, command(deck, tmp_path / "ranks", sets), code=4).stderr


def test_other_commands_speak_once(tmp_path):
    deck = write_deck(tmp_path, SPHERES)
    for arguments, code, words in [(["validate", deck], 0, "valid"), (["validate", tmp_path / "missing"], 5, "cannot read"),
                                   (["run", tmp_path / "missing"], 5, "cannot read"), (["--version"], 0, "compiler:"),
                                   (["run", deck, "--nonsense"], 2, "--nonsense")]:
        done = mpirun(3, [CAROM, *arguments], code=code)
        assert (done.stdout + done.stderr).count(words) == 1


@pytest.mark.kills_mpirun
def test_a_killed_rank(tmp_path):
    out = tmp_path / "out"
    job = start(3, command(write_deck(tmp_path, SPHERES), out, ENDLESS))
    os.kill(when_it_runs(job, out)[1], signal.SIGKILL)
    errors = job.communicate(timeout=600)[1]
    assert job.returncode != 0 and "rank 1" in errors and "Killed" in errors
    when_it_has_ended(out)
    assert len(data_sets(out / "trajectory.h5md")["particles/trajectory/position/step"]) >= 3
    assert len(thermo(out)["time"]) >= 3


@pytest.mark.kills_mpirun
def test_a_stopped_rank(tmp_path):
    out = tmp_path / "out"
    job = start(3, command(write_deck(tmp_path, SPHERES), out, ENDLESS, ("--quiet", "--silence", "2")))
    os.kill(when_it_runs(job, out)[1], signal.SIGSTOP)
    errors = job.communicate(timeout=600)[1]
    assert job.returncode == 70 and "no answer from rank 1 of 3 for 2 s" in errors
    assert summary(out)["status"] == "failed" and "rank 1 of 3" in summary(out)["error"]
    assert frames_are_sound(out) >= 3


@pytest.mark.kills_mpirun
@pytest.mark.parametrize("stopped", [0, 1])
def test_a_rank_that_is_stopped_before_it_starts(stopped, tmp_path):
    """A rank is stopped while the other waits in MPI, which does not detect it."""
    out = tmp_path / "out"
    first = ["sh", "-c", f'if [ $OMPI_COMM_WORLD_RANK = {stopped} ]; then kill -STOP $$; fi; exec "$@"', "sh"]
    done = mpirun(2, first + command(write_deck(tmp_path, SPHERES), out, ENDLESS, ("--quiet", "--silence", "2")), code=70)
    assert f"carom: rank {1 - stopped}: MPI does not start within 2 s: another rank is stopped" in done.stderr
    when_it_has_ended(out)


@pytest.mark.kills_mpirun
@needs_compiler
def test_a_rank_that_is_stopped_at_the_end(tmp_path):
    """A rank is stopped after everything has been written."""
    (tmp_path / "stop.c").write_text("#include <signal.h>\nint MPI_Finalize(void) { return raise(SIGSTOP); }\n")
    subprocess.run(["cc", "-shared", "-fPIC", "-o", tmp_path / "stop.so", tmp_path / "stop.c"], check=True)
    last = ["sh", "-c", f'if [ $OMPI_COMM_WORLD_RANK = 1 ]; then export LD_PRELOAD={tmp_path}/stop.so; fi; exec "$@"', "sh"]
    done = mpirun(2, last + command(write_deck(tmp_path, SPHERES), tmp_path / "out", arguments=("--quiet", "--silence", "2")), code=70)
    assert "carom: rank 0: MPI does not end within 2 s" in done.stderr
    assert summary(tmp_path / "out")["status"] == "done"


def test_rank_0_cannot_write(tmp_path):
    out = tmp_path / "out"
    often = ["output.frame_interval=1.0", "output.thermo_interval=1.0"]
    job = start(3, command(write_deck(tmp_path, SPHERES), out, ENDLESS[:2] + often))
    rank_0 = when_it_runs(job, out)[0]
    room = (out / "trajectory.h5md").stat().st_size + 1000000
    resource.prlimit(rank_0, resource.RLIMIT_FSIZE, (room, resource.RLIM_INFINITY))
    errors = job.communicate(timeout=600)[1]
    assert job.returncode == 5 and "carom: rank 0 of 3: " in errors and "File too large" in errors
    assert summary(out)["status"] == "failed" and "File too large" in summary(out)["error"]
    assert frames_are_sound(out) >= 3


@pytest.mark.kills_mpirun
def test_a_rank_without_memory(tmp_path):
    out = tmp_path / "out"
    job = start(2, command(write_deck(tmp_path, SPHERES), out, ENDLESS))
    status = pathlib.Path(f"/proc/{when_it_runs(job, out)[1]}/status").read_text()
    job.terminate()
    job.communicate()
    # The memory of a small run and a little more; a sphere takes about 300 bytes.
    limit = int(re.search(r"VmPeak:\s+(\d+) kB", status)[1]) + 20000
    limited = ["sh", "-c", f'if [ $OMPI_COMM_WORLD_RANK = 1 ]; then ulimit -v {limit}; fi; exec "$@"', "sh"]
    done = mpirun(2, limited + command(tmp_path / "input.toml", tmp_path / "large", ["particles.0.count=256000"]), code=70)
    assert "carom: rank 1 of 2: out of memory" in done.stderr
