#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The transport coefficients that a run has averaged (output.transport_interval), against the lag, each with a panel of its own.

    tools/plot_transport.py runs/hard-sphere-fluid
    tools/plot_transport.py runs/hard-sphere-fluid/transport.csv --columns vacf,diffusion -o transport.png

A coefficient is read where its curve becomes flat; the grey line and its band are the value of summary.json, at the longest lag. The bars
are one standard error.
"""

import argparse
import pathlib

import numpy as np

from carom_files import one_line, read_summary, read_table, reading, split_errors
from carom_plot import panels

NAMES = {"vacf": "velocity autocorrelation", "diffusion": "diffusion coefficient", "shear_viscosity": "shear viscosity",
         "thermal_conductivity": "thermal conductivity", "electrical_conductivity": "electrical conductivity"}


@one_line
def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=pathlib.Path, help="directory of a run, or its transport.csv")
    parser.add_argument("--columns", help="some columns, as vacf,diffusion; default: all")
    parser.add_argument("-o", "--output", type=pathlib.Path, help="default: transport.png in the run's directory")
    options = parser.parse_args(arguments)
    table = options.run / "transport.csv" if options.run.is_dir() else options.run
    curves, errors = split_errors(read_table(table))
    with reading(table):
        lag = curves.pop("time")
    names = options.columns.split(",") if options.columns else list(curves)
    if unknown := [name for name in names if name not in curves]:
        raise SystemExit(f"There is no {unknown[0]} in {table}, only {', '.join(curves)}.")
    values = read_summary(table.parent).get("transport", {}) if (table.parent / "summary.json").exists() else {}
    file = options.output or table.with_suffix(".png")
    with panels(file, *({"xlabel": "lag [time]", "title": NAMES.get(name, name)} for name in names)) as row:
        for axes, name in zip(row, names):
            axes.errorbar(lag, curves[name], errors.get(name, np.nan), fmt=".-", markersize=3, linewidth=0.8)
            if name in values:
                mean, error = values[name]["mean"], values[name]["standard_error"] or 0.0
                axes.axhline(mean, color="grey", linewidth=0.8)
                axes.axhspan(mean - error, mean + error, color="grey", alpha=0.2)
    print(f"Results: {file}")


if __name__ == "__main__":
    main()
