#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Regression runs: does Carom still compute, bit for bit, what it computed when the results were stored?

    CAROM=build/release/io/carom tests/regression/regression.py check cva-2d
    tests/regression/regression.py bits cva-2d --program build/clang/tests/regression/final_state   # sha256 alone
    tools/renew-regression                      # runs all, shows what changed, stores the new results

A case is a deck in decks/ and a file of the same name in results/ that holds
  sha256     of the final positions, then velocities, in the order of ids, as little-endian doubles;
  values     counts of events, energies, the largest energy error;
  summary    all that summary.json says of the run, not of the machine;
  thermo     the last row of thermo.csv;
  state      the final positions and velocities.
All of it is the same on every processor and by every compiler.
"""

import argparse
import hashlib
import json
import pathlib
import shlex
import subprocess
import sys
import tempfile

import numpy as np

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parents[1] / "tools"))

from carom_files import Trajectory, find_carom, read_thermo, run_carom
from compare import OF_THE_MACHINE


def flat(entries, prefix=""):
    """Flattens nested dictionaries, with names like energy.final."""
    found = {}
    for name, value in entries.items():
        found |= flat(value, f"{prefix}{name}.") if isinstance(value, dict) else {prefix + name: value}
    return found


def number_or_null(value):
    return None if np.isnan(value) else float(value)


def run_case(carom, name):
    """Runs a case and returns the contents for its results file."""
    with tempfile.TemporaryDirectory() as directory:
        summary = run_carom(carom, HERE / "decks" / f"{name}.toml", directory)
        thermo = {name: number_or_null(column[-1]) for name, column in read_thermo(directory).items()}
        with Trajectory(directory) as trajectory:
            x, v = trajectory.position(-1), trajectory.velocity(-1)
    raw = x.astype("<f8").tobytes() + v.astype("<f8").tobytes()
    energy = summary["energy"]
    return {
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


def differences(stored, new):
    """The failures of a check, one line each."""
    lines = []
    for part in ("values", "summary", "thermo"):
        lines += [f"{name}: is no more" for name in sorted(stored[part].keys() - new[part].keys())]
        lines += [f"{name}: stored {stored[part][name]}, now {new[part][name]}"
                  for name in sorted(stored[part].keys() & new[part].keys()) if stored[part][name] != new[part][name]]
    for part in ("x", "v"):
        old, value = np.array(stored["state"][part]), np.array(new["state"][part])
        if old.shape != value.shape:
            lines.append(f"final {part}: shape {old.shape} stored, now {value.shape}")
        elif (old != value).any():
            worst = np.unravel_index(np.argmax(np.abs(old - value)), old.shape)[0]
            lines.append(f"final {part}: differs by up to {np.max(np.abs(old - value)):.3e}, at particle {worst}")
    if stored["sha256"] != new["sha256"] and not lines:
        lines.append("sha256: other bits")
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


def check_bits(program, name):
    """Compares the hash only, of what final_state.cc, made for any processor by any compiler, writes."""
    state = subprocess.run([*program, str(HERE / "decks" / f"{name}.toml")], stdout=subprocess.PIPE, check=True).stdout
    same = hashlib.sha256(state).hexdigest() == stored_result(name)["sha256"]
    print(f"{name}: {'the stored bits' if same else 'other bits'}")
    return 0 if same else 1


def renew(carom, names):
    for name in names:
        stored, new = stored_result(name), run_case(carom, name)
        if stored == new:
            print(f"{name}: as stored")
            continue
        lines = differences(stored, new) if stored else ["new"]
        print("\n".join(f"{name}: {line}" for line in lines or ["new entries"]))
        result_file(name).parent.mkdir(exist_ok=True)
        result_file(name).write_text(json.dumps(new, indent=1) + "\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("action", choices=["check", "bits", "renew"])
    parser.add_argument("cases", nargs="*", help="default: all")
    parser.add_argument("--program", type=shlex.split, help="bits: the program final_state, after the emulator that it needs")
    options = parser.parse_args()
    names = options.cases or sorted(deck.stem for deck in (HERE / "decks").glob("*.toml"))
    if options.action == "bits":
        return max([check_bits(options.program, name) for name in names])
    carom = find_carom()
    if options.action == "renew":
        return renew(carom, names)
    return max([check(carom, name) for name in names])


if __name__ == "__main__":
    sys.exit(main())
