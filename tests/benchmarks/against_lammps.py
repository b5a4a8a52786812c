#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Time of Carom and of LAMMPS for a Lennard-Jones melt and for a fluid of hard spheres with a Yukawa attraction, in alternating runs.

    . tools/mpi-env.sh; tests/benchmarks/against_lammps.py --carom build/release/io/carom --lammps lmp

The melt: 32,000 particles, density 0.8442, temperature 1.44, cutoff 2.5, shifted, 400 steps of 0.004 (bench/in.lj of LAMMPS, with the
potential shifted), with Carom's `verlet` and with `lmp -sf opt`. The fluid: the 10,976 spheres of inputs/yukawa-fluid.toml up to t = 0.5,
with steps of 0.01. LAMMPS has no hard cores; it replaces them by the cut Mie potential with exponents 50 and 49 and epsilon = kT/1.5
(Jover et al., J. Chem. Phys. 137 (2012) 144505), which needs a step of 0.001. The core and the Yukawa tail are two pair styles (`hybrid/overlay`)
or one table of 10,000 points, interpolated linearly (`table`); the rows name which one ran. All programs start from one state.

Times are wall seconds of the loop over the steps: the median of --repeat alternating runs, and the smallest and the largest in brackets.
The first line names the processor's vector instructions; --simd measures Carom with fewer of them. Debian compiles its LAMMPS for any
x86-64 processor (SSE2); one compiled for the processor at hand takes less time.
"""

import argparse
import json
import os
import pathlib
import re
import statistics
import subprocess
import tempfile

import numpy as np

from electrolyte import Trajectory, find_carom, run_carom, write_data

ROOT = pathlib.Path(__file__).resolve().parents[2]
SET = {"melt": ["particles.count=32000", "system.box=[33.5919,33.5919,33.5919]", "run.steps=400"],
       "fluid": ["run.end_time=0.5"]}
DECK = {"melt": "lennard-jones", "fluid": "yukawa-fluid"}
HEAD = """units lj
atom_style charge
read_data data
"""
TAIL = """neighbor 0.3 bin
neigh_modify delay 0 every 1 check yes
fix 1 all nve
timestep {step}
thermo 100
run {steps}
"""
MELT = "pair_style lj/cut 2.5\npair_coeff 1 1 1.0 1.0 2.5\npair_modify shift yes\n"
# A temperature of 1.5 makes epsilon = 1. 50/49 is where the Mie potential has its minimum, at 1.0204.
OVERLAY = """pair_style hybrid/overlay mie/cut 1.020408163265306 yukawa 1.8 3.5
pair_coeff 1 1 mie/cut 1.0 1.0 50.0 49.0
pair_coeff 1 1 yukawa -6.049647464412946
"""
TABLE = "pair_style table linear 10000\npair_coeff 1 1 table FLUID 3.5\n"


def write_table(path, points=10000, inner=0.9, cutoff=3.5):
    """The core and the tail of the fluid as a table of LAMMPS: r, V and the force, at equal distances of r²."""
    r = np.sqrt(np.linspace(inner**2, cutoff**2, points))
    factor = 50 * (50 / 49) ** 49
    tail = -6.049647464412946 * np.exp(-1.8 * r) / r
    core = np.where(r < 50 / 49, factor * (r**-50 - r**-49) + 1, 0)
    force = tail * (1.8 + 1 / r) + np.where(r < 50 / 49, factor * (50 * r**-51 - 49 * r**-50), 0)
    rows = "\n".join(f"{k + 1} {x:.15g} {v:.15g} {f:.15g}" for k, (x, v, f) in enumerate(zip(r, core + tail, force)))
    path.write_text(f"FLUID\nN {points} RSQ {inner} {cutoff}\n\n{rows}\n")


def write_start(carom, system, directory):
    """Carom's start as a data file of LAMMPS."""
    run_carom(carom, ROOT / f"inputs/{DECK[system]}.toml", directory / "start",
              [*SET[system], "run.steps=1", "output.frame_interval=1e9", "output.thermo_interval=1e9"])
    with Trajectory(directory / "start") as trajectory:
        write_data(directory / "data", float(trajectory.edges(0)[0]), trajectory.position(0), np.zeros(len(trajectory.position(0))),
                   trajectory.velocity(0))


def lammps(command, directory, potential, step, steps, *options):
    (directory / "in").write_text(HEAD + potential + TAIL.format(step=step, steps=steps))
    text = subprocess.run([command, *options, "-in", "in", "-log", "none"], cwd=directory, check=True, capture_output=True, text=True).stdout
    return float(re.search(r"Loop time of (\S+)", text).group(1))


def carom_run(command, system, directory, simd, *more):
    out = directory / "run"
    run_carom(command, ROOT / f"inputs/{DECK[system]}.toml", out,
              [*SET[system], "output.frame_interval=1e9", "output.thermo_interval=0.4", *more], environment={**os.environ, "CAROM_SIMD": simd})
    return json.loads((out / "summary.json").read_text())["wall_seconds"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--carom")
    parser.add_argument("--lammps", default="lmp")
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--systems", nargs="+", choices=SET, default=list(SET))
    parser.add_argument("--simd", nargs="+", choices=("avx512", "avx2", "sse2"), help="default: the widest, and those below")
    given = parser.parse_args()
    carom = find_carom(given.carom)
    flags = re.search(r"^flags.*$", pathlib.Path("/proc/cpuinfo").read_text(), re.MULTILINE).group().split()
    widths = given.simd or [name for name, flag in (("avx512", "avx512dq"), ("avx2", "avx2"), ("sse2", "sse2")) if flag in flags]
    print(f"This processor has {widths[0]}.\n\n| system | program | seconds |\n|---|---|---|")
    for system in given.systems:
        with tempfile.TemporaryDirectory() as name:
            directory = pathlib.Path(name)
            write_start(carom, system, directory)
            write_table(directory / "table")
            if system == "melt":
                runs = {"LAMMPS, lj/cut/opt": lambda: lammps(given.lammps, directory, MELT, 0.004, 400, "-sf", "opt")}
            else:
                runs = {f"LAMMPS, {style}": lambda text=text: lammps(given.lammps, directory, text, 0.001, 500, "-sf", "opt")
                        for style, text in (("hybrid/overlay", OVERLAY), ("table", TABLE))}
            for method in ["verlet"] if system == "melt" else ["edda", "psa"]:
                for simd in widths:
                    runs[f"Carom, {method}, {simd}"] = lambda simd=simd, method=method: carom_run(
                        carom, system, directory, simd, f"integrator.type={method}")
            seconds = {program: [] for program in runs}
            for _ in range(given.repeat):
                for program, run in runs.items():
                    seconds[program].append(run())
            for program, each in seconds.items():
                print(f"| {system} | {program} | {statistics.median(each):.2f} ({min(each):.2f} to {max(each):.2f}) |", flush=True)


if __name__ == "__main__":
    main()
