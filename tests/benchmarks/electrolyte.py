#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Molecular dynamics of charges with Ewald sums: time per step against LAMMPS at equal force error.

    . tools/mpi-env.sh; tests/benchmarks/electrolyte.py --carom build/release/io/carom --lammps lmp --ions 1000 8000 --ranks 1

N = 4 c³ ions of charges ±1, at random on an fcc lattice at the number density 0.0925 per cubed diameter, with the Coulomb
constant 1.68, repel each other by the WCA potential. The force error is the root mean square over all ions and components
of the Coulomb forces at the start, less those of Carom at an accuracy of 1e-7. LAMMPS runs `ewald` and `pppm` with several cutoffs;
the table has the one that takes the least time with an error up to 1.1 times Carom's. Times per step are wall times of the steps after
the start, the median of three alternating runs.
"""

import argparse
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "tools"))
from carom_files import Trajectory, find_carom, run_carom

DENSITY, CONSTANT, STEP = 0.0925, 1.68, 0.005

DECK = """format = 1
[system]
dimension = 3
box = [{edge}, {edge}, {edge}]
boundary = ["periodic", "periodic", "periodic"]
[[particles]]
name = "cation"
count = {half}
charge = 1.0
mass = 1.0
temperature = {temperature}
[[particles]]
name = "anion"
count = {half}
charge = -1.0
mass = 1.0
temperature = {temperature}
[placement]
type = "fcc"
seed = 1
[[interaction]]
type = "coulomb"
constant = 1.68
form = "ewald"
accuracy = {accuracy}
{more}
[integrator]
type = "verlet"
step = {step}
[run]
steps = {steps}
[output]
directory = "unused"
frame_interval = 1e9
thermo_interval = 1e9
"""
WCA = '[[interaction]]\ntype = "wca"\nepsilon = 1.0\nsigma = 1.0\n'
LAMMPS = """units lj
atom_style charge
read_data {data}
pair_style lj/cut/coul/long 1.122462048309373 {cutoff}
pair_coeff * * {epsilon} 1.0
pair_modify shift yes
kspace_style {style} {accuracy}
neighbor 0.3 bin
neigh_modify one 10000 page 200000
fix 1 all nve
timestep {step}
thermo {steps}
"""


class Carom:
    def __init__(self, command, directory):
        self.command, self.directory = command, directory

    def run(self, ions, accuracy, steps, step=STEP, temperature=1.0, more=WCA, ranks=1):
        """Runs the deck; returns the directory and the seconds it took."""
        deck = self.directory / "deck.toml"
        deck.write_text(DECK.format(edge=(ions / DENSITY) ** (1 / 3), half=ions // 2, temperature=temperature, accuracy=accuracy,
                                    more=more, step=step, steps=steps))
        started = time.monotonic()
        run_carom(self.command, deck, self.directory / "run", launcher=["mpirun", "-n", str(ranks)])
        return self.directory / "run", time.monotonic() - started

    def start(self, ions, accuracy):
        """Positions, charges and Coulomb forces: ions at rest get the velocity step × force."""
        step = 1e-6
        directory, _ = self.run(ions, accuracy, 1, step=step, temperature=0.0, more="")
        with Trajectory(directory) as trajectory:
            return trajectory.position(0), trajectory.charge, trajectory.velocity(-1) / step

    def seconds_per_step(self, ions, accuracy, steps, ranks):
        return (self.run(ions, accuracy, 3 * steps, ranks=ranks)[1] - self.run(ions, accuracy, steps, ranks=ranks)[1]) / (2 * steps)


def write_data(path, edge, position, charge, velocity=None):
    """Writes a data file of LAMMPS for ions of mass 1 in a cube."""
    def rows(values):
        return [" ".join(map(repr, map(float, each))) for each in values]
    atoms = [f"{i + 1} 1 {float(q) * CONSTANT ** 0.5!r} {x}" for i, (q, x) in enumerate(zip(charge, rows(position % edge)))]
    parts = ["", f"{len(charge)} atoms", "1 atom types", *(f"0 {edge!r} {axis}lo {axis}hi" for axis in "xyz"), "", "Masses", "", "1 1.0", "",
             "Atoms # charge", "", *atoms]
    if velocity is not None:
        parts += ["", "Velocities", "", *(f"{i + 1} {v}" for i, v in enumerate(rows(velocity)))]
    path.write_text("\n".join(parts) + "\n")


class Lammps:
    def __init__(self, command, directory, position, charge):
        self.command, self.directory = command, directory
        write_data(directory / "data", (len(charge) / DENSITY) ** (1 / 3), position, charge)

    def run(self, style, cutoff, accuracy, commands, steps=1, epsilon=1.0, ranks=1):
        script = LAMMPS.format(data=self.directory / "data", cutoff=cutoff, epsilon=epsilon, style=style, accuracy=accuracy, step=STEP, steps=steps)
        (self.directory / "in").write_text(script + commands)
        done = subprocess.run(["mpirun", "-n", str(ranks), self.command, "-in", str(self.directory / "in"), "-log", "none"],
                              capture_output=True, text=True, cwd=self.directory)
        if done.returncode != 0:
            raise SystemExit(done.stdout + done.stderr)
        return done.stdout

    def forces(self, style, cutoff, accuracy):
        """Coulomb forces at the start."""
        self.run(style, cutoff, accuracy, "dump 1 all custom 1 forces id fx fy fz\ndump_modify 1 sort id format float %20.15g\nrun 0\n", epsilon=0.0)
        return np.loadtxt(self.directory / "forces", skiprows=9)[:, 1:]

    def seconds_per_step(self, style, cutoff, accuracy, steps, ranks):
        commands = f"velocity all create 1.0 1 loop geom\nrun 2\nrun {steps}\n"
        lines = [line for line in self.run(style, cutoff, accuracy, commands, steps, ranks=ranks).splitlines() if line.startswith("Loop time")]
        return float(lines[-1].split()[3]) / steps


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--carom")
    parser.add_argument("--lammps", default="lmp")
    parser.add_argument("--ions", type=int, nargs="+", default=[1372, 8788])
    parser.add_argument("--ranks", type=int, default=1)
    parser.add_argument("--accuracy", type=float, default=1e-4)
    parser.add_argument("--steps", type=int, default=20)
    parser.add_argument("--cutoffs", type=float, nargs="+", default=[4.0, 6.0, 8.0, 10.0, 12.0, 15.0])
    given = parser.parse_args()
    print("| ions | force error | Carom, ms per step | LAMMPS ewald (cutoff) | ratio | LAMMPS pppm (cutoff) | ratio |\n|---|---|---|---|---|---|---|")
    for ions in given.ions:
        with tempfile.TemporaryDirectory() as directory:
            carom = Carom(find_carom(given.carom), pathlib.Path(directory))
            position, charge, exact = carom.start(ions, 1e-7)
            error = np.sqrt(np.mean((carom.start(ions, given.accuracy)[2] - exact) ** 2))
            lammps = Lammps(given.lammps, pathlib.Path(directory), position, charge)
            entries = []
            for style in ("ewald", "pppm"):
                best = None
                for cutoff in given.cutoffs:
                    if 2 * cutoff > (ions / DENSITY) ** (1 / 3):
                        continue
                    accuracy = error
                    for _ in range(8):  # the estimate of LAMMPS is not its error
                        found = np.sqrt(np.mean((lammps.forces(style, cutoff, accuracy) - exact) ** 2))
                        if found <= 1.1 * error:
                            break
                        accuracy *= 0.9 * error / found
                    else:
                        continue
                    seconds = lammps.seconds_per_step(style, cutoff, accuracy, given.steps, given.ranks)
                    if best is None or seconds < best[0]:
                        best = seconds, cutoff, accuracy
                entries.append((style, *best))
            times = {name: [] for name in ("carom", "ewald", "pppm")}
            for _ in range(3):
                times["carom"].append(carom.seconds_per_step(ions, given.accuracy, given.steps, given.ranks))
                for style, _, cutoff, accuracy in entries:
                    times[style].append(lammps.seconds_per_step(style, cutoff, accuracy, given.steps, given.ranks))
            median = {name: 1000 * statistics.median(each) for name, each in times.items()}
            cells = [f"{median[style]:.1f} ({cutoff:g}) | {median[style] / median['carom']:.2f}" for style, _, cutoff, _ in entries]
            print(f"| {len(charge)} | {error:.1e} | {median['carom']:.1f} | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
