#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The structure factor S(k) that a run has averaged (output.sk_interval).

    tools/plot_sk.py runs/hard-sphere-fluid
    tools/plot_sk.py runs/primitive-electrolyte/sk.csv --columns S,S_charge -o sk.png

The bars are one standard error.
"""

import argparse
import pathlib

import numpy as np

from carom_files import one_line, read_table, reading, split_errors
from carom_plot import picture


@one_line
def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=pathlib.Path, help="directory of a run, or its sk.csv")
    parser.add_argument("--columns", help="some columns, as S,S_charge; default: all")
    parser.add_argument("-o", "--output", type=pathlib.Path, help="default: sk.png in the run's directory")
    options = parser.parse_args(arguments)
    table = options.run / "sk.csv" if options.run.is_dir() else options.run
    curves, errors = split_errors(read_table(table))
    with reading(table):
        k, _ = curves.pop("k"), curves.pop("waves")
    names = options.columns.split(",") if options.columns else list(curves)
    if unknown := [name for name in names if name not in curves]:
        raise SystemExit(f"There is no {unknown[0]} in {table}, only {', '.join(curves)}.")
    file = options.output or table.with_suffix(".png")
    with picture(file, xlabel="k [1/length]", ylabel="S(k)", title="Structure factor") as axes:
        for name in names:
            axes.errorbar(k, curves[name], errors.get(name, np.nan), fmt=".-", markersize=3, linewidth=0.8,
                          label=name if len(names) > 1 else None)
    print(f"Results: {file}")


if __name__ == "__main__":
    main()
