# SPDX-License-Identifier: BSD-3-Clause
"""Makes simulations from the files of other programs: GSD (HOOMD-blue), extended XYZ (OVITO, ASE) and LAMMPS data files.

Numbers keep the units that they have in the file. GSD needs Debian's python3-gsd, and extended XYZ needs python3-ase.
"""

import importlib
import math
import pathlib

import numpy as np

from carom.errors import FileError, UsageError

# The columns of an atom in a LAMMPS data file between its id and its image, by atom style.
SPHERE = ("type", "diameter", "density", "x", "y", "z")
STYLES = {"atomic": ("type", "x", "y", "z"), "charge": ("type", "charge", "x", "y", "z"), "sphere": SPHERE,
          "bond": ("molecule", "type", "x", "y", "z"), "angle": ("molecule", "type", "x", "y", "z"),
          "molecular": ("molecule", "type", "x", "y", "z"), "full": ("molecule", "type", "charge", "x", "y", "z")}
HYBRID = {"sphere": ("diameter", "density"), "charge": ("charge",), "bond": ("molecule",), "angle": ("molecule",),
          "molecular": ("molecule",), "full": ("molecule", "charge"), "atomic": ()}


def package(name, debian):
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise ImportError(f"reading this file needs the Python package {name.partition('.')[0]}: install Debian's {debian}, "
                          f"or pip install {name.partition('.')[0]}") from error


def read_gsd(path, frame):
    hoomd = package("gsd.hoomd", "python3-gsd")
    with hoomd.open(str(path), "rb") as file:
        snapshot = file[frame]
    p, box = snapshot.particles, np.asarray(snapshot.configuration.box, dtype=float)
    flat = snapshot.configuration.dimensions == 2
    # In GSD the origin is in the middle of the box. Single precision may put a position beyond an edge by its rounding.
    return {"edges": box[:3], "tilt": box[3:], "flat": flat, "periodic": [True, True, not flat],
            "position": np.asarray(p.position, dtype=float) + box[:3] / 2, "velocity": p.velocity, "mass": p.mass,
            "charge": p.charge, "spin": _spins_of_gsd(p), "radius": np.asarray(p.diameter, dtype=float) / 2, "kind": p.typeid, "names": list(p.types),
            "bonds": np.asarray(snapshot.bonds.group, dtype=int).reshape(-1, 2)}


def _spins_of_gsd(p):
    """The angular velocities of bodies whose moments of inertia are equal about all their axes, else none. The angular momentum is
    the vector part of ½ P q*, P the conjugate quaternion of the file and q the orientation."""
    moment = np.asarray(p.moment_inertia, dtype=float)
    if not p.angmom.any() or (moment[:, 2] <= 0).any() or any((moment[:, k] != moment[:, 2])[moment[:, k] != 0].any() for k in (0, 1)):
        return None
    P, q = np.asarray(p.angmom, dtype=float), np.asarray(p.orientation, dtype=float)
    momentum = (q[:, :1] * P[:, 1:] - P[:, :1] * q[:, 1:] - np.cross(P[:, 1:], q[:, 1:])) / 2
    return momentum / moment[:, 2:]


def read_extxyz(path, frame):
    atoms = package("ase.io", "python3-ase").read(str(path), index=frame, format="extxyz")
    cell, arrays = np.asarray(atoms.cell), atoms.arrays
    names, kind = np.unique(atoms.get_chemical_symbols(), return_inverse=True)
    velocity = next((arrays[name] for name in ("velo", "velocities", "vel", "velocity") if name in arrays), None)
    if velocity is None and atoms.has("momenta"):
        velocity = atoms.get_velocities()
    stated = str(atoms.info.get("species_names", "")).split(",")
    if len(stated) == len(names):  # in the order of the elements that replace them in the file
        order = np.argsort(np.argsort([atoms.numbers[kind == k][0] for k in range(len(names))]))
        names = [stated[rank] for rank in order]
    return {"edges": np.diag(cell), "tilt": cell - np.diag(np.diag(cell)), "flat": False, "periodic": list(atoms.pbc),
            "position": atoms.positions, "velocity": velocity, "mass": arrays.get("mass", atoms.get_masses()),
            "charge": arrays.get("charge", arrays.get("initial_charges")), "spin": arrays.get("angular_velocity"), "radius": arrays.get("radius"), "kind": kind,
            "names": list(names), "bonds": np.empty((0, 2), int)}


def read_lammps(path, frame):
    """Replaces the reader of ASE, which does not read radii and converts units."""
    sections, head, name, style = {}, {}, None, ""
    for line in path.read_text().splitlines()[1:]:
        words, comment = line.partition("#")[0].split(), line.partition("#")[2].split()
        if not words:
            continue
        if words[0].isalpha():
            name = " ".join(words)
            sections[name] = []
            style = " ".join(comment) if name == "Atoms" else style
        elif name is None:
            head[" ".join(word for word in words if not _is_number(word))] = [float(word) for word in words if _is_number(word)]
        else:
            sections[name].append([float(word) for word in words if _is_number(word)])
    kinds = style.split() or ["atomic"]
    columns = STYLES.get(style or "atomic")
    if kinds[0] == "hybrid" and all(kind in HYBRID for kind in kinds[1:]):
        columns = ("type", "x", "y", "z", *(column for kind in kinds[1:] for column in HYBRID[kind]))
    if columns is None:
        raise FileError(f"{path}: the atom style '{style}' is not known; write the file with one of: {', '.join(STYLES)}")
    atoms = np.array(sorted(sections["Atoms"]))
    of = {column: atoms[:, 1 + k] for k, column in enumerate(columns)}
    low = np.array([head[f"{k}lo {k}hi"][0] for k in "xyz"])
    edges = np.array([head[f"{k}lo {k}hi"][1] for k in "xyz"]) - low
    radius = of["diameter"] / 2 if "diameter" in of else None
    kind = of["type"].astype(int)
    if radius is not None:
        mass = of["density"] * np.where(radius > 0, 4 / 3 * math.pi * radius**3, 1.0)
    else:
        masses = {int(row[0]): row[1] for row in sections.get("Masses", [])}
        mass = np.array([masses.get(each, 1.0) for each in kind])
    ids, velocity, spin = atoms[:, 0], None, None
    if sections.get("Velocities"):
        rows = np.array(sorted(sections["Velocities"]))
        velocity, spin = rows[:, 1:4], rows[:, 4:7] if radius is not None and rows[:, 4:7].any() else None
    bonds = np.array([row[2:4] for row in sections.get("Bonds", [])]).reshape(-1, 2)
    flat = edges[2] == 1 and low[2] == -0.5 and not np.any(of["z"])
    kinds = np.unique(kind)
    return {"edges": edges, "tilt": np.array(head.get("xy xz yz", [0.0])), "flat": flat, "periodic": [True, True, not flat],
            "position": np.column_stack([of[k] for k in "xyz"]) - (0 if flat else low) * np.ones(3), "velocity": velocity,
            "mass": mass, "charge": of.get("charge"), "spin": spin, "radius": radius, "kind": np.searchsorted(kinds, kind),
            "names": [str(each) for each in kinds], "bonds": np.searchsorted(ids, bonds)}


def _is_number(word):
    try:
        float(word)
    except ValueError:
        return False
    return True


READERS = {".gsd": read_gsd, ".extxyz": read_extxyz, ".xyz": read_extxyz, ".data": read_lammps, ".lammps": read_lammps,
           ".lmp": read_lammps}


def read(kind_of_simulation, file, frame, radius, boundary):
    """A simulation with the particles of a file, without forces and integrator.

    file: its ending determines the format: .gsd, .extxyz or .xyz, .data or .lammps. frame: the number of the frame; -1 is the last
    one. radius: the radii of the hard cores, one number or N; needed if the file has none, and replaces those of the file. boundary:
    replaces the boundaries of the file (LAMMPS data files name none: periodic).

    Particles are numbered species by species. `simulation.bonds` holds the bonds of the file, (bonds, 2) ids, for add_force().
    Raises FileError if the file cannot be read, ImportError if a package is missing, and UsageError if the box is not rectangular.
    """
    path = pathlib.Path(file)
    if path.suffix not in READERS:
        raise UsageError(f"{file}: the ending '{path.suffix}' is not known; give a file with one of: {', '.join(READERS)}")
    if not path.is_file():
        raise FileError(f"{file}: there is no such file; check the path")
    try:
        found = READERS[path.suffix](path, frame)
    except (FileError, ImportError):
        raise
    except Exception as error:
        raise FileError(f"{file}: cannot read it: {error}") from error
    if np.any(found["tilt"]):
        raise UsageError(f"{file}: the box is not rectangular; Carom has rectangular ones only")
    flat = found["flat"] or (not found["periodic"][2] and not np.any(found["position"][:, 2]) and found["edges"][2] == 1)
    columns = 2 if flat else 3
    rules = boundary or ["periodic" if each else "open" for each in found["periodic"][:columns]]
    simulation = kind_of_simulation(box=found["edges"][:columns], boundary=rules)
    order = np.argsort(found["kind"], kind="stable")
    given = {"mass": found["mass"], "charge": found["charge"], "radius": found["radius"] if radius is None else radius}
    if given["radius"] is None:
        raise UsageError(f"{file}: there are no radii in it; give radius=…")
    for kind in np.unique(found["kind"]):
        rows = order[found["kind"][order] == kind]
        each = {name: np.broadcast_to(np.asarray(values, dtype=float), len(order))[rows]
                for name, values in given.items() if values is not None}
        velocity = None if found["velocity"] is None else np.asarray(found["velocity"], dtype=float)[rows, :columns]
        spin = None if found["spin"] is None else np.asarray(found["spin"], dtype=float)[rows, 2 if flat else slice(None)]
        simulation.add_particles(position=np.asarray(found["position"], dtype=float)[rows, :columns], velocity=velocity, spin=spin,
                                 species=found["names"][kind], **each)
    simulation._cores = radius is not None
    new = np.empty(len(order), int)
    new[order] = np.arange(len(order))
    simulation.bonds = new[found["bonds"]] if len(found["bonds"]) else np.empty((0, 2), int)
    return simulation
