#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Is a trajectory a valid H5MD 1.1 file, and does it follow Carom's own rules?

    tools/check_h5md.py runs/five-springs
    tools/check_h5md.py runs/five-springs/trajectory.h5md --no-mdanalysis

Prints every violation and ends with exit code 1 if there is one. Besides the format
(https://www.nongnu.org/h5md/h5md.html, version 1.1) it checks the requirements of MDAnalysis and VMD: one group
of particles, positions in three columns, a time-dependent box that shares step and time with the positions, units of length and
time if the deck names them (output.units) and no other units, fixed-length strings,
an old superblock. It also checks the contents: finite numbers, increasing times, centres inside the box, and
that MDAnalysis reads the same positions.
"""

import argparse
import pathlib
import sys
import tomllib
import warnings

import h5py
import numpy as np

from carom_files import TRAJECTORY, as_text, one_line, open_hdf5, reading

PARTICLES = "particles/trajectory"
# The elements with units if the deck names units, by their paths in the group of particles.
UNITS = {"position/value": "length", "box/edges/value": "length", "radius": "length", "velocity/value": "velocity",
         "angular_velocity/value": "frequency"}
UNITS |= {f"{clock}/time": "time" for clock in ("position", "velocity", "image", "box/edges")}
OVERHANG = 1e-12  # how far a sphere may extend beyond a wall, relative to the edge


class Checker:
    """Collects violations; each check_… checks one part and may rely on the earlier checks."""

    def __init__(self, file):
        self.file = file
        self.violations = []
        try:
            deck = tomllib.loads(as_text(file["parameters/deck"][()])) if "parameters/deck" in file else {}
        except tomllib.TOMLDecodeError:
            deck = {}  # named below
        self.units = deck.get("output", {}).get("units", {})

    def expect(self, condition, violation):
        if not condition:
            self.violations.append(violation)
        return bool(condition)

    def has(self, path, kind):
        noun = "group" if kind is h5py.Group else "data set"
        return self.expect(isinstance(self.file.get(path), kind), f"/{path}: there is no such {noun}")

    def attribute(self, path, name):
        """The attribute's value, or None with a violation."""
        if self.file.get(path) is None or name not in self.file[path].attrs:
            self.violations.append(f"/{path}: attribute '{name}' is missing")
            return None
        return self.file[path].attrs[name]

    def element(self, path):
        """A time-dependent element: value, step and time of equal length. Returns whether it can be read."""
        if not self.has(path, h5py.Group):
            return False
        if not all([self.has(f"{path}/{part}", h5py.Dataset) for part in ("value", "step", "time")]):
            return False
        value, step, time = (self.file[path][part] for part in ("value", "step", "time"))
        good = self.expect(step.ndim == 1 and time.ndim == 1, f"/{path}: step and time must be explicit, one a frame")
        good = good and self.expect(value.ndim >= 1 and len(value) == len(step) == len(time),
                                    f"/{path}: value, step and time differ in length")
        self.expect(np.issubdtype(step.dtype, np.integer), f"/{path}/step: must be an integer")
        if good and len(time) > 1:
            self.expect(np.all(np.diff(time[:]) > 0), f"/{path}/time: must rise from frame to frame")
            self.expect(np.all(np.diff(step[:].astype(np.int64)) >= 0), f"/{path}/step: must not fall")
        if np.issubdtype(value.dtype, np.floating) and not path.startswith("observables"):
            self.expect(all(np.isfinite(value[frame]).all() for frame in range(len(value))),
                        f"/{path}/value: holds a number that is not finite")
        return good

    def check_metadata(self):
        version = self.attribute("h5md", "version")
        self.expect(version is None or list(np.atleast_1d(version)) == [1, 1], "/h5md: version must be [1, 1]")
        for path, names in (("h5md/author", ["name"]), ("h5md/creator", ["name", "version"])):
            if self.has(path, h5py.Group):
                for name in names:
                    value = self.attribute(path, name)
                    self.expect(value is None or as_text(value).strip(), f"/{path}: attribute '{name}' is empty")

    def check_storage(self):
        superblock = self.file.id.get_create_plist().get_version()[0]
        self.expect(superblock < 3, f"superblock version {superblock}: written with library version bounds 'latest'")

        def visit(name, item):
            types = [(f"/{name}", item.dtype)] if isinstance(item, h5py.Dataset) else []
            types += [(f"/{name}, attribute '{key}'", item.attrs.get_id(key).dtype) for key in item.attrs]
            for place, dtype in types:
                string, unit = h5py.check_string_dtype(dtype), place.endswith("'unit'")
                self.expect(string is None or (string.length is None) == unit,
                            f"{place}: a string of {'fixed' if unit else 'variable'} length")
            found = item.attrs.get("unit")
            if self.units:
                length, time = self.units["length"], self.units["time"]
                kind = UNITS.get(name.removeprefix(f"{PARTICLES}/")) or ("time" if name.endswith("/time") else None)
                wanted = {"length": length, "time": time, "velocity": f"{length} {time}-1", "frequency": f"{time}-1", None: None}[kind]
                self.expect(found == wanted, f"/{name}: attribute 'unit' is {found}, by the deck {wanted}")
            else:
                self.expect(found is None, f"/{name}: attribute 'unit', but units are reduced")

        self.file.visititems(visit)

    def check_particles(self):
        """Returns whether positions and box can be read."""
        if not (self.has("particles", h5py.Group) and self.has(PARTICLES, h5py.Group)):
            return False
        self.expect(list(self.file["particles"]) == ["trajectory"], "/particles: must hold the one group 'trajectory'")
        if not self.element(f"{PARTICLES}/position"):
            return False
        position = self.file[f"{PARTICLES}/position/value"]
        if not self.expect(position.ndim == 3 and position.shape[2] == 3, "position: must be [frames][particles][3]"):
            return False
        self.expect(position.dtype == np.float64, "position: must be in double precision")
        rough = ["angular_velocity"] if "angular_velocity" in self.file[PARTICLES] else []
        for name in ["velocity", "image", *rough]:
            if self.element(f"{PARTICLES}/{name}"):
                value = self.file[f"{PARTICLES}/{name}/value"]
                self.expect(value.shape[1:] == position.shape[1:], f"{name}: shape {value.shape}, position's is {position.shape}")
        for name in ("mass", "radius", "charge", "species", "id", *(["moment_of_inertia"] if rough else [])):
            if self.has(f"{PARTICLES}/{name}", h5py.Dataset):
                values = self.file[f"{PARTICLES}/{name}"]
                self.expect(values.shape == position.shape[1:2], f"{name}: must be [particles]")
        ids = self.file.get(f"{PARTICLES}/id")
        self.expect(ids is None or np.array_equal(ids[:], np.arange(len(ids))), "id: particles are not in the order of ids")
        return self.check_box(position)

    def check_box(self, position):
        box = f"{PARTICLES}/box"
        if not self.has(box, h5py.Group):
            return False
        dimension, boundary = self.attribute(box, "dimension"), self.attribute(box, "boundary")
        self.expect(dimension is None or int(dimension) == 3, f"/{box}: dimension must be 3, also for 2-D runs")
        if boundary is not None:
            names = [as_text(name) for name in np.atleast_1d(boundary)]
            self.expect(len(names) == 3 and set(names) <= {"periodic", "none"},
                        f"/{box}: boundary must be three times 'periodic' or 'none'")
        if not self.element(f"{box}/edges"):
            return False
        edges = self.file[f"{box}/edges/value"]
        for name in ("step", "time"):
            self.expect(self.file[f"{box}/edges/{name}"] == self.file[f"{PARTICLES}/position/{name}"],
                        f"/{box}/edges/{name}: must be a hard link to position's")
        return self.expect(edges.shape[1:] == (3, 3), f"/{box}/edges: value must be [frames][3][3]")

    def check_observables(self):
        if not self.has("observables", h5py.Group):
            return
        frames = self.file.get(f"{PARTICLES}/position/step")
        for name in self.file["observables"]:
            path = f"observables/{name}"
            if self.element(path):
                self.expect(set(self.file[path]) == {"value", "step", "time"}, f"/{path}: observables must be flat")
                self.expect(frames is None or np.array_equal(self.file[path]["step"][:], frames[:]),
                            f"/{path}: must have one value a frame")

    def check_parameters(self):
        """Returns the true dimension, or None."""
        found = {name: self.has(f"parameters/{name}", h5py.Dataset)
                 for name in ("deck", "title", "integrator", "dimension", "boundary", "species")}
        if found["deck"]:
            self.expect("[system]" in as_text(self.file["parameters/deck"][()]), "/parameters/deck: is not a deck")
        if not found["dimension"]:
            return None
        dimension = int(self.file["parameters/dimension"][()])
        return dimension if self.expect(dimension in (2, 3), "/parameters/dimension: must be 2 or 3") else None

    def check_contents(self, dimension):
        """`dimension` is the true dimension, None if unknown."""
        group = self.file[PARTICLES]
        boundary = [as_text(name) for name in np.atleast_1d(group["box"].attrs.get("boundary", []))]
        if dimension == 2:
            self.expect(boundary[2:] == ["none"], "a 2-D run: boundary along z must be 'none'")
            self.expect(all(frame[2, 2] == 1 for frame in group["box/edges/value"]), "a 2-D run: edge along z must be 1")
            for name in ("position", "velocity", "image"):
                if (value := group.get(f"{name}/value")) is not None and value.shape == group["position/value"].shape:
                    self.expect(not np.any(value[:, :, 2]), f"a 2-D run: {name} along z must be 0")
        edges = group["box/edges/value"][:]
        allowed = np.eye(3)
        allowed[1, 0] = 1   # the tilt of a sheared box
        self.expect(np.array_equal(edges, edges * allowed) and np.all(edges.diagonal(axis1=1, axis2=2) > 0),
                    "edges: must be a matrix of positive lengths on the diagonal and nothing else but the tilt of the second edge along x")
        self.expect(np.all(edges[:, 1, 0] >= 0) and np.all(edges[:, 1, 0] < edges[:, 0, 0]), "edges: the tilt must be in [0, edge)")
        for axis in [axis for axis, rule in enumerate(boundary) if rule == "periodic"]:
            x = group["position/value"][:, :, axis]
            self.expect(np.all(x >= 0) and np.all(x < edges[:, axis, axis, None]),
                        f"position: outside [0, edge) along the periodic axis {'xyz'[axis]}")

    def check_walls(self):
        """No sphere may extend beyond a wall; verlet ignores walls, so there is nothing to check."""
        names = [f"{PARTICLES}/radius", "parameters/boundary", "parameters/integrator"]
        if not all(name in self.file for name in names):
            return
        radius, rules, integrator = (self.file[name][()] for name in names)
        if as_text(integrator) == "verlet" or len(radius) != self.file[f"{PARTICLES}/position/value"].shape[1]:
            return
        for axis in [axis for axis, rule in enumerate(rules) if as_text(rule) == "wall"]:
            frames = len(self.file[f"{PARTICLES}/position/step"])
            x = self.file[f"{PARTICLES}/position/value"][:frames, :, axis]
            edge = self.file[f"{PARTICLES}/box/edges/value"][:frames, axis, axis][:, None]
            gap = np.minimum(x, edge - x) - radius
            self.expect(np.all(gap >= -OVERHANG * edge), f"position: a sphere stands over the wall along {'xyz'[axis]}")

    def check_with_mdanalysis(self, path):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            import MDAnalysis

            position = self.file[f"{PARTICLES}/position/value"]
            try:
                universe = MDAnalysis.Universe.empty(position.shape[1], trajectory=True)
                universe.load_new(str(path), format="H5MD", convert_units=False)
                read = [np.array(frame.positions) for frame in universe.trajectory]
                universe.trajectory.close()
            except Exception as error:  # its message is the violation
                self.violations.append(f"MDAnalysis can't read it: {error}")
                return
        frames = len(self.file[f"{PARTICLES}/position/step"])
        self.expect(len(read) == frames, f"MDAnalysis sees {len(read)} of {frames} frames")
        self.expect(all(np.array_equal(mine, theirs.astype(np.float32)) for mine, theirs in zip(read, position)),
                    "MDAnalysis reads other positions")


def violations(path, with_mdanalysis=True):
    """All violations of a trajectory (the file or its run's directory), one line each. A file that cannot be read ends the program."""
    path = pathlib.Path(path)
    path = path / TRAJECTORY if path.is_dir() else path
    with reading(path), open_hdf5(path) as file:
        checker = Checker(file)
        checker.check_metadata()
        checker.check_storage()
        readable = checker.check_particles()
        checker.check_observables()
        dimension = checker.check_parameters()
        if readable:
            checker.check_contents(dimension)
            checker.check_walls()
            if with_mdanalysis:
                checker.check_with_mdanalysis(path)
        return checker.violations


@one_line
def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=pathlib.Path, help="directory of a run, or its trajectory")
    parser.add_argument("--no-mdanalysis", action="store_true", help="don't open it with MDAnalysis")
    options = parser.parse_args(arguments)
    found = violations(options.run, not options.no_mdanalysis)
    print("\n".join(found) if found else f"{options.run}: conforms to H5MD 1.1 and Carom's rules")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
