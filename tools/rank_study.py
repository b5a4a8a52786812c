#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The performance of many ranks: counts of runs with many ranks, and a model of the efficiency fitted to them.

    tools/rank_study.py
    tools/rank_study.py --ranks 8,64 --per-rank 500,2000 --collisions 20 --rate 1e6

The script measures free flight of a deck on these numbers of ranks: windows, rounds per window, events run twice at borders, events
redone, and the imbalance of the whole run, as in run.log. If there are more ranks than cores, run `. tools/mpi-env.sh` first. Spheres
start at random positions (--placement): a crystal would be cut between its layers, and ranks would get unequal shares until the box
is divided again.

It fits these formulas to the runs in which ranks have neighbours on all sides, with s = (spheres per rank)^(-1/D): events run twice,
(1 + h s)^D - 1, a shell around a cube; events redone, r s, a surface; rounds per window, a + b log2(spheres at all borders), a chain of
repairs that becomes longer by one with a certain probability. In the picture, hollow symbols are runs with fewer ranks, which are not
in the fit; bars are standard errors of the counts for independent events.

The model that follows: efficiency = work / (work (1 + twice + redone + imbalance) + messages), for one window of a rank.
The work is its collisions by --rate. The imbalance is that of independent events, sqrt(2 ln P / events), times
--imbalance. Messages: a window has rounds + 1 exchanges and rounds + 3 reductions; a reduction takes
log2 P times --latency, an exchange --latency and --overhead for each of 3^D - 1 neighbours. The model neglects the volume of data,
the bookkeeping of windows, and starts and ends of epochs and frames, at which ranks exchange all their data.
"""

import argparse
import pathlib
import re
import tempfile

import numpy as np

from carom_files import one_line
from carom_plot import panels
from studies import processor_seconds, read_deck, run_deck, write_table

COUNTS = re.compile(r"(\d+) windows, ([\d.]+) rounds each; events at borders run twice ([\d.]+)%, redone ([\d.]+)%, "
                    r"imbalance ([\d.]+)%")
COLUMNS = ["ranks", "per_rank", "particles", "windows", "events", "rounds", "twice", "redone", "redone_events",
           "imbalance"]
MODEL = ["ranks", "per_rank", "rounds", "twice", "redone", "imbalance", "messages", "efficiency"]
RATE_COLLISIONS = 1_000_000


def parse_arguments(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    default = pathlib.Path(__file__).resolve().parent.parent / "inputs" / "hard-sphere-fluid.toml"
    parser.add_argument("deck", type=pathlib.Path, nargs="?", default=default, help="default: inputs/hard-sphere-fluid.toml")
    parser.add_argument("--ranks", default="2,4,8,16,32,64", help="numbers of ranks, a rank each")
    parser.add_argument("--per-rank", default="500,2000,10000", help="spheres per rank")
    parser.add_argument("--most", type=int, default=130000, help="spheres of a run; larger ones are left out")
    parser.add_argument("--collisions", type=float, default=10, help="of a sphere in a run")
    parser.add_argument("--placement", default="random", help="of the spheres, instead of the deck's")
    parser.add_argument("--imbalance", type=float,
                        help="factor by which the imbalance exceeds that of independent events; default: fitted")
    parser.add_argument("--rate", type=float, help="collisions per second of one core; default: measured without ranks")
    parser.add_argument("--latency", type=float, default=5e-6, help="of a message [s], an assumption")
    parser.add_argument("--overhead", type=float, default=5e-7, help="of each further message of an exchange [s], likewise")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="changes the deck, as in carom run")
    parser.add_argument("--carom", help="the command; default: $CAROM or the build of tools/run")
    parser.add_argument("-o", "--output", type=pathlib.Path, help="directory; default: runs/rank-study-<deck>")
    options = parser.parse_args(arguments)
    options.output = options.output or pathlib.Path("runs") / f"rank-study-{options.deck.stem}"
    options.ranks = sorted(map(int, options.ranks.split(",")))
    options.per_rank = sorted(map(int, options.per_rank.split(",")))
    if options.ranks[0] < 2 or options.per_rank[0] < 8:
        parser.error("--ranks must be at least 2, --per-rank at least 8")
    return options


def counts_of(log):
    """The line about ranks in a run.log: windows, rounds a window, and the shares of events."""
    found = COUNTS.search(log)
    if not found:
        raise SystemExit("run.log has nothing about windows: is the deck one of free flight, and are there several ranks?")
    windows, rounds, *percent = found.groups()
    return {"windows": int(windows), "rounds": float(rounds)} | {
        name: float(value) / 100 for name, value in zip(("twice", "redone", "imbalance"), percent)}


def run(options, deck, particles, collisions, **how):
    """Summary, run.log and seconds of a run that writes only its end."""
    plan = {"end_time": 1e9, "collisions": int(collisions)}
    deck = deck | {"run": plan, "output": {"frame_interval": 0.0, "thermo_interval": 0.0}}
    before = processor_seconds()
    with tempfile.TemporaryDirectory() as directory:
        place = pathlib.Path(directory) / "run"
        summary = run_deck(options, deck, f"{place}.toml", place,
                           [f"particles.0.count={particles}", f"placement.type={options.placement}"], **how)
        return summary, (place / "run.log").read_text(), min(summary["wall_seconds"], processor_seconds() - before)


def measure(options, deck, ranks, per_rank):
    """A row of the table of counts."""
    particles = ranks * per_rank
    summary, log, _ = run(options, deck, particles, particles * options.collisions / 2,
                          launcher=["mpirun", "-n", str(ranks)])
    row = counts_of(log) | {"ranks": ranks, "per_rank": per_rank, "particles": particles}
    row["events"] = sum(summary["events"].values()) / row["windows"] / ranks
    row["redone_events"] = row["redone"] * row["events"]
    print("{ranks:7} {per_rank:10} {windows:8} {events:8.0f} {rounds:7.2f} {twice:8.1%} {redone:8.2%} "
          "{redone_events:8.2f} {imbalance:9.1%}".format(**row), flush=True)
    return row


def measured_rate(options, deck):
    """Collisions a second of one core, without ranks, and the number of spheres."""
    particles = options.per_rank[-1]
    summary, _, seconds = run(options, deck, particles, RATE_COLLISIONS)
    return summary["events"]["sphere_sphere"] / seconds, particles


def border(ranks, per_rank, dimension):
    """The logarithm of the approximate number of spheres at borders."""
    return np.log2(ranks * per_rank ** (1 - 1 / dimension))


def fit(rows, dimension, imbalance=None):
    """The inputs of the model from the counts."""
    inner = [row for row in rows if row["ranks"] >= 2**dimension]
    if len({border(row["ranks"], row["per_rank"], dimension) for row in inner}) < 2:
        raise SystemExit(f"The fit needs two runs of {2**dimension} or more ranks.")
    column = lambda name: np.array([row[name] for row in inner])
    s = column("per_rank") ** (-1 / dimension)
    b, a = np.polyfit(border(column("ranks"), column("per_rank"), dimension), column("rounds"), 1)
    if imbalance is None:
        factors = column("imbalance") * np.sqrt(column("events") * column("windows") / (2 * np.log(column("ranks"))))
        imbalance = np.mean(factors)
    return {"dimension": dimension, "h": np.mean(((1 + column("twice")) ** (1 / dimension) - 1) / s),
            "r": np.mean(column("redone") / s), "a": a, "b": b,
            "events": np.mean(column("events") / column("per_rank")), "imbalance": imbalance}


def modelled(fitted, options, ranks, per_rank):
    """A row of the table of efficiencies; messages are in units of the work."""
    dimension, s = fitted["dimension"], per_rank ** (-1 / fitted["dimension"])
    rounds = fitted["a"] + fitted["b"] * border(ranks, per_rank, dimension)
    twice, redone = (1 + fitted["h"] * s) ** dimension - 1, fitted["r"] * s
    events = fitted["events"] * per_rank
    imbalance = fitted["imbalance"] * np.sqrt(2 * np.log(ranks) / events)
    work = events / options.rate
    exchange = options.latency + options.overhead * min(3**dimension, ranks)
    messages = ((rounds + 1) * exchange + (rounds + 3) * np.log2(ranks) * options.latency) / work
    return {"ranks": ranks, "per_rank": per_rank, "rounds": rounds, "twice": twice, "redone": redone,
            "imbalance": imbalance, "messages": messages, "efficiency": 1 / (1 + twice + redone + imbalance + messages)}


def counting_error(row, name):
    """The standard error of a fraction of the events if they are independent."""
    return np.sqrt(row[name] / (row["events"] * row["windows"] * row["ranks"]))


def draw(rows, fitted, options, title, file):
    sizes = np.geomspace(min(row["per_rank"] for row in rows), 1e6)
    with panels(file, {"title": f"{title}\nevents at borders: measured, and the fit", "xlabel": "spheres per rank",
                       "ylabel": "share of the events", "xscale": "log", "yscale": "log"},
                {"title": f"{title}\nefficiency, modelled", "xlabel": "spheres per rank", "ylabel": "efficiency",
                 "xscale": "log"}) as (left, right):
        curves = [modelled(fitted, options, options.ranks[-1], size) for size in sizes]
        for name, colour, label in (("twice", "C0", "run twice"), ("redone", "C1", "redone")):
            for row in rows:
                full = row["ranks"] >= 2 ** fitted["dimension"]
                left.errorbar(row["per_rank"], row[name], counting_error(row, name), fmt="o", capsize=2, color=colour,
                              fillstyle="full" if full else "none")
            left.plot(sizes, [row[name] for row in curves], color=colour, label=label)
        for ranks in (64, 1000, 10000):
            curves = [modelled(fitted, options, ranks, size) for size in sizes]
            right.plot(sizes, [row["efficiency"] for row in curves], label=f"{ranks} ranks")


@one_line
def main(arguments=None):
    options = parse_arguments(arguments)
    deck = read_deck(options)
    options.output.mkdir(parents=True, exist_ok=True)
    print("Measured; events, and events redone, are of a rank in a window.")
    print("  ranks   per rank  windows   events  rounds    twice   redone   events imbalance")
    rows = [measure(options, deck, ranks, per_rank) for per_rank in options.per_rank for ranks in options.ranks
            if ranks * per_rank <= options.most]
    fitted = fit(rows, deck["system"]["dimension"], options.imbalance)
    how = "given"
    if options.rate is None:
        options.rate, particles = measured_rate(options, deck)
        how = f"measured with {particles} spheres"
    print("Fitted: h {h:.2f}, r {r:.3f}, rounds {a:.2f} + {b:.3f} log2(border), {events:.3f} events per sphere and window, "
          "imbalance {imbalance:.2f} of independent events".format(**fitted))
    print(f"One core: {options.rate:.3g} collisions/s ({how}). Assumed: {options.latency:.1e} s a message, "
          f"{options.overhead:.1e} s each further one")
    print("Modelled:\n  ranks   per rank  rounds    twice   redone imbalance messages efficiency")
    model = [modelled(fitted, options, ranks, per_rank) for per_rank in (10**4, 10**5, 10**6)
             for ranks in (64, 1000, 10000)]
    for row in model:
        print("{ranks:7} {per_rank:10} {rounds:7.2f} {twice:8.1%} {redone:8.2%} {imbalance:9.1%} {messages:8.1%} "
              "{efficiency:10.2f}".format(**row))
    table, prediction, figure = (options.output / name for name in ("ranks.csv", "model.csv", "ranks.png"))
    write_table(table, COLUMNS, rows)
    write_table(prediction, MODEL, model)
    draw(rows, fitted, options, deck.get("title", options.deck.stem), figure)
    print(f"Results: {table}, {prediction}, {figure}")


if __name__ == "__main__":
    main()
