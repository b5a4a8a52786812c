# SPDX-License-Identifier: BSD-3-Clause
"""Reads LAMMPS data files (https://docs.lammps.org/read_data.html), strictly: whatever cannot be kept is refused by its line.

The readers of ASE 3.22 and MDAnalysis 2.4, which Debian 12 has, were tried. ASE converts units, fills in zeros for missing rows, and knows
neither radii nor type labels. MDAnalysis reads single precision, and gives the k-th velocity to the k-th atom whatever its id.
"""

import dataclasses
import math
import re

import numpy as np

from carom.errors import FileError, UsageError

# The columns of an atom between its id and its image, by atom style.
STYLES = {"atomic": ("type", "x", "y", "z"), "charge": ("type", "charge", "x", "y", "z"),
          "bond": ("molecule", "type", "x", "y", "z"), "angle": ("molecule", "type", "x", "y", "z"),
          "molecular": ("molecule", "type", "x", "y", "z"), "full": ("molecule", "type", "charge", "x", "y", "z"),
          "sphere": ("type", "diameter", "density", "x", "y", "z"), "bpm/sphere": ("molecule", "type", "diameter", "density", "x", "y", "z")}
HYBRID = {name: tuple(column for column in columns if column not in ("type", "x", "y", "z")) for name, columns in STYLES.items()}
SHAPES = ("Ellipsoids", "Lines", "Triangles", "Bodies")  # of particles that are no spheres


@dataclasses.dataclass
class Row:
    line: int
    words: list


class DataFile:
    """The header and the sections of a file, and its errors."""

    def __init__(self, path):
        self.path, self.head, self.sections, self.hints, self.labels = path, {}, {}, {}, {}
        name = None
        for number, text in enumerate(text_of(path).splitlines()[1:], 2):
            words, comment = text.partition("#")[0].split(), text.partition("#")[2].split()
            if not words:
                continue
            if not any(map(is_number, words)):  # every row has a number, and no name of a section has one
                name = " ".join(words)
                if name in self.sections:
                    self.fail(number, f"there is a second section '{name}'; keep one of them")
                self.sections[name], self.hints[name] = [], " ".join(comment)
            elif name is None:
                count = next((k for k, word in enumerate(words) if not is_number(word)), len(words))
                self.head[" ".join(words[count:])] = Row(number, words[:count])
            else:
                self.sections[name].append(Row(number, words))
        for row in self.sections.get("Atom Type Labels", []):
            number = self.number(row, 0, int)
            self.labels[row.words[-1]] = number if len(row.words) == 2 else self.fail(row.line, "a type label is a number and a word")

    def fail(self, line, problem, kind=FileError):
        raise kind(f"{self.path}:{line}: {problem}" if line else f"{self.path}: {problem}")

    def number(self, row, k, kind=float):
        try:
            value = kind(row.words[k])
        except ValueError:
            self.fail(row.line, f"'{row.words[k]}' is no {'whole ' if kind is int else ''}number; look at column {k + 1}")
        except IndexError:
            self.fail(row.line, f"there are {len(row.words)} columns where {k + 1} or more are needed; is the row cut off?")
        if not math.isfinite(value):
            self.fail(row.line, f"column {k + 1} is {row.words[k]}, which is not finite")
        return value

    def stated(self, name, default=None):
        """A count in the header."""
        return self.number(self.head[name], 0, int) if name in self.head else default

    def rows(self, name, counted):
        """The rows of a section; their number must be the one in the header."""
        found, stated = self.sections.get(name, []), self.stated(counted, 0)
        if len(found) != stated:
            self.fail(self.head[counted].line if counted in self.head else found[0].line,
                      f"the header states {stated} {counted}, and there are {len(found)} rows under '{name}'; is the file cut off?")
        return found

    def kind(self, row, k):
        """The number of the type of atoms in a column, where it may be given by its label."""
        if len(row.words) > k and row.words[k] in self.labels:
            return self.labels[row.words[k]]
        number, most = self.number(row, k, int), self.stated("atom types", 0)
        if not 1 <= number <= most:
            self.fail(row.line, f"the type {number} is not one of the {most} atom types that the header states")
        return number


def text_of(path):
    try:
        return path.read_text()
    except UnicodeDecodeError as error:
        raise FileError(f"{path}: is no text: {error}") from error


def is_number(word):
    return re.fullmatch(r"[-+]?(\d+\.?\d*|\.\d+)([eEdD][-+]?\d+)?|[-+]?(inf|nan)", word, re.IGNORECASE) is not None


def columns_of(file, atoms, atom_style):
    """The columns of the section Atoms, by the style that is asked for, or else by the comment behind the name of the section."""
    style = atom_style or file.hints["Atoms"]
    if style:
        first, *parts = style.split()
        columns = STYLES.get(first)
        if first == "hybrid" and parts and all(part in HYBRID for part in parts):
            columns = ("type", "x", "y", "z", *(column for part in parts for column in HYBRID[part]))
        if columns is None:
            file.fail(None if atom_style else atoms[0].line, f"the atom style '{style}' is not known; give atom_style=…, one of: {', '.join(STYLES)}, "
                      "or 'hybrid' and several of them")
        return style, columns
    width = len(atoms[0].words)
    fits = [name for name, columns in STYLES.items() if width in (len(columns) + 1, len(columns) + 4)]
    if len({STYLES[name] for name in fits}) != 1:
        file.fail(atoms[0].line, f"no comment behind 'Atoms' names the atom style, and rows of {width} columns "
                  + (f"may be {' or '.join(fits)}; give atom_style='{fits[0]}' or another one" if fits else f"are none of {', '.join(STYLES)}"))
    return fits[0], STYLES[fits[0]]


def edges_of(file):
    """The low corner of the box and its edges, in a box that is rectangular."""
    low, high = np.full(3, -0.5), np.full(3, 0.5)  # where the header states nothing
    for k, axis in enumerate("xyz"):
        if (row := file.head.get(f"{axis}lo {axis}hi")) is not None:
            low[k], high[k] = file.number(row, 0), file.number(row, 1)
    edges = high - low
    vectors = [file.head.get(f"{name}vec") for name in "abc"]
    if any(vectors):  # "general triclinic"
        rows = [[file.number(row, k) for k in range(3)] if row else [0.0] * 3 for row in vectors]
        edges, tilt, line = np.diag(rows), rows - np.diag(np.diag(rows)), vectors[0 if vectors[0] else 1].line
        if (row := file.head.get("abc origin")) is not None:
            low = np.array([file.number(row, k) for k in range(3)])
    else:
        row = file.head.get("xy xz yz")
        tilt, line = [file.number(row, k) for k in range(3)] if row else [0.0], row.line if row else None
    if np.any(tilt):
        file.fail(line, "the box is not rectangular; Carom has rectangular ones only", UsageError)
    if not (edges > 0).all():
        file.fail(None, f"the edges of the box are {', '.join(map(str, edges))}; all must be positive")
    return low, edges


def read(path, atom_style=None):
    """The particles of a file, as a dictionary for carom.formats."""
    file = DataFile(path)
    for name in SHAPES:
        if file.sections.get(name):
            file.fail(file.sections[name][0].line, f"the file has particles that are no spheres ('{name}'); Carom has spheres only")
    low, edges = edges_of(file)
    if "Atoms" not in file.sections or not file.sections["Atoms"]:
        file.fail(None, "there is no section 'Atoms' with rows; is it a data file of LAMMPS (write_data)?")
    atoms = file.rows("Atoms", "atoms")
    style, columns = columns_of(file, atoms, atom_style)
    of = {name: np.zeros(len(atoms)) for name in columns}
    ids, image = {}, np.zeros((len(atoms), 3), int)
    for k, row in enumerate(atoms):
        if len(row.words) not in (len(columns) + 1, len(columns) + 4):
            file.fail(row.line, f"there are {len(row.words)} columns; the atom style '{style}' has {len(columns) + 1}, or "
                      f"{len(columns) + 4} with images; name another one by atom_style=…, or mend the row")
        number = file.number(row, 0, int)
        if number in ids:
            file.fail(row.line, f"the atom {number} was in line {atoms[ids[number]].line} already; give each atom an id of its own")
        ids[number] = k
        for column, name in enumerate(columns, 1):
            of[name][k] = file.kind(row, column) if name == "type" else file.number(row, column)
        image[k] = [file.number(row, len(columns) + 1 + axis, int) for axis in range(3)] if len(row.words) > len(columns) + 1 else 0
    kind = of["type"].astype(int)
    radius = of["diameter"] / 2 if "diameter" in of else None
    velocity, spin = velocities(file, ids, len(atoms), radius is not None)
    # A file of a simulation in two dimensions: a thin box about z = 0, where all atoms are.
    flat = edges[2] <= 1 and low[2] == -edges[2] / 2 and not of["z"].any() and (velocity is None or not velocity[:, 2].any())
    order = sorted(ids, key=int)
    place = np.array([ids[number] for number in order])
    rank = {number: k for k, number in enumerate(order)}
    bonds = [[rank[bonded(file, row, k, ids)] for k in (2, 3)] for row in file.rows("Bonds", "bonds")]
    kinds, names = np.unique(kind), {number: label for label, number in file.labels.items()}
    lost = [f"'{name}'" for name, rows in file.sections.items()
            if rows and name not in ("Atoms", "Velocities", "Masses", "Bonds", "Atom Type Labels", "Bond Type Labels")]
    pick = {name: None if values is None else values[place] for name, values in
            {"velocity": velocity, "mass": masses(file, of, kind, radius), "charge": of.get("charge"), "spin": spin, "radius": radius}.items()}
    return pick | {"edges": edges, "flat": flat, "periodic": [True, True, not flat], "position":
                   (np.column_stack([of[axis] for axis in "xyz"]) - (0 if flat else low) * np.ones(3))[place], "image": image[place],
                   "kind": np.searchsorted(kinds, kind[place]), "names": [names.get(each, str(each)) for each in kinds],
                   "bonds": np.array(bonds, int).reshape(-1, 2), "lost": [f"not read: {', '.join(lost)}"] if lost else []}


def velocities(file, ids, count, spheres):
    """Velocities, and angular velocities of spheres if they turn; None where there are none."""
    rows = file.sections.get("Velocities", [])
    if not rows:
        return None, None
    found, spin, seen = np.zeros((count, 3)), np.zeros((count, 3)), {}
    for row in rows:
        number = file.number(row, 0, int)
        if number not in ids or number in seen:
            file.fail(row.line, f"the atom {number} has a velocity in line {seen[number]} already" if number in seen else
                      f"there is no atom {number} in the section 'Atoms' to which this velocity could belong")
        seen[number] = row.line
        found[ids[number]] = [file.number(row, 1 + k) for k in range(3)]
        if spheres and len(row.words) > 4:
            spin[ids[number]] = [file.number(row, 4 + k) for k in range(3)]
    if len(rows) != count:
        missing = next(number for number in ids if number not in seen)
        file.fail(rows[-1].line, f"there are {len(rows)} velocities of {count} atoms, and none of atom {missing}; give each atom one, or leave them all out")
    return found, spin if spin.any() else None


def masses(file, of, kind, radius):
    if radius is not None:
        return of["density"] * np.where(radius > 0, 4 / 3 * math.pi * radius**3, 1.0)
    rows = file.sections.get("Masses", [])
    found = {file.kind(row, 0): file.number(row, 1) for row in rows}
    if rows and (unknown := set(kind) - set(found)):
        file.fail(rows[-1].line, f"the section 'Masses' has no mass of the type {min(unknown)}")
    return np.array([found[each] for each in kind]) if rows else None


def bonded(file, row, k, ids):
    number = file.number(row, k, int)
    if number not in ids:
        file.fail(row.line, f"there is no atom {number} in the section 'Atoms' for this bond")
    return number
