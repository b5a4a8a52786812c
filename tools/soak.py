#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Random decks, killed and continued at random instants: is the result that of an undisturbed run, bit for bit?

    tools/soak.py --minutes 30
    tools/soak.py --count 100 --seed 7 --ranks 1,2,3,4
    tools/soak.py --only 17 --seed 7 --count 100       # only deck 17 of these, after an error
    tools/soak.py --jumps tests/regression/decks/*.toml inputs/*.toml --count 50 --seed 3
    tools/soak.py --systems --count 1000
    tools/soak.py --systems cdda,psa,cva,mcva --count 1000 --only 17
    tools/soak.py --systems --accuracy 1e-3 --count 300

Each deck draws a method, forces, boundaries, a dimension, sizes and outputs. It runs once undisturbed, then again on other
numbers of ranks, with checkpoints a few hundredths of a second apart, while it is killed (KILL to the process, a rank, or
mpirun), told to stop (USR2, TERM, INT, HUP, --max-wall), or given a nearer end first. After each it continues with `carom run
--continue`, or from the start if there was no checkpoint yet. All files and the summary are compared. Spheres must not overlap,
and free-flight, cdda and edda must conserve the energy. Exit code 0: no error; 1: an error; its files remain in --output.

--jumps measures instead the largest change of the energy in a slab with the exact methods, relative to the reference of energy
errors: in the given decks, with their own method if it is free-flight, otherwise with cdda and edda, and in the random
decks. A run that takes long is stopped.

--systems runs random systems that are hard (random_systems.py) by edda or the methods named, each once and undisturbed. A run is
ok if the energy of cdda and edda is right to 1e-12 of the largest K + |V| at all steps, the first included, and no spheres overlap
by more than 1e-12 of their contact distance; warned if the energy error is larger and the run warns of it; an error if it ends
with exit code 4 and a message of one line; wrong if it ends with 0 but is neither; slow if it takes more than --patience seconds
of processor time; otherwise a crash. Exit code 1: a run is wrong, slow or a crash, or more than 2 % of the runs of cdda or edda are errors.
The files of runs that are not ok remain in --output.
"""

import argparse
import concurrent.futures
import os
import pathlib
import random
import resource
import shutil
import signal
import subprocess
import sys
import time
import tomllib

import numpy as np

from carom_files import Error, find_carom, one_line, read_summary, read_thermo, toml_text
from compare import compare, summary_differences
from random_systems import random_system

LARGEST_OVERLAP = 1e-9  # allowed overlap of spheres
EXACT = {"free-flight": 1e-9, "cdda": 1e-9, "edda": 1e-9}  # largest error of H, over its reference
ROUNDING = 1e-12  # largest error of H over its scale, and overlap over the contact distance, of a hard system
MOST_ERRORS = 0.02  # fraction of hard systems that may end in an error
TIME_LIMIT = 120  # [s], for one process
MPIRUN_EXTRA = 10  # [s] that mpirun may run longer than its ranks


class Found(Exception):
    """An error that was found."""


def mpi_environment():
    """The environment with the settings of mpi-env.sh."""
    lines = (pathlib.Path(__file__).resolve().parent / "mpi-env.sh").read_text().splitlines()
    return os.environ | dict(line.removeprefix("export ").split("=", 1) for line in lines if line.startswith("export "))


# Decks

def random_forces(dice, method, dimension, boundary, species):
    """Some terms of V that the box allows."""
    periodic, terms = "periodic" in boundary, []
    if dice.random() < 0.3:
        along = [0.0 if kind == "periodic" else dice.uniform(-0.5, 0.5) for kind in boundary]
        terms.append({"type": "uniform-field", "acceleration": along})
    if method == "free-flight":
        return terms
    cutoff = dice.uniform(1.5, 2.2)
    cut = {"cutoff": cutoff, "cut": dice.choice(["switch", "shifted", "force-shifted"])}
    pairs = [
        {"type": "yukawa", "amplitude": dice.uniform(-2, 2), "kappa": dice.uniform(1, 3), **cut},
        {"type": "lennard-jones", "epsilon": dice.uniform(0.2, 1), "sigma": 0.9, **cut},
        {"type": "wca", "epsilon": dice.uniform(0.2, 1), "sigma": 1.1},
        {"type": "morse", "depth": 0.5, "alpha": 3.0, "r0": 1.1, **cut},
        {"type": "inverse-power", "epsilon": dice.uniform(-0.5, 0.5), "sigma": 1.0, "exponent": 4.0, **cut},
        {"type": "table", "r": [0.5, 0.8, 1.1, 1.5, 2.0], "value": [3.0, 1.0, -0.4, -0.2, 0.0], "cutoff": 1.9},
    ]
    if len(species) > 1:
        pairs.append({"type": "coulomb", "form": "damped-shifted", "damping": 0.8, "cutoff": cutoff})
        pairs.append({"type": "yukawa", "amplitude": 1.0, "kappa": 1.0, "charges": True, "cutoff": cutoff, "species": species})
    if not periodic:
        pairs.append({"type": "gravity", "constant": 0.05})
        terms.append({"type": "harmonic-trap", "stiffness": dice.uniform(0.1, 0.5)})
    bonds = [{"type": "harmonic-bond", "within": 1.4, "stiffness": 20.0, "rest_length": 1.15}]
    if not periodic:
        bonds.append({"type": "harmonic-bond", "chain": True, "stiffness": 1.0, "rest_length": 1.2})
    if dice.random() < 0.4:
        terms.append(dice.choice(bonds))
    return terms + dice.sample(pairs, dice.choice([1, 1, 2]))


def random_walls(dice, boundary, end, length):
    """Further walls, and faces that move or are shaken, by at most a tenth of a sphere during the run; `length`: the longest edge of the box."""
    walls, dimension = [], len(boundary)
    for axis, side in [(axis, side) for axis in range(dimension) if boundary[axis] == "wall" for side in "-+"]:
        if dice.random() < 0.3:
            continue
        motion = dice.choice([dice.uniform(-0.05, 0.05) / end, {"amplitude": dice.uniform(0, 0.05), "frequency": dice.uniform(0.1, 1.0)}])
        walls.append({"name": "xyz"[axis] + side, "velocity": motion})
        if dice.random() < 0.3:
            walls[-1]["until"] = dice.uniform(0, 2) * end
        if dice.random() < 0.3:
            walls[-1]["temperature"] = dice.uniform(0.3, 3.0)
    if "open" in boundary and dice.random() < 0.5:
        normal = [0.0 if kind == "periodic" else dice.gauss(0, 1) for kind in boundary]
        walls.append({"name": "far", "normal": normal, "offset": -30.0 * sum(abs(each) for each in normal)})
    periodic = [kind == "periodic" for kind in boundary]
    if "open" in boundary and sum(periodic) <= dimension - 2 and dice.random() < 0.5:  # a cavity around the box, or a tube along an axis of it
        walls.append({"name": "cavity", "shape": "sphere", "centre": [length / 2] * dimension,
                      "radius": dice.uniform(1.0, 1.2) * length * dimension**0.5 / 2 + 0.6})
        if any(periodic) or dimension == 3 and dice.random() < 0.5:
            axis = [1.0 if each else 0.0 for each in periodic] if any(periodic) else [dice.gauss(0, 1) for _ in boundary]
            walls[-1] |= {"shape": "cylinder", "axis": axis}
        if dice.random() < 0.3:
            walls[-1]["temperature"] = dice.uniform(0.3, 3.0)
    return walls


def random_bath(dice, end):
    """A bath, with a ramp or without, that acts between once in ten runs and ten times a run."""
    temperature = dice.choice([dice.uniform(0.5, 2.0), [dice.uniform(0.5, 2.0), dice.uniform(0.5, 2.0)]])
    kind = dice.choice(["andersen", "rescaling", "langevin"])
    return {"type": kind, "temperature": temperature, "friction" if kind == "langevin" else "rate": 10**dice.uniform(-1, 1) / end}


def random_steps(dice, lattice, count, species):
    """Wells and shoulders between species, and tethers along the rows of a lattice."""
    steps, names = [], ["*", *species]
    for _ in range(dice.choice([1, 1, 2])):
        number = dice.choice([1, 1, 2])
        ranges = sorted(dice.uniform(1.02, 1.7) for _ in range(number))
        steps.append({"between": [dice.choice(names), dice.choice(names)], "range": ranges if number > 1 else ranges[0],
                      "depth": [dice.uniform(-1, 2) for _ in ranges] if number > 1 else dice.uniform(-1, 2)})
    if lattice in ("square", "simple-cubic") and dice.random() < 0.4:
        edge = round(count**(1 / (2 if lattice == "square" else 3)))
        steps.append({"chain": True, "chain_length": edge, "tether": dice.uniform(1.3, 2.0)})
    return steps


def random_contacts(dice, boundary, walls, species):
    """Laws of contacts between species, and of species with walls."""
    faces = ["xyz"[axis] + side for axis, kind in enumerate(boundary) if kind == "wall" for side in "-+"]
    partners, laws = ["*", *species], []
    for _ in range(dice.choice([1, 1, 2, 3])):
        ice = {"form": "power", "v0": 10**dice.uniform(-3, 0), "exponent": dice.uniform(0.1, 0.4)}
        laws.append({"between": [dice.choice(partners), dice.choice(partners + faces + [wall["name"] for wall in walls])],
                     "restitution": dice.choice([dice.uniform(0, 1), ice])})
        if dice.random() < 0.5:
            laws[-1]["rest_speed"] = 10**dice.uniform(-9, -2)
        if dice.random() < 0.4:
            laws[-1]["tangential"] = dice.uniform(-1, 1)
            if dice.random() < 0.5:
                laws[-1]["friction"] = dice.uniform(0, 1)
    return laws


def random_deck(dice, seconds):
    """A deck that takes about this long; many cannot run."""
    method = dice.choice(["free-flight", "free-flight", "verlet", "psa", "psa", "cva", "mcva", "cdda", "edda", "edda"])
    dimension = dice.choice([2, 3])
    boundary = ["periodic"] * dimension
    if dice.random() < 0.5:
        boundary = [dice.choice(["periodic", "open"] if method == "verlet" else ["periodic", "wall", "open"]) for _ in range(dimension)]
    cuts_all = method in ("cva", "mcva", "cdda")
    edge = dice.choice([3, 4, 5] if cuts_all else [3, 5, 6, 8])
    lattice = dice.choice(["square", "random"] if dimension == 2 else ["fcc", "simple-cubic", "random"])
    count = {"square": edge**2, "fcc": 4 * max(2, edge // 2)**3, "simple-cubic": edge**3, "random": edge**dimension}[lattice]
    sphere = {"temperature": dice.uniform(0.5, 2.0), "radius": 0.5, "mass": dice.choice([1.0, 0.7])}
    particles = [{"name": "a", "count": count, **sphere}]
    if dice.random() < 0.4:
        ions = {"count": max(1, count // 2)}, {"count": count - max(1, count // 2)}
        particles = [{"name": "a", **sphere, **ions[0], "charge": 1.0}, {"name": "b", **sphere, **ions[1], "charge": -1.0}]
        particles[1] |= {"radius": dice.choice([0.5, 0.3]), "mass": dice.choice([1.0, 3.0])}
    packing = dice.uniform(0.1, 0.25) if lattice == "random" else dice.uniform(0.1, 0.4)
    step = dice.choice([0.005, 0.01, 0.02, 0.05])
    integrator = {"type": method, "step": step}
    if method == "mcva":
        integrator["variant"] = dice.choice(["grid", "restart"])
    if method == "cdda":
        integrator["order"] = dice.choice([2, 2, 4])
    # Microseconds a particle and step, roughly.
    cost = {"verlet": 2, "psa": 3, "cva": 10, "mcva": 15, "cdda": 40, "edda": 8, "free-flight": 0}[method] * integrator.get("order", 2)**2 / 4
    steps = max(20, int(seconds * 1e6 / (cost * count))) if cost else 0
    run = {"steps": steps}
    if method == "free-flight":
        integrator["step"] = dice.choice([0.3, 2.0, 20.0, 1000.0])
        run = {"collisions": int(seconds * 4e5)}
    end = run.get("steps", 0) * step or run["collisions"] / count
    if method != "free-flight" and dice.random() < 0.3:
        run = {"end_time": end}
    output = {"directory": "unused", "frame_interval": end / dice.uniform(3, 30), "thermo_interval": end / dice.uniform(3, 60),
              "checkpoint_wall": f"0:0:{dice.choice([0.0, 0.02, 0.1])}", "events": dice.random() < 0.6}
    for average in ("rdf", "msd", "profile"):
        if dice.random() < 0.5:
            output[average + "_interval"] = end / dice.uniform(5, 50)
    if method == "verlet":
        for species in particles:
            species["display_radius"] = species.pop("radius")
    bath = random_bath(dice, end) if integrator.get("variant") != "restart" and dice.random() < 0.3 else None
    if bath and isinstance(bath["temperature"], list) and "collisions" in run:
        bath["temperature"] = bath["temperature"][0]
    walled = method != "verlet" and integrator.get("variant") != "restart" and dice.random() < 0.7
    length = (count * np.pi / (4 if dimension == 2 else 6) / packing)**(1 / dimension)
    walls = random_walls(dice, boundary, end, length) if walled else []
    dissipates = method != "verlet" and dice.random() < 0.5
    contacts = random_contacts(dice, boundary, walls, [each["name"] for each in particles]) if dissipates else []
    if any("tangential" in law for law in contacts) and dice.random() < 0.7:
        particles[0] |= {"rotational_temperature": dice.uniform(0, 2.0), "inertia": dice.uniform(0.1, 0.6)}
    steps = random_steps(dice, lattice, count, [each["name"] for each in particles]) \
        if method in ("free-flight", "psa", "edda", "cdda") and dice.random() < 0.4 else []
    if method in ("cdda", "edda") and (dice.random() < 0.4):
        integrator["accuracy"] = dice.choice([1e-2, 1e-3, 1e-4])
    system = {"dimension": dimension, "boundary": boundary}
    forces = random_forces(dice, method, dimension, boundary, [each["name"] for each in particles])
    if method in ("free-flight", "psa", "verlet", "edda") and boundary[:2] == ["periodic", "periodic"] and dice.random() < 0.5:
        rate = lambda: dice.choice([-1, 1]) * 10**dice.uniform(-1.5, 0.5)
        unit = end * 1e-3 if method == "free-flight" else step
        changes = sorted({unit * dice.randrange(1 + int(end / unit)) for _ in range(dice.choice([0, 0, 1, 2, 3]))})
        system["shear"] = {"rate": [[time, dice.choice([0.0, rate()])] for time in changes] or rate()}
        steps = []
        if method != "free-flight":
            contacts = []
            walls = [wall for wall in walls if "temperature" not in wall]
            forces = [force for force in forces if force["type"] in ("harmonic-bond", "wca") or force.get("cutoff", np.inf) < length]
    return {"format": 1, "system": system,
            "wall": walls, "contact": contacts, "step": steps, "bath": [bath] if bath else [], "particles": particles,
            "placement": {"type": lattice, "packing_fraction": packing, "seed": dice.randrange(1000)},
            "interaction": forces,
            "integrator": integrator, "run": run, "output": output}


def words(deck):
    """A deck in a line."""
    n = sum(species["count"] for species in deck["particles"])
    forces = "+".join(term["type"] for term in deck["interaction"]) or "no forces"
    more = "".join(f", {kind}" for kind in ("wall", "contact", "step", "bath") if deck.get(kind))
    more += ", shear" * ("shear" in deck["system"]) + " that changes" * isinstance(deck["system"].get("shear", {}).get("rate"), list)
    more += ", spins" if any("tangential" in law for law in deck.get("contact", [])) else ""
    return f"{deck['integrator']['type']} {deck['system']['dimension']}-D {n} {forces} {'/'.join(deck['system']['boundary'])}{more}"


# Runs

class Run:
    """A run in a directory by consecutive processes."""

    def __init__(self, carom, deck, output, dice):
        self.carom, self.deck, self.output, self.dice = str(carom), deck, output, dice
        self.begun = self.continued = 0

    def start(self, ranks, arguments):
        """Continues if there is a checkpoint, otherwise starts again."""
        launcher = ["mpirun", "-n", str(ranks)] if ranks > 1 else []
        go_on = any((self.output / name).exists() for name in ("checkpoint.h5", "checkpoint.previous.h5"))
        what = ["--continue", self.output] if go_on else [self.deck, "-o", self.output]
        self.begun += not go_on
        self.continued += go_on
        command = [*launcher, self.carom, "run", *what, "--quiet", *arguments]
        return subprocess.Popen([str(part) for part in command], env=mpi_environment(), stdout=subprocess.DEVNULL,
                                stderr=subprocess.PIPE, text=True)

    def processes(self):
        """The processes of the command that run here."""
        found = []
        for process in pathlib.Path("/proc").glob("[0-9]*"):
            try:
                arguments = (process / "cmdline").read_bytes().split(b"\0")
            except OSError:  # it has just ended
                continue
            if str(self.output).encode() in arguments and arguments[0] == self.carom.encode():
                found.append(int(process.name))
        return found

    @staticmethod
    def kill(process, number):
        try:
            os.kill(process, number)
        except ProcessLookupError:  # it has ended
            pass

    def end(self, job, codes, most=TIME_LIMIT):
        """Waits for a process; its exit code must be one of these. Also kills the ranks that a killed mpirun leaves in MPI_Init, and an
        mpirun without ranks: if a rank was killed, Open MPI 4.1.4 with PMIx 4.2.2 may wait for a mutex in memory that it has freed."""
        until = alone = time.monotonic() + most
        late = False
        while True:
            try:
                error = job.communicate(timeout=None if late else min(1, most))[1].strip()
                break
            except subprocess.TimeoutExpired:
                now, left = time.monotonic(), self.processes()
                late = now > until
                alone = now + MPIRUN_EXTRA if left else min(alone, now + MPIRUN_EXTRA)
                if late or job.poll() == -signal.SIGKILL:
                    for process in left:
                        self.kill(process, signal.SIGKILL)
                if late or now > alone:
                    job.kill()
        for _ in range(1000):  # mpirun does not wait for processes that it kills
            if not self.processes():
                break
            time.sleep(0.01)
        if late:
            raise Found(f"it does not end in {most:.0f} s; {len(left)} of its processes were left: {error}")
        if job.returncode not in codes:
            raise Found(f"exit code {job.returncode}: {error}")
        return job.returncode

    def disturb(self, ranks, seconds):
        """Starts a process, and may end it early."""
        how = self.dice.choice(["KILL", "KILL", "KILL", "USR2", "TERM", "INT", "HUP", "--max-wall"])
        if how == "--max-wall":
            self.end(self.start(ranks, ["--max-wall", f"{seconds:.3f}"]), (0, 75))
            return
        if ranks > 1 and how in ("TERM", "INT", "HUP"):  # mpirun handles these signals itself
            how = "USR2"
        job = self.start(ranks, [])
        time.sleep(seconds)
        number = getattr(signal, "SIG" + how)
        at = [job.pid, *self.processes()] if how == "KILL" and ranks > 1 else [job.pid]
        self.kill(self.dice.choice(at), number)
        # A signal may come before the command, or mpirun, is ready for it, or after it; a killed rank has other exit codes.
        self.end(job, range(-64, 256) if how == "KILL" else (0, 75, -number, 128 + number))


def soak(carom, deck, seconds, where, ranks, dice):
    """Tests one deck that has an undisturbed run; returns what happened, in words. Raises Found."""
    file = where / "deck.toml"
    summary = read_summary(where / "undisturbed")
    method = deck["integrator"]["type"]
    energy = summary["energy"]
    most = max(energy["reference"], abs(energy["work"]))  # a flow may do a thousand times the work of the energy at the start
    error = energy["max_abs_error"] / (most or 1)
    if error > EXACT.get(method, float("inf")):
        raise Found(f"the energy is wrong by {error:.1e}")
    if method != "verlet" and summary["max_overlap"] > LARGEST_OVERLAP:
        raise Found(f"spheres overlap by {summary['max_overlap']:.1e}")

    run = Run(carom, file, where / "continued", dice)
    used = []
    for _ in range(dice.choice([1, 2, 3, 4])):
        used.append(dice.choice(ranks))
        run.disturb(used[-1], dice.uniform(0, 1.1) * seconds)
    used.append(dice.choice(ranks))
    run.end(run.start(used[-1], []), (0,))
    lines = compare(where / "undisturbed", where / "continued") + summary_differences(where / "undisturbed", where / "continued")
    if lines:
        raise Found("; ".join(lines))
    return f"ranks {'-'.join(map(str, used))}, begun {run.begun}, continued {run.continued}", run.continued


def draw(carom, dice, seconds, where, ranks):
    """A deck that has run, and its time [s]."""
    while True:
        shutil.rmtree(where, ignore_errors=True)
        where.mkdir(parents=True)
        deck = random_deck(dice, seconds)
        (where / "deck.toml").write_text(toml_text(deck))
        if subprocess.run([str(carom), "validate", str(where / "deck.toml")], capture_output=True).returncode != 0:
            continue
        undisturbed, start = Run(carom, where / "deck.toml", where / "undisturbed", dice), time.monotonic()
        try:  # bonds may break in a small box, steps be too long for a force
            undisturbed.end(undisturbed.start(dice.choice(ranks), []), (0,), most=20 * seconds + 10)
        except Found as problem:
            print(f"      {words(deck)}, not taken: {str(problem)[:150]!r}")
            continue
        return deck, time.monotonic() - start


# Jumps of the energy

def largest_jump(carom, file, method, where, seconds):
    """The largest relative |H − H of the row before| of a run with a row for each slab; None if it does not run."""
    shutil.rmtree(where, ignore_errors=True)
    deck = tomllib.loads(file.read_text())
    interval = deck.get("output", {}).get("thermo_interval", 1.0) if method == "free-flight" else deck["integrator"]["step"]
    sets = [f"integrator={{type=\"{method}\", step={interval}}}"] if method != deck["integrator"]["type"] else []
    sets += [f"output.thermo_interval={interval}", "output.frame_interval=0.0"]
    command = [carom, "run", file, "-o", where, "--quiet", "--max-wall", seconds, *(part for each in sets for part in ("--set", each))]
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    if done.returncode not in (0, 75):
        print(f"      {file} with {method}, not taken: {done.stderr.strip()[:150]!r}")
        return None
    energies = read_thermo(where)["total"]
    if len(energies) < 2:
        print(f"      {file} with {method}, not taken: no slab is done in {seconds:g} s")
        return None
    return np.abs(np.diff(energies)).max() / (read_summary(where)["energy"]["reference"] or 1)


def jumps(carom, decks, options):
    """The largest jump by method, in words."""
    where, most, runs = options.output.resolve() / "jump", {}, {}

    def measure(file, method, name):
        jump = largest_jump(carom, file, method, where, options.seconds)
        if jump is None:
            return
        runs[method] = runs.get(method, 0) + 1
        most[method] = max(most.get(method, (0, "")), (jump, name))
        print(f"{jump:9.1e}  {method:12} {name}", flush=True)

    for file in decks:
        free = tomllib.loads(file.read_text())["integrator"]["type"] == "free-flight"
        for method in ["free-flight"] if free else ["cdda", "edda"]:
            measure(file, method, file)
    dice, taken = random.Random(options.seed), 0
    while taken < (options.count if options.count < 10**9 else 0):
        deck = random_deck(dice, options.seconds)
        method = deck["integrator"]["type"]
        file = options.output.resolve() / "jump.toml"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(toml_text(deck))
        if method not in EXACT or subprocess.run([str(carom), "validate", str(file)], capture_output=True).returncode != 0:
            continue
        taken += 1
        measure(file, method, words(deck))
    for method, (jump, name) in most.items():
        print(f"{method}: the largest jump of {runs[method]} runs is {jump:.1e}, in {name}")


# Hard systems

def run_system(carom, method, number, options):
    """Runs one system with a method: the result, in a word and in words; (None, "") if the deck is refused."""
    where = options.output.resolve() / f"{number}-{method}"
    shutil.rmtree(where, ignore_errors=True)
    where.mkdir(parents=True)
    deck = random_system(random.Random(f"{options.seed} {number}"))
    if method != "edda":
        deck["integrator"] = {"type": method, "step": deck["integrator"]["step"]}
    if options.accuracy and method in ("cdda", "edda"):
        deck["integrator"]["accuracy"] = options.accuracy
        del deck["integrator"]["step"]
    (where / "deck.toml").write_text(toml_text(deck))
    command = [str(carom), "run", str(where / "deck.toml"), "-o", str(where / "run"), "--quiet"]
    limit = (int(options.patience), int(options.patience) + 5)
    done = subprocess.run(command, capture_output=True, text=True, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, limit))
    said = "\n".join(line for line in done.stderr.strip().splitlines() if ": warning: " not in line)
    if done.returncode in (2, 3):
        return "refused", said
    if done.returncode in (-signal.SIGXCPU, -signal.SIGKILL):
        return "slow", f"it takes more than {limit[0]} s"
    if done.returncode == 4 and len(said.splitlines()) == 1:
        return "error", said
    if done.returncode != 0:
        return "crash", f"exit code {done.returncode}: {said}"
    summary = read_summary(where / "run")
    energy, overlap = summary["energy"], summary["max_overlap"]
    rows = read_thermo(where / "run")
    scale = max(energy["reference"], (rows["kinetic"] + np.abs(rows["potential"])).max())
    error = max(energy["max_abs_error"], abs(energy["after_first_step"] - energy["initial"])) / (scale or 1)
    if overlap > ROUNDING or method in EXACT and not error <= ROUNDING:
        warned = overlap <= ROUNDING and any("rounding has added up" in warning for warning in summary["warnings"])
        return "warned" if warned else "wrong", f"the energy is off by {error:.1e}, spheres overlap by {overlap:.1e}"
    shutil.rmtree(where)
    return "ok", ""


def hard_systems(carom, options):
    """Runs them, a process for each core, and prints a table; returns the exit code."""
    methods, kinds = options.systems.split(","), ["ok", "error", "warned", "wrong", "slow", "crash", "refused"]
    numbers = range(options.count) if options.only is None else [options.only]
    tasks = [(method, number) for number in numbers for method in methods]
    became = {method: {kind: [] for kind in kinds} for method in methods}
    with concurrent.futures.ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        for (method, number), (kind, said) in zip(tasks, pool.map(lambda task: run_system(carom, *task, options), tasks)):
            became[method][kind].append(number)
            if kind != "ok":
                print(f"{number:4d}  {method:5} {kind:8} {said[:200]}", flush=True)
    bad = False
    print("method " + "".join(f"{kind:>9}" for kind in kinds))
    for method, found in became.items():
        print(f"{method:7}" + "".join(f"{len(found[kind]):9d}" for kind in kinds))
        most = MOST_ERRORS * (len(numbers) - len(found["refused"])) if method in EXACT else len(numbers)
        bad = bad or any(found[kind] for kind in ("wrong", "slow", "crash")) or len(found["error"]) > most
    for method, found in became.items():
        for kind in kinds[1:]:
            if found[kind]:
                print(f"seed {options.seed}, {method}, {kind}: {' '.join(map(str, found[kind]))}")
    return 1 if bad else 0


@one_line
def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=10**9, help="decks")
    parser.add_argument("--minutes", type=float, default=float("inf"))
    parser.add_argument("--only", type=int, help="this deck alone")
    parser.add_argument("--ranks", default="1,2,3,4", help="numbers of ranks to choose from")
    parser.add_argument("--seconds", type=float, default=0.4, help="about what a deck takes")
    parser.add_argument("--jumps", type=pathlib.Path, nargs="*", metavar="DECK", help="measure the largest jump of the energy in a slab")
    parser.add_argument("--systems", nargs="?", const="edda", metavar="METHODS", help="run hard systems by these methods; default: edda")
    parser.add_argument("--accuracy", type=float, help="hard systems: edda and cdda choose their steps")
    parser.add_argument("--patience", type=float, default=60, help="processor time that a hard system may take [s]")
    parser.add_argument("--carom", help="the command; default: $CAROM or the build of tools/run")
    parser.add_argument("-o", "--output", type=pathlib.Path, default=pathlib.Path("runs/soak"))
    options = parser.parse_args(arguments)
    carom, ranks = find_carom(options.carom), list(map(int, options.ranks.split(",")))
    if options.jumps is not None:
        jumps(carom, options.jumps, options)
        return 0
    if options.count == 10**9 and options.minutes == float("inf") and options.only is None:
        parser.error("say --count or --minutes")
    if options.systems:
        return hard_systems(carom, options)
    end, done, found, continued = time.monotonic() + 60 * options.minutes, 0, 0, 0
    for number in [options.only] if options.only is not None else range(options.count):
        if time.monotonic() > end:
            break
        where = options.output.resolve() / str(number)
        dice = random.Random(f"{options.seed} {number}")
        deck, seconds = draw(carom, dice, options.seconds, where, ranks)
        try:
            outcome, times = soak(carom, deck, seconds, where, ranks, dice)
            continued += times
            shutil.rmtree(where)
        except (Found, Error) as problem:
            outcome = f"FOUND in {where}: {problem}"
            found += 1
        done += 1
        print(f"{number:4d}  {words(deck)}: {outcome}", flush=True)
    print(f"{done} decks, continued {continued} times, {found} with something found")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
