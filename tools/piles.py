#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Do piles come to rest, without overlaps and with a closed ledger, and what does it cost?

    tools/piles.py rows                                # 40 discs, three widths, five restitutions, --seeds 5, edda and psa
    tools/piles.py random --seeds 40 --methods edda,cdda,psa,cva,mcva
    tools/piles.py balls                               # a ball bounces: the time at which it rests, against the formula
    tools/piles.py large --seeds 1                     # 200 spheres in 3-D, 500 discs
    tools/piles.py rows --rest 10000                   # then this many steps at rest
    tools/piles.py rows --only width=10.37_e=0.5       # cases whose names have this part

Contacts have the default rest speed unless the name of a case says otherwise. For each case the script prints the processor time,
the largest |H + dissipated - work - H(0)| over the reference of energy errors, the largest overlap over the contact distance (the
larger of the run's own figure, which includes walls, and that of two spheres in all frames), and the kinetic energy that is left for
each sphere, where a sphere of mass 1 that falls by a diameter has 1. Exit code 1: a run fails, takes more than --patience seconds,
overlaps by more than 1e-11, moves at the end (rows, large), has an error of the ledger above 1e-12 (edda, cdda), or a ball rests
more than a step before or after the time of the formula (all but psa, whose kicks end slow bounces earlier).
"""

import argparse
import concurrent.futures
import math
import os
import pathlib
import random
import resource
import shutil
import signal
import subprocess
import sys

import numpy as np

from carom_files import Trajectory, find_carom, one_line, read_summary, read_thermo, toml_text
from random_systems import log_uniform

STEP = 0.02
OVERLAP, LEDGER, REST = 1e-11, 1e-12, 1e-12
EXACT = ("edda", "cdda")


def pile(count, box, restitution, seed, dimension=2, end=60.0):
    """A deck: spheres of diameter 1 fall into a box that is periodic along all axes but the last."""
    down = [0.0] * (dimension - 1) + [-1.0]
    return {"format": 1, "system": {"dimension": dimension, "box": box, "boundary": ["periodic"] * (dimension - 1) + ["wall"]},
            "contact": [{"between": ["*", "*"], "restitution": restitution}],
            "particles": [{"name": "a", "count": count, "radius": 0.5, "temperature": 1.0}], "placement": {"type": "random", "seed": seed},
            "interaction": [{"type": "uniform-field", "acceleration": down}], "run": {"end_time": end}}


def rows(seed):
    for width in (10.0, 10.37, 11.0):
        for restitution in (0.0, 0.5, 0.8, 0.9, 0.95):
            yield f"width={width}_e={restitution}", pile(40, [width, 30.0], restitution, seed)


def large(seed):
    yield "3d_200_e=0.5", pile(200, [5.37, 5.37, 20.0], 0.5, seed, dimension=3)
    yield "2d_500_e=0.5", pile(500, [40.37, 60.0], 0.5, seed)


def random_pile(seed):
    """2 to 60 bodies of one or two sizes and laws; some are pulled sideways, start at rest, or lie on a floor that moves."""
    dice = random.Random(seed)
    dimension, count = dice.choice([2, 2, 3]), round(log_uniform(dice, 2, 60))
    sideways = dice.choice([0.0, 0.0, dice.uniform(-0.5, 0.5)])
    boundary = [dice.choice(["wall", "periodic"] if sideways == 0 else ["wall"]) for _ in range(dimension - 1)] + ["wall"]
    width = dice.choice([round(dice.uniform(2.2, 8), 2), float(dice.randint(3, 8))])
    height = max(4.0, 4 * count / width ** (dimension - 1))
    deck = pile(count, [width] * (dimension - 1) + [height], round(dice.uniform(0, 0.95), 3), seed, dimension, end=40.0)
    deck["system"]["boundary"] = boundary
    deck["interaction"][0]["acceleration"][0] = sideways
    if dice.random() < 0.4 and count > 2:
        few = dice.randint(1, count - 1)
        other = {"name": "b", "count": few, "radius": round(dice.uniform(0.25, 0.5), 3), "mass": log_uniform(dice, 0.1, 10), "temperature": 1.0}
        deck["particles"] = [deck["particles"][0] | {"count": count - few}, other]
        deck["contact"].append({"between": ["b", "*"], "restitution": round(dice.uniform(0, 0.95), 3)})
    if dice.random() < 0.3:
        for species in deck["particles"]:
            species["temperature"] = 0.0
    if dice.random() < 0.3:
        deck["wall"] = [{"name": "xyz"[dimension - 1] + "-", "velocity": dice.choice([-0.02, 0.02])}]
    return deck


def ball(restitution, rest_speed):
    deck = pile(1, [5.0, 5.0], restitution, 1, end=0.0)
    deck["particles"] = [{"name": "a", "radius": 0.5, "position": [[2.5, 1.5]]}]  # its gap to the floor is 1
    del deck["placement"]
    deck["contact"][0]["rest_speed"] = rest_speed
    deck["run"]["end_time"] = 2 * time_of_rest(restitution, rest_speed) + 1
    return deck


def time_of_rest(restitution, rest_speed):
    """The time of the first impact below the rest speed, of a ball that falls by 1 under an acceleration of 1."""
    time = speed = math.sqrt(2)
    while speed >= rest_speed:
        speed *= restitution
        time += 2 * speed
    return time


def balls(_):
    for restitution in (0.1, 0.3, 0.5, 0.7, 0.8, 0.9, 0.95):
        for rest_speed in (1e-6, 1e-4, 1e-2, 1e-1):
            yield f"e={restitution}_rest={rest_speed:g}", ball(restitution, rest_speed)


SETS = {"rows": rows, "large": large, "balls": balls, "random": lambda seed: [("random", random_pile(seed))]}


def deepest_overlap(where):
    """The largest overlap of two spheres in all frames, over their contact distance."""
    with Trajectory(where) as frames:
        radius, most = frames.radius, 0.0
        edges, sigma = frames.edges() * frames.periodic, radius[:, None] + radius
        i, j = np.triu_indices(len(radius), 1)
        for frame in range(len(frames)):
            x = frames.position(frame)
            apart = x[i] - x[j]
            apart -= edges * np.round(apart / np.where(edges > 0, edges, 1))
            most = max(most, np.max(1 - np.linalg.norm(apart, axis=1) / sigma[i, j], initial=0.0))
    return most


def run(carom, name, deck, method, options):
    """Runs a case; returns a line of the table and whether it is as it should be."""
    where = options.output.resolve() / f"{name}_{method}"
    shutil.rmtree(where, ignore_errors=True)
    where.mkdir(parents=True)
    end = deck["run"]["end_time"] + options.rest * STEP
    deck = deck | {"integrator": {"type": method, "step": STEP}, "run": {"end_time": end},
                   "output": {"frame_interval": end / 40, "thermo_interval": STEP}}
    (where / "deck.toml").write_text(toml_text(deck))
    command = [str(carom), "run", str(where / "deck.toml"), "-o", str(where / "run"), "--quiet"]
    limit = (math.ceil(options.patience), math.ceil(options.patience) + 5)
    with (where / "stderr").open("w") as said:
        process = subprocess.Popen(command, stderr=said, stdout=said, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, limit))
        _, status, used = os.wait4(process.pid, 0)
    seconds = used.ru_utime + used.ru_stime
    if status != 0:
        slow = os.waitstatus_to_exitcode(status) in (-signal.SIGXCPU, -signal.SIGKILL)
        why = "too slow" if slow else (where / "stderr").read_text().strip()[-160:]
        return f"{name:32} {method:5}{seconds:8.2f} s  FAILS: {why}", False
    summary, thermo = read_summary(where / "run"), read_thermo(where / "run")
    energy = summary["energy"]
    ledger = energy["max_abs_error"] / (energy["reference"] or 1)
    overlap = max(summary["max_overlap"], deepest_overlap(where / "run"))
    count = sum(species.get("count", 1) for species in deck["particles"])
    good = overlap <= OVERLAP and (method not in EXACT or ledger <= LEDGER)
    left = thermo["kinetic"][-1] / count
    good = good and (left <= REST or options.set not in ("rows", "large"))
    line = f"{name:32} {method:5}{seconds:8.2f} s{ledger:10.1e}{overlap:10.1e}{left:10.1e}"
    if options.set == "balls":
        moves = thermo["time"][thermo["kinetic"] > 1e-20]  # at rest the last digits of forces may remain
        rest, law = moves[-1] if len(moves) else 0.0, deck["contact"][0]
        expected = time_of_rest(law["restitution"], law["rest_speed"])
        line += f"  at rest after {rest:.2f}, formula {expected:.2f}"
        if method != "psa":
            good = good and abs(rest - expected) <= 1.01 * STEP
    return line + ("" if good else "  WRONG"), good


@one_line
def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("set", choices=SETS)
    parser.add_argument("--seeds", type=int, default=5, help="from 1 on; balls use one")
    parser.add_argument("--methods", default="edda,psa")
    parser.add_argument("--rest", type=int, default=0, metavar="STEPS", help="go on for this many steps")
    parser.add_argument("--only", default="", metavar="PART")
    parser.add_argument("--patience", type=float, default=60, help="processor time that a case may take [s]")
    parser.add_argument("--carom", help="the command; default: $CAROM or the build of tools/run")
    parser.add_argument("-o", "--output", type=pathlib.Path, default=pathlib.Path("runs/piles"))
    options = parser.parse_args(arguments)
    carom = find_carom(options.carom)
    seeds = [1] if options.set == "balls" else range(1, options.seeds + 1)
    cases = [(f"{name}_seed={seed}", deck) for seed in seeds for name, deck in SETS[options.set](seed)]
    tasks = [(name, deck, method) for name, deck in cases for method in options.methods.split(",") if options.only in name]
    print(f"{'case':32} method    time    ledger   overlap   kinetic")
    wrong = 0
    with concurrent.futures.ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        for line, good in pool.map(lambda task: run(carom, *task, options), tasks):
            print(line, flush=True)
            wrong += not good
    print(f"{len(tasks)} runs, {wrong} not as they should be")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
