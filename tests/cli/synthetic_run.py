# SPDX-License-Identifier: BSD-3-Clause
"""Writes the files of a run from given positions, as `carom run` would: for tests of the tools that read them."""

import csv
import json

import h5py
import numpy as np

DECK = """format = 1
[system]
dimension = {dimension}
"""


def three_columns(rows):
    """[..., dimension] padded with zeros to [..., 3]."""
    rows = np.asarray(rows)
    return np.concatenate([rows, np.zeros(rows.shape[:-1] + (3 - rows.shape[-1],), rows.dtype)], axis=-1)


def write_trajectory(path, x, v, edges, boundary, radius=0.1, dt=0.5, image=None, species=None, names=("sphere",)):
    """x, v: [frames][particles][dimension]."""
    frames, particles, dimension = np.shape(x)
    text = lambda words: np.array(words, dtype="S16")
    with h5py.File(path, "w") as file:
        file.create_group("h5md").attrs["version"] = np.array([1, 1], dtype="i4")
        file.create_group("h5md/author").attrs["name"] = np.bytes_("tester")
        creator = file.create_group("h5md/creator")
        creator.attrs["name"], creator.attrs["version"] = np.bytes_("synthetic"), np.bytes_("1")
        group = file.create_group("particles/trajectory")
        image = np.zeros(np.shape(x), dtype="i4") if image is None else image
        for name, rows in (("position", x), ("velocity", v), ("image", image)):
            group[f"{name}/value"] = three_columns(rows)
        group["position/step"] = np.arange(frames, dtype="i8")
        group["position/time"] = dt * np.arange(frames)
        box = group.create_group("box")
        box.attrs["dimension"] = np.int32(3)
        rules = ["periodic" if rule == "periodic" else "none" for rule in boundary] + ["none"] * (3 - dimension)
        box.attrs["boundary"] = text(rules)
        box["edges/value"] = np.tile(np.diag(np.append(edges, np.ones(3 - dimension))), (frames, 1, 1))
        for name, value in (("mass", 1.0), ("radius", radius), ("charge", 0.0)):
            group[name] = np.full(particles, value)
        group["species"] = np.zeros(particles, dtype="i4") if species is None else species
        group["id"] = np.arange(particles, dtype="u4")
        file["observables/kinetic_energy/value"] = 0.5 * np.sum(np.square(v), axis=(1, 2))
        for name in ("particles/trajectory/velocity", "particles/trajectory/image", "particles/trajectory/box/edges",
                     "observables/kinetic_energy"):
            file[f"{name}/step"], file[f"{name}/time"] = group["position/step"], group["position/time"]
        for name, value in (("deck", DECK.format(dimension=dimension)), ("title", "synthetic"), ("integrator", "none")):
            file[f"parameters/{name}"] = np.bytes_(value)
        file["parameters/dimension"] = np.int32(dimension)
        file["parameters/boundary"], file["parameters/species"] = text(boundary), text(names)


def write_run(directory, total, **trajectory):
    """A trajectory (arguments of write_trajectory), thermo.csv with the given total energies, and summary.json."""
    directory.mkdir(parents=True, exist_ok=True)
    write_trajectory(directory / "trajectory.h5md", **trajectory)
    with open(directory / "thermo.csv", "w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["time", "total", "shadow"])
        rows.writerows([0.5 * k, repr(energy), ""] for k, energy in enumerate(total))
    energy = {"after_first_step": total[0], "reference": 2.0}
    (directory / "summary.json").write_text(json.dumps({"status": "done", "energy": energy}))
