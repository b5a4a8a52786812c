# SPDX-License-Identifier: BSD-3-Clause
"""Ctrl-C: a real signal to a real process."""

import json
import os
import signal
import subprocess
import sys
import time

import pytest

SCRIPT = """
import json, sys
import numpy as np
sys.path.insert(0, {here!r})
from scenes import five_springs, gas, same_state
sim = {make}
print("ready", flush=True)
try:
    sim.run(time=1e7{more})  # one epoch of the third case takes seconds
except KeyboardInterrupt:
    at = sim.time
    whole = {make}
    end = at + {ahead}
    sim.run(time=end)
    whole.run(time=end)
    print(json.dumps({{"time": at, "same": same_state(sim, whole), "finite": bool(np.isfinite(sim.position).all())}}))
"""


def processor_seconds(process):
    with open(f"/proc/{process.pid}/stat") as file:
        return sum(map(int, file.read().rsplit(")", 1)[1].split()[11:13])) / os.sysconf("SC_CLK_TCK")


PLACEMENT = """
import carom
sim = carom.Simulation(dimension=3, boundary="periodic")
sim.add_particles(count=300000, temperature=1.0, radius=0.5)
try:
    print("ready", flush=True)
    sim.place("random", packing_fraction=0.375)
except KeyboardInterrupt:
    print(len(sim))
"""


def test_ctrl_c_ends_a_placement():
    """It would take hours; the simulation stays as it was."""
    with subprocess.Popen([sys.executable, "-c", PLACEMENT], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline() == "ready\n"
        start = processor_seconds(process)
        while processor_seconds(process) < start + 0.2:
            time.sleep(0.01)
        process.send_signal(signal.SIGINT)
        try:
            assert process.communicate(timeout=600)[0] == "0\n" and process.returncode == 0
        finally:
            process.kill()


@pytest.mark.parametrize("make, ahead, more", [
    ("five_springs()", 1.005, ""), ("gas()", 10.0, ""), ("gas(4096, step=1000)", 10.0, ""),
    ("five_springs()", 1.0, ", every=0.05, callback=lambda s: s.energy")])
def test_ctrl_c_ends_the_step_and_the_run_goes_on(make, ahead, more):
    import pathlib
    script = SCRIPT.format(here=str(pathlib.Path(__file__).parent), make=make, more=more, ahead=ahead)
    with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline() == "ready\n"
        start = processor_seconds(process)
        while processor_seconds(process) < start + 0.2:
            time.sleep(0.01)
        process.send_signal(signal.SIGINT)
        said = json.loads(process.stdout.readline())
        assert process.wait(600) == 0
    assert 0 < said["time"] < (1000 if "step=1000" in make else 1e7)  # within the first epoch
    assert said["same"] and said["finite"]
