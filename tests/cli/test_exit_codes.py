# SPDX-License-Identifier: BSD-3-Clause
"""Failures of runs: exit code, message, and readable files."""

import os
import shutil
import signal
import subprocess
import time

import pytest

from runs import (MPIRUN, SPHERES, SPRINGS, command, data_sets, frames_are_sound, in_mount, needs_carom, needs_compiler, needs_mount, run,
                  running, same, signalled, summary, thermo, wait_until_stopped, write_deck)

pytestmark = needs_carom


@needs_mount
@pytest.mark.parametrize("size", ["3m", "5m"])
def test_full_disk(size, tmp_path):
    deck, disk = write_deck(tmp_path, SPHERES), tmp_path / "disk"
    disk.mkdir()
    overrides = ["run.end_time=100000.0", "output.frame_interval=0.05", "output.thermo_interval=0.05",
                 "output.events=true"]
    done = in_mount(f"size={size}", disk, command(deck, disk, overrides), tmp_path / "kept")
    assert done.returncode == 5, done.stderr
    assert str(disk) in done.stderr and "No space left" in done.stderr and "free space" in done.stderr
    kept = tmp_path / "kept"
    n = frames_are_sound(kept)
    assert n > 20
    s = summary(kept)
    assert s["status"] == "failed" and "No space left" in s["error"]
    assert "No space left" in (kept / "run.log").read_text()
    run(deck, tmp_path / "free", [f"run.end_time={0.05 * (n - 1)}"] + overrides[1:])
    position = "particles/trajectory/position/value"
    whole = data_sets(tmp_path / "free" / "trajectory.h5md")[position]
    assert same({"x": data_sets(kept / "trajectory.h5md")[position][: n - 1]}, {"x": whole[: n - 1]})


@needs_mount
@pytest.mark.parametrize("what", ["frames", "thermo", "events", "averages"])
def test_each_file_may_meet_a_full_disk(what, tmp_path):
    """The flushed parts of all files are there and equal to the files of a run on an empty disk."""
    deck, disk, kept, free = write_deck(tmp_path, SPHERES), tmp_path / "disk", tmp_path / "kept", tmp_path / "free"
    disk.mkdir()
    often = {"frames": ["output.frame_interval=0.005"], "thermo": ["output.thermo_interval=0.0002"],
             "events": ["output.events=true"], "averages": ["output.rdf_interval=0.1", "output.rdf_bins=40000"]}[what]
    overrides = ["run.end_time=1000000.0", "output.frame_interval=0.0", "output.thermo_interval=0.5"] + often
    done = in_mount("size=2m", disk, command(deck, disk, overrides), kept)
    assert done.returncode == 5, done.stderr
    assert str(disk) in done.stderr and "No space left" in done.stderr and "free space" in done.stderr
    left = {path.name for path in kept.iterdir()}
    assert {"deck.toml", "run.log", "summary.json", "thermo.csv", "trajectory.h5md"} <= left
    assert not any(name.endswith((".journal", ".part", ".lock")) for name in left)
    s, rows = summary(kept), thermo(kept)
    assert s["status"] == "failed" and "No space left" in s["error"] and "No space left" in (kept / "run.log").read_text()
    run(deck, free, [f"run.end_time={rows['time'][-1] + 1}"] + overrides[1:])
    names = {"trajectory.h5md": "particles/trajectory/position/step", "events.h5": "events/time"}
    for name, clock in names.items():
        if name in left:
            part, whole = data_sets(kept / name), data_sets(free / name)
            n = len(part[clock])
            assert n > 0 and all(len(value) == n for key, value in part.items() if key.startswith("events/") or key.endswith("/value"))
            grown = {key: value for key, value in part.items() if key.startswith("events/") or key.endswith(("/value", "/step", "/time"))}
            assert same(grown, {key: whole[key][:n] for key in grown})
    text = (kept / "thermo.csv").read_text()
    assert text.endswith("\n") and (free / "thermo.csv").read_text().startswith(text)


@needs_mount
def test_disk_full_from_the_start(tmp_path):
    disk = tmp_path / "disk"
    disk.mkdir()
    done = in_mount("size=4k", disk, command(write_deck(tmp_path, SPRINGS), disk))
    assert done.returncode == 5 and "No space left" in done.stderr, done.stderr


def test_file_size_limit(tmp_path):
    """A full disk without a mount: a limit on file sizes, which would kill a process that ignores it."""
    deck, out = write_deck(tmp_path, SPHERES), tmp_path / "out"
    limited = ["sh", "-c", 'ulimit -f 20000; exec "$@"', "sh"]  # blocks of 512 bytes
    done = subprocess.run(limited + command(deck, out, ["run.end_time=100000.0", "output.frame_interval=0.05",
                                                        "output.thermo_interval=0.05"]),
                          capture_output=True, text=True, timeout=1200)
    assert done.returncode == 5, (done.returncode, done.stderr)
    assert "trajectory.h5md" in done.stderr and "File too large" in done.stderr
    assert frames_are_sound(out) > 20
    assert summary(out)["status"] == "failed"


def test_directory_below_a_file(tmp_path):
    (tmp_path / "file").write_text("x")
    done = run(write_deck(tmp_path, SPRINGS), tmp_path / "file" / "out", code=5)
    assert str(tmp_path / "file" / "out") in done.stderr and "Not a directory" in done.stderr and "-o" in done.stderr


@needs_mount
def test_read_only_directory(tmp_path):
    disk = tmp_path / "disk"
    disk.mkdir()
    done = in_mount("ro", disk, command(write_deck(tmp_path, SPRINGS), disk))
    assert done.returncode == 5 and "Read-only file system" in done.stderr and str(disk) in done.stderr


@pytest.mark.skipif(os.geteuid() == 0, reason="permissions do not bind root")
def test_unwritable_directory(tmp_path):
    out = tmp_path / "out"
    out.mkdir(mode=0o555)
    done = run(write_deck(tmp_path, SPRINGS), out, code=5)
    assert "Permission denied" in done.stderr and str(out) in done.stderr


def test_standard_output_full(tmp_path):
    out = tmp_path / "out"
    with open("/dev/full", "w") as full:
        done = subprocess.run(command(write_deck(tmp_path, SPRINGS), out, arguments=()), stdout=full,
                              stderr=subprocess.PIPE, text=True)
    assert done.returncode == 5 and "standard output" in done.stderr
    assert summary(out)["status"] == "done"


@pytest.mark.parametrize("method", ["psa", "cva", "mcva", "cdda", "edda"])
def test_too_many_events_in_a_step(method, tmp_path):
    out = tmp_path / "out"
    overrides = [f"integrator.type=\"{method}\"", "integrator.max_events_per_step=1", "integrator.step=0.5",
                 "run.steps=1000", "output.frame_interval=0.5", "output.thermo_interval=0.5"]
    done = run(write_deck(tmp_path, SPRINGS), out, overrides, code=4)
    assert "max_events_per_step" in done.stderr and "particle" in done.stderr
    assert any(digit in done.stderr for digit in "0123"), done.stderr
    s = summary(out)
    assert s["status"] == "failed" and "max_events_per_step" in s["error"]
    assert "max_events_per_step" in (out / "run.log").read_text()
    assert frames_are_sound(out) == len(thermo(out)["time"]) == s["steps"] + 1


@pytest.mark.parametrize("change, code, words", [
    ("integrator.type=\"rk4\"", 2, "rk4"),
    ("integrator.step=0.0", 2, "integrator.step"),
    ("integrator.stpe=0.1", 2, "step"),
    ("system.dimension=4", 2, "dimension"),
    ("system.box=[2.0, 2.0]", 3, "wall"),
])
def test_bad_deck(change, code, words, tmp_path):
    out = tmp_path / "out"
    done = run(write_deck(tmp_path, SPRINGS), out, [change], code=code)
    assert words in done.stderr
    assert not out.exists()  # a deck that cannot run changes no file


def test_missing_deck(tmp_path):
    done = run(tmp_path / "missing.toml", tmp_path / "out", code=5)
    assert "missing.toml" in done.stderr


def test_spheres_that_have_flown_apart(tmp_path):
    """No further collision is possible, and the run has no other end."""
    deck = tmp_path / "apart.toml"
    deck.write_text("""format = 1
[system]
dimension = 2
box = [6.0, 6.0]
boundary = ["open", "wall"]
[[particles]]
name = "disc"
radius = 0.5
position = [[2.0, 2.0], [4.0, 2.0]]
velocity = [[1.0, 0.0], [-1.0, 0.1]]
[integrator]
type = "free-flight"
[run]
collisions = 1000
""")
    done = run(deck, tmp_path / "out", code=4)
    assert "no two spheres have met" in done.stderr and "run.end_time" in done.stderr
    assert summary(tmp_path / "out")["events"]["sphere_sphere"] == 1


@needs_compiler
@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("checkpoints", ["\"0\"", "\"\""])
def test_a_directory_that_is_removed(checkpoints, ranks, killer, tmp_path):
    """Removes the directory during a run, also before its first checkpoint. Rank 0 stops itself meanwhile."""
    deck, out = write_deck(tmp_path, SPHERES), tmp_path / "out"
    launcher = [*MPIRUN, str(ranks)] if ranks > 1 else []
    overrides = ["run.end_time=20.0", f"output.checkpoint_wall={checkpoints}", "output.events=true"]
    job = subprocess.Popen(launcher + command(deck, out, overrides), env=signalled(killer, out, signal.SIGSTOP, 20), stderr=subprocess.PIPE, text=True)
    while not (out / "thermo.csv").exists():
        assert job.poll() is None, job.stderr.read()
        time.sleep(0.01)
    process = running(out)[0] if ranks > 1 else job.pid
    wait_until_stopped(job, process)
    assert (out / "checkpoint.h5").exists() == (checkpoints != "\"\"")
    shutil.rmtree(out)
    os.kill(process, signal.SIGCONT)
    error = job.communicate(timeout=600)[1]
    assert job.returncode == 5, error
    assert str(out) in error and "No such file or directory" in error
    assert not out.exists()
