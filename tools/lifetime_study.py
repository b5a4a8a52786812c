#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The lifetime of an isolated cluster with different methods: runs many starts until the first particle evaporates.

    tools/python tools/lifetime_study.py inputs/evaporating-cluster.toml -o runs/lifetimes
    tools/python tools/lifetime_study.py inputs/evaporating-cluster.toml --runs edda:0.02,psa:0.01,psa:0.005 --starts 10
    tools/python tools/lifetime_study.py inputs/evaporating-cluster.toml --energy -23 --runs edda:0.02,psa:0.005

--runs lists METHOD:STEP, or METHOD:STEP:STARTS for another number of starts. The method "soft" is velocity
Verlet with a steep Mie 50-49 core of depth 0.2 in place of the hard core, which is what a program without hard spheres would use.

A start has the positions of the deck and new random velocities, without momentum and angular momentum, scaled so that the energy is
exactly that of the deck (or --energy). Every unit of time the script looks whether the cluster has come apart: whether its particles
form two groups that are farther than 5 from each other. The mean lifetime is the total time of all starts over the number of
evaporations, its standard error that over the root of this number; a start that reaches --end-time counts with its time only.

lifetimes.csv has a row for each start. Starts that it contains already are not run again, so a study that was stopped can be continued, and
--starts can be raised. lifetimes.png shows the survival curves, and the mean lifetime against the processor time of 1000 units of time.
"""

import argparse
import csv
import multiprocessing
import os
import pathlib
import time

import numpy as np

try:
    import carom  # before the tools, which would import its sources without the compiled part
    carom.Simulation
except ImportError as missing:
    raise SystemExit("This study needs the built Python module: tools/python tools/lifetime_study.py DECK") from missing

from carom_files import one_line
from carom_plot import panels

RUNS = "edda:0.05,edda:0.02,edda:0.01,psa:0.02,psa:0.01,psa:0.005,psa:0.0025:30,psa:0.001:20,cva:0.01:24,mcva:0.01:24,soft:0.002:4"
COLUMNS = ["run", "start", "lifetime", "evaporated", "temperature", "energy_change", "collisions", "seconds"]
APART = 5.0    # two groups of particles farther apart than this do not come together again
MELTED = 10.0  # temperatures are averaged from this time on


class Evaporated(Exception):
    """Ends a run from its callback."""


def parse_arguments(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("deck", type=pathlib.Path)
    parser.add_argument("--runs", default=RUNS, help=f"default: {RUNS}")
    parser.add_argument("--starts", type=int, default=60, help="of each run that does not say how many; default: 60")
    parser.add_argument("--energy", type=float, help="of every start; default: the deck's")
    parser.add_argument("--end-time", type=float, default=6000.0, help="of a start that does not evaporate; default: 6000")
    parser.add_argument("--seed", type=int, default=20110901)
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="starts at a time")
    parser.add_argument("-o", "--output", type=pathlib.Path, default=pathlib.Path("runs/lifetimes"), help="directory")
    options = parser.parse_args(arguments)
    try:
        options.starts_of = {f"{method}:{float(step):g}": int(starts[0]) if starts else options.starts
                             for method, step, *starts in (run.split(":") for run in options.runs.split(","))}
    except ValueError:
        parser.error(f"--runs {options.runs}: give METHOD:STEP or METHOD:STEP:STARTS, separated by commas")
    return options


def simulation(deck, run):
    """The cluster of the deck with the method and step of a run."""
    method, step = run.split(":")
    if method != "soft":
        return carom.Simulation.from_deck(deck, set={"integrator.type": method, "integrator.step": float(step)})
    # Cores so small that they never meet: psa without collisions is velocity Verlet.
    sim = carom.Simulation.from_deck(deck, set={"integrator.type": "psa", "integrator.step": float(step),
                                                "particles.0.radius": 0.05})
    # Mie: 0.2 C ((1/r)^50 - (1/r)^49), from its minimum inwards, where it is zero.
    for exponent, sign in ((50, 1), (49, -1)):
        sim.add_force("inverse-power", epsilon=sign * 0.2 * 50 * (50 / 49) ** 49, sigma=1.0, exponent=exponent,
                      cutoff=50 / 49, cut="shifted")
    return sim


def random_velocities(position, kinetic, random):
    """Velocities of equal masses of 1 with this kinetic energy, without momentum and angular momentum."""
    x = position - position.mean(axis=0)
    v = random.normal(size=x.shape)
    v -= v.mean(axis=0)
    inertia = np.eye(3) * (x**2).sum() - x.T @ x
    v -= np.cross(np.linalg.solve(inertia, np.cross(x, v).sum(axis=0)), x)
    return v * np.sqrt(kinetic / (0.5 * (v**2).sum()))


def is_apart(position):
    """Whether the particles form groups that are farther than APART from each other."""
    near = np.linalg.norm(position[:, None] - position, axis=-1) < APART
    return not np.linalg.matrix_power(near.astype(float), len(position)).all()


def live(options, run, start):
    """Runs one start until its first evaporation; returns its row of the table."""
    sim = simulation(options.deck, run)
    energy = sim.energy if options.energy is None else options.energy
    kinetic = energy - sim.potential
    if kinetic <= 0:
        raise SystemExit(f"The start has no energy of {energy:g}: its potential energy is {sim.potential:g}.")
    sim.velocity = random_velocities(sim.position, kinetic, np.random.default_rng([options.seed, start]))
    temperatures = []

    def look(now):
        if is_apart(now.position):
            raise Evaporated
        if now.time > MELTED:
            temperatures.append(2 * now.kinetic / (3 * len(now) - 6))

    begin, evaporated = time.process_time(), False
    try:
        sim.run(time=options.end_time, every=1.0, callback=look, progress=False)
    except Evaporated:
        evaporated = True
    return {"run": run, "start": start, "lifetime": sim.time, "evaporated": int(evaporated),
            "temperature": f"{np.mean(temperatures):.5f}" if temperatures else "", "energy_change": f"{sim.energy - energy:.4g}",
            "collisions": sim.collisions, "seconds": f"{time.process_time() - begin:.3f}"}


def live_case(case):
    return live(*case)


class Lives:
    """The settings that all starts of one run share."""

    def __init__(self, rows):
        column = {name: np.array([float(row[name] or "nan") for row in rows]) for name in COLUMNS[2:]}
        self.times, self.events = column["lifetime"], int(column["evaporated"].sum())
        total = self.times.sum()
        self.mean = total / max(self.events, 1)
        self.error = self.mean / np.sqrt(max(self.events, 1))
        temperature = column["temperature"][np.isfinite(column["temperature"])]
        if len(temperature) == 0:  # all clusters evaporated while they melted
            temperature = np.array([np.nan])
        self.temperature, self.temperature_error = temperature.mean(), temperature.std() / np.sqrt(max(len(temperature) - 1, 1))
        self.heating = column["energy_change"].sum() / total
        self.cost = 1000 * column["seconds"].sum() / total

    def survival(self, end):
        """Times and the fraction of the starts that live longer, as steps to draw with where="post"."""
        deaths = np.sort(self.times)[:self.events]
        return np.append(deaths, end), np.append(1 - np.arange(1, self.events + 1) / len(self.times), 1 - self.events / len(self.times))


def read(file):
    """The rows of the table by run and start; empty if there is no table yet."""
    if not file.exists():
        return {}
    with open(file, newline="") as stream:
        return {(row["run"], int(row["start"])): row for row in csv.DictReader(stream)}


def draw(lives, options):
    """The survival with edda at every step, and with psa at steps from long (light) to short (dark); the mean lifetime against the cost."""
    colours = {"edda": "tab:blue", "psa": "tab:red", "cva": "tab:green", "mcva": "tab:olive"}  # not "soft": other programs are faster there
    of = lambda name: [run for run in lives if run.startswith(f"{name}:")]
    step = lambda run: run.split(":")[1]
    title = "An isolated cluster of 13 attractive hard spheres"
    with panels(options.output / "lifetimes.png",
                {"xlabel": "time", "ylabel": "fraction of the clusters that still live", "xscale": "log", "title": title},
                {"xlabel": "processor seconds of 1000 units of time", "ylabel": "mean lifetime", "yscale": "log",
                 "title": "Mean lifetime against cost"}) as (left, right):
        for k, run in enumerate(of("psa")):
            times, alive = lives[run].survival(options.end_time)
            shade = 0.4 + 0.6 * k / max(len(of("psa")) - 1, 1)
            left.step(np.append(1.0, times), np.append(1.0, alive), where="post", color=colours["psa"], alpha=shade, linewidth=1.2)
            height = 0.55 - 0.1 * k
            at = times[np.argmax(alive <= height)] if (alive <= height).any() else times[-1]
            left.text(at, height, f"psa {step(run)}" if k == 0 else step(run), color=colours["psa"], fontsize=9, ha="center", va="center",
                      bbox={"facecolor": "white", "edgecolor": "none", "pad": 1})
        for run in of("edda"):
            times, alive = lives[run].survival(options.end_time)
            left.step(np.append(1.0, times), np.append(1.0, alive), where="post", color=colours["edda"], linewidth=1.2)
        if of("edda"):
            mean, error = pooled(lives, of("edda"))
            left.text(options.end_time, 0.75, "edda\n" + ", ".join(map(step, of("edda"))), color=colours["edda"], fontsize=9, ha="right")
            right.axhspan(mean - error, mean + error, color=colours["edda"], alpha=0.2)
            right.text(0.98, mean + 1.3 * error, f"edda, all steps: {mean:.0f} ± {error:.0f}", fontsize=9,
                       color=colours["edda"], ha="right", va="bottom", transform=right.get_yaxis_transform())
        for name, colour in colours.items():
            each = [lives[run] for run in of(name)]
            if not each:
                continue
            right.errorbar([one.cost for one in each], [one.mean for one in each], [one.error for one in each], color=colour, marker="o",
                           linestyle="-" if name == "psa" else "", linewidth=0.8, capsize=3)
            for run, one in zip(of(name), each):
                if name != "edda":
                    right.annotate(f"{name} {step(run)}", (one.cost, one.mean), xytext=(-7, -16 if name == "cva" else 4), fontsize=9,
                                   textcoords="offset points", ha="right", color=colour)
        right.set_xscale("log")
        right.set_xlim(left=0.6 * right.get_xlim()[0])  # for the first label
        right.set_xticks([0.5, 1, 2, 5], ["0.5", "1", "2", "5"], minor=False)
        right.minorticks_off()


def pooled(lives, runs):
    """The mean lifetime of all starts of some runs, and its standard error."""
    events = sum(lives[run].events for run in runs)
    mean = sum(lives[run].times.sum() for run in runs) / max(events, 1)
    return mean, mean / np.sqrt(max(events, 1))


@one_line
def main(arguments=None):
    options = parse_arguments(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    table = options.output / "lifetimes.csv"
    rows = read(table)
    # The first start of every run, then the second, so that a slow period of the machine affects all runs.
    cases = [(options, run, start) for start in range(max(options.starts_of.values()))
             for run, starts in options.starts_of.items() if start < starts and (run, start) not in rows]
    with open(table, "a", newline="") as stream, multiprocessing.Pool(options.jobs) as pool:
        writer = csv.DictWriter(stream, COLUMNS)
        if not rows:
            writer.writeheader()
        for row in pool.imap_unordered(live_case, cases):
            writer.writerow(row)
            stream.flush()
    rows = read(table)
    lives = {run: Lives([rows[run, start] for start in range(starts)]) for run, starts in options.starts_of.items()}
    print("run            starts  evaporated  lifetime         temperature       dE/dt     s per 1000 t")
    for run, one in lives.items():
        print(f"{run:14} {len(one.times):6d}  {one.events:10d}  {one.mean:6.0f} ± {one.error:<6.0f}  "
              f"{one.temperature:.4f} ± {one.temperature_error:.4f}  {one.heating:8.1e}  {one.cost:8.2f}")
    if edda := [run for run in lives if run.startswith("edda:")]:
        mean, error = pooled(lives, edda)
        print(f"edda, all steps: {mean:.0f} ± {error:.0f}")
    draw(lives, options)
    print(f"Results: {table}, {options.output / 'lifetimes.png'}")


if __name__ == "__main__":
    main()
