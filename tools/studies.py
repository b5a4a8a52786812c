# SPDX-License-Identifier: BSD-3-Clause
"""Common functions of energy_study.py, cost_study.py, step_study.py and rank_study.py: options, a deck for each run, runs, tables.

    parser = study_parser(__doc__, "psa,cva,mcva,cdda")
    parser.add_argument(...)
    options = parse(parser, arguments, "energy-study")      # .deck, .methods, .steps, .set, .carom, .output
    summary = run_deck(options, variant(deck, "cdda:order=4", 0.01, {"steps": 100}), "deck.toml", "runs/here")
"""

import argparse
import csv
import pathlib
import resource
import tomllib

from carom_files import RunFailed, find_carom, reading, run_carom, toml_text


def study_parser(description, methods):
    """A parser of the options of every study; `methods` are the default methods to compare."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("deck", type=pathlib.Path)
    parser.add_argument("--methods", default=methods, help="names, each with keys: cdda:order=4")
    parser.add_argument("--steps", help="default: the deck's own")
    parser.add_argument("--end-time", type=float, help="of every run")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="changes the deck, as in carom run")
    parser.add_argument("--carom", help="the command; default: $CAROM or the build of tools/run")
    parser.add_argument("-o", "--output", type=pathlib.Path, help="directory; default: runs/<study>-<deck>")
    return parser


def parse(parser, arguments, study):
    """The options, with lists split and steps in descending order."""
    options = parser.parse_args(arguments)
    options.methods = options.methods.split(",")
    steps = options.steps.split(",") if options.steps else [read_deck(options)["integrator"]["step"]]
    options.steps = sorted(map(float, steps), reverse=True)
    options.output = options.output or pathlib.Path("runs") / f"{study}-{options.deck.stem}"
    if options.steps[-1] <= 0:
        parser.error("every step must be positive")
    return options


def read_deck(options):
    with reading(options.deck):
        text = options.deck.read_text()
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise SystemExit(f"{options.deck}: is not a deck: {error}") from error


def integrator_table(method, step):
    """The deck's [integrator] for a method given as name[:key=value…]; a step of None is left out."""
    name, *keys = method.split(":")
    table = {"type": name} | ({} if step is None else {"step": step})
    for key in keys:
        key, _, value = key.partition("=")
        try:
            table |= tomllib.loads(f"{key} = {value}")
        except tomllib.TOMLDecodeError:  # a word without quotes
            table[key] = value
    return table


def variant(deck, method, step, plan):
    """The deck with another method and [run], and output only at start and end."""
    return deck | {"integrator": integrator_table(method, step), "run": plan,
                   "output": {"frame_interval": 0.0, "thermo_interval": 0.0}}


def run_deck(options, deck, file, directory, overrides=(), **how):
    """Writes a deck to a file and runs it; returns the summary. Raises RunFailed if the run fails numerically; the study
    ends if the deck is wrong. `how`: launcher and environment, as for run_carom."""
    pathlib.Path(file).write_text(toml_text(deck))
    try:
        return run_carom(find_carom(options.carom), file, directory, [*options.set, *overrides], **how)
    except RunFailed as failure:
        if failure.code == 2:
            raise SystemExit(str(failure)) from failure
        raise


def processor_seconds():
    """The time of all commands run so far."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def relative_error(summary):
    """The largest |H − H₁| of a run over its E_ref."""
    return summary["energy"]["max_abs_error"] / summary["energy"]["reference"]


def write_table(file, columns, rows):
    with open(file, "w", newline="") as stream:
        writer = csv.DictWriter(stream, columns)
        writer.writeheader()
        writer.writerows(rows)


def with_markers(methods):
    """(method, marker of its curve) for each."""
    return zip(methods, "osD^vPX*" * len(methods))
