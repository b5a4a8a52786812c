#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The costs of accuracy and of system size: time and force passes of the methods.

    tools/cost_study.py inputs/five-springs.toml --end-time 6 --steps 0.1,0.03,0.01,0.003,0.001
    tools/cost_study.py inputs/spring-lattice.toml --counts 64,256,1024,4096 --methods cva,cdda,edda --end-time 1
    tools/cost_study.py inputs/yukawa-fluid.toml --set particles.count=256 --end-time 0.5 --steps 0.02,0.01,0.005

Without --counts, the figure shows two errors against the time of the run: that of the energy (the largest |H - H1| / E_ref until
the end time), and that of the positions at the end time (the largest difference of a coordinate from --reference, which runs at a
fifth of the smallest step). With --counts, it shows the time and the force passes of a step against the number of particles of
the only species of the deck, at the largest of --steps.

Times are processor times of the loop of a run, including its measurements. Neither the clock of the loop nor the processor time of
the command can be less, so the script takes the smaller one of them, and the smallest of --repeats runs (of fewer if they take
long); bars extend to the largest one. The table is printed and, like the figure, written to the output directory. Runs that
fail are reported and left out.
"""

import pathlib
import sys
import tempfile

import numpy as np

from carom_files import RunFailed, Trajectory, one_line
from carom_plot import panels
from studies import (parse, processor_seconds, read_deck, relative_error, run_deck, study_parser, variant, with_markers,
                     write_table)

COLUMNS = ["method", "particles", "step", "steps", "collisions", "passes_per_step", "seconds", "seconds_most", "seconds_per_step",
           "energy_error", "position_error"]
LONGEST_REPEATED = 20.0  # [s] longer runs are not repeated


def parse_arguments(arguments=None):
    parser = study_parser(__doc__, "psa,cva,mcva,cdda,edda")
    parser.set_defaults(end_time=6.0)
    parser.add_argument("--counts", help="numbers of particles to compare the cost of a step at")
    parser.add_argument("--reference", default="cdda:order=4", help="method with positions taken for exact, or none")
    parser.add_argument("--repeats", type=int, default=3)
    options = parse(parser, arguments, "cost-study")
    options.counts = [int(count) for count in options.counts.split(",")] if options.counts else []
    if options.repeats < 1 or min(options.counts, default=1) <= 0:
        parser.error("--repeats must be at least 1, every count positive")
    return options


def run_once(options, deck, method, step, overrides=()):
    """Summary, last unwrapped positions and seconds of one run."""
    plan, before = {"end_time": options.end_time}, processor_seconds()
    with tempfile.TemporaryDirectory() as directory:
        run = pathlib.Path(directory) / "run"
        summary = run_deck(options, variant(deck, method, step, plan), f"{run}.toml", run, overrides)
        with Trajectory(run) as trajectory:
            return summary, trajectory.unwrapped(-1), min(summary["wall_seconds"], processor_seconds() - before)


def measure(options, deck, method, step, exact=None, overrides=()):
    """The method's row of the table; None if it fails."""
    times = []
    try:
        while len(times) < options.repeats and sum(times) < LONGEST_REPEATED:
            summary, positions, seconds = run_once(options, deck, method, step, overrides)
            times.append(seconds)
    except RunFailed as failure:
        print(f"{method}, step {step:g}: {failure}", file=sys.stderr)
        return None
    row = {"method": method, "particles": summary["particles"], "step": step, "steps": summary["steps"],
           "collisions": summary["events"]["sphere_sphere"], "seconds": min(times), "seconds_most": max(times),
           "passes_per_step": summary["force_passes"] / summary["steps"], "seconds_per_step": min(times) / summary["steps"],
           "energy_error": relative_error(summary),
           "position_error": np.nan if exact is None else np.abs(positions - exact).max()}
    print("{method:14} {particles:6} {step:8g} {seconds:10.4f} {seconds_per_step:10.2e} {passes_per_step:8.1f} "
          "{energy_error:9.1e} {position_error:9.1e}".format(**row), flush=True)
    return row


def draw(rows, x, columns, labels, file):
    with panels(file, *labels) as row:
        for axes, column in zip(row, columns):
            for method, marker in with_markers(list(dict.fromkeys(entry["method"] for entry in rows))):
                mine = [entry for entry in rows if entry["method"] == method]
                # For each time, the difference to the slowest run.
                late = {"seconds": [[0 for _ in mine], [entry["seconds_most"] - entry["seconds"] for entry in mine]]}
                late["seconds_per_step"] = late["seconds"] / np.array([entry["steps"] for entry in mine])
                axes.errorbar([entry[x] for entry in mine], [entry[column] for entry in mine], late.get(column), late.get(x),
                              marker=marker, capsize=2, label=method)
                axes.set(xscale="log", yscale="log")


@one_line
def main(arguments=None):
    options = parse_arguments(arguments)
    deck, steps = read_deck(options), options.steps
    options.output.mkdir(parents=True, exist_ok=True)
    print("method         particles    step    seconds  seconds/step  passes   energy  position")
    if options.counts:
        rows = [measure(options, deck, method, steps[0], overrides=[f"particles.count={count}"])
                for method in options.methods for count in options.counts]
    else:
        known = options.reference != "none"
        exact = run_once(options, deck, options.reference, steps[-1] / 5)[1] if known else None
        rows = [measure(options, deck, method, step, exact) for method in options.methods for step in steps]
    rows = [row for row in rows if row]
    name = "cost" if options.counts else "work"
    table, figure = options.output / f"{name}.csv", options.output / f"{name}.png"
    write_table(table, COLUMNS, rows)
    what = [f"cost of a step of {steps[0]:g} against size" if options.counts else f"error against cost, to t = {options.end_time:g}"]
    title = f"{deck.get('title', options.deck.stem)}\n{', '.join(what + options.set)}"
    if options.counts:
        draw(rows, "particles", ["passes_per_step", "seconds_per_step"],
             [{"title": title, "xlabel": "particles", "ylabel": what} for what in ("force passes per step", "processor time per step [s]")],
             figure)
    else:
        errors = {"energy_error": r"largest $|H - H_1|$ / $E_{\mathrm{ref}}$"}
        if known:
            errors["position_error"] = "largest error of a coordinate [length]"
        labels = [{"title": title, "xlabel": "processor time [s]", "ylabel": what} for what in errors.values()]
        draw(rows, "seconds", list(errors), labels, figure)
    print(f"Results: {table}, {figure}")


if __name__ == "__main__":
    main()
