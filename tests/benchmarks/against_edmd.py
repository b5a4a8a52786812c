#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Collisions per second of Carom and of EDMD (github.com/FSmallenburg/EDMD; Eur. Phys. J. E 45 (2022) 22), in alternating runs.

    tests/benchmarks/against_edmd.py EDMD --bin build/release --spheres 1000 10000 100000 --filled 0.10 0.30 0.49

EDMD is a directory with its sources, whose version Single runs at packing fractions from 0.4 on and Cell below. It is compiled with its
author's flags, without thermostat and output, and with up to 200 cells along an axis instead of 75, and starts from a state that Carom has
equilibrated. Both programs report the processor time of their event loops, for so many collisions (--collisions). The table has the
medians, in thousand collisions per second, and the median of the ratios of pairs.

    tests/benchmarks/against_edmd.py EDMD --sizes --spheres 10000 --filled 0.01 0.05 0.10 0.20 --collisions 100000

--sizes: every thousandth sphere has ten times the diameter and the same mass, because EDMD knows no other, and EDMD runs in its version
Cell. Carom's rate is that of a whole run, in real time.
"""

import argparse
import json
import pathlib
import re
import statistics
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "tools"))
from carom_files import Trajectory, run_carom

ROOT = pathlib.Path(__file__).resolve().parents[2]
MEASURED = """    clock_t begin = clock();
    while (colcounter < {collisions}u)"""
REPORT = """    printf("rate %g\\n", {collisions} / ((double)(clock() - begin) / CLOCKS_PER_SEC));
    simtime = maxtime;"""


def edmd_program(sources, version, collisions, directory):
    """Compiles EDMD so that it runs this many collisions from init.sph and prints its rate."""
    name = f"md{version}"
    (directory / "mt19937ar.c").write_text((sources / version / "mt19937ar.c").read_text())
    (directory / f"{name}.h").write_text((sources / version / f"{name}.h").read_text())
    text = (sources / version / f"{name}.c").read_text()
    for old, new in ((r"    while \(simtime <= maxtime\)", MEASURED.format(collisions=collisions)),
                     (r"    simtime = maxtime;", REPORT.format(collisions=collisions)),
                     (r"int usethermostat = \d", "int usethermostat = 0"), (r"int initialconfig = \d", "int initialconfig = 0"),
                     (r"double writeinterval = \d+", "double writeinterval = 1e9")):
        text, found = re.subn(old, lambda _, new=new: new, text)
        if found != 1:
            raise SystemExit(f"{name}.c has '{old}' {found} times; take commit 2d0c862")
    text = re.sub("define MAXCEL 75", "define MAXCEL 200", text)
    (directory / f"{name}.c").write_text("#include <time.h>\n" + text)
    subprocess.run(["gcc", "-Ofast", "-funroll-loops", "-march=native", "-w", f"{name}.c", "-o", "md", "-lm"], cwd=directory, check=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("edmd", type=pathlib.Path)
    parser.add_argument("--bin", type=pathlib.Path, default=ROOT / "build/release", help="where carom and carom_bench are built")
    parser.add_argument("--spheres", type=int, nargs="+", default=[1000, 10000, 100000])
    parser.add_argument("--filled", type=float, nargs="+", default=[0.10, 0.30, 0.49], help="packing fractions")
    parser.add_argument("--collisions", type=int, default=1000000)
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--sizes", action="store_true", help="spheres of diameters 1 and 10")
    given = parser.parse_args()
    print("| packing fraction | spheres | Carom | EDMD | ratio |\n|---|---|---|---|---|")
    for filled in given.filled:
        for spheres in given.spheres:
            with tempfile.TemporaryDirectory() as name:
                directory = pathlib.Path(name)
                edmd_program(given.edmd, "Single" if filled >= 0.4 and not given.sizes else "Cell", given.collisions, directory)
                few = spheres // 1000 if given.sizes else 0
                deck = ROOT / "inputs" / ("ten-to-one.toml" if given.sizes else "hard-sphere-fluid.toml")
                counts = [f"particles.0.count={few}", f"particles.1.count={spheres}", "particles.0.mass=1.0"] if few else [
                    f"particles.0.count={spheres}"]
                settings = counts + [f"placement.packing_fraction={filled}", "run.end_time=1e9", "output.frame_interval=1e9",
                                     "output.thermo_interval=1e9"]
                run_carom(given.bin / "io/carom", deck, directory / "state",
                          settings + [f"run.collisions={(2 if given.sizes else 40) * spheres}"])
                with Trajectory(directory / "state") as state:
                    edges, position = state.edges(-1), state.position(-1)
                unit = 10 if given.sizes else 1  # EDMD's unit of length is the largest diameter
                rows = [f"{len(position)}", " ".join(repr(float(edge) / unit) for edge in edges)]
                rows += ["a " + " ".join(f"{each:.15g}" for each in x / unit) + f" {0.5 if k < few else 0.5 / unit}"
                         for k, x in enumerate(position % edges)]
                (directory / "init.sph").write_text("\n".join(rows) + "\n")
                pairs = []
                for k in range(given.repeat):
                    if given.sizes:
                        run_carom(given.bin / "io/carom", deck, directory / str(k), settings + [f"run.collisions={given.collisions}"])
                        rate = json.loads((directory / str(k) / "summary.json").read_text())["collisions_per_second"]
                    else:
                        subprocess.run([given.bin / "tests/benchmarks/carom_bench", "--n", str(spheres), "--packing-fraction", str(filled),
                                        "--repeat", "1", "--collisions", str(given.collisions), "--json", directory / "bench.json"],
                                       check=True, capture_output=True)
                        rate = json.loads((directory / "bench.json").read_text())["points"][0]["collisions_per_second"]["median"]
                    text = subprocess.run(["./md"], cwd=directory, check=True, capture_output=True, text=True).stdout
                    pairs.append((rate, float(re.search(r"rate (\S+)", text).group(1))))
            rates = [statistics.median(each) / 1000 for each in zip(*pairs)]
            ratio = statistics.median(a / b for a, b in pairs)
            print(f"| {filled:.2f} | {spheres} | {rates[0]:.0f} | {rates[1]:.0f} | {ratio:.2f} |", flush=True)


if __name__ == "__main__":
    main()
