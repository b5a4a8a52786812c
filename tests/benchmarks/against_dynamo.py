#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""User times of Carom and of DynamO (github.com/dynamomd/DynamO) for hard spheres, in alternating runs.

    tests/benchmarks/against_dynamo.py DIRECTORY --carom build/release/io/carom            # 10,000 spheres in dilute gases
    tests/benchmarks/against_dynamo.py DIRECTORY --carom build/release/io/carom --wells    # 10,976 spheres with square wells
    tests/benchmarks/against_dynamo.py DIRECTORY --carom build/release/io/carom --sizes    # ten of them have the tenfold diameter

DIRECTORY has the programs dynamod and dynarun, built as Release without the visualiser. DynamO starts from a lattice that has melted for
60,000 events, with wells for 400,000; both programs run whole commands, without observables or frames. The tables have medians, in events
per second of user time, and the median of the ratios of pairs. Wells have the range 1.5 and the depth 1, and the temperature is 1.5 at the
start.
"""

import argparse
import math
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import tomllib

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "tools"))
from carom_files import find_carom, read_summary, toml_text

ROOT = pathlib.Path(__file__).resolve().parents[2]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dynamo", type=pathlib.Path)
    parser.add_argument("--carom")
    parser.add_argument("--filled", type=float, nargs="+", default=[0.002, 0.005, 0.01], help="packing fractions")
    parser.add_argument("--wells", type=float, nargs="*", metavar="DENSITY", help="square wells at these densities; default: 0.5 0.8")
    parser.add_argument("--sizes", action="store_true", help="diameters 1:10 and masses 1:1000 at packing fraction 0.005")
    parser.add_argument("--collisions", type=int, default=200000)
    parser.add_argument("--repeat", type=int, default=3)
    given = parser.parse_args()
    carom = pathlib.Path(find_carom(given.carom)).resolve()
    print(f"| {'packing fraction' if given.wells is None else 'density'} | Carom | DynamO | ratio |\n|---|---|---|---|")
    with tempfile.TemporaryDirectory() as name:
        directory = pathlib.Path(name)

        def user_seconds(command):
            before = os.times().children_user
            subprocess.run(command, cwd=directory, check=True, capture_output=True)
            return os.times().children_user - before

        def print_row(name, pairs):
            """Seconds for an event, of Carom and of DynamO."""
            rates = [1 / statistics.median(each) for each in zip(*pairs)]
            print(f"| {name} | {rates[0]:.0f} | {rates[1]:.0f} | {statistics.median(b / a for a, b in pairs):.1f} |", flush=True)

        def of_wells(density):
            deck = tomllib.loads((ROOT / "inputs/square-well.toml").read_text())
            deck.pop("bath")
            deck["particles"][0]["count"] = 10976
            deck["placement"]["packing_fraction"] = density * math.pi / 6
            deck["run"]["end_time"] = 8.0
            deck["output"] |= {"frame_interval": 1e9, "thermo_interval": 1.0}
            (directory / "wells.toml").write_text(toml_text(deck))
            seconds = user_seconds([carom, "run", "wells.toml", "--quiet", "-o", "run"])
            events = read_summary(directory / "run")["events"]
            return seconds / sum(events[kind] for kind in ("sphere_sphere", "entered", "left", "bounced"))

        for density in [] if given.wells is None else given.wells or [0.5, 0.8]:
            user_seconds([given.dynamo / "dynamod", "-m", "1", "--f1", "1.5", "--f2", "1", "-C", "14", "-d", repr(density), "-r", "1.5",
                          "-s", "1", "-o", "lattice.xml"])
            user_seconds([given.dynamo / "dynarun", "lattice.xml", "-E", "-c", "400000", "-o", "melt.xml"])
            print_row(density, [(of_wells(density), user_seconds([given.dynamo / "dynarun", "melt.xml", "-E", "-c", "400000", "-o", "end.xml"])
                                 / 400000) for _ in range(given.repeat)])
        if given.sizes:
            small, large, filled = 10966, 10, 0.005  # at higher ones large spheres overlap on the lattice of dynamod
            density = (small + large) * filled / (math.pi / 6 * (large + small / 1000))
            user_seconds([given.dynamo / "dynamod", "-m", "8", "--f1", "0.1", "--f2", "0.001", "--i2", str(large), "-C", "14", "-d", repr(density),
                          "-r", "1", "-s", "1", "-o", "lattice.xml"])
            user_seconds([given.dynamo / "dynarun", "lattice.xml", "-E", "-c", "60000", "-o", "melt.xml"])
            deck = tomllib.loads((ROOT / "inputs/ten-to-one.toml").read_text())
            deck["particles"][0]["count"], deck["particles"][1]["count"] = large, small
            deck["placement"]["packing_fraction"] = filled
            deck["run"]["collisions"] = given.collisions
            deck["output"] |= {"frame_interval": 1e9, "thermo_interval": 1e9}
            (directory / "sizes.toml").write_text(toml_text(deck))
            print_row(filled, [[user_seconds(command) / given.collisions for command in (
                [carom, "run", "sizes.toml", "--quiet", "-o", "run"],
                [given.dynamo / "dynarun", "melt.xml", "-E", "-c", str(given.collisions), "-o", "end.xml"])] for _ in range(given.repeat)])
        for filled in given.filled if given.wells is None and not given.sizes else []:
            user_seconds([given.dynamo / "dynamod", "-m", "0", "--i1", "2", "-x", "20", "-y", "20", "-z", "25", "--rectangular-box",
                          "-d", repr(6 * filled / math.pi), "-s", "1", "-o", "lattice.xml"])
            user_seconds([given.dynamo / "dynarun", "lattice.xml", "-E", "-c", "60000", "-o", "melt.xml"])
            gas = [carom, "run", ROOT / "inputs/hard-sphere-fluid.toml", "--quiet", "-o", directory / "run"]
            for value in ("particles.0.count=10000", "placement.type=random", f"placement.packing_fraction={filled}",
                          f"run.collisions={given.collisions}", "run.end_time=1e9", "output.events=false", "output.frame_interval=1e9",
                          "output.thermo_interval=1e9"):
                gas += ["--set", value]
            print_row(filled, [[user_seconds(command) / given.collisions for command in (
                gas, [given.dynamo / "dynarun", "melt.xml", "-E", "-c", str(given.collisions), "-o", "end.xml"])] for _ in range(given.repeat)])


if __name__ == "__main__":
    main()
