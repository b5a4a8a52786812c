#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The energy errors of methods against the step: runs the sweep and draws the thesis figure.

    tools/energy_study.py inputs/five-springs.toml --methods psa,cva,mcva,cdda --steps 0.3,0.1,0.03,0.01,0.003,0.001
    tools/energy_study.py inputs/nine-gravity.toml --methods cva,mcva:variant=restart,cdda:order=4
    tools/energy_study.py inputs/five-springs.toml --methods psa,cva --end-time 6 --starts 16 --steps 0.03,0.01,0.003,0.001

Every run makes 5000 steps (--count) or, for a clean order, goes to a fixed --end-time. Runs start from --starts perturbed copies of
the initial state of the deck (seeded; start 0 is the state itself). The figure shows the largest |H - H1|, where H1 is the energy
after the first step (in decks with contacts that dissipate, moving walls or baths, H + dissipated - work - heat), as a geometric
mean over the starts; the CSV also has it relative to E_ref = max(|H1|, K1 + sum |V|).

With a fixed end time, the order is fitted to the steps up to --fit-below. With a fixed number of steps, runs with longer steps last
longer; the legend then gives the growth of the error with the step, which exceeds the order if the error also grows with time.
Errors at the level of rounding have no order. Runs that fail are reported, kept as rows without an error, and left out of the
figure. The decks of all runs are written beside the CSV.
"""

import concurrent.futures
import os
import sys
import tempfile

import numpy as np

from carom_files import RunFailed, one_line
from carom_plot import picture
from studies import parse, read_deck, relative_error, run_deck, study_parser, variant, with_markers, write_table

ROUNDING = 1e-11  # relative to E_ref: smaller errors are rounding and have no order
COLUMNS = ["method", "step", "start", "max_abs_energy_error", "energy_reference", "relative_energy_error",
           "max_abs_shadow_energy_error", "max_overlap", "sphere_sphere", "sphere_wall", "steps", "passes_per_step",
           "wall_seconds", "status"]


def parse_arguments(arguments=None):
    parser = study_parser(__doc__, "psa,cva,mcva,cdda")
    parser.set_defaults(steps="0.3,0.1,0.03,0.01,0.003,0.001")
    parser.add_argument("--count", type=int, default=5000, help="steps a run, without --end-time")
    parser.add_argument("--starts", type=int, default=1, help="how many initial states to average over")
    parser.add_argument("--perturbation", type=float, default=0.01,
                        help="half-width of the uniform perturbation of each coordinate and velocity")
    parser.add_argument("--seed", type=int, default=20070101)
    parser.add_argument("--fit-below", type=float, default=0.03, help="largest step that enters the order")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="runs at a time")
    options = parse(parser, arguments, "energy-study")
    if options.starts < 1:
        parser.error("--starts must be at least 1")
    return options


def perturbed(deck, start, amplitude, seed):
    """A copy of the deck with every coordinate and velocity moved by up to `amplitude`; the deck itself for start 0."""
    if start == 0:
        return deck
    random = np.random.default_rng([seed, start])
    tables = []
    for table in deck["particles"]:
        if "position" not in table:
            raise SystemExit("Perturbed starts need a deck with explicit positions.")
        moved = dict(table)
        for key in ("position", "velocity"):
            values = np.array(table.get(key, np.zeros_like(table["position"], dtype=float)), dtype=float)
            moved[key] = (values + random.uniform(-amplitude, amplitude, values.shape)).tolist()
        tables.append(moved)
    return deck | {"particles": tables}


def run_one(options, deck, method, step, start):
    """Runs one method at one step from one start; returns its row of the CSV."""
    name = f"{method.replace(':', '-').replace('=', '-')}-{step:g}-{start:02d}"
    deck = variant(perturbed(deck, start, options.perturbation, options.seed), method, step,
                   {"end_time": options.end_time} if options.end_time else {"steps": options.count})
    row = dict.fromkeys(COLUMNS, "") | {"method": method, "step": step, "start": start}
    try:
        with tempfile.TemporaryDirectory() as directory:
            summary = run_deck(options, deck, options.output / "decks" / f"{name}.toml", directory)
    except RunFailed as failure:
        print(f"{name}: {failure}", file=sys.stderr)
        return row | {"status": f"failed ({failure.code})"}
    return row | {
        "max_abs_energy_error": summary["energy"]["max_abs_error"], "energy_reference": summary["energy"]["reference"],
        "relative_energy_error": relative_error(summary),
        "max_abs_shadow_energy_error": summary["shadow_energy"]["max_abs_error"],
        "max_overlap": summary["max_overlap"], "sphere_sphere": summary["events"]["sphere_sphere"],
        "sphere_wall": summary["events"]["sphere_wall"], "steps": summary["steps"],
        "passes_per_step": summary["force_passes"] / summary["steps"],
        "wall_seconds": summary["wall_seconds"], "status": summary["status"]}


def curve(rows, method, column="max_abs_energy_error"):
    """Steps, and the geometric means over the starts of an error, of one method's successful runs."""
    errors = {}
    for row in rows:
        if row["method"] == method and row[column] not in ("", None) and float(row[column]) > 0:
            errors.setdefault(float(row["step"]), []).append(float(row[column]))
    steps = np.array(sorted(errors))
    return steps, np.array([np.exp(np.mean(np.log(errors[step]))) for step in steps])


def spread(rows, method, column="max_abs_energy_error"):
    """The standard error of that mean over the starts, as a factor, at each step."""
    errors = {}
    for row in rows:
        if row["method"] == method and row[column] not in ("", None) and float(row[column]) > 0:
            errors.setdefault(float(row["step"]), []).append(np.log(float(row[column])))
    return np.exp([np.std(errors[step]) / np.sqrt(len(errors[step])) for step in sorted(errors)])


def fitted_order(steps, errors, below):
    """Slope of log error against log step over the steps not above `below`; NaN with fewer than two of them."""
    use = steps <= below * (1 + 1e-9)
    return np.polyfit(np.log(steps[use]), np.log(errors[use]), 1)[0] if use.sum() > 1 else np.nan


def describe(rows, method, options):
    """The method's line in the legend: its order, or its distance from rounding."""
    worst = max((float(row["relative_energy_error"]) for row in rows
                 if row["method"] == method and row["relative_energy_error"] != ""), default=np.nan)
    if worst < ROUNDING:
        return rf"{method}: ≤ {worst:.1e} $E_{{\mathrm{{ref}}}}$"
    order = fitted_order(*curve(rows, method), options.fit_below)
    # With a fixed number of steps the run is longer for larger steps, and its error larger: the slope is no order.
    return f"{method}: order {order:.2f}" if options.end_time and np.isfinite(order) else method


def draw(rows, options, deck, file):
    title = deck.get("title", options.deck.stem)
    driven = any(deck.get(table) for table in ("contact", "wall", "bath"))
    error = r"$|E - E_1|$, $E = H$ + dissipated − work − heat" if driven else r"$|H - H_1|$ [energy]"
    length = f"to t = {options.end_time:g}" if options.end_time else f"{options.count} steps"
    starts = f", {options.starts} starts" if options.starts > 1 else ""
    with picture(file, xlabel="step [time]", ylabel=f"largest {error}", title=f"{title}\n{length}{starts}") as axes:
        axes.at_ends = 0.65
        for method, marker in with_markers(options.methods):
            steps, errors = curve(rows, method)
            axes.loglog(steps, errors, marker=marker, label=describe(rows, method, options))
            if options.starts > 1:
                axes.fill_between(steps, *errors * spread(rows, method) ** [[-1], [1]], alpha=0.2)


@one_line
def main(arguments=None):
    options = parse_arguments(arguments)
    deck = read_deck(options)
    (options.output / "decks").mkdir(parents=True, exist_ok=True)
    cases = [(method, step, start) for method in options.methods for step in options.steps
             for start in range(options.starts)]
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        rows = list(pool.map(lambda case: run_one(options, deck, *case), cases))
    table, figure = options.output / "energy.csv", options.output / "energy.png"
    write_table(table, COLUMNS, rows)
    draw(rows, options, deck, figure)
    for method in options.methods:
        print(describe(rows, method, options).replace(r"$E_{\mathrm{ref}}$", "E_ref").replace("≤", "at most"))
    print(f"Results: {table}, {figure}")


if __name__ == "__main__":
    main()
