#!/usr/bin/python3
"""What accuracy costs, and what size costs: time and force passes of the methods.

    tools/cost_study.py inputs/five-springs.toml --end-time 6 --steps 0.1,0.03,0.01,0.003,0.001
    tools/cost_study.py inputs/spring-lattice.toml --counts 64,256,1024,4096 --methods cva,cdda,acva,acdda --end-time 1

Without --counts: errors at the end time, of the energy (the largest |H - H1| / E_ref on the way) and of the positions (the
largest difference of a coordinate from --reference at a fifth of the smallest step), against the time the run took. With
--counts: time and force passes of a step against the number of particles of the deck's only species, at the first of
--steps or the deck's own. Times are those of the run's loop, measuring included, the shortest of --repeats runs one after the
other. The table goes to the terminal and, with the figure, to the output directory; runs that fail are reported and left out.
"""

import argparse
import csv
import pathlib
import sys
import tempfile
import tomllib

import numpy as np

from carom_files import RunFailed, Trajectory, find_carom, run_carom, toml_text
from carom_plot import panels
from energy_study import integrator_table

COLUMNS = ["method", "particles", "step", "steps", "collisions", "passes_per_step", "seconds", "seconds_per_step",
           "energy_error", "position_error"]


def parse_arguments(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("deck", type=pathlib.Path)
    parser.add_argument("--methods", default="psa,cva,mcva,cdda,acva,acdda", help="names, each with keys: cdda:order=4")
    parser.add_argument("--steps", help="default: the deck's own")
    parser.add_argument("--counts", help="numbers of particles to compare the cost of a step at")
    parser.add_argument("--end-time", type=float, default=6.0)
    parser.add_argument("--reference", default="cdda:order=4", help="the method whose positions are taken for exact")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--carom", help="the command; default: $CAROM or the build of tools/run")
    parser.add_argument("-o", "--output", type=pathlib.Path, help="directory; default: runs/cost-study-<deck>")
    options = parser.parse_args(arguments)
    options.methods = options.methods.split(",")
    options.counts = [int(count) for count in options.counts.split(",")] if options.counts else []
    options.steps = [float(step) for step in options.steps.split(",")] if options.steps else []
    options.output = options.output or pathlib.Path("runs") / f"cost-study-{options.deck.stem}"
    if options.repeats < 1 or min(options.steps + options.counts, default=1) <= 0:
        parser.error("--repeats must be at least 1, every step and count positive")
    return options


def run_once(carom, deck, method, step, end_time):
    """Summary and last unwrapped positions of one run."""
    deck = deck | {"integrator": integrator_table(method, step), "run": {"end_time": end_time},
                   "output": {"frame_interval": 0.0, "thermo_interval": 0.0}}
    with tempfile.TemporaryDirectory() as directory:
        file = pathlib.Path(directory) / "deck.toml"
        file.write_text(toml_text(deck))
        summary = run_carom(carom, file, pathlib.Path(directory) / "run")
        with Trajectory(pathlib.Path(directory) / "run") as trajectory:
            return summary, trajectory.unwrapped(-1)


def measure(options, carom, deck, method, step, exact=None):
    """The method's row of the table; None where it fails."""
    try:
        runs = [run_once(carom, deck, method, step, options.end_time) for _ in range(options.repeats)]
    except RunFailed as failure:
        if failure.code == 2:  # not a numerical failure: the question was wrong
            raise SystemExit(str(failure)) from failure
        print(f"{method}, step {step:g}: {failure}", file=sys.stderr)
        return None
    summary, positions = runs[0]
    seconds = min(run["wall_seconds"] for run, _ in runs)
    row = {"method": method, "particles": summary["particles"], "step": step, "steps": summary["steps"],
           "collisions": summary["events"]["sphere_sphere"], "seconds": seconds,
           "passes_per_step": summary["force_passes"] / summary["steps"], "seconds_per_step": seconds / summary["steps"],
           "energy_error": summary["energy"]["max_abs_error"] / summary["energy"]["reference"],
           "position_error": np.nan if exact is None else np.abs(positions - exact).max()}
    print("{method:14} {particles:6} {step:8g} {seconds:10.4f} {seconds_per_step:10.2e} {passes_per_step:8.1f} "
          "{energy_error:9.1e} {position_error:9.1e}".format(**row), flush=True)
    return row


def resized(deck, count):
    """The deck with so many particles."""
    if len(deck["particles"]) != 1 or "count" not in deck["particles"][0]:
        raise SystemExit("--counts needs a deck with one species given by count.")
    return deck | {"particles": [deck["particles"][0] | {"count": count}]}


def draw(rows, x, columns, labels, file):
    with panels(file, *labels) as row:
        for axes, column in zip(row, columns):
            for method, marker in zip(dict.fromkeys(entry["method"] for entry in rows), "osD^vPX*" * len(rows)):
                mine = [entry for entry in rows if entry["method"] == method]
                axes.loglog([entry[x] for entry in mine], [entry[column] for entry in mine], marker=marker, label=method)


def main(arguments=None):
    options = parse_arguments(arguments)
    carom = find_carom(options.carom)
    deck = tomllib.loads(options.deck.read_text())
    steps = options.steps or [deck["integrator"]["step"]]
    options.output.mkdir(parents=True, exist_ok=True)
    print("method         particles    step    seconds  seconds/step  passes   energy  position")
    if options.counts:
        rows = [measure(options, carom, resized(deck, count), method, steps[0])
                for method in options.methods for count in options.counts]
    else:
        _, exact = run_once(carom, deck, options.reference, min(steps) / 5, options.end_time)
        rows = [measure(options, carom, deck, method, step, exact) for method in options.methods for step in steps]
    rows = [row for row in rows if row]
    name = "cost" if options.counts else "work"
    table, figure = options.output / f"{name}.csv", options.output / f"{name}.png"
    with open(table, "w", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS)
        writer.writeheader()
        writer.writerows(rows)
    title = deck.get("title", options.deck.stem)
    if options.counts:
        title += f"\nstep {steps[0]:g}"
        draw(rows, "particles", ["passes_per_step", "seconds_per_step"],
             [{"title": title, "xlabel": "particles", "ylabel": what} for what in ("force passes a step", "seconds a step")],
             figure)
    else:
        title += f"\nto t = {options.end_time:g}"
        draw(rows, "seconds", ["energy_error", "position_error"],
             [{"title": title, "xlabel": "seconds", "ylabel": what}
              for what in (r"largest $|H - H_1|$ / $E_{\mathrm{ref}}$", "largest error of a coordinate")], figure)
    print(f"Results: {table}, {figure}")


if __name__ == "__main__":
    main()
