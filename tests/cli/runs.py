# SPDX-License-Identifier: BSD-3-Clause
"""Common parts of the tests of `carom run`: small decks, ways to start the command, readers of its files."""

import csv
import json
import os
import pathlib
import re
import shutil
import subprocess
import time

import h5py
import numpy as np
import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
CAROM = os.environ.get("CAROM", "")
needs_carom = pytest.mark.skipif(not CAROM, reason="needs the command: CAROM=build/release/io/carom")

needs_compiler = pytest.mark.skipif(not shutil.which("cc"), reason="needs a C compiler for the library that kills")

# A separate namespace for mounts, as root or with user namespaces, which disappears at the end.
UNSHARE = ["unshare", "-m"] if os.geteuid() == 0 else ["unshare", "-Urm"]
can_mount = subprocess.run(UNSHARE + ["mount", "-t", "tmpfs", "none", "/mnt"], capture_output=True).returncode == 0
needs_mount = pytest.mark.skipif(not can_mount, reason="may not mount here (not root, no user namespaces)")


def in_mount(options, target, arguments, keep=None):
    """Runs a command with a tmpfs on `target`; afterwards copies its contents to `keep`."""
    script = 'mount -t tmpfs -o "$1" none "$2"; keep="$3"; target="$2"; shift 3; "$@"; code=$?; '
    script += 'if [ -n "$keep" ]; then cp -r "$target" "$keep"; fi; exit $code'
    return subprocess.run(UNSHARE + ["sh", "-c", script, "sh", options, str(target), str(keep or ""), *arguments],
                          capture_output=True, text=True, timeout=1200)


# Four discs joined by springs between hard walls: smooth forces, pair and wall collisions.
SPRINGS = """
format = 1
title = "four discs on springs"
[system]
dimension = 2
box = [9.0, 5.0]
boundary = ["wall", "wall"]
[[particles]]
name = "disc"
position = [[1.5, 2.5], [3.5, 2.5], [5.5, 2.6], [7.5, 2.5]]
velocity = [[0.3, 0.1], [1.1, -0.4], [-0.9, 0.7], [0.2, -0.3]]
radius = 0.5
mass = [1.0, 2.0, 1.5, 1.0]
[[interaction]]
type = "harmonic-bond"
pairs = [[0, 1], [1, 2], [2, 3]]
stiffness = 1.0
rest_length = 1.8
[integrator]
type = "cdda"
step = 0.02
[run]
steps = 400
[output]
directory = "unused"
frame_interval = 0.5
thermo_interval = 0.1
"""

# Spheres in a periodic box: free flight in three dimensions.
SPHERES = """
format = 1
title = "periodic hard spheres"
[system]
dimension = 3
boundary = ["periodic", "periodic", "periodic"]
[[particles]]
name = "sphere"
count = 108
temperature = 1.0
radius = 0.5
[placement]
type = "fcc"
packing_fraction = 0.3
seed = 7
[integrator]
type = "free-flight"
[run]
end_time = 3.0
[output]
directory = "unused"
frame_interval = 0.5
thermo_interval = 0.1
"""

# The same spheres, rough and with spin.
ROUGH = SPHERES.replace("[[particles]]", '[[contact]]\nbetween = ["*", "*"]\ntangential = 0.5\n[[particles]]').replace(
    "temperature = 1.0", "temperature = 1.0\nrotational_temperature = 0.5")


def mpi_environment():
    """The environment with the settings of tools/mpi-env.sh."""
    lines = (ROOT / "tools" / "mpi-env.sh").read_text().splitlines()
    settings = [line.removeprefix("export ").split("=", 1) for line in lines if line.startswith("export ")]
    assert len(settings) == 5
    return os.environ | dict(settings)


MPIRUN = ["timeout", "-k", "10", "1200", "mpirun", "--timeout", "1000", "-n"]


def mpirun(ranks, arguments, code=0, **options):
    done = subprocess.run(MPIRUN + [str(ranks)] + [str(argument) for argument in arguments], env=mpi_environment(),
                          capture_output=True, text=True, **options)
    assert done.returncode == code, done.stderr
    return done


def signalled(killer, output, number, at=1, name="thermo.csv", **more):
    """The environment of a run that sends itself a signal at the `at`-th change of a file in its directory."""
    more = {"LD_PRELOAD": killer, "KILL_IN": f"{output}/{name}", "KILL_AT": at, "KILL_SIGNAL": int(number)} | more
    return mpi_environment() | {key: str(value) for key, value in more.items()}


def running(output):
    """The processes of the run that writes to this directory, by rank."""
    found = {}
    for process in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            arguments = (process / "cmdline").read_bytes().split(b"\0")
            rank = re.search(rb"(?:^|\0)OMPI_COMM_WORLD_RANK=(\d+)", (process / "environ").read_bytes())
        except OSError:  # it has just ended, or belongs to another user
            continue
        if rank and str(output).encode() in arguments and arguments[0] == CAROM.encode():
            found[int(rank[1])] = int(process.name)
    return found


def wait_until_stopped(job, process=None):
    """Waits until a process of a job, the job itself by default, has stopped itself."""
    while pathlib.Path(f"/proc/{process or job.pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "T":
        assert job.poll() is None
        time.sleep(0.005)


def wait_until_computed(job, seconds):
    """Waits until a process has computed for so many more seconds of processor time."""
    def computed():
        times = pathlib.Path(f"/proc/{job.pid}/stat").read_text().rsplit(")", 1)[1].split()[11:13]
        return sum(map(int, times)) / os.sysconf("SC_CLK_TCK")
    end = computed() + seconds
    while computed() < end:
        assert job.poll() is None
        time.sleep(0.01)


def write_deck(directory, text):
    path = pathlib.Path(directory) / "input.toml"
    path.write_text(text)
    return path


def command(deck, output, overrides=(), arguments=("--quiet",)):
    sets = [part for override in overrides for part in ("--set", override)]
    return [CAROM, "run", str(deck), "-o", str(output), *sets, *arguments]


def run(deck, output, overrides=(), arguments=("--quiet",), code=0, **options):
    done = subprocess.run(command(deck, output, overrides, arguments), capture_output=True, text=True, timeout=1200,
                          **options)
    assert done.returncode == code, done.stderr
    return done


def summary(output):
    return json.loads((output / "summary.json").read_text())


def thermo(output):
    with open(output / "thermo.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    return {name: np.array([float(row[name]) for row in rows]) for name in rows[0]} if rows else {}


def data_sets(path):
    """Every data set of an HDF5 file, by each of its names (h5py's visititems shows a hard-linked one only once)."""
    def members(group, prefix):
        for name, item in group.items():
            if isinstance(item, h5py.Group):
                yield from members(item, prefix + name + "/")
            else:
                yield prefix + name, item[()]

    with h5py.File(path) as file:
        return dict(members(file, ""))


def same(one, other):
    """Whether two dictionaries of arrays are equal bit by bit."""
    return one.keys() == other.keys() and all(
        np.asarray(one[k]).tobytes() == np.asarray(other[k]).tobytes() for k in one)


def frames_are_sound(output):
    """Every frame in the file is complete and equal to that of a run on an empty disk."""
    sets, rows = data_sets(output / "trajectory.h5md"), thermo(output)
    n = len(sets["particles/trajectory/position/value"])
    lengths = {len(v) for k, v in sets.items() if k.split("/")[-1] in ("value", "step", "time")}
    assert lengths == {n}
    assert np.array_equal(sets["particles/trajectory/position/time"], rows["time"][:n])
    assert np.array_equal(sets["observables/kinetic_energy/value"], rows["kinetic"][:n])
    return n
