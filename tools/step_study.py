#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""What a step costs and what it gets wrong: a table of methods with fixed steps and with steps of their own.

    tools/step_study.py inputs/five-springs.toml --end-time 6 --steps 0.1,0.05 --accuracies 1e-3,1e-4 --reference cdda:order=4:step=0.001
    tools/step_study.py inputs/yukawa-fluid.toml --set particles.count=256 --end-time 50 --methods psa,edda --steps 0.02 \\
        --accuracies 1e-4 --means potential,pressure --set output.start=equilibrated --set output.thermo_interval=0.05
    tools/step_study.py dimers.toml --end-time 100 --steps 0.1 --accuracies 1e-4 --bonds 2 --set output.frame_interval=0.5

Each method runs with each of --steps, and the methods that choose their own steps (cdda, edda) also with each of --accuracies. The cost
is the number of force passes (computations of all forces); unlike a time, it is the same on every machine. The energy error is
the largest |H - H1| / E_ref, or "rounding"; the position error is the largest difference of a coordinate from the
run of --reference at the end time. --means names entries of `means` of summary.json, which are shown with one standard error. --bonds N
shows the mean distance of neighbours in chains of N particles in order of their ids, over all frames but the first one, with the
standard error of a mean over independent chains.

The table is printed and written to steps.csv in the output directory. Runs that fail are reported and left out.
"""

import math
import pathlib
import sys
import tempfile

import numpy as np

from carom_files import RunFailed, Trajectory, one_line
from studies import parse, read_deck, relative_error, run_deck, study_parser, variant, write_table

ADAPTING = ("cdda", "edda")
ROUNDING = 1e-11  # relative to E_ref


def parse_arguments(arguments=None):
    parser = study_parser(__doc__, "psa,cva,cdda,edda")
    parser.add_argument("--accuracies", default="", help="values of integrator.accuracy for cdda and edda")
    parser.add_argument("--means", default="", help="entries of `means` of summary.json to show")
    parser.add_argument("--reference", help="a method with its keys, such as cdda:order=4:step=0.001, whose positions count as exact")
    parser.add_argument("--bonds", type=int, help="number of particles of a chain whose mean bond length is shown")
    options = parse(parser, arguments, "step-study")
    options.accuracies = sorted((float(accuracy) for accuracy in options.accuracies.split(",") if accuracy), reverse=True)
    options.means = [name for name in options.means.split(",") if name]
    if options.accuracies and options.accuracies[-1] <= 0:
        parser.error("every accuracy must be positive")
    if options.bonds is not None and options.bonds < 2:
        parser.error("a chain with bonds has at least 2 particles")
    return options


def cases(options):
    """(method with its keys, step or None, what the table calls it) of each run."""
    for method in options.methods:
        yield from ((method, step, f"step {step:g}") for step in options.steps)
        if method.split(":")[0] in ADAPTING:
            yield from ((f"{method}:accuracy={accuracy!r}", None, f"accuracy {accuracy:.0e}") for accuracy in options.accuracies)


def bond_length(trajectory, particles):
    """The mean distance of neighbours in chains of this many particles, and its standard error over the chains."""
    x = np.array([trajectory.unwrapped(frame) for frame in range(1, len(trajectory))])
    chains = x.reshape(len(x), -1, particles, x.shape[-1])
    of_chain = np.linalg.norm(np.diff(chains, axis=2), axis=-1).mean(axis=(0, 2))
    return of_chain.mean(), of_chain.std(ddof=1) / math.sqrt(len(of_chain)) if len(of_chain) > 1 else None


def run_once(options, deck, method, step):
    """Summary, last unwrapped positions and, with --bonds, the bond length and its error."""
    with tempfile.TemporaryDirectory() as directory:
        run = pathlib.Path(directory) / "run"
        plan = {"end_time": options.end_time} if options.end_time else deck["run"]
        summary = run_deck(options, variant(deck, method, step, plan), f"{run}.toml", run)
        with Trajectory(run) as trajectory:
            return summary, trajectory.unwrapped(-1), bond_length(trajectory, options.bonds) if options.bonds else None


def with_error(mean, error):
    """A mean and its standard error, both to the second digit of the error."""
    if error is None or not error > 0:
        return f"{mean:.4g} +- ?"
    digits = max(0, 1 - math.floor(math.log10(error)))
    return f"{mean:.{digits}f} +- {error:.{digits}f}"


def measure(options, deck, method, step, named, exact):
    """The row of the table; None if the run fails."""
    try:
        summary, positions, bond = run_once(options, deck, method, step)
    except RunFailed as failure:
        print(f"{method}, {named}: {failure}", file=sys.stderr)
        return None
    energy = relative_error(summary)
    row = {"method": method.split(":accuracy")[0], "step or accuracy": named, "steps": summary["steps"],
           "force passes": round(summary["force_passes"]), "energy error": "rounding" if energy < ROUNDING else f"{energy:.1e}"}
    if exact is not None:
        row["position error"] = f"{np.abs(positions - exact).max():.1e}"
    for name in options.means:
        if name not in summary["means"]:
            raise SystemExit(f"There is no mean {name}, only {', '.join(summary['means'])}.")
        row[name] = with_error(summary["means"][name]["mean"], summary["means"][name]["standard_error"])
    if bond:
        row["bond length"] = with_error(*bond)
    return row


@one_line
def main(arguments=None):
    options = parse_arguments(arguments)
    deck, exact, rows = read_deck(options), None, []
    options.output.mkdir(parents=True, exist_ok=True)
    if options.reference:
        exact = run_once(options, deck, options.reference, None)[1]
    for method, step, named in cases(options):
        if row := measure(options, deck, method, step, named, exact):
            if not rows:
                widths = {name: max(len(name), 18 if name in [*options.means, "bond length"] else 0) for name in row}
                widths |= {"method": 12, "step or accuracy": 16}
                print("  ".join(f"{name:>{widths[name]}}" for name in row))
            print("  ".join(f"{row[name]:>{widths[name]}}" for name in row), flush=True)
            rows.append(row)
    if rows:
        write_table(options.output / "steps.csv", list(rows[0]), rows)


if __name__ == "__main__":
    main()
