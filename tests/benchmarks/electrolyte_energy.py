#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Charged hard spheres: error of the energy against cost, for edda and psa, and for LAMMPS with a steep potential for the cores.

    . tools/mpi-env.sh; tests/benchmarks/electrolyte_energy.py --carom build/release/io/carom --lammps lmp

500 ions of the restricted primitive model (inputs/electrolyte-ewald.toml) at the number density 0.185 (2 mol/l) move for 20 units of time,
from one state that edda has equilibrated. LAMMPS replaces the hard cores by the cut Mie potential with exponents 50 and 49 and
epsilon = kT/1.5 (Jover et al., J. Chem. Phys. 137 (2012) 144505), and sums charges with `ewald`. The error is the largest difference of the
total energy from that at the start, relative to the kinetic energy at the start. Times are user times per unit of simulated time.
"""

import argparse
import csv
import os
import pathlib
import subprocess
import tempfile

from electrolyte import Trajectory, find_carom, run_carom, write_data

ROOT = pathlib.Path(__file__).resolve().parents[2]
IONS, DENSITY, TIME = 500, 0.185, 20.0
EDGE = (IONS / DENSITY) ** (1 / 3)
LAMMPS = """units lj
atom_style charge
read_data data
pair_style hybrid/overlay mie/cut 1.020408163265306 coul/long 5.0
pair_coeff * * mie/cut {epsilon} 1.0 50.0 49.0
pair_coeff * * coul/long
pair_modify shift yes
kspace_style ewald 1e-5
neighbor 0.3 bin
neigh_modify delay 0 every 1 check yes
fix 1 all nve
timestep {step}
thermo 1
thermo_style custom step etotal ke
thermo_modify norm no format float %.15g
run {steps}
"""


def timed(command, **options):
    """User seconds of a command, and its output."""
    before = os.times().children_user
    done = subprocess.run(command, capture_output=True, text=True, check=True, **options)
    return os.times().children_user - before, done.stdout


def carom_row(carom, directory, method, step):
    out = directory / f"{method}-{step}"
    seconds, _ = timed([carom, "branch", directory / "start", "-o", out, "--quiet", "--set", f"integrator.type={method}",
                        "--set", f"integrator.step={step}", "--set", f"run.end_time={2 * TIME}", "--set", "run.steps=1000000000",
                        "--set", f"output.thermo_interval={step}", "--set", "output.frame_interval=1e9"])
    with open(out / "thermo.csv", encoding="utf-8") as file:
        rows = [(float(row["total"]), float(row["kinetic"])) for row in csv.DictReader(file)]
    return seconds, rows


def lammps_row(lammps, directory, step, temperature):
    script = LAMMPS.format(epsilon=temperature / 1.5, step=step, steps=round(TIME / step))
    (directory / "in").write_text(script)
    seconds, text = timed([lammps, "-in", "in", "-log", "none"], cwd=directory)
    lines = text.split("Step", 1)[1].split("Loop time")[0].splitlines()[1:]
    return seconds, [(float(total), float(kinetic)) for _, total, kinetic in (line.split() for line in lines if line.strip())]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--carom")
    parser.add_argument("--lammps", default="lmp")
    given = parser.parse_args()
    carom = find_carom(given.carom)
    with tempfile.TemporaryDirectory() as name:
        directory = pathlib.Path(name)
        run_carom(carom, ROOT / "inputs/electrolyte-ewald.toml", directory / "start",
                  [f"particles.0.count={IONS // 2}", f"particles.1.count={IONS // 2}", f"system.box=[{EDGE},{EDGE},{EDGE}]",
                   "interaction.0.accuracy=1e-5", f"run.steps={round(TIME / 0.05)}", "output.frame_interval=1.0"])
        with Trajectory(directory / "start") as trajectory:
            velocity = trajectory.velocity(-1)
            write_data(directory / "data", EDGE, trajectory.position(-1), trajectory.charge, velocity)
        temperature = float((velocity ** 2).sum() / (3 * IONS))
        print("| program | step | ms per unit of time | error of the energy |\n|---|---|---|---|")
        runs = [(f"Carom, {method}", step, lambda method=method, step=step: carom_row(carom, directory, method, step))
                for method, steps in (("edda", (0.05, 0.02)), ("psa", (0.02, 0.005, 0.001))) for step in steps]
        runs += [("LAMMPS", step, lambda step=step: lammps_row(given.lammps, directory, step, temperature))
                 for step in (0.004, 0.002, 0.001, 0.0005)]
        for program, step, run in runs:
            seconds, rows = run()
            error = max(abs(total - rows[0][0]) for total, _ in rows) / rows[0][1]
            print(f"| {program} | {step} | {1000 * seconds / TIME:.0f} | {error:.1e} |", flush=True)


if __name__ == "__main__":
    main()
