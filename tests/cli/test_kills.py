"""A run is killed at every other change of its files in turn: nothing that was flushed is lost."""

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

from runs import CAROM, ROOT, SPHERES, command, data_sets, killer_library, needs_carom, needs_compiler, run, write_deck

sys.path.insert(0, str(ROOT / "tools"))

import carom_files

pytestmark = [needs_carom, needs_compiler]

FILES = {"trajectory.h5md": "particles/trajectory/position/step", "events.h5": "events/time"}
FRAME_INTERVAL = 0.1


@pytest.fixture(scope="module")
def place():
    """A directory on a file system in memory, where there is one: syncs take no time there."""
    memory = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None
    with tempfile.TemporaryDirectory(prefix="carom-kills-", dir=memory) as name:
        yield pathlib.Path(name)


@functools.lru_cache
def deck(directory):
    """A deck that writes every kind of file."""
    text = SPHERES.replace("end_time = 3.0", "end_time = 0.5").replace("frame_interval = 0.5", f"frame_interval = {FRAME_INTERVAL}")
    return write_deck(directory, text.replace("thermo_interval = 0.1", "thermo_interval = 0.05\nevents = true\nrdf_interval = 0.1"))


@pytest.fixture(scope="module")
def killer(tmp_path_factory):
    return killer_library(tmp_path_factory.mktemp("library"))


def killed_run(killer, directory, at=None, half=False):
    """Runs into directory/out and dies there at one change; returns how many changes were made where `at` is None."""
    shutil.rmtree(directory / "out", ignore_errors=True)
    environment = os.environ | {"LD_PRELOAD": str(killer), "KILL_IN": str(directory / "out") + "/"}
    environment |= {"KILL_COUNT": str(directory / "count")} if at is None else {"KILL_AT": str(at), "KILL_HALF": str(int(half))}
    done = subprocess.run(command(deck(directory), directory / "out"), env=environment, capture_output=True, text=True)
    assert done.returncode == (0 if at is None else -signal.SIGKILL), done.stderr
    return int((directory / "count").read_text()) if at is None else None


def begins_like(sets, whole, clock):
    """Whether all series have as many rows as `clock`, and these are the first of the undisturbed run."""
    n = len(sets[clock])
    parts = {name: value[:n] if len(value.shape) > 0 and len(value) == len(whole[clock]) else value for name, value in whole.items()}
    parts.pop("parameters/deck"), sets.pop("parameters/deck")  # names the directory
    assert sets.keys() == parts.keys()
    for name, value in sets.items():
        assert value.tobytes() == parts[name].tobytes(), name
    return n


def journal_is_complete(path):
    """Whether the kill fell between the journal's end and that of the flush."""
    journal = path.with_name(path.name + ".journal")
    return journal.exists() and journal.read_bytes()[:8] == b"CAROMJ01"


def test_equal_runs_write_equal_bytes(killer, place):
    """In as many changes, so that kills can be counted."""
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
            assert after >= left[name], (at, name)  # what the kill before has left
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
    assert interrupted > 15  # kills within a flush were among them


def test_an_incomplete_journal_is_discarded(tmp_path):
    """Also one whose bytes are not those that were written."""
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
            assert path.read_bytes() == before and not journal.exists()
