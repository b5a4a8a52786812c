# SPDX-License-Identifier: BSD-3-Clause
"""A run is killed at every second change of its files in turn: no flushed data is lost."""

import functools
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time

import numpy as np
import pytest

from runs import CAROM, ROOT, SPHERES, command, data_sets, needs_carom, needs_compiler, run, write_deck

sys.path.insert(0, str(ROOT / "tools"))

import carom_files

pytestmark = [needs_carom, needs_compiler]

FILES = {"trajectory.h5md": "particles/trajectory/position/step", "events.h5": "events/time"}
FRAME_INTERVAL = 0.1


@pytest.fixture(scope="module")
def place():
    """A directory on a file system in memory if there is one: syncs take no time there."""
    memory = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None
    with tempfile.TemporaryDirectory(prefix="carom-kills-", dir=memory) as name:
        yield pathlib.Path(name)


@functools.lru_cache
def deck(directory):
    """A deck that writes every kind of file."""
    text = SPHERES.replace("end_time = 3.0", "end_time = 0.5").replace("frame_interval = 0.5", f"frame_interval = {FRAME_INTERVAL}")
    return write_deck(directory, text.replace("thermo_interval = 0.1", "thermo_interval = 0.05\nevents = true\nrdf_interval = 0.1"))


def killed_run(killer, directory, at=None, half=False):
    """Runs into directory/out and dies there at one change; returns the number of changes if `at` is None."""
    shutil.rmtree(directory / "out", ignore_errors=True)
    environment = os.environ | {"LD_PRELOAD": str(killer), "KILL_IN": str(directory / "out") + "/"}
    environment |= {"KILL_COUNT": str(directory / "count")} if at is None else {"KILL_AT": str(at), "KILL_HALF": str(int(half))}
    done = subprocess.run(command(deck(directory), directory / "out"), env=environment, capture_output=True, text=True)
    assert done.returncode == (0 if at is None else -signal.SIGKILL), done.stderr
    return int((directory / "count").read_text()) if at is None else None


def begins_like(sets, whole, clock):
    """Whether all series have as many rows as `clock`, and the rows are the first rows of the undisturbed run."""
    n = len(sets[clock])
    parts = {name: value[:n] if len(value.shape) > 0 and len(value) == len(whole[clock]) else value for name, value in whole.items()}
    parts.pop("parameters/deck"), sets.pop("parameters/deck")  # it names the directory
    assert sets.keys() == parts.keys()
    for name, value in sets.items():
        assert value.tobytes() == parts[name].tobytes(), name
    return n


def journal_is_complete(path):
    """Whether the kill was between the end of the journal and the end of the flush."""
    journal = path.with_name(path.name + ".journal")
    return journal.exists() and journal.read_bytes()[:8] == b"CAROMJ01"


def test_equal_runs_write_equal_bytes(killer, place):
    """Every run makes an equal number of changes, so that kills can be counted."""
    runs = []
    for _ in range(2):
        changes = killed_run(killer, place)
        runs.append([changes, *((place / "out" / name).read_bytes() for name in FILES)])
        time.sleep(1.1)  # HDF5 would keep times in seconds
    assert runs[0] == runs[1]


def test_every_other_write(killer, place):
    changes = killed_run(killer, place)
    assert sorted(path.name for path in (place / "out").iterdir()) == [
        "checkpoint.h5", "deck.toml", "events.h5", "rdf.csv", "run.log", "summary.json", "thermo.csv", "trajectory.h5md"]
    whole = {name: data_sets(place / "out" / name) for name in FILES}
    rows = (place / "out" / "thermo.csv").read_text()
    assert changes > 150
    interrupted, left = 0, dict.fromkeys(FILES, 0)
    for at in range(1, changes + 1, 2):
        killed_run(killer, place, at, half=at % 3 == 0)
        out = place / "out"
        torn = {name: journal_is_complete(out / name) for name in FILES}
        interrupted += any(torn.values())
        written = {}
        for name, clock in FILES.items():
            if not (out / name).exists():
                assert left[name] == 0
                continue
            if not torn[name]:
                written[name] = begins_like(data_sets(out / name), whole[name], clock)
            if at % 16 == 1:
                info = subprocess.run([CAROM, "info", str(out / name)], capture_output=True, text=True)
                assert info.returncode == 0, (at, info.stderr)
            carom_files.complete_flush(out / name)
            assert not (out / (name + ".journal")).exists()
            after = begins_like(data_sets(out / name), whole[name], clock)
            assert after >= written.get(name, 0)
            assert after >= left[name], (at, name)  # the files after the previous kill
            left[name] = after
            written[name] = after
        if not (out / "thermo.csv").exists():
            continue
        assert rows.startswith((out / "thermo.csv").read_text())
        table = carom_files.read_thermo(out) if (out / "thermo.csv").read_text().count("\n") > 1 else {}
        if not table:
            continue
        # A row is written before the frame of the same time.
        frames_due = np.isclose(np.round(table["time"] / FRAME_INTERVAL) * FRAME_INTERVAL, table["time"]).sum()
        assert written["trajectory.h5md"] >= frames_due - 1, at
    assert interrupted > 15  # some kills were within a flush


def logged_run(killer, directory):
    """The file operations of a run, in order: (what, name, size, position)."""
    log, out = directory / "log", directory / "out"
    log.unlink(missing_ok=True)
    shutil.rmtree(out, ignore_errors=True)
    environment = os.environ | {"LD_PRELOAD": str(killer), "KILL_IN": str(out), "KILL_LOG": str(log)}
    subprocess.run(command(deck(directory), out, ['output.checkpoint_wall="0"']), env=environment, check=True)
    lines = [line.split(" ") for line in log.read_text().splitlines()]
    return [(what, os.path.relpath(path, out), int(size), int(at)) for what, path, size, at in lines]


def test_a_file_is_synced_before_it_takes_its_name(killer, place):
    """The file is synced after its last write, and the directory after the renaming: after a power failure there is the old file or the new one."""
    calls = logged_run(killer, place)
    renamed = {}
    for n, (what, name, _, _) in enumerate(calls):
        if what != "rename" or name == "checkpoint.previous.h5":
            continue
        before = [(what, size) for what, file, size, _ in calls[:n] if file == name + ".part"]
        assert before[-1][0] == "sync" and "write" in (what for what, _ in before), (name, before[-3:])
        assert calls[n + 1][:2] == ("sync", "."), (name, calls[n + 1])
        renamed[name] = renamed.get(name, 0) + 1
    assert set(renamed) == {"carom.lock", "deck.toml", "summary.json", "rdf.csv", "trajectory.h5md", "events.h5", "checkpoint.h5"}
    assert renamed["checkpoint.h5"] > 1
    # The last checkpoint keeps its name until the next one is on the disk, whose signature, the first block, is written last.
    for n, (what, name, _, _) in enumerate(calls):
        if what == "rename" and name == "checkpoint.previous.h5":
            part = [call for call in calls[:n] if call[1] == "checkpoint.h5.part"]
            assert part[-1][0] == "sync" and part[-2] == ("write", "checkpoint.h5.part", 512, 0)
            assert calls[n + 1][:2] == ("rename", "checkpoint.h5")


def test_the_journal_is_synced_before_the_file_is_changed(killer, place):
    """The journal is emptied after the file is synced: at any power failure the file has the state of a flush, or the journal completes it."""
    calls, durable = logged_run(killer, place), 0
    for name in FILES:
        journal, ours = name + ".journal", [call for call in calls if call[1] in (name, name + ".journal")]
        flush, synced = None, 0
        for n, (what, file, size, at) in enumerate(ours):
            before = ours[n - 1]
            if file == journal and what == "write" and size > 8:
                assert at == 0 and flush is None
                flush, synced = n, 0
            elif file == journal and what == "write":  # it is emptied
                assert (size, at) == (8, 0) and flush is not None and synced in (0, 2)
                assert synced == 0 or before[:2] == ("sync", name)
                flush = None
            elif file == journal and what == "sync":
                # New data in the file, to which the journal refers, is on the disk before the journal.
                assert n == flush + 2 and before[:2] == ("sync", name)
                synced, durable = 1, durable + 1
            elif file == name and what == "sync" and synced == 1:
                assert before[0] in ("write", "resize") and before[1] == name
                synced = 2
            elif file == journal and what == "remove" and n > 0 and before[0] != "rename":
                assert flush is None and before[:2] == ("sync", name), before
        assert flush is None and [call[0] for call in ours if call[1] == journal][-1] == "remove"
    assert durable > 1


def test_an_incomplete_journal_is_discarded(tmp_path):
    """A complete journal with a wrong checksum is discarded, too."""
    run(deck(tmp_path), tmp_path / "out")
    path = tmp_path / "out" / "trajectory.h5md"
    journal = path.with_name(path.name + ".journal")
    before = path.read_bytes()
    block = (b"CAROMJ01" + (12345).to_bytes(8, "little") + (52).to_bytes(8, "little") + len(before).to_bytes(8, "little")
             + (0).to_bytes(8, "little") + (4).to_bytes(8, "little") + b"junk")
    for broken in (block, block[:40], b"CAROMJ01", b"", b"another format altogether, and long enough"):
        for complete in (carom_files.complete_flush, lambda file: subprocess.run([CAROM, "info", str(file)], check=True)):
            journal.write_bytes(broken)
            complete(path)
            assert path.read_bytes() == before
            assert not journal.exists() or not broken, "only an empty one, which says nothing, may stay"
