# SPDX-License-Identifier: BSD-3-Clause
"""`carom run --continue` after external failures: kills, full disks, damaged checkpoints, processes that hold the directory."""

import os
import pathlib
import random
import shutil
import signal
import subprocess
import time

import pytest

from going_on import ALL_OUTPUT, CHECKPOINTS, box, compare, expect_same, go_on, summary_differences
from runs import (CAROM, SPHERES, SPRINGS, command, in_mount, mpi_environment, needs_carom, needs_compiler,
                  needs_mount, run, summary, thermo, wait_until_stopped, write_deck)

pytestmark = needs_carom


def killed(killer, deck, out, at, overrides, go=False, where="", rows=0):
    """Runs and dies at a change of its files after so many rows (None: counts the changes); returns whether it died."""
    environment = os.environ | {"LD_PRELOAD": str(killer), "KILL_IN": f"{out}/{where}", "KILL_HALF": str((at or 0) % 2), "KILL_ROWS": str(rows)}
    environment |= {"KILL_AT": str(at)} if at else {"KILL_COUNT": str(out.parent / "count")}
    what = [CAROM, "run", "--continue", str(out), "--quiet"] if go else command(deck, out, overrides)
    done = subprocess.run(what, env=environment, capture_output=True, text=True, timeout=600)
    assert done.returncode in (0, -signal.SIGKILL), done.stderr
    return done.returncode != 0


@needs_compiler
@pytest.mark.parametrize("method", ["free-flight", "psa"])
def test_killed_at_its_writes(method, killer, tmp_path):
    """Kills a run also while it writes checkpoints, and while it is being continued. CAROM_KILLS sets the number of kills.

    The clock decides how many checkpoints a run writes, but each has one before its second row and one at its end. So the place
    of a kill is counted in rows, or in changes of the files of two checkpoints."""
    dice, kills = random.Random(7), int(os.environ.get("CAROM_KILLS", "12"))
    deck, whole, out = write_deck(tmp_path, box(method, 3, 200 if method == "psa" else 60)), tmp_path / "whole", tmp_path / "out"
    run(deck, whole, ALL_OUTPUT)
    rows = len(thermo(whole)["time"])
    killed(killer, deck, out, None, ALL_OUTPUT, where="checkpoint.h5")
    of_a_checkpoint, refused, continued = int((tmp_path / "count").read_text()), 0, 0
    assert rows > 40 and of_a_checkpoint > 4
    for n in range(kills):
        shutil.rmtree(out)
        where, at, row = (("checkpoint.h5", dice.randrange(1, 2 * of_a_checkpoint), 0) if n % 2 == 1 else
                          ("", dice.randrange(1, 6), dice.randrange(0, rows - 6)))
        assert killed(killer, deck, out, at, ALL_OUTPUT + CHECKPOINTS, where=where, rows=row)
        if not (out / "checkpoint.h5").exists() and not (out / "checkpoint.previous.h5").exists():
            # There may be files or none yet.
            assert "there is no checkpoint.h5 to go on from" in go_on(out, code=5).stderr
            refused += 1
            continue
        if n % 3 == 0:
            killed(killer, deck, out, dice.randrange(1, 60), [], go=True)
        go_on(out)
        assert compare(whole, out) + summary_differences(whole, out) == []
        continued += 1
    print(f"{kills} kills: {continued} continued, {refused} before the first checkpoint")
    assert continued > kills / 4


@pytest.mark.kills_mpirun
def test_killed_ranks(tmp_path):
    """SIGKILL to mpirun at random instants, each time continuing from the last checkpoint."""
    dice = random.Random(3)
    deck, whole, out = write_deck(tmp_path, box("edda", 3, 400)), tmp_path / "whole", tmp_path / "out"
    run(deck, whole, ALL_OUTPUT)
    what = command(deck, out, ALL_OUTPUT + ["output.checkpoint_wall=\"0.02\""])
    for _ in range(3):
        job = subprocess.Popen(["mpirun", "-n", "2", *what], env=mpi_environment(), stderr=subprocess.PIPE, text=True)
        while not (out / "checkpoint.h5").exists():
            time.sleep(0.01)
        time.sleep(dice.uniform(0.05, 0.6))
        job.kill()
        job.wait()
        what = [CAROM, "run", "--continue", str(out), "--quiet"]
    go_on(out, ranks=3)  # the lock waits for processes that are ending
    expect_same(whole, out)


@needs_mount
def test_a_full_disk_during_a_checkpoint(tmp_path):
    """The earlier checkpoint remains; with more space the run continues."""
    disk, kept, whole = tmp_path / "disk", tmp_path / "kept", tmp_path / "whole"
    disk.mkdir()
    deck = write_deck(tmp_path, SPHERES)
    # Rows are written slowly, and more and more checkpoints of 200 kB beside them.
    overrides = ["particles.0.count=4000", "run.end_time=40.0", "output.thermo_interval=0.5", "output.frame_interval=2.0"]
    run(deck, whole, overrides)
    done = in_mount("size=2700k", disk, command(deck, disk, overrides + CHECKPOINTS), kept)
    assert done.returncode == 5 and "No space left" in done.stderr, done.stderr
    assert (kept / "checkpoint.h5").exists() and summary(kept)["status"] == "failed"
    assert not list(kept.glob("*.part"))
    go_on(kept)
    expect_same(whole, kept)


def interrupted(tmp_path):
    """A run with two checkpoints, and the end of an undisturbed run."""
    deck, whole, out = write_deck(tmp_path, box("psa", 2, 300)), tmp_path / "whole", tmp_path / "out"
    run(deck, whole, ALL_OUTPUT)
    run(deck, out, [*ALL_OUTPUT, "run.steps=100"])
    go_on(out, ["--set", "run.steps=200"])
    assert (out / "checkpoint.previous.h5").exists()
    return whole, out


def test_the_other_slot(tmp_path):
    whole, out = interrupted(tmp_path)
    last = out / "checkpoint.h5"
    good = last.read_bytes()
    damage = {"its checksum is not that of its contents": good[:5000] + bytes([good[5000] ^ 1]) + good[5001:],
              "damaged or cut off": good[: len(good) // 2],
              "written by a newer carom": good.replace(b"carom checkpoint 8", b"carom checkpoint 9", 1),
              "not a checkpoint of carom": b"something else"}
    for words, contents in damage.items():
        trial = tmp_path / "trial"
        shutil.rmtree(trial, ignore_errors=True)
        shutil.copytree(out, trial)
        (trial / "checkpoint.h5").write_bytes(contents)
        before = {path.name: path.read_bytes() for path in trial.iterdir()}
        go_on(trial, ["--set", "run.steps=1"], code=2)  # a refused command does not change the slots
        assert {path.name: path.read_bytes() for path in trial.iterdir()} == before
        done = go_on(trial, ["--set", "run.steps=300"])
        assert words in done.stderr and "going on from checkpoint.previous.h5" in done.stderr, done.stderr
        expect_same(whole, trial)
        shutil.copy(trial / "checkpoint.h5", trial / "checkpoint.previous.h5")
        for name in ("checkpoint.h5", "checkpoint.previous.h5"):
            (trial / name).write_bytes(contents)
        refused = go_on(trial, code=5)
        assert words in refused.stderr and "checkpoint.previous.h5" in refused.stderr
    last.unlink()
    go_on(out, ["--set", "run.steps=300"])
    expect_same(whole, out)


@needs_compiler
def test_a_damaged_slot_and_kills(killer, tmp_path):
    """A run that continues from the earlier checkpoint keeps it until there is another valid one."""
    whole, out = interrupted(tmp_path)
    (out / "checkpoint.h5").write_bytes(b"damaged")
    trial, at, deaths = tmp_path / "trial", 0, 0
    while True:
        at += 1
        shutil.rmtree(trial, ignore_errors=True)
        shutil.copytree(out, trial)
        if not killed(killer, None, trial, at, [], go=True, where="checkpoint"):
            break
        deaths += 1
        go_on(trial)
    assert deaths > 4


@needs_compiler
def test_the_checkpoint_is_read_when_the_directory_is_free(killer, tmp_path):
    """A process that is ending may write another checkpoint meanwhile."""
    whole, out = interrupted(tmp_path)
    earlier = tmp_path / "earlier"
    run(tmp_path / "input.toml", earlier, [*ALL_OUTPUT, "run.steps=100"])
    late = (out / "checkpoint.h5").read_bytes()
    (out / "checkpoint.h5").write_bytes((earlier / "checkpoint.h5").read_bytes())
    owner = subprocess.Popen(["sleep", "60"])
    lock_of(out, owner.pid)
    job = subprocess.Popen([CAROM, "run", "--continue", str(out), "--set", "run.steps=300"], stdout=subprocess.PIPE, text=True,
                           env=os.environ | {"LD_PRELOAD": str(killer), "STOP_ASLEEP": "1"})
    wait_until_stopped(job)  # it waits for the owner to end
    (out / "checkpoint.h5").write_bytes(late)
    owner.kill()
    owner.wait()
    job.send_signal(signal.SIGCONT)
    assert "continued at step 200" in job.communicate()[0] and job.returncode == 0
    expect_same(whole, out)


def test_a_checkpoint_that_cannot_be_renamed(tmp_path):
    """A checkpoint that cannot be renamed is a file error; the last one remains, and the run continues from it once its name is free."""
    whole, out = interrupted(tmp_path)
    (out / "checkpoint.previous.h5").unlink()
    (out / "checkpoint.previous.h5").mkdir()
    before = (out / "checkpoint.h5").read_bytes()
    refused = go_on(out, ["--set", "run.steps=300"], code=5).stderr
    assert f"{out}/checkpoint.previous.h5: is a directory, a pipe or a device" in refused and summary(out)["status"] == "failed"
    assert (out / "checkpoint.h5").read_bytes() == before and not list(out.glob("*.part"))
    (out / "checkpoint.previous.h5").rmdir()
    go_on(out, ["--set", "run.steps=300"])
    expect_same(whole, out)


def lock_of(out, process, host=None):
    """Writes the lock of a process."""
    ticks = pathlib.Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()[19]
    host = host or pathlib.Path("/proc/sys/kernel/hostname").read_text().strip()
    (out / "carom.lock").write_text(f"host {host}\nprocess {process}\nstarted then\nticks {ticks}\n")


def test_locks(tmp_path):
    deck, out = write_deck(tmp_path, SPRINGS), tmp_path / "out"
    run(deck, out)
    job = subprocess.Popen(["sleep", "60"])
    try:
        for arguments in ([], ["--take-over"]):
            lock_of(out, job.pid)
            assert "is at work in this directory" in go_on(out, arguments, code=5).stderr
    finally:
        job.kill()
        job.wait()
    go_on(out)
    lock_of(out, os.getpid(), "another")
    assert "--take-over" in go_on(out, code=5).stderr
    assert "ended from outside" in go_on(out, ["--take-over"]).stderr
    assert not (out / "carom.lock").exists()
    done = subprocess.run([CAROM, "run", str(deck), "--take-over"], capture_output=True, text=True)
    assert done.returncode == 2 and "--continue" in done.stderr
