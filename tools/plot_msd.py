#!/usr/bin/python3
"""The mean squared displacement of a trajectory, and the diffusion coefficient from its slope.

    tools/plot_msd.py runs/hard-sphere-fluid
    tools/plot_msd.py runs/hard-discs --fit 5,20 -o msd.png
    tools/plot_msd.py runs/hard-discs/msd.csv --dimension 2   # what the run itself has averaged (output.msd_interval)

Averaged over particles and over all time origins, with displacements followed through periodic boundaries. Needs frames
at equal times. D = slope / (2 d) over --fit (default: the later half of the lags); a CSV with lag, msd stands beside the picture,
msd-frames.csv by default.
(Allen, Tildesley, Computer Simulation of Liquids, 2nd ed., section 2.7.)
"""

import argparse
import pathlib

import numpy as np

from carom_files import Trajectory, read_table, reading
from carom_plot import picture


def regular_frames(times):
    """How many frames stand at equal intervals, from the first on: the last one of a run may come early."""
    if len(times) < 3:
        return len(times)
    gaps = np.diff(times)
    odd = np.flatnonzero(np.abs(gaps - gaps[0]) > 1e-6 * gaps[0])
    return odd[0] + 1 if len(odd) else len(times)


def mean_squared_displacement(trajectory):
    """Lag times and the mean squared displacement at each, up to half the length of the trajectory."""
    frames = regular_frames(trajectory.time)
    if frames < 3:
        raise SystemExit("There are not enough frames at equal times: set output.frame_interval to a multiple of the step.")
    if frames < len(trajectory) - 1:
        print(f"Using the first {frames} of {len(trajectory)} frames: the others don't come at equal times.")
    x = np.stack([trajectory.unwrapped(frame) for frame in range(frames)])
    # Up to 100 lags, at equal distances or, for long trajectories, at equal ratios.
    lags = np.unique(np.geomspace(1, frames // 2, 100).astype(int)) if frames > 200 else np.arange(1, frames // 2 + 1)
    msd = np.array([np.mean(np.sum((x[lag:] - x[:-lag]) ** 2, axis=2)) for lag in lags])
    return lags * (trajectory.time[1] - trajectory.time[0]), msd


def diffusion_coefficient(lag, msd, dimension, between=None):
    low, high = between or (lag[-1] / 2, lag[-1])
    use = (lag >= low) & (lag <= high)
    if use.sum() < 2:
        return np.nan
    return np.polyfit(lag[use], msd[use], 1)[0] / (2 * dimension)


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
        columns = read_table(options.run)
        with reading(options.run):
            lag = columns.pop("time")
            columns.pop("origins")
        diffusion = {name: diffusion_coefficient(lag, msd, options.dimension, between) for name, msd in columns.items()}
        file = options.output or options.run.with_suffix(".png")
        draw(file, lag, columns, diffusion)
        print("".join(f"{name}: D = {value:.6g}\n" for name, value in diffusion.items()) + f"Results: {file}")
        return
    with Trajectory(options.run) as trajectory:
        lag, msd = mean_squared_displacement(trajectory)
        diffusion = diffusion_coefficient(lag, msd, trajectory.dimension, between)
        title = trajectory.title
    folder = options.run if options.run.is_dir() else options.run.parent
    file = options.output or folder / "msd.png"
    table = file.with_name(file.stem + "-frames.csv")
    np.savetxt(table, np.stack([lag, msd], axis=1), delimiter=",", header="lag,msd", comments="")
    draw(file, lag, {"msd": msd}, {"msd": diffusion}, title)
    print(f"D = {diffusion:.6g}\nResults: {table}, {file}")


def draw(file, lag, curves, diffusion, title=""):
    with picture(file, xlabel="lag", ylabel="mean squared displacement", title=title) as axes:
        for name, msd in curves.items():
            axes.loglog(lag, msd, "o-", markersize=3, label=f"{name}: D = {diffusion[name]:.4g}")


if __name__ == "__main__":
    main()
