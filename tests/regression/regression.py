#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Regression runs: does Carom still compute, bit for bit, what it computed when the results were stored?

    CAROM=build/release/io/carom tests/regression/regression.py check cva-2d
    tools/renew-regression                      # runs all, shows what changed, stores the new results

A case is a deck in decks/ and a file of the same name in results/ that holds
  platform   compiler and architecture of the stored run;
  sha256     of the final positions, then velocities, in the order of ids, as little-endian doubles;
  values     counts of events, energies, the largest energy error;
  summary    all that summary.json says of the run, not of the machine;
  thermo     the last row of thermo.csv;
  state      the final positions and velocities.
On the stored platform the hash decides, and summary and thermo are equal. Elsewhere, where another compiler may round
otherwise, counts must agree and all else within a tolerance, but for what rounding alone decides (ROUNDED); the decks are
short enough for chaos not to blow rounding up to it.
"""

import argparse
import hashlib
import json
import pathlib
import platform
import re
import subprocess
import sys
import tempfile

import numpy as np

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parents[1] / "tools"))

from carom_files import Trajectory, find_carom, read_thermo, run_carom
from compare import OF_THE_MACHINE

STATE_TOLERANCE = 1e-8  # absolute, of positions, velocities and the end time; changes of 1e-15 in the start come to 3e-11
ENERGY_TOLERANCE = 1e-8  # relative to E_ref
ROUNDING = 1e-12  # energy errors below this, relative to E_ref, count as equal
MEAN_TOLERANCE = 1e-8  # relative, or absolute below 1, of pressures, rates and the like
ROUNDED = re.compile("max_overlap|_error$|folded|force_passes|sweeps|pieces|slabs_halved|frozen|fallbacks|momentum")


def this_platform(carom):
    """Compiler and architecture, for instance "g++ 12.2.0, x86_64", from `carom --version`."""
    version = subprocess.run([str(carom), "--version"], capture_output=True, text=True, check=True).stdout
    compiler = re.search(r"(?:g\+\+|clang) [\d.]+", version)
    if not compiler:
        raise SystemExit(f"carom --version names no compiler that is known here:\n{version}")
    return f"{compiler.group()}, {platform.machine()}"


def flat(entries, prefix=""):
    """Nested dictionaries as one, with names like energy.final."""
    found = {}
    for name, value in entries.items():
        found |= flat(value, f"{prefix}{name}.") if isinstance(value, dict) else {prefix + name: value}
    return found


def number_or_null(value):
    return None if np.isnan(value) else float(value)


def run_case(carom, name):
    """Runs a case and returns what its results file should hold."""
    with tempfile.TemporaryDirectory() as directory:
        summary = run_carom(carom, HERE / "decks" / f"{name}.toml", directory)
        thermo = {name: number_or_null(column[-1]) for name, column in read_thermo(directory).items()}
        with Trajectory(directory) as trajectory:
            x, v = trajectory.position(-1), trajectory.velocity(-1)
    raw = x.astype("<f8").tobytes() + v.astype("<f8").tobytes()
    energy = summary["energy"]
    return {
        "platform": this_platform(carom),
        "sha256": hashlib.sha256(raw).hexdigest(),
        "values": {
            "steps": summary["steps"], "end_time": summary["end_time"],
            "sphere_sphere": summary["events"]["sphere_sphere"], "sphere_wall": summary["events"]["sphere_wall"],
            "energy_final": energy["final"], "energy_reference": energy["reference"],
            "energy_error": energy["max_abs_error"], "shadow_energy_error": summary["shadow_energy"]["max_abs_error"],
        },
        "summary": flat({name: value for name, value in summary.items() if name not in OF_THE_MACHINE}),
        "thermo": thermo,
        "state": {"x": x.tolist(), "v": v.tolist()},
    }


def value_differences(stored, new):
    """One line for each value that changed by more than its tolerance."""
    lines, reference = [], stored["energy_reference"]
    for name, old in stored.items():
        value = new[name]
        if old is None or value is None:
            same = old is value
        elif name.endswith("_error"):
            same = abs(old - value) <= 1e-3 * max(old, value) or max(old, value) <= ROUNDING * reference
        elif name.startswith("energy"):
            same = abs(old - value) <= ENERGY_TOLERANCE * reference
        elif name == "end_time":
            same = abs(old - value) <= STATE_TOLERANCE
        else:
            same = old == value
        if not same:
            lines.append(f"{name}: stored {old}, now {value}")
    return lines


def account_differences(stored, new, exact):
    """One line for each stored entry of a summary or a row that changed: at all, or by more than rounding can do."""
    lines = [f"{name}: is no more" for name in sorted(stored.keys() - new.keys())]
    for name in sorted(stored.keys() & new.keys()):
        old, value = stored[name], new[name]
        same = old == value
        if not exact and not same:
            same = bool(ROUNDED.search(name)) or (isinstance(old, float) and isinstance(value, float)
                                                  and abs(old - value) <= MEAN_TOLERANCE * max(1, abs(old)))
        if not same:
            lines.append(f"{name}: stored {old}, now {value}")
    return lines


def differences(stored, new):
    """What a check objects to, one line each."""
    lines = value_differences(stored["values"], new["values"])
    for part in ("summary", "thermo"):
        lines += account_differences(stored.get(part, {}), new[part], stored["platform"] == new["platform"])
    for part in ("x", "v"):
        old, value = np.array(stored["state"][part]), np.array(new["state"][part])
        if old.shape != value.shape:
            lines.append(f"final {part}: shape {old.shape} stored, now {value.shape}")
        elif np.max(np.abs(old - value)) > STATE_TOLERANCE:
            worst = np.unravel_index(np.argmax(np.abs(old - value)), old.shape)[0]
            lines.append(f"final {part}: differs by up to {np.max(np.abs(old - value)):.3e}, at particle {worst}")
    if stored["platform"] == new["platform"] and stored["sha256"] != new["sha256"]:
        changed = sum(a != b for part in ("x", "v") for a, b in zip(stored["state"][part], new["state"][part]))
        lines.append(f"sha256: other bits on the same platform ({stored['platform']}), in {changed} vectors")
    return lines


def result_file(name):
    return HERE / "results" / f"{name}.json"


def stored_result(name):
    return json.loads(result_file(name).read_text()) if result_file(name).exists() else None


def check(carom, name):
    stored = stored_result(name)
    if stored is None:
        print(f"{name}: nothing is stored; run tools/renew-regression")
        return 1
    lines = differences(stored, run_case(carom, name))
    print("\n".join([f"{name}: {line}" for line in lines] or [f"{name}: as stored"]))
    return 1 if lines else 0


def renew(carom, names):
    for name in names:
        stored, new = stored_result(name), run_case(carom, name)
        if stored == new:
            print(f"{name}: as stored")
            continue
        lines = differences(stored, new) if stored else ["new"]
        if stored and stored["platform"] != new["platform"]:
            lines.append(f"platform: {stored['platform']} becomes {new['platform']}")
        print("\n".join(f"{name}: {line}" for line in lines or ["last digits"]))
        result_file(name).parent.mkdir(exist_ok=True)
        result_file(name).write_text(json.dumps(new, indent=1) + "\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("action", choices=["check", "renew"])
    parser.add_argument("cases", nargs="*", help="default: all")
    options = parser.parse_args()
    names = options.cases or sorted(deck.stem for deck in (HERE / "decks").glob("*.toml"))
    carom = find_carom()
    if options.action == "renew":
        return renew(carom, names)
    return max([check(carom, name) for name in names])


if __name__ == "__main__":
    sys.exit(main())
