#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""User times of Carom and of DynamO (github.com/dynamomd/DynamO) for 10,000 hard spheres in dilute gases, in alternating runs.

    tests/benchmarks/against_dynamo.py DIRECTORY --carom build/release/io/carom

DIRECTORY has the programs dynamod and dynarun, built as Release without the visualiser. DynamO starts from a lattice that has melted for
60,000 events; both programs run whole commands, without observables or frames. The table has medians, in collisions per second of user
time, and the median of the ratios of pairs.
"""

import argparse
import math
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "tools"))
from carom_files import find_carom

ROOT = pathlib.Path(__file__).resolve().parents[2]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dynamo", type=pathlib.Path)
    parser.add_argument("--carom")
    parser.add_argument("--filled", type=float, nargs="+", default=[0.002, 0.005, 0.01], help="packing fractions")
    parser.add_argument("--collisions", type=int, default=200000)
    parser.add_argument("--repeat", type=int, default=3)
    given = parser.parse_args()
    carom = pathlib.Path(find_carom(given.carom)).resolve()
    print("| packing fraction | Carom | DynamO | ratio |\n|---|---|---|---|")
    with tempfile.TemporaryDirectory() as name:
        directory = pathlib.Path(name)

        def user_seconds(command):
            before = os.times().children_user
            subprocess.run(command, cwd=directory, check=True, capture_output=True)
            return os.times().children_user - before

        for filled in given.filled:
            user_seconds([given.dynamo / "dynamod", "-m", "0", "--i1", "2", "-x", "20", "-y", "20", "-z", "25", "--rectangular-box",
                          "-d", repr(6 * filled / math.pi), "-s", "1", "-o", "lattice.xml"])
            user_seconds([given.dynamo / "dynarun", "lattice.xml", "-E", "-c", "60000", "-o", "melt.xml"])
            gas = [carom, "run", ROOT / "inputs/hard-sphere-fluid.toml", "--quiet", "-o", directory / "run"]
            for value in ("particles.0.count=10000", "placement.type=random", f"placement.packing_fraction={filled}",
                          f"run.collisions={given.collisions}", "run.end_time=1e9", "output.events=false", "output.frame_interval=1e9",
                          "output.thermo_interval=1e9"):
                gas += ["--set", value]
            pairs = [(user_seconds(gas), user_seconds([given.dynamo / "dynarun", "melt.xml", "-E", "-c", str(given.collisions), "-o", "end.xml"]))
                     for _ in range(given.repeat)]
            rates = [given.collisions / statistics.median(each) for each in zip(*pairs)]
            print(f"| {filled} | {rates[0]:.0f} | {rates[1]:.0f} | {statistics.median(b / a for a, b in pairs):.1f} |", flush=True)


if __name__ == "__main__":
    main()
