#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Whether Carom and DynamO (github.com/dynamomd/DynamO) make the same events from the same start: 500 spheres with square wells.

    tests/benchmarks/events_of_dynamo.py DIRECTORY --carom build/release/io/carom

DIRECTORY has the programs dynamod and dynarun. The start is a state of Carom in a bath at temperature 1.5; its positions are rounded to
multiples of 2^-40, so that both programs get the same numbers although DynamO's box is centred at zero. Events are compared one by
one: pair, kind (cores collide, a pair enters the well, leaves it, or turns back at its edge) and time, of which DynamO's plugin
Trajectory prints four decimals. The table has the largest difference of a coordinate between the two programs, and between two runs of
Carom, one of which starts with one sphere displaced by 2^-40. Both differences grow exponentially; the script fits their rates.
"""

import argparse
import bz2
import pathlib
import re
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as xml

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))
from carom_files import Trajectory, find_carom, open_hdf5, run_carom, toml_text

EDGE, COUNT, INTERVAL, GRID = 10.0, 500, 0.25, 2.0**-40
KINDS = {0: "CORE", 3: "STEP_IN", 4: "STEP_OUT", 5: "BOUNCE"}


def deck(end, **more):
    sphere = {"name": "sphere", "radius": 0.5} | more
    return {"format": 1, "system": {"dimension": 3, "box": [EDGE] * 3, "boundary": ["periodic"] * 3}, "particles": [sphere],
            "step": [{"between": ["sphere", "sphere"], "range": 1.5, "depth": 1.0}], "integrator": {"type": "free-flight"},
            "run": {"end_time": end}, "output": {"frame_interval": INTERVAL, "thermo_interval": INTERVAL, "events": True}}


def of_carom(carom, directory, what):
    """The positions and velocities of the frames of a run, and its events: times, pairs, kinds."""
    directory.mkdir()
    (directory / "start.toml").write_text(toml_text(what))
    run_carom(carom, directory / "start.toml", directory / "run")
    with Trajectory(directory / "run") as trajectory:
        frames = [(trajectory.position(k), trajectory.velocity(k)) for k in range(len(trajectory.time))]
    with open_hdf5(directory / "run" / "events.h5") as file:
        time, kind, lo, hi = (file["events"][name][:] for name in ("time", "kind", "lo", "hi"))
    return frames, time, list(zip(lo, hi, (KINDS[each] for each in kind)))


def of_dynamo(dynamo, directory, position, velocity, events, end):
    """The positions of DynamO's snapshots, and its events: times, pairs, kinds."""
    config = xml.Element("DynamOconfig", version="1.5.0")

    def add(parent, tag, **attributes):
        return xml.SubElement(parent, tag, attributes)

    simulation = add(config, "Simulation")
    add(add(simulation, "Scheduler", Type="NeighbourList"), "Sorter", Type="BoundedPQMinMax3")
    add(simulation, "SimulationSize", **{axis: repr(EDGE) for axis in "xyz"})
    add(add(add(simulation, "Genus"), "Species", Mass="1", Name="Bulk", Type="Point"), "IDRange", Type="All")
    add(simulation, "BC", Type="PBC")
    well = add(add(simulation, "Interactions"), "Interaction", Type="SquareWell", Diameter="1", Elasticity="1", Lambda="1.5", WellDepth="1",
               Name="Bulk")
    add(well, "IDPairRange", Type="All")
    add(simulation, "Dynamics", Type="Newtonian")
    add(config, "Properties")
    particles = add(config, "ParticleData")
    for number, rows in enumerate(zip(position - EDGE / 2, velocity)):
        particle = add(particles, "Pt", ID=str(number))
        for tag, row in zip("PV", rows):
            add(particle, tag, **{axis: repr(float(value)) for axis, value in zip("xyz", row)})
    xml.ElementTree(config).write(directory / "start.xml")
    subprocess.run([dynamo / "dynarun", "start.xml", "-c", str(events), "-f", repr(end), "--snapshot", repr(INTERVAL), "-L", "Trajectory",
                    "-o", "end.xml", "--out-data-file=output.xml"], cwd=directory, check=True, capture_output=True)
    times, made = [], []
    event = re.compile(r"Event Type=(\w+), t=([\d.]+).*\n   2PEvent: p1=(\d+), p2=(\d+).*post-rvdot=(-?)")
    for kind, time, lo, hi, minus in event.findall((directory / "trajectory.out").read_text()):
        times.append(float(time))
        made.append((int(lo), int(hi), "BOUNCE" if kind == "STEP_OUT" and minus else kind))
    frames = []
    for number in range(round(end / INTERVAL)):
        file = next(directory.glob(f"Snapshot.{number}.xml*"), None)
        if file is None:
            break
        rows = xml.fromstring((bz2.decompress if file.suffix == ".bz2" else bytes)(file.read_bytes())).iter("P")
        frames.append(np.array([[float(row.get(axis)) for axis in "xyz"] for row in rows]) + EDGE / 2)
    return frames, np.array(times), made


def apart(first, second):
    """The largest difference of a coordinate."""
    return abs((first - second + EDGE / 2) % EDGE - EDGE / 2).max()


def growth(time, difference):
    """The rate at which a difference grows, from ten times its first value until it may change the order of events."""
    part = (difference > 10 * difference[0]) & (difference < 1e-3)
    return np.polyfit(time[part], np.log(difference[part]), 1)[0]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dynamo", type=pathlib.Path)
    parser.add_argument("--carom")
    parser.add_argument("--end", type=float, default=6.0, help="time of the end")
    parser.add_argument("--seed", type=int, default=7, help="of the start")
    given = parser.parse_args()
    carom = find_carom(given.carom)
    with tempfile.TemporaryDirectory() as name:
        directory = pathlib.Path(name)
        bath = {"placement": {"type": "fcc", "seed": given.seed}, "bath": [{"type": "andersen", "temperature": 1.5, "rate": 0.1}]}
        (position, velocity), = of_carom(carom, directory / "melt", deck(20.0, count=COUNT, temperature=1.5) | bath)[0][-1:]
        position = np.round(position / GRID) * GRID % EDGE
        frames, times, events = of_carom(carom, directory / "carom", deck(given.end, position=position, velocity=velocity))
        moved = position.copy()
        moved[0, 0] = (moved[0, 0] + GRID) % EDGE
        displaced, _, displaced_events = of_carom(carom, directory / "moved", deck(given.end, position=moved, velocity=velocity))
        theirs, their_times, their_events = of_dynamo(given.dynamo.resolve(), directory, position, velocity, 10 * len(events), given.end)
    same = next((k for k, pair in enumerate(zip(events, their_events)) if pair[0] != pair[1]), min(len(events), len(their_events)))
    wrong = abs(times[:same] - their_times[:same]).max()
    print(f"Up to time {given.end:g} Carom makes {len(events)} events, DynamO {len(their_events)}, and Carom with one sphere displaced "
          f"{len(displaced_events)}.")
    print(f"The first {same} have the same pairs and kinds in the same order, up to time {times[same - 1]:.3f}: "
          + ", ".join(f"{sum(event[2] == kind for event in events[:same])} {kind}" for kind in KINDS.values()) + ".")
    print(f"Their times differ by at most {wrong:.1e}, where DynamO prints four decimals.")
    print("\n| time | events until then | Carom and DynamO | Carom, one sphere displaced |\n|---|---|---|---|")
    rows = np.array([(k * INTERVAL, np.searchsorted(times, k * INTERVAL), apart(frames[k][0], theirs[k - 1]), apart(frames[k][0], displaced[k][0]))
                     for k in range(1, len(theirs) + 1)])
    for time, count, ours, other in rows[rows[:, 2] < 1][1::2]:
        print(f"| {time:g} | {count:.0f} | {ours:.0e} | {other:.0e} |")
    print(f"\nThe differences grow as exp({growth(rows[:, 0], rows[:, 2]):.1f} t) and exp({growth(rows[:, 0], rows[:, 3]):.1f} t).")


if __name__ == "__main__":
    main()
