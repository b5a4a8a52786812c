#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The radial distribution function g(r) of a trajectory, in 2-D and 3-D, in periodic and walled boxes.

    tools/plot_rdf.py runs/hard-sphere-fluid
    tools/plot_rdf.py runs/primitive-electrolyte --species cation,anion --bins 200 --first-frame 20 -o rdf.png
    tools/plot_rdf.py runs/hard-sphere-fluid/rdf.csv          # averages of the run itself (output.rdf_interval)

Along periodic axes the nearest image counts, so r ends at half the shortest periodic edge. Along walls, g refers to an ideal gas in
the region that the centres can reach (the average over directions u of the product of 1 - r |u_k| / L_k over the walled axes), so
that g = 1 without correlations, also near the walls (approximately if radii differ). The band is one standard error: from four parts
of the run, each averaged separately, or from an rdf.csv.
The script writes a CSV with r, g and error beside the picture, by default rdf-frames.csv.
(Allen, Tildesley, Computer Simulation of Liquids, 2nd ed., section 2.6.)
"""

import argparse
import pathlib

import numpy as np
from scipy.spatial import cKDTree

from carom_files import Trajectory, one_line, read_table, reading, split_errors
from carom_plot import picture

BLOCKS = 4  # parts of the run, for the error


def directions(dimension):
    """Unit vectors of equal weight in the positive quadrant or octant."""
    n = 64
    if dimension == 2:
        angle = (np.arange(n * n) + 0.5) / (n * n) * np.pi / 2
        return np.stack([np.cos(angle), np.sin(angle)], axis=1)
    z, angle = np.meshgrid((np.arange(n) + 0.5) / n, (np.arange(n) + 0.5) / n * np.pi / 2)
    rho = np.sqrt(1 - z**2)
    return np.stack([rho * np.cos(angle), rho * np.sin(angle), z], axis=-1).reshape(-1, 3)


def ideal_fraction(radii, edges, periodic):
    """For each shell [radii[k], radii[k+1]): the fraction of the region's volume in which an ideal gas has partners."""
    dimension = len(edges)
    shell = {2: np.pi, 3: 4 / 3 * np.pi}[dimension] * np.diff(radii**dimension) / np.prod(edges)
    middle = 0.5 * (radii[1:] + radii[:-1])
    inside = np.ones((len(middle), len(directions(dimension))))
    for axis in np.flatnonzero(~periodic):
        reach = middle[:, None] * directions(dimension)[None, :, axis]
        inside *= np.clip(1 - reach / edges[axis], 0, None)
    return shell * inside.mean(axis=1)


def pair_counts(a, b, radii, edges, periodic):
    """Ordered pairs (one of a, one of b) with a distance in each shell, 0 (a particle and itself) excepted."""
    size = np.where(periodic, edges, 0.0)  # 0: no images along this axis
    tree_a, tree_b = (cKDTree(x, boxsize=size) for x in (a, b))
    return np.diff(tree_a.count_neighbors(tree_b, np.nextafter(radii, 0)).astype(float))


def radial_distribution(trajectory, bins=150, largest=None, species=None, first_frame=0):
    """Middles of the shells, g there, averaged over the frames from first_frame on, and its standard error."""
    if "open" in trajectory.boundary:
        raise SystemExit("g(r) needs a density: there is none in a box with an open boundary.")
    if unknown := set(species or []) - set(trajectory.species_names):
        raise SystemExit(f"There is no species {', '.join(unknown)}, only {', '.join(trajectory.species_names)}.")
    every = np.arange(len(trajectory.species))
    chosen = [every[trajectory.species == trajectory.species_names.index(name)] for name in species or []]
    chosen = chosen or [every, every]
    walled = ~trajectory.periodic
    # Centres stay a radius away from a wall.
    margin = np.where(walled, min(trajectory.radius[np.concatenate(chosen)]), 0.0)
    edges = trajectory.edges() - 2 * margin
    largest = largest or min(np.where(trajectory.periodic, edges / 2, edges))
    if any(trajectory.periodic) and largest > min(edges[trajectory.periodic]) / 2 * (1 + 1e-12):
        raise SystemExit("r can't go beyond half the shortest periodic edge.")
    radii = np.linspace(0, largest, bins + 1)
    frames = range(first_frame, len(trajectory))
    counts = np.array([pair_counts(*(_into(trajectory.position(frame)[ids] - margin, edges, trajectory.periodic)
                                     for ids in chosen), radii, edges, trajectory.periodic) for frame in frames])
    pairs = len(chosen[0]) * len(chosen[1]) - len(np.intersect1d(*chosen))
    if pairs == 0:
        raise SystemExit("g(r) needs two particles.")
    g = counts / (pairs * ideal_fraction(radii, edges, trajectory.periodic))
    return 0.5 * (radii[1:] + radii[:-1]), g.mean(axis=0), error_of_blocks(g)


def error_of_blocks(g):
    """The standard error of the mean over frames, from parts of the run; NaN if there are fewer frames than parts."""
    if len(g) < BLOCKS:
        return np.full(g.shape[1], np.nan)
    means = [block.mean(axis=0) for block in np.array_split(g, BLOCKS)]
    return np.std(means, axis=0, ddof=1) / np.sqrt(BLOCKS)


def curves_of_table(file, species=None):
    """The contents of a run's rdf.csv: r, and g by name, for all particles or for two species."""
    columns, _ = split_errors(read_table(file))
    with reading(file):
        r = columns.pop("r")
    if species is None:
        return r, columns
    names = [f"g_{a}_{b}" for a, b in (species, species[::-1])]
    found = [name for name in names if name in columns]
    if not found:
        raise SystemExit(f"There is no {names[0]} in {file}, only {', '.join(columns)}.")
    return r, {found[0]: columns[found[0]]}


def _into(x, edges, periodic):
    """Moves coordinates off the edge itself, where rounding may put them and which the tree refuses."""
    return np.where(periodic & (x >= edges), x - edges, x)


@one_line
def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=pathlib.Path, help="directory of a run, its trajectory, or its rdf.csv")
    parser.add_argument("--bins", type=int, default=150)
    parser.add_argument("--largest", type=float, help="largest r; default: half the shortest edge")
    parser.add_argument("--species", help="names of two species, as cation,anion; default: all particles")
    parser.add_argument("--first-frame", type=int, default=0, help="skip what comes before (equilibration)")
    parser.add_argument("-o", "--output", type=pathlib.Path, help="default: rdf.png in the run's directory")
    options = parser.parse_args(arguments)
    species = options.species.split(",") if options.species else None
    if species and len(species) != 2:
        parser.error("--species takes two names")
    if options.run.suffix == ".csv":
        r, curves = curves_of_table(options.run, species)
        file = options.output or options.run.with_suffix(".png")
        draw(file, r, curves, errors=split_errors(read_table(options.run))[1])
        print(f"Results: {file}")
        return
    with Trajectory(options.run) as trajectory:
        if options.first_frame >= len(trajectory):
            parser.error(f"there are {len(trajectory)} frames")
        r, g, error = radial_distribution(trajectory, options.bins, options.largest, species, options.first_frame)
        title = trajectory.title
    folder = options.run if options.run.is_dir() else options.run.parent
    file = options.output or folder / "rdf.png"
    table = file.with_name(file.stem + "-frames.csv")
    np.savetxt(table, np.stack([r, g, error], axis=1), delimiter=",", header="r,g,error", comments="")
    draw(file, r, {"g": g}, title, {"g": error})
    print(f"Results: {table}, {file}")


def draw(file, r, curves, title="", errors=None):
    with picture(file, xlabel="r [length]", ylabel="g(r)", title=f"{title}\nradial distribution function".strip()) as axes:
        for name, g in curves.items():
            axes.plot(r, g, label=name if len(curves) > 1 else None)
            error = (errors or {}).get(name, np.nan)
            axes.fill_between(r, g - error, g + error, alpha=0.3)
        axes.axhline(1, color="grey", linewidth=0.8)


if __name__ == "__main__":
    main()
