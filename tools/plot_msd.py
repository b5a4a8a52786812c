#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The mean squared displacement of a trajectory, and the diffusion coefficient from its slope.

    tools/plot_msd.py runs/hard-sphere-fluid
    tools/plot_msd.py runs/hard-discs --fit 5,20 -o msd.png
    tools/plot_msd.py runs/hard-discs/msd.csv --dimension 2   # averages of the run itself (output.msd_interval)

The average is over all particles and all time origins; displacements are continuous across periodic boundaries. The frames must be
at equal distances in time. D = slope / (2 d) is fitted to the lags of --fit, by default from a twentieth to an eighth of the length
of the run. Each lag is weighted by its error msd sqrt(2 / (d n)), where n is the number of particles times the number of successive
windows of this lag in the run.

The error of D (one standard deviation) comes from four parts of the run, each fitted separately. An msd.csv has no parts; the error is
then the relative error of the msd at the first lag of the fit, as for independent particles. In a fluid, where neighbours move
together, the true error is about twice as large. The error bars of the picture are also those of independent particles. If velocities
stay correlated for a long time, the slope still rises with the lag: try other values of --fit.
The script writes a CSV with lag and msd beside the picture, by default msd-frames.csv.
(Allen, Tildesley, Computer Simulation of Liquids, 2nd ed., section 2.7.)
"""

import argparse
import pathlib

import numpy as np

from carom_files import TRAJECTORY, Trajectory, one_line, read_table, reading, split_errors
from carom_plot import picture

FROM, TO = 20, 8  # the fit goes from this part of the length of the run to that
BLOCKS = 4        # parts of the run, for the error


def regular_frames(times):
    """The number of frames at equal intervals, from the first on: the last frame of a run may come early."""
    if len(times) < 3:
        return len(times)
    gaps = np.diff(times)
    odd = np.flatnonzero(np.abs(gaps - gaps[0]) > 1e-6 * gaps[0])
    return odd[0] + 1 if len(odd) else len(times)


def sheared(trajectory):
    """Whether a flow carries the particles along x: only the displacements across it diffuse."""
    return any(trajectory.tilt(frame) != 0 for frame in range(len(trajectory)))


def mean_squared_displacement(trajectory):
    """Lag times up to half the length of the trajectory, how many windows of each follow one another, the mean squared
    displacement [lags], in a sheared box across the flow, and that of the origins in each of so many parts of the run [parts, lags]."""
    frames = regular_frames(trajectory.time)
    if frames < 3:
        raise SystemExit("There are not enough frames at equal times: set output.frame_interval to a multiple of the step.")
    if frames < len(trajectory) - 1:
        print(f"Using the first {frames} of {len(trajectory)} frames: the others don't come at equal times.")
    x = np.stack([trajectory.unwrapped(frame) for frame in range(frames)])[:, :, int(sheared(trajectory)):]
    # Up to 100 lags, at equal distances or, for long trajectories, at equal ratios.
    lags = np.unique(np.geomspace(1, frames // 2, 100).astype(int)) if frames > 200 else np.arange(1, frames // 2 + 1)
    of_origins = [np.mean(np.sum((x[lag:] - x[:-lag]) ** 2, axis=2), axis=1) for lag in lags]
    starts = frames * np.arange(BLOCKS + 1) // BLOCKS
    of_blocks = np.array([[msd[first:behind].mean() if len(msd) > first else np.nan for msd in of_origins]
                          for first, behind in zip(starts, starts[1:]) if behind > first])
    return (lags * (trajectory.time[1] - trajectory.time[0]), (frames - 1) // lags,
            np.array([msd.mean() for msd in of_origins]), of_blocks)


def relative_errors(windows, particles, dimension):
    """The error of a mean squared displacement whose components are Gaussian."""
    return np.sqrt(2 / (dimension * particles * windows))


def fitted(lag, windows, msd, between=None):
    """The lags of the fit."""
    length = np.max(lag * windows)
    low, high = between or (length / FROM, length / TO)
    return (lag >= low * (1 - 1e-9)) & (lag <= high * (1 + 1e-9)) & (msd > 0)


def diffusion_coefficient(lag, windows, msd, dimension, between=None):
    """D of a line through the lags of the fit, weighted by their errors."""
    use = fitted(lag, windows, msd, between)
    if use.sum() < 2:
        return np.nan
    return np.polyfit(lag[use], msd[use], 1, w=np.sqrt(windows[use]) / msd[use])[0] / (2 * dimension)


def error_of_blocks(lag, windows, of_blocks, dimension, between=None):
    """The standard error of D from parts of the run; NaN for fewer than two."""
    each = [diffusion_coefficient(lag, windows, msd, dimension, between) for msd in of_blocks]
    each = [value for value in each if np.isfinite(value)]
    return np.std(each, ddof=1) / np.sqrt(len(each)) if len(each) > 1 else np.nan


def particle_numbers(directory):
    """How many particles the mean squared displacement of each column of a run's msd.csv is of; nothing without a trajectory."""
    if not (directory / TRAJECTORY).exists():
        return {}
    with Trajectory(directory) as trajectory:
        numbers = np.bincount(trajectory.species, minlength=len(trajectory.species_names))
        return {msd + name: n for msd in ("msd", "msd_across")
                for name, n in [("", len(trajectory.species)), *zip([f"_{name}" for name in trajectory.species_names], numbers)]}


@one_line
def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=pathlib.Path, help="directory of a run, its trajectory, or its msd.csv")
    parser.add_argument("--dimension", type=int, choices=(2, 3), default=3, help="of the run of an msd.csv")
    parser.add_argument("--fit", help="lags between which the slope is taken, as 5,20")
    parser.add_argument("-o", "--output", type=pathlib.Path, help="default: msd.png in the run's directory")
    options = parser.parse_args(arguments)
    between = [float(lag) for lag in options.fit.split(",")] if options.fit else None
    if between and len(between) != 2:
        parser.error("--fit takes two lags")
    if options.run.suffix == ".csv":
        columns, _ = split_errors(read_table(options.run))
        with reading(options.run):
            lag, windows = columns.pop("time"), columns.pop("origins")
        dimension, file, title, table = options.dimension - ("msd_across" in columns), options.output or options.run.with_suffix(".png"), "", None
        numbers = particle_numbers(options.run.parent)
        spread = {name: relative_errors(windows, numbers.get(name, np.nan), dimension) for name in columns}
        error = {}
        for name, msd in columns.items():
            value = diffusion_coefficient(lag, windows, msd, dimension, between)
            first = np.argmax(fitted(lag, windows, msd, between))
            error[name] = value * spread[name][first]
    else:
        with Trajectory(options.run) as trajectory:
            lag, windows, msd, of_blocks = mean_squared_displacement(trajectory)
            across = sheared(trajectory)
            dimension, title, name = trajectory.dimension - across, trajectory.title, "msd_across" if across else "msd"
        columns = {name: msd}
        spread = {name: relative_errors(windows, len(trajectory.species), dimension)}
        error = {name: error_of_blocks(lag, windows, of_blocks, dimension, between)}
        file = options.output or (options.run if options.run.is_dir() else options.run.parent) / "msd.png"
        table = file.with_name(file.stem + "-frames.csv")
        np.savetxt(table, np.stack([lag, msd], axis=1), delimiter=",", header="lag,msd", comments="")
    results = {name: diffusion_text(diffusion_coefficient(lag, windows, msd, dimension, between), error[name])
               for name, msd in columns.items()}
    draw(file, lag, columns, spread, results, title)
    prefix = (lambda name: f"{name}: ") if table is None else (lambda name: "")
    print("".join(f"{prefix(name)}D = {text}\n" for name, text in results.items())
          + "Results: " + (f"{table}, " if table else "") + str(file))


def diffusion_text(value, error):
    return f"{value:.4g} ± {error:.1g}" if np.isfinite(error) else f"{value:.6g}"


def draw(file, lag, curves, spread, results, title=""):
    with picture(file, xlabel="lag [time]", ylabel="mean squared displacement [length$^2$]",
                 title=title or "Mean squared displacement", xscale="log", yscale="log") as axes:
        for name, msd in curves.items():
            bars = msd * spread[name] if np.isfinite(spread[name]).all() else None
            axes.errorbar(lag, msd, bars, fmt="o-", markersize=3, capsize=2, label=f"{name}: D = {results[name]} [length$^2$/time]")


if __name__ == "__main__":
    main()
