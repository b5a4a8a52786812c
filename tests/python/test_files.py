# SPDX-License-Identifier: BSD-3-Clause
"""Runs from Python that write files and continue from them, and callbacks that set velocities."""

import os
import re
import signal
import subprocess
import sys
import urllib.request

import numpy as np
import pytest

import carom
from scenes import ROOT, five_springs, gas, run_command, same_state

OUTPUT = {"thermo_interval": 0.1, "frame_interval": 0.5, "rdf_interval": 0.1, "msd_interval": 0.1, "events": True}
SET = [part for key, value in OUTPUT.items() for part in ("--set", f"output.{key}={str(value).lower()}")]
DECKS = [("five-springs.toml", {}), ("hard-sphere-fluid.toml", {"particles.0.count": 108})]


def same_files(one, other):
    done = subprocess.run(["/usr/bin/python3", ROOT / "tools/compare.py", one, other], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    for name in ("thermo.csv", "rdf.csv", "msd.csv"):
        assert (one / name).read_bytes() == (other / name).read_bytes(), name


@pytest.mark.parametrize("deck, change", DECKS)
def test_the_files_are_those_of_the_command_which_goes_on_with_them(tmp_path, deck, change):
    deck, by_command, by_python = ROOT / "inputs" / deck, tmp_path / "command", tmp_path / "python"
    run_command(deck, by_command, "--set", "run.end_time=2", *SET,
                *[part for key, value in change.items() for part in ("--set", f"{key}={value}")])
    sim = carom.Simulation.from_deck(deck, set=change)
    sim.output(by_python, **OUTPUT)
    sim.run(time=0.9)
    sim.run(time=2)
    same_files(by_command, by_python)
    assert sim.open().summary["status"] == "done" and len(sim.open().frames) == 5 and sim.directory == str(by_python)
    for name, entry in sim.open().summary["means"].items():
        assert all(sim.means[name][key] == value or (value is None and np.isnan(sim.means[name][key])) for key, value in entry.items())
    assert sim.means["temperature"]["mean"] > 0
    for name, table in sim.open().averages.items():
        assert sim.averages[name].keys() == table.keys()
        assert all(np.array_equal(values, sim.averages[name][column], equal_nan=True) for column, values in table.items())
    for directory in (by_command, by_python):
        done = subprocess.run([os.environ["CAROM"], "run", "--continue", directory, "--set", "run.end_time=3", "--quiet"])
        assert done.returncode == 0
    same_files(by_command, by_python)


@pytest.mark.parametrize("make", [five_springs, gas])
def test_another_python_goes_on(tmp_path, make):
    undisturbed, first = make(), make()
    for sim, name in ((undisturbed, "one"), (first, "two")):
        sim.output(tmp_path / name, **OUTPUT)
    undisturbed.run(time=4)
    first.run(time=1.005)
    later = carom.Simulation.from_run(tmp_path / "two")
    assert later.title == first.title and len(later) == len(first)
    later.run(time=4)
    assert same_state(later, undisturbed)
    same_files(tmp_path / "one", tmp_path / "two")


def test_a_change_of_a_continued_run_begins_another_without_files(tmp_path):
    sim = five_springs()
    sim.output(tmp_path / "run", thermo_interval=0.5)
    sim.run(time=1)
    later = carom.Simulation.from_run(tmp_path / "run")
    later.integrator("psa", step=0.001)
    assert later.time == 0 and later.directory is None
    before = (tmp_path / "run" / "thermo.csv").read_bytes()
    later.run(time=0.1)
    assert (tmp_path / "run" / "thermo.csv").read_bytes() == before
    with pytest.raises(carom.UsageError, match="writes no files; call output"):
        later.open()


def test_a_killed_python_is_continued(tmp_path):
    """The run writes checkpoints continually, and is killed after the second."""
    script = ("import sys; sys.path.insert(0, sys.argv[1]); from scenes import five_springs; s = five_springs();"
              "s.output(sys.argv[2], thermo_interval=0.1, frame_interval=0.5, rdf_interval=0.1, msd_interval=0.1, events=True,"
              " checkpoint_wall='0.01'); s.run(time=100000)")
    killed = subprocess.Popen([sys.executable, "-c", script, ROOT / "tests/python", tmp_path / "killed"])
    while not (tmp_path / "killed/checkpoint.previous.h5").exists():
        assert killed.poll() is None
    killed.send_signal(signal.SIGKILL)
    killed.wait()
    later, undisturbed = carom.Simulation.from_run(tmp_path / "killed"), five_springs()
    end = np.ceil(carom.open(tmp_path / "killed").thermo["time"][-1] + 1)
    undisturbed.output(tmp_path / "undisturbed", **OUTPUT)
    for sim in (later, undisturbed):
        sim.run(time=end)
    assert same_state(later, undisturbed)
    same_files(tmp_path / "killed", tmp_path / "undisturbed")


def test_averages_can_be_looked_at_during_the_run(tmp_path):
    sim, pairs = five_springs(), []
    sim.output(tmp_path / "run", thermo_interval=1, rdf_interval=0.5)
    sim.run(time=5, callback=lambda s: pairs.append(s.averages["rdf"]["g"].sum()))
    assert len(pairs) == 6 and len(set(pairs)) > 3 and sim.averages["rdf"]["g"].sum() == pairs[-1]


def test_what_output_refuses(tmp_path):
    sim = five_springs()
    sim.output(tmp_path / "run", thermo_interval=0.1, frame_intervall=1)
    with pytest.raises(carom.UsageError, match="frame_intervall.*frame_interval"):
        sim.run(time=1)
    sim.output(tmp_path / "run", thermo_interval=0.1)
    with pytest.raises(carom.UsageError, match="'every' is 0.3, but the rows of thermo.csv come every 0.1"):
        sim.run(time=1, every=0.3, callback=print)
    sim.output(tmp_path / "run", frame_interval=0.1)
    with pytest.raises(carom.UsageError, match=r"output\(\) got no thermo_interval, .* give output\(\) that thermo_interval"):
        sim.run(time=1, every=0.3, callback=print)
    sim.output(tmp_path / "run", thermo_interval=0.1)
    sim.run(time=1)
    (tmp_path / "run" / "thermo.csv").write_text("another\n")
    with pytest.raises(carom.FileError, match="thermo.csv"):
        sim.run(time=2)
    with pytest.raises(carom.FileError, match="checkpoint"):
        carom.Simulation.from_run(tmp_path)


def test_an_earlier_run_is_kept_and_said(tmp_path):
    for sim in (five_springs(), five_springs()):
        sim.output(tmp_path / "run", thermo_interval=0.5)
        last = sim
        if (tmp_path / "run").exists():
            with pytest.warns(carom.CaromWarning, match="^the files of an earlier run in this directory are now in .*backup.1"):
                sim.run(time=1)
        else:
            sim.run(time=1)
    assert (tmp_path / "run/backup.1/thermo.csv").exists() and last.time == 1


def test_an_earlier_run_is_replaced_on_request(tmp_path, recwarn):
    """Files of other names stay."""
    (tmp_path / "run").mkdir()
    (tmp_path / "run/notes.csv").write_text("mine")
    for more in ({"rdf_interval": 0.1, "events": True}, {}):
        sim = five_springs()
        sim.output(tmp_path / "run", thermo_interval=0.5, overwrite=True, **more)
        sim.run(time=1)
        assert not sim.warnings and not recwarn.list
    assert not list((tmp_path / "run").glob("backup*")) and (tmp_path / "run/notes.csv").read_text() == "mine"
    assert not (tmp_path / "run/rdf.csv").exists() and not (tmp_path / "run/events.h5").exists()
    assert sim.open().thermo["time"].tolist() == [0, 0.5, 1]


PLAIN = """
import h5py, sys
with h5py.File(sys.argv[1], "r") as file:
    print(file["particles/trajectory/position/value"].shape[0])
"""


def test_the_files_of_an_active_run_can_be_read(tmp_path):
    """By carom.open() and `carom info`; other programs need a variable, which `carom info` and the page of the files name."""
    said = []

    def look(s):
        file = tmp_path / "run/trajectory.h5md"
        said.append((carom.open(tmp_path / "run").frames[-1].time, "time" in carom.open(tmp_path / "run").events))
        info = subprocess.run([os.environ["CAROM"], "info", file], capture_output=True, text=True)
        said.append((info.returncode, "HDF5_USE_FILE_LOCKING=FALSE" in info.stdout))
        for variable in ({}, {"HDF5_USE_FILE_LOCKING": "FALSE"}):
            done = subprocess.run([sys.executable, "-c", PLAIN, file], capture_output=True, text=True, env=os.environ | variable)
            said.append((done.returncode, done.stdout if variable else "unable to lock file" in done.stderr))

    sim = five_springs()
    sim.output(tmp_path / "run", thermo_interval=1, frame_interval=1, events=True)
    sim.run(time=3, callback=lambda s: look(s) if s.time == 2 else None)
    assert said[0][0] in (1, 2) and said[0][1] and said[1] == (0, True) and said[2] == (1, True)
    assert said[3][0] == 0 and int(said[3][1]) in (2, 3)
    info = subprocess.run([os.environ["CAROM"], "info", tmp_path / "run"], capture_output=True, text=True)
    assert "HDF5_USE_FILE_LOCKING" not in info.stdout


def test_a_mean_without_an_error_says_how_long_to_run(tmp_path):
    """Seven steps are too few, whatever they hold; eight may do. The same in summary.json and run.log."""
    sim = five_springs()
    sim.output(tmp_path / "run")
    sim.run(steps=7)
    mean = sim.means["temperature"]
    assert np.isnan(mean["standard_error"]) and abs(mean["needed_time"] - 0.08) < 1e-12
    assert sim.open().summary["means"]["temperature"]["needed_time"] == mean["needed_time"]
    log = (tmp_path / "run/run.log").read_text()
    assert "no standard error of: pressure, temperature, potential" in log and "a run to time 0.08 at least" in log
    sim.run(steps=100)
    walls = sim.open().summary["walls"]
    assert {wall["collisions"] for wall in walls.values()} == {0}
    for name in ("force_standard_error", "pressure_standard_error", "independent_samples"):
        assert {wall[name] for wall in walls.values()} == {None}
    sim = gas(step=0.1)
    sim.run(time=20)
    assert sim.means["pressure"]["standard_error"] > 0 and np.isnan(sim.means["pressure"]["needed_time"])


@pytest.mark.parametrize("method", ["psa", "cva", "mcva", "cdda", "edda"])
def test_a_callback_sets_velocities_and_the_clock_goes_on(method):
    def slow(s):
        if s.step in (0, 50, 100):
            s.velocity = 0.5 * s.velocity

    sim, by_hand = five_springs(), five_springs()
    for each in (sim, by_hand):
        each.integrator(method, step=0.01)
    sim.run(time=1, every=0.5, callback=slow)
    sim.run(time=1.5)
    for _ in range(3):
        by_hand.velocity = 0.5 * by_hand.velocity
        by_hand.run(time=0.5)
    assert sim.time == 1.5 and sim.step == 150
    assert np.allclose(sim.position, by_hand.position, rtol=0, atol=1e-3 if method in ("psa", "mcva", "cva") else 1e-11)
    exact = method in ("cdda", "edda")
    assert sim.energy_error < (1e-13 if exact else 0.02) and sim.energy == pytest.approx(by_hand.energy, rel=1e-9 if exact else 0.02)
    assert sim.energy < 0.2 * five_springs().energy


def test_a_thermostat_of_free_flight_needs_epochs_that_end_with_the_callback():
    sim, seen = gas(), []
    with pytest.raises(carom.UsageError, match="epoch of free flight is going on.*step=every"):
        sim.run(time=2, every=0.5, callback=lambda s: s.thermalize(1.0, seed=s.step) if s.time == 0.5 else None)
    sim = gas(step=0.5)

    def heat(s):
        seen.append(s.temperature)
        s.thermalize(1 + s.time, seed=s.step + 1)

    sim.run(time=2, every=0.5, callback=heat)
    assert sim.time == 2 and sim.step == 4 and sim.collisions > 0
    assert np.allclose(seen[1:], [1, 1.5, 2, 2.5]) and sim.energy_error < 1e-13


def test_velocities_set_at_a_shortened_end_hold(tmp_path):
    sim = five_springs()
    sim.output(tmp_path / "run", thermo_interval=0.205)
    rest = np.zeros((5, 2))

    def stop(s):
        if s.time == 0.205:
            s.velocity = rest

    sim.run(time=0.205, callback=stop)
    later = carom.Simulation.from_run(tmp_path / "run")
    assert np.array_equal(later.velocity, rest) and later.time == 0.205
    for each in (sim, later):
        each.run(time=1)
    assert same_state(sim, later) and sim.energy_error < 1e-13 and sim.energy < 1
    assert sim.step == 21 + 80  # steps are counted from the shortened one on


def test_a_velocity_that_is_no_number_is_refused_in_a_callback():
    sim = five_springs()
    with pytest.raises(carom.InitialStateError, match="particle 0 are not finite"):
        sim.run(time=1, every=0.5, callback=lambda s: setattr(s, "velocity", np.full((5, 2), np.nan)))


def test_a_page_shows_the_run(tmp_path):
    sim = five_springs()
    with pytest.raises(carom.UsageError, match="writes no files"):
        sim.view()
    sim.output(tmp_path / "run", thermo_interval=0.1, frame_interval=0.1)
    sim.run(time=1)
    with sim.view(browser=False) as page:
        assert re.match(r"http://127\.0\.0\.1:\d+/", page.address) and page.address in page._repr_html_()
        assert "<!doctype html>" in urllib.request.urlopen(page.address).read().decode()
        with pytest.raises(carom.Error, match="port"):
            sim.view(port=int(page.address.split(":")[2].split("/")[0]), browser=False)
        state = urllib.request.urlopen(page.address + "runs").read().decode()
        assert '"frames":11' in state.replace(" ", "")
    with pytest.raises(OSError):
        urllib.request.urlopen(page.address, timeout=5)
    sim.open().view(export=tmp_path / "page.html")
    assert "<!doctype html>" in (tmp_path / "page.html").read_text()


def with_output(**output):
    return {"format": 1, "system": {"dimension": 2, "box": [12.0, 6.0], "boundary": ["periodic", "wall"]},
            "particles": [{"name": "disc", "position": [[2.0, 3.0], [6.0, 3.0]], "velocity": [[1.0, 0.5], [0.0, 0.0]], "radius": 0.5}],
            "integrator": {"type": "psa", "step": 0.01}, "run": {"end_time": 1.0}} | ({"output": output} if output else {})


def test_the_output_of_a_deck_is_kept(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    deck = with_output(directory="files", thermo_interval=0.25, msd_interval=0.1, events=True)
    sim = carom.Simulation.from_deck(deck)
    sim.run()
    assert sim.directory is None and not (tmp_path / "files").exists(), "scans of a deck would write into one directory"
    sim.output()
    sim.run()
    assert sim.directory == str(tmp_path / "files") and len(sim.averages["msd"]["msd"]) and (tmp_path / "files/events.h5").exists()
    assert len(sim.open().thermo["time"]) == 5
    sim.output("others", rdf_interval=0.1)
    sim.run()
    assert {"msd", "rdf"} <= sim.averages.keys() and len(sim.open().thermo["time"]) == 5
    with pytest.raises(carom.UsageError, match="there is no 'directory'; give one"):
        five_springs().output()


def test_the_interval_of_calls_is_that_of_the_rows(tmp_path):
    sim = carom.Simulation.from_deck(with_output(directory=str(tmp_path / "run"), thermo_interval=0.25))
    sim.output()
    times = []
    sim.run(every=0.5, callback=lambda s: times.append(s.time))
    assert np.allclose(times, [0, 0.5, 1]) and np.allclose(sim.open().thermo["time"], times)
    with pytest.raises(carom.UsageError, match="the rows of thermo.csv come every 0.5"):
        sim.run(time=2, every=0.25, callback=print)
    sim.output()
    for wrong in (-1, "x", float("nan")):
        with pytest.raises(carom.UsageError, match="run: 'every' is .*; give a positive number"):
            sim.run(every=wrong)
    sim.run()
    assert np.allclose(sim.open().thermo["time"], [0, 0.25, 0.5, 0.75, 1]), "a refused interval leaves nothing behind"
    sim.output(thermo_interval=0.25)
    with pytest.raises(carom.UsageError, match="the rows of thermo.csv come every 0.25"):
        sim.run(time=2, every=0.5, callback=print)


def test_the_files_name_the_script(tmp_path):
    script = tmp_path / "scan.py"
    script.write_text("import carom\nsim = carom.Simulation(box=[12, 6])\nsim.add_particles(position=[[2, 3]])\n"
                      "sim.integrator('psa', step=0.01)\nsim.output('run')\nsim.run(steps=5)\n")
    subprocess.run([sys.executable, script], cwd=tmp_path, check=True)
    assert "scan.py" in (tmp_path / "run/run.log").read_text() and "simulation.py" not in (tmp_path / "run/run.log").read_text()
    # The places in the deck that the session has written are no lines of the script.
    script.write_text(script.read_text().replace("[[2, 3]]", "[[2, 3], [2.5, 3]]"))
    failed = subprocess.run([sys.executable, script], cwd=tmp_path, capture_output=True, text=True).stderr
    assert "InitialStateError: 1 pair of spheres overlaps" in failed, failed
