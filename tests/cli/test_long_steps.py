# SPDX-License-Identifier: BSD-3-Clause
"""Long steps: a step is abandoned when the run must stop, and repeated from its start when the run is continued."""

import signal
import subprocess
import time

import pytest

from going_on import INTERRUPTED, expect_same, go_on, wait_for_rows
from runs import command, mpi_environment, needs_carom, run, summary, wait_until_computed, write_deck

pytestmark = needs_carom

# Densely packed discs: a million collisions in a time of 1, a hundred times more in ENDLESS.
JAMMED = """
format = 1
title = "jammed discs"
[system]
dimension = 2
boundary = ["periodic", "periodic"]
[[particles]]
name = "disc"
count = 64
radius = 0.5
temperature = 1.0
[placement]
type = "hexagonal"
packing_fraction = 0.9068
seed = 5
[[interaction]]
type = "yukawa"
amplitude = 1.0
kappa = 2.0
cutoff = 1.9
[integrator]
type = "cva"
step = 0.003
max_events_per_step = 20000000
[run]
steps = 3
[output]
directory = "unused"
events = true
frame_interval = 0.0001
thermo_interval = 0.0001
"""
ENDLESS = ["integrator.step=0.5", "placement.packing_fraction=0.906899"]

# Discs joined by springs that are far too stiff for the step, which is halved many times.
YUKAWA = '"yukawa"\namplitude = 1.0\nkappa = 2.0\ncutoff = 1.9'
SPRINGS = '"harmonic-bond"\nwithin = 1.5\nstiffness = 1e6\nrest_length = 1.34'
STIFF = JAMMED.replace(YUKAWA, SPRINGS).replace("0.9068", "0.5")


def deck_of(tmp_path, method, text=JAMMED):
    name, _, variant = method.partition(" ")
    return write_deck(tmp_path, text.replace('"cva"', f'"{name}"' + (f'\nvariant = "{variant}"' if variant else "")))


def expect_interrupted(out):
    assert summary(out)["status"] == "interrupted" and summary(out)["steps"] == 0
    assert (out / "checkpoint.h5").exists()
    assert (out / "thermo.csv").read_text().count("\n") <= 2  # only the start


@pytest.mark.parametrize("method", ["psa", "cva", "mcva", "mcva restart", "cdda", "edda"])
def test_max_wall(method, tmp_path):
    out = tmp_path / "out"
    run(deck_of(tmp_path, method), out, ENDLESS, ("--quiet", "--max-wall", "0.4"), INTERRUPTED)
    expect_interrupted(out)
    assert "stopped by --max-wall" in (out / "run.log").read_text()


@pytest.mark.parametrize("method, number", [("cva", "TERM"), ("cdda", "INT"), ("edda", "HUP"), ("psa", "USR2")])
def test_signals(method, number, tmp_path):
    out = tmp_path / "out"
    job = subprocess.Popen(command(deck_of(tmp_path, method), out, ENDLESS), stderr=subprocess.PIPE, text=True)
    wait_for_rows(job, out, 1)
    wait_until_computed(job, 0.1)
    job.send_signal(getattr(signal, "SIG" + number))
    assert job.wait(600) == INTERRUPTED, job.stderr.read()
    expect_interrupted(out)


@pytest.mark.parametrize("method", ["cva", "edda"])
def test_signals_to_mpirun(method, tmp_path):
    out = tmp_path / "out"
    job = subprocess.Popen(["mpirun", "-n", "2", *command(deck_of(tmp_path, method), out, ENDLESS)], env=mpi_environment(),
                           stderr=subprocess.PIPE, text=True)
    wait_for_rows(job, out, 1)
    time.sleep(0.2)
    job.send_signal(signal.SIGUSR2)
    assert job.wait(600) == INTERRUPTED, job.stderr.read()
    expect_interrupted(out)


@pytest.mark.parametrize("method, before, after", [("cva", 2, 1), ("cdda", 1, 1), ("edda", 1, 2)])
def test_going_on_from_within_a_step(method, before, after, tmp_path):
    whole, out = tmp_path / "whole", tmp_path / "out"
    deck = deck_of(tmp_path, method, STIFF if method == "edda" else JAMMED)
    overrides = [f"integrator.step={ {'cva': 0.003, 'cdda': 0.0005, 'edda': 0.05}[method] }"]
    launcher = ["mpirun", "-n", str(before)] if before > 1 else []
    job = subprocess.Popen(launcher + command(deck, out, [*overrides, "run.steps=1000000"]), env=mpi_environment(), stderr=subprocess.PIPE, text=True)
    wait_for_rows(job, out, 1)
    job.send_signal(signal.SIGUSR2)
    assert job.wait(600) == INTERRUPTED, job.stderr.read()
    end = f"run.steps={summary(out)['steps'] + 1}"
    run(deck, whole, [*overrides, end])
    go_on(out, ["--set", end], ranks=after)
    expect_same(whole, out)


def test_a_checkpoint_waits_for_the_end_of_the_step(tmp_path):
    """USR1 comes within a step without end, which USR2 abandons."""
    out = tmp_path / "out"
    job = subprocess.Popen(command(deck_of(tmp_path, "cva"), out, ENDLESS), stderr=subprocess.PIPE, text=True)
    wait_for_rows(job, out, 1)
    wait_until_computed(job, 0.2)
    job.send_signal(signal.SIGUSR1)
    wait_until_computed(job, 0.2)
    assert not (out / "checkpoint.h5").exists()
    job.send_signal(signal.SIGUSR2)
    assert job.wait(600) == INTERRUPTED, job.stderr.read()
    assert (out / "checkpoint.h5").exists() and not (out / "checkpoint.previous.h5").exists()
