# SPDX-License-Identifier: BSD-3-Clause
"""Makes simulations from the files of other programs: GSD (HOOMD-blue), extended XYZ (OVITO, ASE) and LAMMPS data files.

Numbers keep the units that they have in the file. GSD needs Debian's python3-gsd, and extended XYZ needs python3-ase.
"""

import importlib
import pathlib

import numpy as np

from carom import lammps_data
from carom.errors import FileError, UsageError


def package(name, debian):
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise ImportError(f"reading this file needs the Python package {name.partition('.')[0]}: install Debian's {debian}, "
                          f"or pip install {name.partition('.')[0]}") from error


def read_gsd(path, frame):
    hoomd = package("gsd.hoomd", "python3-gsd")
    try:
        with hoomd.open(str(path), "rb") as file:
            snapshot = file[frame]
    except (OSError, RuntimeError, IndexError) as error:
        raise FileError(f"{path}: cannot read it: {error}") from error
    p, box = snapshot.particles, np.asarray(snapshot.configuration.box, dtype=float)
    flat = snapshot.configuration.dimensions == 2
    # In GSD the origin is in the middle of the box. Single precision may put a position beyond an edge by its rounding.
    return {"edges": box[:3], "tilt": box[3:], "flat": flat, "periodic": [True, True, not flat],
            "position": np.asarray(p.position, dtype=float) + box[:3] / 2, "image": np.asarray(p.image), "velocity": p.velocity, "mass": p.mass,
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
    """ASE reads the line with the box. Its reader of the columns takes elements only, and gives them the masses of these."""
    comment_of = package("ase.io.extxyz", "python3-ase").key_val_str_to_dict
    lines = lammps_data.text_of(path).splitlines()
    starts, at = [], 0
    while at < len(lines) and lines[at].strip():
        if not lines[at].strip().isdigit() or at + 2 + int(lines[at]) > len(lines):
            raise FileError(f"{path}:{at + 1}: here must stand the number of particles of a frame, with so many lines behind the next one; "
                            "is the file cut off?")
        starts.append(at)
        at += 2 + int(lines[at])
    if not starts or not -len(starts) <= frame < len(starts):
        raise FileError(f"{path}: there is no frame {frame}; it has {len(starts)}")
    start = starts[frame]
    try:
        said = comment_of(lines[start + 1])
    except (ValueError, KeyError) as error:
        raise FileError(f"{path}:{start + 2}: {error}; see https://github.com/libAtoms/extxyz for the format") from error
    said = said if "Lattice" in said or "Properties" in said else {}  # any words, in a plain .xyz
    arrays = _columns(path, start + 2, lines[start + 2:start + 2 + int(lines[start])], str(said.get("Properties", "species:S:1:pos:R:3")))
    position = arrays["pos"] if arrays["pos"].ndim == 2 else arrays["pos"][:, None]
    flat = position.shape[1] == 2
    if flat:
        position = np.column_stack([position, np.zeros(len(position))])
    cell = np.asarray(said["Lattice"], dtype=float) if "Lattice" in said else None
    rules = np.broadcast_to(said.get("pbc", [cell is not None] * 3), 3).tolist()
    if cell is None and any(rules):
        raise FileError(f"{path}:{start + 2}: there is no Lattice, so the box is open, but pbc says that it is periodic; give one of them")
    mass = next((arrays[name] for name in ("mass", "masses") if name in arrays), None)
    velocity = next((arrays[name] for name in ("velo", "velocities", "vel", "velocity") if name in arrays), None)
    if velocity is None and "momenta" in arrays:
        velocity = arrays["momenta"] / (1.0 if mass is None else mass[:, None])
    names, kind = np.unique(arrays.get("species", arrays.get("Z", np.full(len(position), "particle"))).astype(str), return_inverse=True)
    stated = str(said.get("species_names", "")).split(",")
    if "species_names" in said and len(stated) == len(names):  # in the order of the elements that replace them in the file
        numbers = package("ase.data", "python3-ase").atomic_numbers
        order = np.argsort(np.argsort([numbers.get(name, 0) for name in names]))
        names = [stated[rank] for rank in order]
    if cell is None:  # an open box has no edge that matters; this one has the size of what is in it
        cell = np.diag(np.maximum(np.ptp(position, axis=0), 1.0))
    edges = np.diag(cell)
    return {"edges": edges, "tilt": cell - np.diag(edges), "flat": flat or (not rules[2] and not position[:, 2].any()), "periodic": rules,
            "position": position, "velocity": _three(velocity), "mass": mass, "charge": arrays.get("charge", arrays.get("initial_charges")),
            "spin": _three(arrays.get("angular_velocity")), "radius": arrays.get("radius"), "kind": kind, "names": list(names),
            "bonds": np.empty((0, 2), int)}


def _three(vectors):
    """Vectors of two components get a third one."""
    return np.column_stack([vectors, np.zeros(len(vectors))]) if vectors is not None and vectors.ndim == 2 and vectors.shape[1] == 2 else vectors


def _columns(path, line, rows, properties):
    """The columns of a frame by name; `line` is the number of lines before the first row."""
    parts = properties.split(":")
    if len(parts) % 3 or not all(part.isdigit() for part in parts[2::3]) or "pos" not in parts[::3]:
        raise FileError(f"{path}:{line}: Properties is '{properties}'; it must be name:type:columns:… and have 'pos'")
    words = [row.split() for row in rows]
    wanted, arrays, at = sum(map(int, parts[2::3])), {}, 0
    for k, row in enumerate(words):
        if len(row) != wanted:
            raise FileError(f"{path}:{line + 1 + k}: there are {len(row)} columns, and Properties names {wanted}")
    for name, kind, count in zip(parts[::3], parts[1::3], map(int, parts[2::3])):
        values = np.array([row[at:at + count] for row in words], dtype=str).reshape(len(words), count)
        at += count
        if kind in "RI":
            for k, row in enumerate(values):
                try:
                    row.astype(float if kind == "R" else int)
                except ValueError as error:
                    raise FileError(f"{path}:{line + 1 + k}: '{' '.join(row)}' is no number where Properties has '{name}'") from error
            values = values.astype(float if kind == "R" else int)
        arrays[name] = values[:, 0] if count == 1 else values
    return arrays


READERS = {".gsd": read_gsd, ".extxyz": read_extxyz, ".xyz": read_extxyz, ".data": lammps_data.read, ".lammps": lammps_data.read,
           ".lmp": lammps_data.read}


def read(kind_of_simulation, file, frame=-1, radius=None, boundary=None, atom_style=None):
    """A simulation with the particles of a file, without forces and integrator.

    file: its ending determines the format: .gsd, .extxyz or .xyz, .data or .lammps. frame: the number of the frame; -1 is the last
    one. radius: the radii of the hard cores, one number or N; needed if the file has none, and replaces those of the file. boundary:
    replaces the boundaries of the file (LAMMPS data files name none: periodic). atom_style: of a LAMMPS data file that does not name it,
    such as "full" or "hybrid sphere charge".

    Particles are numbered species by species. `simulation.bonds` holds the bonds of the file, (bonds, 2) ids, for add_force(). What a file
    has and Carom does not read, and masses that it does not state (they are 1 then), are named by a warning.
    Raises FileError, with the line where there are lines, if the file cannot be read or is at odds with itself, ImportError if a package is
    missing, and UsageError if the box is not rectangular.
    """
    path = pathlib.Path(file)
    if path.suffix not in READERS:
        raise UsageError(f"{file}: the ending '{path.suffix}' is not known; give a file with one of: {', '.join(READERS)}")
    if not path.is_file():
        raise FileError(f"{file}: there is no such file; check the path")
    reader = READERS[path.suffix]
    found = reader(path, atom_style) if reader is lammps_data.read else reader(path, frame)
    told = found.get("lost", []) + _rectangular(file, found)
    flat, columns = found["flat"], 2 if found["flat"] else 3
    if not (np.asarray(found["edges"][:columns]) > 0).all():
        raise FileError(f"{file}: the edges of the box are {', '.join(map(str, found['edges'][:columns]))}; all must be positive")
    rules = [boundary] * columns if isinstance(boundary, str) else boundary or ["periodic" if each else "open" for each in found["periodic"][:columns]]
    simulation = kind_of_simulation(box=found["edges"][:columns], boundary=rules)
    if found["mass"] is None:
        told.append("the file states no masses; all are 1")
    given = {"mass": found["mass"], "charge": found["charge"], "radius": found["radius"] if radius is None else radius}
    if given["radius"] is None:
        raise UsageError(f"{file}: there are no radii in it; give radius=…")
    position = np.asarray(found["position"], dtype=float)[:, :columns]
    if (image := found.get("image")) is not None and image.any():
        moved = image[:, :columns].any(axis=0) & (np.array(rules) != "periodic")
        if moved.any():
            raise UsageError(f"{file}: particles have image numbers along axis {int(np.argmax(moved))}, which is not periodic; give another boundary")
        position = position + image[:, :columns] * found["edges"][:columns]
    if path.suffix == ".gsd":
        position, apart = _pushed_apart(position, np.broadcast_to(np.asarray(given["radius"], float), len(position)),
                                        np.where(np.array(rules) == "periodic", found["edges"][:columns], 0))
        if apart > 0:
            told.append(f"spheres that overlap by the rounding of GSD to single precision were pushed apart, by {apart:.1e} at most")
    order = np.argsort(found["kind"], kind="stable")
    for kind in np.unique(found["kind"]):
        rows = order[found["kind"][order] == kind]
        each = {name: np.broadcast_to(np.asarray(values, dtype=float), len(order))[rows]
                for name, values in given.items() if values is not None}
        velocity = None if found["velocity"] is None else np.asarray(found["velocity"], dtype=float)[rows, :columns]
        spin = None if found["spin"] is None else np.asarray(found["spin"], dtype=float)[rows, 2 if flat else slice(None)]
        simulation.add_particles(position=position[rows], velocity=velocity, spin=spin, species=found["names"][kind], **each)
    simulation._cores = radius is not None
    new = np.empty(len(order), int)
    new[order] = np.arange(len(order))
    simulation.bonds = new[found["bonds"]] if len(found["bonds"]) else np.empty((0, 2), int)
    simulation._warn([f"{file}: {text}" for text in told], level=4)
    return simulation


def _rectangular(file, found):
    """Refuses boxes that are not rectangular; returns what there is to say of those that are so but for rounding.

    Programs compute the edges of a box by sines and cosines, in double or in single precision. Off the diagonal these leave errors of
    a few 2^-53 or 2^-24 of the longest edge, which are taken for 0.
    """
    tilt, longest = np.abs(found.get("tilt", 0.0)).max(), np.abs(found["edges"]).max()
    if tilt > 4 * 2.0**-24 * longest:
        raise UsageError(f"{file}: the box is not rectangular; Carom has rectangular ones only")
    return [f"the box is not rectangular by {tilt:.1e}, which is taken for rounding"] if tilt > 4 * 2.0**-53 * longest else []


def _pushed_apart(position, radius, edges):
    """Positions from numbers of single precision, where touching spheres no longer overlap, and the largest distance moved.

    Each coordinate is off by at most half a unit in the last place of the largest one, and so are radii and edges. So spheres that
    touch in double precision overlap by no more than `rounding`, and moves as short as that suffice. If spheres overlap by more, or
    sweeps over the pairs find no such moves, all are left as they are: the run refuses them. edges: of periodic directions, else 0.
    """
    spacing = float(np.spacing(np.float32(np.abs(position).max(initial=0) + edges.max(initial=0))))
    rounding = 2 * spacing * position.shape[1] ** 0.5
    moved, wide = np.zeros_like(position), radius.max(initial=0)
    if wide == 0:
        return position, 0.0
    tree = package("scipy.spatial", "python3-scipy").cKDTree
    for _ in range(100):  # a sweep takes milliseconds; chains of touching spheres need about ten
        x = position + moved
        pairs = tree(np.where(edges > 0, x % np.where(edges > 0, edges, 1), x), boxsize=edges).query_pairs(2 * wide, output_type="ndarray")
        apart = x[pairs[:, 1]] - x[pairs[:, 0]]
        apart -= edges * np.round(np.divide(apart, edges, out=np.zeros_like(apart), where=edges > 0))
        distance, contact = np.linalg.norm(apart, axis=1), radius[pairs].sum(axis=1)
        close = distance < contact * (1 + 1e-15)
        if not close.any():
            return position + moved, float(np.abs(moved).max())
        if (contact - distance)[close].max() > rounding or not distance.all():
            break
        push = ((contact * (1 + 4e-15) - distance) / 2 / distance)[close, None] * apart[close]
        np.add.at(moved, pairs[close, 0], -push)
        np.add.at(moved, pairs[close, 1], push)
        if np.linalg.norm(moved, axis=1).max() > rounding:
            break
    return position, 0.0
