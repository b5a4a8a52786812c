#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Densities, temperatures, velocities and pressures across the box that a run has averaged (output.profile_interval), each with a panel
of its own.

    tools/plot_profile.py runs/electrolyte-walls
    tools/plot_profile.py runs/heat-flow/profile.csv --columns density,temperature -o profile.png

The band is one standard error.
"""

import argparse
import pathlib

from carom_files import one_line, read_table, reading, split_errors
from carom_plot import panels

QUANTITIES = ("density", "temperature", "velocity", "pressure")


@one_line
def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=pathlib.Path, help="directory of a run, or its profile.csv")
    parser.add_argument("--columns", help="some quantities or columns, as density,temperature_cation; default: all")
    parser.add_argument("-o", "--output", type=pathlib.Path, help="default: profile.png in the run's directory")
    options = parser.parse_args(arguments)
    table = options.run / "profile.csv" if options.run.is_dir() else options.run
    curves, errors = split_errors(read_table(table))
    with reading(table):
        x = curves.pop("x")
    wanted = options.columns.split(",") if options.columns else QUANTITIES
    shown = {quantity: [name for name in curves if name.split("_")[0] == quantity and {name, quantity} & set(wanted)] for quantity in QUANTITIES}
    if unknown := [name for name in options.columns and wanted or () if name not in (*curves, *QUANTITIES)]:
        raise SystemExit(f"There is no {unknown[0]} in {table}, only {', '.join(curves)}.")
    shown = {quantity: names for quantity, names in shown.items() if names}
    file = options.output or table.with_suffix(".png")
    with panels(file, *({"xlabel": "position across the box", "title": quantity} for quantity in shown)) as row:
        for axes, (quantity, names) in zip(row, shown.items()):
            for name in names:
                label = ("all" if name == quantity else name.removeprefix(quantity + "_")) if len(names) > 1 else None
                line, = axes.plot(x, curves[name], label=label)
                if name in errors:
                    axes.fill_between(x, curves[name] - errors[name], curves[name] + errors[name], color=line.get_color(), alpha=0.3)
    print(f"Results: {file}")


if __name__ == "__main__":
    main()
