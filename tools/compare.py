#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Are two runs equal, bit for bit or within a tolerance?

    tools/compare.py runs/a runs/b                      # every frame and every thermo row, bit for bit
    tools/compare.py runs/a runs/b --tolerance 1e-9     # largest absolute difference of positions, velocities, thermo
    tools/compare.py runs/a runs/b --last               # only the final records: for runs with other output intervals
    tools/compare.py runs/a runs/b --summary            # summary.json too, except for wall clock, memory and ranks

The tool compares all data sets of /particles and /observables of the trajectory, thermo.csv, and events.h5 and averages if both runs
have them, but not the resolved decks and the times of the wall clock. Exit code 0: equal; 1: different.
"""

import argparse
import pathlib
import sys

import h5py
import numpy as np

from carom_files import TRAJECTORY, one_line, open_hdf5, read_summary, read_table, read_thermo, reading

TABLES = ["rdf.csv", "sk.csv", "msd.csv", "profile.csv", "transport.csv", "pressure_tensor.csv"]
# The fields of the summary that describe the machine and the directory, not the run.
OF_THE_MACHINE = {"deck", "version", "ranks", "wall_seconds", "collisions_per_second", "peak_memory_bytes"}


def data_sets(path, groups):
    """All data sets of an HDF5 file below the given groups, by their full names."""
    with reading(path), open_hdf5(path) as file:
        return _data_sets(file, groups)


def _data_sets(file, groups):
    found = {}
    for group in groups:
        if group in file:
            file[group].visititems(
                lambda name, item: found.update({f"/{group}/{name}": item[()]}) if isinstance(item, h5py.Dataset) else None)
            if isinstance(file[group], h5py.Dataset):
                found[f"/{group}"] = file[group][()]
    return found


def last_frame(sets):
    """The final records of a trajectory: step, time and the last frame of each value."""
    frames = {name: value[-1] for name, value in sets.items()
              if name.startswith("/particles") and name.rsplit("/", 1)[-1] in ("value", "step", "time")}
    fixed = {name: value for name, value in sets.items() if name.startswith("/particles") and name not in frames}
    return frames | fixed


def differences(a, b, tolerance):
    """One line for each array that differs (tolerance None: in any bit)."""
    lines = [f"only in one: {name}" for name in sorted(a.keys() ^ b.keys())]
    for name in sorted(a.keys() & b.keys()):
        left, right = np.asarray(a[name]), np.asarray(b[name])
        if left.shape != right.shape:
            lines.append(f"{name}: shape {left.shape} against {right.shape}")
        elif left.dtype != right.dtype:
            lines.append(f"{name}: type {left.dtype} against {right.dtype}")
        elif left.tobytes() == right.tobytes():
            continue
        elif not np.issubdtype(left.dtype, np.floating):
            if tolerance is None or not np.array_equal(left, right):
                lines.append(f"{name}: {np.count_nonzero(left != right)} of {left.size} differ")
        else:
            distance = np.where(np.isnan(left) & np.isnan(right), 0.0, np.abs(left - right))
            worst = np.max(np.nan_to_num(distance, nan=np.inf))
            if tolerance is None or worst > tolerance:
                lines.append(f"{name}: differ by up to {worst:.3e}")
    return lines


def summary_differences(a, b):
    """One line for each field of two summaries that differs, except for the fields of the machine."""
    a, b = read_summary(a), read_summary(b)
    return [f"summary.json, {name}: {a.get(name)} against {b.get(name)}"
            for name in sorted((a.keys() | b.keys()) - OF_THE_MACHINE) if a.get(name) != b.get(name)]


def compare(a, b, tolerance=None, last=False):
    """The differences between two runs, one line each; empty if there are none."""
    a, b = pathlib.Path(a), pathlib.Path(b)
    sets = [data_sets(run / TRAJECTORY, ("particles", "observables")) for run in (a, b)]
    if last:
        return differences(*map(last_frame, sets), tolerance)
    lines = differences(*sets, tolerance)
    lines += [f"thermo.csv, {line}" for line in differences(read_thermo(a), read_thermo(b), tolerance)]
    for name in TABLES:
        if (a / name).exists() and (b / name).exists():
            lines += [f"{name}, {line}" for line in differences(read_table(a / name), read_table(b / name), tolerance)]
    if (a / "events.h5").exists() and (b / "events.h5").exists():
        events = [data_sets(run / "events.h5", ["events"]) for run in (a, b)]
        lines += [f"events.h5, {line}" for line in differences(*events, tolerance)]
    return lines


@one_line
def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("a", type=pathlib.Path, help="directory of a run")
    parser.add_argument("b", type=pathlib.Path, help="directory of another")
    parser.add_argument("--tolerance", type=float, help="allowed absolute difference; default: none, bit for bit")
    parser.add_argument("--last", action="store_true", help="compare the final records only")
    parser.add_argument("--summary", action="store_true", help="compare summary.json too")
    options = parser.parse_args(arguments)
    lines = compare(options.a, options.b, options.tolerance, options.last)
    if options.summary:
        lines += summary_differences(options.a, options.b)
    print("\n".join(lines) if lines else "the same")
    return 1 if lines else 0


if __name__ == "__main__":
    sys.exit(main())
