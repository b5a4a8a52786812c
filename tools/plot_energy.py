#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The energy error of runs over time, from their thermo.csv.

    tools/plot_energy.py runs/five-springs
    tools/plot_energy.py runs/cva runs/mcva runs/cdda --relative --logarithmic -o energy.png

The picture shows H - H1, with H1 the energy after the first step, and dashed, if the method has a shadow energy S_h, S_h minus its
first value. --relative divides by E_ref = max(|H1|, K1 + sum |V|) of summary.json.
"""

import argparse
import pathlib

import numpy as np

from carom_files import one_line, read_summary, read_thermo, reading
from carom_plot import picture


def energy_errors(directory, relative=False):
    """Time, H - H1, and S_h minus its first value (None if the method has no shadow energy)."""
    thermo, summary = read_thermo(directory), read_summary(directory)
    with reading(directory):
        energy, shadow = summary["energy"], thermo["shadow"]
        scale = energy["reference"] if relative else 1.0
        known = np.flatnonzero(np.isfinite(shadow))
        shadow_error = (shadow - shadow[known[0]]) / scale if len(known) else None
        return thermo["time"], (thermo["total"] - energy["after_first_step"]) / scale, shadow_error


def draw(directories, relative, logarithmic, file):
    size, what = (np.abs, "$|H - H_1|$") if logarithmic else (np.asarray, "$H - H_1$")
    unit = r" / $E_{\mathrm{ref}}$" if relative else " [energy]"
    with picture(file, xlabel="t [time]", ylabel=what + unit, title="Energy error over time", yscale="log" if logarithmic else "linear") as axes:
        for directory in directories:
            time, error, shadow_error = energy_errors(directory, relative)
            name = pathlib.Path(directory).name
            (line,) = axes.plot(time, size(error), label=name)
            if shadow_error is not None:
                axes.plot(time, size(shadow_error), "--", color=line.get_color(), alpha=0.7, label=f"{name}, of $S_h$")


@one_line
def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", nargs="+", type=pathlib.Path, help="directories of runs")
    parser.add_argument("--relative", action="store_true", help="divide by E_ref")
    parser.add_argument("--logarithmic", action="store_true", help="draw the absolute value on a logarithmic axis")
    parser.add_argument("-o", "--output", type=pathlib.Path, help="default: energy.png in the first run's directory")
    options = parser.parse_args(arguments)
    file = options.output or options.runs[0] / "energy.png"
    draw(options.runs, options.relative, options.logarithmic, file)
    print(f"Results: {file}")


if __name__ == "__main__":
    main()
