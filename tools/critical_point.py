#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The critical point of a square-well fluid, from slabs of liquid beside their vapour at several temperatures.

    tools/python tools/critical_point.py                                                   # a quarter of an hour
    tools/python tools/critical_point.py --temperatures 1,1.05,1.1 --edge 6 --length 36 --time 400      # half a minute

A slab of liquid of edge x edge evaporates in a periodic box of edge x edge x length until its vapour is saturated, in an Andersen bath.
The density of the liquid is taken within 0.08 box lengths of the middle of the slab, and the density of the vapour farther away than
0.36 box lengths.
Errors are standard errors of 16 blocks of time. The critical temperature Tc follows from fits of the difference of the densities by
A t^0.326, where t = 1 - T/Tc, and by A t^0.326 + B t^0.826, which has the first correction to this law (Wegner, Phys. Rev. B 5 (1972)
4529). The critical density follows from the law of rectilinear diameters: the mean of both densities is linear in T. Errors of the fits
are their scatter when the densities get random errors.
"""

import argparse

import numpy as np

try:
    import carom
    carom.Simulation
except ImportError as missing:
    raise SystemExit("This study needs the built Python module: tools/python tools/critical_point.py") from missing

BETA = 0.326
BLOCKS = 16
BINS = 100


def slab(T, options):
    """The densities of liquid and vapour in each block of a run."""
    edge, length = options.edge, options.length
    across, layers = int(edge / 1.06), round(options.density * edge**2 * length / int(edge / 1.06)**2)
    sites = np.stack(np.meshgrid(range(across), range(across), range(layers), indexing="ij"), axis=-1).reshape(-1, 3) + 0.5
    spacing = np.array([edge / across, edge / across, 1.06])
    sim = carom.Simulation(dimension=3, box=[edge, edge, length], boundary="periodic")
    sim.add_particles(position=sites * spacing + [0, 0, (length - 1.06 * layers) / 2], radius=0.5)
    sim.thermalize(T, seed=options.seed)
    sim.add_step("*", "*", range=options.range, depth=1.0)
    sim.add_bath("andersen", temperature=T, rate=0.2, seed=options.seed)
    sim.integrator("free-flight", step=1.0)
    rows = []

    def look(sim):
        z = sim.position[:, 2] / length
        middle = np.angle(np.exp(2j * np.pi * z).mean()) / (2 * np.pi)
        rows.append(np.histogram((z - middle + 0.5) % 1, bins=BINS, range=(0, 1))[0])

    start = options.time / 5
    sim.run(time=start)
    sim.run(time=start + options.time, every=2.0, callback=look)
    density = np.array([block.mean(axis=0) for block in np.array_split(rows, BLOCKS)]) * BINS / (edge**2 * length)
    from_middle = abs((np.arange(BINS) + 0.5) / BINS - 0.5)
    return density[:, from_middle < 0.08].mean(axis=1), density[:, from_middle > 0.36].mean(axis=1)


def critical_point(T, liquid, vapour, error, powers):
    """Tc and chi squared of a fit by these powers of 1 - T/Tc, and the critical density; error is that of the difference of the densities."""
    def fit(Tc):
        terms = (1 - T[:, None] / Tc)**powers / error[:, None]
        return ((terms @ np.linalg.lstsq(terms, (liquid - vapour) / error, rcond=None)[0] - (liquid - vapour) / error)**2).sum()

    trial = np.linspace(1.001 * T.max(), 1.3 * T.max(), 25)
    for _ in range(4):                                         # closer and closer to the minimum
        best = np.clip(np.argmin([fit(Tc) for Tc in trial]), 1, len(trial) - 2)
        trial = np.linspace(trial[best - 1], trial[best + 1], 25)
    return trial[12], fit(trial[12]), np.polyval(np.polyfit(T, (liquid + vapour) / 2, 1, w=1 / error), trial[12])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--temperatures", default="0.95,1.05,1.1,1.15")
    parser.add_argument("--range", type=float, default=1.5, help="of the well, in diameters")
    parser.add_argument("--edge", type=float, default=8.0)
    parser.add_argument("--length", type=float, default=60.0)
    parser.add_argument("--density", type=float, default=0.3, help="of the whole box")
    parser.add_argument("--time", type=float, default=1500.0, help="of each temperature, after a fifth more in which the slab melts")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    T = np.array([float(each) for each in options.temperatures.split(",")])
    means, errors = [], []
    print("   T    liquid            vapour")
    for each in T:
        blocks = np.array(slab(each, options))
        means.append(blocks.mean(axis=1))
        errors.append(blocks.std(axis=1) / (BLOCKS - 1)**0.5)
        print(f"{each:5.3f}  {means[-1][0]:.4f} +- {errors[-1][0]:.4f}  {means[-1][1]:.4f} +- {errors[-1][1]:.4f}", flush=True)
    means, errors = np.array(means).T, np.array(errors).T
    error = np.hypot(*errors)
    random = np.random.default_rng(1)
    for law, powers in (("A t^0.326", [BETA]), ("A t^0.326 + B t^0.826", [BETA, BETA + 0.5])):
        if len(T) > len(powers) + 1:
            Tc, chi_squared, density = critical_point(T, *means, error, powers)
            again = [critical_point(T, *(means + errors * random.normal(size=means.shape)), error, powers) for _ in range(200)]
            Tc_error, _, density_error = np.std(again, axis=0)
            print(f"{law}: critical temperature {Tc:.3f} +- {Tc_error:.3f}, density {density:.3f} +- {density_error:.3f}, "
                  f"chi squared {chi_squared:.1f} for {len(T) - len(powers) - 1} degrees of freedom")


if __name__ == "__main__":
    main()
