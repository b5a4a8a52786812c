# SPDX-License-Identifier: BSD-3-Clause
"""`carom run`: its files, early stops and kills; observing changes nothing."""

import csv
import os
import pty
import random
import re
import signal
import subprocess
import time

import h5py
import numpy as np
import pytest

from going_on import wait_for_rows
from runs import CAROM, SPHERES, SPRINGS, command, data_sets, needs_carom, run, same, summary, thermo, write_deck

pytestmark = needs_carom

PROMISED = """status deck integrator dimension particles ranks steps end_time events.sphere_sphere events.sphere_wall
energy.initial energy.after_first_step energy.final energy.reference energy.max_abs_error shadow_energy.max_abs_error
momentum.max_abs_error max_overlap pressure collision_rate mean_free_time mean_free_path force_passes sweeps pieces slabs_halved fallbacks wall_seconds
collisions_per_second peak_memory_bytes""".split()


def last_records(output):
    """Time, positions, velocities and images of the last frame."""
    with h5py.File(output / "trajectory.h5md") as file:
        group = file["particles/trajectory"]
        return {"time": group["position/time"][-1], "step": group["position/step"][-1]} | {
            name: group[name]["value"][-1] for name in ("position", "velocity", "image")}


def test_files(tmp_path):
    deck, out = write_deck(tmp_path, SPRINGS), tmp_path / "out"
    run(deck, out)
    assert sorted(p.name for p in out.iterdir()) == [
        "checkpoint.h5", "deck.toml", "run.log", "summary.json", "thermo.csv", "trajectory.h5md"]
    s, rows = summary(out), thermo(out)
    for name in PROMISED:
        value = s
        for part in name.split("."):
            assert part in value, name
            value = value[part]
    assert (s["status"], s["integrator"], s["dimension"], s["particles"], s["ranks"], s["steps"]) == (
        "done", "cdda", 2, 4, 1, 400)
    assert s["events"]["sphere_sphere"] > 0 and s["events"]["sphere_wall"] > 0
    assert s["momentum"]["max_abs_error"] is None and s["shadow_energy"]["max_abs_error"] is None
    assert rows["total"][0] == s["energy"]["initial"] and rows["total"][-1] == s["energy"]["final"]
    assert rows["max_energy_error"][-1] == s["energy"]["max_abs_error"] <= 1e-12 * s["energy"]["reference"]
    assert rows["collisions"][-1] == s["events"]["sphere_sphere"]
    assert len(rows["time"]) == 81 and rows["time"][-1] == s["end_time"] == pytest.approx(8, abs=1e-12)
    log = (out / "run.log").read_text()
    for part in ("carom ", "host ", "temperature", "predict", "communicate", "output", "done at time 8"):
        assert part in log, part


def test_averages(tmp_path):
    two = SPHERES.replace('type = "fcc"', 'type = "random"').replace("0.3\n", "0.2\n").replace("[placement]", """[[particles]]
name = "small"
count = 50
temperature = 1.0
radius = 0.3
[placement]""")
    out = tmp_path / "out"
    run(write_deck(tmp_path, two), out,
        ["output.rdf_interval=0.1", "output.rdf_bins=60", "output.msd_interval=0.05", "output.sample_start=0.5"])
    rdf, msd = (np.genfromtxt(out / name, delimiter=",", names=True) for name in ("rdf.csv", "msd.csv"))
    for table, first, means in ((rdf, ("r",), ("g", "g_sphere_sphere", "g_sphere_small", "g_small_small")),
                                (msd, ("time", "origins"), ("msd", "msd_sphere", "msd_small"))):
        assert table.dtype.names == (*first, *means, *(prefix + name for name in means for prefix in ("error_", "samples_")))
    # rdf_range is the default: half the edge, which is less than three diameters; the resolved deck names it.
    edge = float(re.search(r"box = \[([0-9.]+),", (out / "deck.toml").read_text())[1])
    largest = float(re.search(r"rdf_range = ([0-9.]+)", (out / "deck.toml").read_text())[1])
    assert largest == min(edge / 2, 3.0) and len(rdf) == 60
    assert rdf["r"] == pytest.approx((np.arange(60) + 0.5) * largest / 60)
    for name, contact in (("g_sphere_sphere", 1.0), ("g_sphere_small", 0.8), ("g_small_small", 0.6)):
        assert not rdf[name][rdf["r"] + largest / 120 <= contact].any()
        assert rdf[name][rdf["r"] > 1.5 * contact].mean() == pytest.approx(1, abs=0.1)
    assert msd["time"][:9] == pytest.approx(0.05 * np.arange(1, 10))
    assert msd["origins"][0] == 5 and msd["origins"][9] == 1  # of 51 samples
    assert msd["msd"] == pytest.approx((108 * msd["msd_sphere"] + 50 * msd["msd_small"]) / 158)
    s = summary(out)
    assert s["mean_free_time"] == pytest.approx(158 * s["end_time"] / (2 * s["events"]["sphere_sphere"]))
    assert f"mean free path {s['mean_free_path']:.6g}" in (out / "run.log").read_text()
    assert [value["species"] for value in s["contact_value"]] == [["sphere", "sphere"], ["sphere", "small"],
                                                                  ["small", "small"]]
    # The resolved deck gives the same averages; without samples in between the run is the same.
    run(out / "deck.toml", tmp_path / "again")
    assert (tmp_path / "again" / "rdf.csv").read_bytes() == (out / "rdf.csv").read_bytes()
    assert (tmp_path / "again" / "msd.csv").read_bytes() == (out / "msd.csv").read_bytes()
    run(out / "deck.toml", tmp_path / "plain", ["output.rdf_interval=0", "output.msd_interval=0"])
    assert not (tmp_path / "plain" / "rdf.csv").exists() and not (tmp_path / "plain" / "msd.csv").exists()
    assert same(last_records(out), last_records(tmp_path / "plain"))
    # A second run in the directory removes nothing.
    run(write_deck(tmp_path, two), out)
    assert (out / "backup.1" / "rdf.csv").exists() and not (out / "rdf.csv").exists()


def test_names_with_commas_and_quotes(tmp_path):
    names = ["a, b", 'say "c"']
    two = SPHERES.replace('name = "sphere"\ncount = 108', "name = 'say \"c\"'\ncount = 54")
    two = two.replace("[[particles]]", '[[particles]]\nname = "a, b"\ncount = 54\ntemperature = 1.0\nradius = 0.5\n[[particles]]')
    run(write_deck(tmp_path, two), tmp_path / "out", ["run.end_time=0.2", "output.rdf_interval=0.1"])
    with open(tmp_path / "out" / "rdf.csv", newline="") as file:
        assert next(csv.reader(file))[:5] == ["r", "g", *(f"g_{a}_{b}" for a, b in ((names[0], names[0]), (names[0], names[1]), (names[1], names[1])))]


def test_profile(tmp_path):
    out = tmp_path / "out"
    run(write_deck(tmp_path, SPHERES), out, ["output.profile_interval=0.1", "output.profile_bins=6", "output.profile_axis=2"])
    assert (out / "profile.csv").read_text().startswith("x,density,temperature,velocity_x,velocity_y,velocity_z,error_density,")
    profile = np.genfromtxt(out / "profile.csv", delimiter=",", names=True)
    edges = [float(e) for e in re.search(r"box = \[(.*)\]", (out / "deck.toml").read_text())[1].split(",")]
    assert profile["x"] == pytest.approx((np.arange(6) + 0.5) * edges[2] / 6)
    assert profile["density"].mean() == pytest.approx(108 / np.prod(edges))
    # 2K/(D N) of all, which free flight keeps
    assert np.average(profile["temperature"], weights=profile["density"]) == pytest.approx(1)


def test_without_a_seed_it_is_1(tmp_path):
    assert "| `seed` | non-negative integer |  | `1` |" in subprocess.run([CAROM, "schema", "--markdown"], capture_output=True, text=True).stdout
    for name, seed in (("none", ""), ("one", "seed = 1\n"), ("two", "seed = 2\n")):
        run(write_deck(tmp_path, SPHERES.replace("seed = 7\n", seed)), tmp_path / name, ["run.end_time=0.1"])
    none, one, two = (last_records(tmp_path / name) for name in ("none", "one", "two"))
    assert same(none, one) and not same(one, two)


@pytest.mark.parametrize("text", [SPRINGS, SPHERES], ids=["springs", "spheres"])
def test_resolved_deck_gives_the_same_run(text, tmp_path):
    run(write_deck(tmp_path, text), tmp_path / "a")
    run(tmp_path / "a" / "deck.toml", tmp_path / "b")
    a, b = (data_sets(tmp_path / name / "trajectory.h5md") for name in "ab")
    for sets in (a, b):  # the resolved decks may differ in the output directory
        del sets["parameters/deck"]
    assert same(a, b)
    assert (tmp_path / "a" / "thermo.csv").read_bytes() == (tmp_path / "b" / "thermo.csv").read_bytes()


@pytest.mark.parametrize("method", ["psa", "cva", "mcva", "cdda", "edda", "verlet", "free-flight", "collisions", "end_time"])
def test_observing_changes_nothing(method, tmp_path):
    always = {"free-flight": [], "collisions": ["run.collisions=333"],
              "end_time": ["run.end_time=5.013", "integrator.type=\"cva\""]}.get(
                  method, [f"integrator.type=\"{method}\""])
    springs = SPRINGS.replace("radius", "display_radius") if method == "verlet" else SPRINGS
    deck = write_deck(tmp_path, SPHERES if method in ("free-flight", "collisions") else springs)
    ways = [["output.frame_interval=0.0", "output.thermo_interval=0.0"],
            ["output.frame_interval=0.037", "output.thermo_interval=0.0"],
            ["output.frame_interval=0.0", "output.thermo_interval=0.0113", "output.events=true"],
            ["output.frame_interval=0.02", "output.thermo_interval=0.9", "output.events=true"],
            ["output.rdf_interval=0.017", "output.msd_interval=0.11", "output.sample_start=0.3"]]
    records, counts = [], []
    for n, way in enumerate(ways):
        run(deck, tmp_path / str(n), always + way)
        records.append(last_records(tmp_path / str(n)))
        s = summary(tmp_path / str(n))
        counts.append((s["events"], s["steps"], s["end_time"], s["energy"]["final"]))
    assert method == "verlet" or counts[0][0]["sphere_sphere"] >= 2
    for record, count in zip(records[1:], counts[1:]):
        assert same(records[0], record)
        assert count == counts[0]


@pytest.mark.parametrize("text", [SPRINGS, SPHERES], ids=["springs", "spheres"])
def test_events_are_exact(text, tmp_path):
    deck, out = write_deck(tmp_path, text), tmp_path / "out"
    run(deck, out, ["output.events=true"] + (["system.box=[9.0, 3.6]"] if text is SPRINGS else []))
    events = {name.removeprefix("events/"): value for name, value in data_sets(out / "events.h5").items()
              if name.startswith("events/")}
    s, pairs = summary(out)["events"], events["kind"] == 0
    assert pairs.sum() == s["sphere_sphere"] > 0 and (~pairs).sum() == s["sphere_wall"]
    assert len({len(column) for column in events.values()}) == 1
    assert (np.diff(events["time"]) >= -1e-12).all() and (np.diff(events["slab"]) >= 0).all()
    assert (events["lo"][pairs] < events["hi"][pairs]).all()
    gap = np.linalg.norm(events["x_lo"] - events["x_hi"], axis=1) - np.where(pairs, 1.0, 0.5)
    assert np.abs(gap).max() <= 1e-12
    assert text is SPHERES or {2, 3} <= set(events["hi"][~pairs])  # the walls of the short axis
    if text is SPHERES:  # nothing but collisions changes a velocity: the impulses add up to the change
        with h5py.File(out / "trajectory.h5md") as file:
            v = file["particles/trajectory/velocity/value"][()]
        change = np.zeros_like(v[0])
        np.add.at(change, events["lo"], events["impulse"])
        np.add.at(change, events["hi"], -events["impulse"])
        assert np.abs(v[0] + change - v[-1]).max() < 1e-11
        # Flushed frames count the collisions before them.
        frames = data_sets(out / "trajectory.h5md")
        before = np.searchsorted(events["time"], frames["particles/trajectory/position/time"])
        assert (before == frames["observables/collisions/value"]).all()


def test_an_earlier_run_is_kept(tmp_path):
    deck, out = write_deck(tmp_path, SPRINGS), tmp_path / "out"
    run(deck, out)
    first = (out / "trajectory.h5md").read_bytes()
    (out / "notes.txt").write_text("mine")
    done = run(deck, out, ["run.steps=10"])
    assert "backup.1" in done.stderr
    assert (out / "backup.1" / "trajectory.h5md").read_bytes() == first
    assert summary(out / "backup.1")["steps"] == 400 and summary(out)["steps"] == 10
    assert (out / "notes.txt").read_text() == "mine"
    run(deck, out, ["integrator.step=-1"], code=2)  # a deck that cannot run changes no file
    assert summary(out)["steps"] == 10 and not (out / "backup.2").exists()


def test_one_run_at_a_time(tmp_path):
    deck, out = write_deck(tmp_path, SPRINGS), tmp_path / "out"
    child = subprocess.Popen(command(deck, out, ["run.steps=100000000"]))
    while not (out / "trajectory.h5md").exists():
        assert child.poll() is None
        time.sleep(0.01)
    assert f"process {child.pid}\n" in (out / "carom.lock").read_text()
    done = run(deck, out, code=5)
    assert f"process {child.pid} on host" in done.stderr and "wait for its end" in done.stderr and "-o" in done.stderr
    assert child.poll() is None and not (out / "backup.1").exists()
    child.send_signal(signal.SIGKILL)
    before = (out / "carom.lock").read_text()
    done = run(deck, out)  # also while nobody has waited for the process
    child.wait()
    assert f"process {child.pid}" in done.stderr and done.stderr.startswith("warning: ")
    assert "ended from outside" in (out / "run.log").read_text()
    assert (out / "backup.1" / "trajectory.h5md").exists() and not (out / "carom.lock").exists()
    # The number of a process that started at another time; the lock of a run on another host; another text.
    (out / "carom.lock").write_text(before.replace(f"process {child.pid}", f"process {os.getpid()}"))
    assert "ended from outside" in run(deck, out).stderr
    (out / "carom.lock").write_text(re.sub("host .*", "host elsewhere", before))
    assert "delete " + str(out / "carom.lock") in run(deck, out, code=5).stderr
    (out / "carom.lock").write_text("")
    assert "ended from outside" in run(deck, out).stderr and not (out / "carom.lock").exists()
    run(deck, out, ["integrator.max_events_per_step=1", "integrator.step=0.5"], code=4)  # also of a run that fails
    assert not (out / "carom.lock").exists()


def test_of_two_runs_that_start_at_once_one_runs(tmp_path):
    deck, out = write_deck(tmp_path, SPRINGS), tmp_path / "out"
    runs = [subprocess.Popen(command(deck, out, ["run.steps=100000000"]), stderr=subprocess.DEVNULL) for _ in range(4)]
    while sum(child.poll() is None for child in runs) > 1:
        time.sleep(0.01)
    last, = (child for child in runs if child.poll() is None)
    while not (out / "thermo.csv").exists():
        time.sleep(0.01)
    last.send_signal(signal.SIGUSR2)
    assert last.wait() == 75 and sorted(child.wait() for child in runs) == [5, 5, 5, 75]
    assert summary(out)["status"] == "interrupted" and not (out / "backup.1").exists()


def test_terminal(tmp_path):
    deck = write_deck(tmp_path, SPRINGS)
    assert run(deck, tmp_path / "quiet").stdout == ""
    loud = run(deck, tmp_path / "loud", arguments=()).stdout
    assert "4 particles in 2-D" in loud and "done at time 8" in loud and "\r" not in loud
    # On a terminal: one line that renews itself.
    try:
        reader, terminal = pty.openpty()
    except OSError as reason:
        pytest.skip(f"no terminal to be had here: {reason}")
    child = subprocess.Popen(command(deck, tmp_path / "tty", ["run.steps=100000000"], ()), stdout=terminal, stderr=subprocess.PIPE)
    os.close(terminal)
    shown = b""
    try:
        while part := os.read(reader, 65536):
            shown += part
            if shown.count(b"ETA") - shown.count(b"ETA --") > 3:
                child.send_signal(signal.SIGUSR2)
    except OSError:  # Linux: the other side has closed
        pass
    child.stderr.read()
    assert child.wait() == 75
    lines = [line for line in shown.decode().split("\r") if "ETA" in line]
    assert "collisions/s" in lines[-1] and "|ΔE/E| = " in lines[-1]
    assert "ETA --" not in lines[-1]


def test_max_wall(tmp_path):
    deck, out = write_deck(tmp_path, SPRINGS), tmp_path / "out"
    done = run(deck, out, ["run.steps=100000000", "output.thermo_interval=100.0", "output.frame_interval=0.0"],
               ("--quiet", "--max-wall", "00:00:01"), code=75)
    assert f"stopped by --max-wall; carom run --continue {out} goes on" in done.stderr
    s, last = summary(out), last_records(out)
    assert s["status"] == "interrupted" and 0 < s["steps"] < 100000000
    assert last["time"] == s["end_time"] == thermo(out)["time"][-1]
    assert last["step"] == s["steps"]
    assert s["energy"]["max_abs_error"] <= 1e-10


@pytest.mark.parametrize("seed", range(12))
def test_a_kill_leaves_readable_files(seed, tmp_path):
    deck, out = write_deck(tmp_path, SPRINGS), tmp_path / "out"
    child = subprocess.Popen(command(deck, out, ["run.steps=100000000", "output.thermo_interval=0.02",
                                                 "output.frame_interval=0.02", "output.events=true"]))
    wait_for_rows(child, out, 20)
    time.sleep(random.Random(seed).uniform(0.05, 0.5))
    child.send_signal(signal.SIGKILL)
    assert child.wait() == -signal.SIGKILL
    for name in ("trajectory.h5md", "events.h5"):  # completes a flush that the kill interrupted
        subprocess.run([CAROM, "info", out / name], check=True, stdout=subprocess.DEVNULL)
    rows, frames, events = thermo(out), data_sets(out / "trajectory.h5md"), data_sets(out / "events.h5")
    written = len(frames["particles/trajectory/position/step"])  # MDAnalysis ends if a step is missing
    assert written > 10
    assert all(len(value) >= written for name, value in frames.items() if name.endswith(("/value", "/step", "/time")))
    assert len(rows["time"]) - written in (0, 1)  # a row is written before the frame of the same time
    assert np.isfinite(frames["particles/trajectory/position/value"]).all()
    assert np.array_equal(frames["particles/trajectory/position/time"][:written], rows["time"][:written])
    assert np.array_equal(frames["observables/total_energy/value"][:written], rows["total"][:written])
    columns = {name.removeprefix("events/"): value for name, value in events.items() if name.startswith("events/")}
    whole = len(columns["time"])
    assert all(len(value) >= whole for value in columns.values())
    assert same({"t": columns["time"]}, {"t": columns["time_in_slab"][:whole] + 0.02 * columns["slab"][:whole]})
    pairs = (columns["kind"][:whole] == 0).sum()
    assert frames["observables/collisions/value"][written - 1] <= pairs <= rows["collisions"][-1] + 4


def test_one_rank_needs_no_temporary_directory(tmp_path):
    (tmp_path / "file").write_text("x")
    run(write_deck(tmp_path, SPRINGS), tmp_path / "out", env=os.environ | {"TMPDIR": str(tmp_path / "file" / "tmp")})
