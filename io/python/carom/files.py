# SPDX-License-Identifier: BSD-3-Clause
"""Reads the files of a run into arrays: thermo.csv, trajectory.h5md, events.h5, summary.json, deck.toml.

Needs h5py and numpy (Debian's python3-h5py and python3-numpy), but not the compiled part of the package. All numbers are in the
units of the deck.
"""

import builtins
import collections.abc
import contextlib
import csv
import fcntl
import functools
import json
import os
import pathlib
import shutil
import struct
import tempfile
import time
import tomllib
import zlib

import numpy as np

from carom import notebook, page
from carom.errors import FileError

TRAJECTORY = "trajectory.h5md"
AVERAGES = ("rdf", "sk", "msd", "profile", "transport", "pressure_tensor")


@contextlib.contextmanager
def reading(path):
    """Turns errors that occur while a file is read into a FileError that names the file."""
    try:
        yield
    except FileError:
        raise
    except BlockingIOError as error:
        raise FileError(f"{path}: a process is writing this file faster than it can be read; wait for its end") from error
    except UnicodeDecodeError as error:
        raise FileError(f"{path}: is not a text file") from error
    except OSError as error:
        raise FileError(f"{path}: {os.strerror(error.errno) if error.errno else error}") from error
    except (KeyError, ValueError, IndexError, TypeError, RuntimeError, AttributeError) as error:
        raise FileError(f"{path}: is not a file that Carom left there, or damaged: {error}") from error


def open_hdf5(path):
    """Opens an HDF5 file for reading. If a kill has interrupted a flush of the file, the flush is completed first. Of a file that a run
    is writing, a copy of its present state is opened."""
    try:
        import h5py
    except ImportError as error:
        raise ImportError("reading the files of a run needs the Python package h5py: install Debian's python3-h5py, or pip install h5py") \
            from error

    try:
        complete_flush(path)
        return h5py.File(path, "r")
    except BlockingIOError:
        return h5py.File(copy_between_flushes(path), "r")


def copy_between_flushes(path):
    """A copy, without a name, of a file that a run is writing, as it was after one flush (read_between_flushes in io/files/journal.h)."""
    journal = pathlib.Path(f"{pathlib.Path(path).resolve()}.journal")

    def head():  # it changes with each flush, and begins with zeros except during a flush
        return journal.read_bytes()[:32] if journal.exists() else b""

    last_try = time.monotonic() + 10
    while True:
        before = head()
        if before[:1] in (b"", b"\0"):
            copy = tempfile.TemporaryFile()
            with builtins.open(path, "rb") as file:
                shutil.copyfileobj(file, copy)
            if head() == before:
                return copy
        if time.monotonic() > last_try:
            raise BlockingIOError(f"{path}: flushes come faster than it can be read")
        time.sleep(0.002)


def complete_flush(path):
    """Copies the contents of a complete journal beside the file to the file, and removes the journal (io/files/journal.h)."""
    journal = pathlib.Path(f"{pathlib.Path(path).resolve()}.journal")
    if not journal.exists():
        return
    with builtins.open(path, "r+b") as file:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        data = journal.read_bytes()
        magic, checksum, length, size = struct.unpack_from("<8sQQQ", data.ljust(32, b"\0"))
        if magic == b"CAROMJ01" and 32 <= length <= len(data) and zlib.crc32(data[16:length]) == checksum:
            at = 32
            while at < length:
                address, n = struct.unpack_from("<QQ", data, at)
                file.seek(address)
                file.write(data[at + 16:at + 16 + n])
                at += 16 + n
            file.truncate(size)
            file.flush()
            os.fsync(file.fileno())
    journal.unlink()


def read_summary(directory):
    """summary.json as nested dictionaries: read_summary(d)["energy"]["final"]."""
    path = pathlib.Path(directory) / "summary.json"
    with reading(path):
        return json.loads(path.read_text())


def read_thermo(directory):
    """thermo.csv as a dictionary of columns; empty cells become NaN."""
    return read_table(pathlib.Path(directory) / "thermo.csv")


def read_table(path):
    """A CSV file of a run (thermo.csv, rdf.csv, msd.csv) as a dictionary of columns; empty cells become NaN."""
    with reading(path), builtins.open(path, newline="") as file:
        rows = list(csv.reader(line for line in file if line.endswith("\n")))  # a kill may have left a part of a row
        values = np.array([[float(cell) if cell else np.nan for cell in row] for row in rows[1:]])
        values = values.reshape(len(rows) - 1, len(rows[0]))
        return {name: values[:, column] for column, name in enumerate(rows[0])}


def as_text(value):
    """A string from HDF5 as text."""
    return value.decode() if isinstance(value, bytes) else str(value)


class Trajectory:
    """A trajectory, open for reading. `path` is the file trajectory.h5md or the directory of its run.

    Frames are numbered from 0; -1 is the last one. Positions, velocities and images have shape (N, D).
    """

    def __init__(self, path):
        path = pathlib.Path(path)
        self.path = path / TRAJECTORY if path.is_dir() else path
        with reading(self.path):
            self._open()

    def _open(self):
        self._file = open_hdf5(self.path)
        self._group = self._file["particles/trajectory"]
        self.dimension = int(self._file["parameters/dimension"][()])
        self.step = self._group["position/step"][:]
        self.time = self._group["position/time"][:]
        self.radius = self._group["radius"][:]
        self.mass = self._group["mass"][:]
        self.species = self._group["species"][:]  # indices into species_names
        self.title = as_text(self._file["parameters/title"][()])
        self.species_names = [as_text(name) for name in self._file["parameters/species"][:]]
        # Per axis: "wall", "periodic" or "open".
        self.boundary = [as_text(rule) for rule in self._file["parameters/boundary"][:]]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._file.close()

    def __len__(self):
        return len(self.time)

    def __reduce__(self):  # a copy opens the file again
        return Trajectory, (self.path,)

    @property
    def charge(self):
        with reading(self.path):
            return self._group["charge"][:]

    @property
    def bonds(self):
        """The bonds of all interactions, as pairs of ids, (bonds, 2)."""
        with reading(self.path):
            ends = [self._file.get(f"parameters/vmd_structure/bond_{end}") for end in ("from", "to")]
            return np.empty((0, 2), int) if ends[0] is None else np.column_stack([end[:] for end in ends]).astype(int) - 1

    @property
    def periodic(self):
        return np.array([rule == "periodic" for rule in self.boundary])

    def position(self, frame):
        """Centres of the particles, wrapped into the box along periodic axes, (N, D) [length]."""
        return self._read("position", frame)

    def velocity(self, frame):
        """Velocities, (N, D) [length/time]."""
        return self._read("velocity", frame)

    def spin(self, frame):
        """Angular velocities [1/time], (N,) in two dimensions; zeros where no contact changes them."""
        columns = slice(None) if self.dimension == 3 else 2
        with reading(self.path):
            if "angular_velocity" not in self._group:
                return np.zeros((len(self.species), 3))[:, columns]
            return self._group["angular_velocity/value"][frame][:, columns]

    def image(self, frame):
        """How many box edges each particle has crossed along each periodic axis, (N, D)."""
        return self._read("image", frame)

    def unwrapped(self, frame):
        """Unwrapped centres, continuous across periodic boundaries, (N, D) [length]."""
        with reading(self.path):
            cell = self._group["box/edges/value"][frame][: self.dimension, : self.dimension]
        return self.position(frame) + self._read("image", frame) @ cell

    def edges(self, frame=0):
        """Edge lengths of the box [length]."""
        with reading(self.path):
            return np.diag(self._group["box/edges/value"][frame])[: self.dimension].copy()

    def tilt(self, frame=0):
        """Where the image of the box above is along x, in a sheared box [length]."""
        with reading(self.path):
            return float(self._group["box/edges/value"][frame][1, 0])

    def _read(self, name, frame):
        with reading(self.path):
            return self._group[name]["value"][frame][:, : self.dimension]


class Frame:
    """One frame of a trajectory. Each of its arrays, of shape (N, D), is read from the file when it is accessed."""

    def __init__(self, trajectory, number):
        self._trajectory, self._number = trajectory, number
        self.time, self.step = float(trajectory.time[number]), int(trajectory.step[number])

    position = property(lambda self: self._trajectory.position(self._number), doc="Wrapped centres [length].")
    velocity = property(lambda self: self._trajectory.velocity(self._number), doc="Velocities [length/time].")
    spin = property(lambda self: self._trajectory.spin(self._number), doc="Angular velocities [1/time].")
    image = property(lambda self: self._trajectory.image(self._number), doc="Numbers of box edges crossed along each periodic axis.")
    unwrapped = property(lambda self: self._trajectory.unwrapped(self._number), doc="Unwrapped centres [length].")
    edges = property(lambda self: self._trajectory.edges(self._number), doc="Edges of the box [length].")

    def __repr__(self):
        return f"<frame {self._number} at time {self.time:.6g}>"


class Frames(collections.abc.Sequence):
    """The frames of a trajectory: frames[-1].position, frames[::10]."""

    def __init__(self, trajectory):
        self._trajectory = trajectory

    def __len__(self):
        return len(self._trajectory)

    def __getitem__(self, number):
        numbers = range(len(self))[number]  # IndexError beyond the last
        if isinstance(number, slice):
            return [Frame(self._trajectory, each) for each in numbers]
        return Frame(self._trajectory, numbers)


class Run:
    """The directory of a run. Each file is read when it is first needed and then kept in memory, except for the frames."""

    def __init__(self, directory):
        self.directory = pathlib.Path(directory)
        if not self.directory.is_dir():
            raise FileError(f"{directory}: is not the directory of a run; check the path")
        if not (self.directory / "deck.toml").exists():
            raise FileError(f"{directory}: has no deck.toml; give the directory in which a run left its files")

    def __repr__(self):
        return f"<run in {self.directory}>"

    def _repr_html_(self):
        rows = {"directory": str(self.directory), "integrator": self.deck["integrator"]["type"]}
        if (self.directory / "summary.json").exists():
            s = self.summary
            rows |= {"status": s["status"], "particles": f"{s['particles']} in {s['dimension']} dimensions",
                     "time": f"{s['end_time']:.6g}, step {s['steps']}", "collisions": str(s["events"]["sphere_sphere"]),
                     "energy": f"{s['energy']['final']:.10g}, largest error {s['energy']['max_abs_error']:.1e}"}
        return notebook.table("carom.Run", rows)

    def view(self, port=0, browser=None, export=None):
        """Shows the run on a page, in a browser or in the notebook. `export` names a file to write instead, which shows the run
        without a server. See carom.page.Page. Needs the compiled part of the package."""
        if export is not None:
            return page.export([self.directory], export)
        return page.Page([self.directory], port, browser)

    def __reduce__(self):  # a copy reads the files again
        return Run, (self.directory,)

    @functools.cached_property
    def summary(self):
        """summary.json, the results of the run, as nested dictionaries: ["energy"]["max_abs_error"]."""
        return read_summary(self.directory)

    @functools.cached_property
    def deck(self):
        """The resolved deck as nested dictionaries: ["integrator"]["step"]."""
        path = self.directory / "deck.toml"
        with reading(path):
            return tomllib.loads(path.read_text())

    @functools.cached_property
    def thermo(self):
        """The columns of thermo.csv as arrays: time, step, collisions, kinetic, potential, total, …"""
        return read_thermo(self.directory)

    @functools.cached_property
    def averages(self):
        """The averages that the run has taken, by name and column: ["rdf"]["r"]."""
        files = {name: self.directory / f"{name}.csv" for name in AVERAGES}
        return {name: read_table(path) for name, path in files.items() if path.exists()}

    @functools.cached_property
    def events(self):
        """All collisions, one array for each column of events.h5 (time, kind, lo, hi, …; io/files/events.h); None if the run has
        not recorded them."""
        path = self.directory / "events.h5"
        if not path.exists():
            return None
        with reading(path), open_hdf5(path) as file:
            return {name: values[:] for name, values in file["events"].items() if hasattr(values, "shape")}

    @functools.cached_property
    def trajectory(self):
        """The trajectory, with the data that all frames share: mass, radius, charge, species, boundary, and the times of the frames."""
        return Trajectory(self.directory)

    @property
    def frames(self):
        """The frames of the trajectory: frames[-1].position."""
        return Frames(self.trajectory)

    @functools.cached_property
    def bonds(self):
        """The bonds of all interactions, as pairs of ids, (bonds, 2)."""
        return self.trajectory.bonds

    def universe(self):
        """The trajectory as a Universe of MDAnalysis, in the units of the deck, with masses, charges, radii and bonds; names and types
        are the species. In two dimensions z is 0. See carom.mdanalysis."""
        import MDAnalysis

        from carom import mdanalysis  # noqa: F401, teaches MDAnalysis the files of Carom
        with reading(self.trajectory.path):
            return MDAnalysis.Universe(str(self.trajectory.path), format="H5MD", topology_format="H5MD", convert_units=False)


def open(directory):
    """Opens the directory of a run: .thermo, .frames, .events, .summary, .deck, .averages, .universe()."""
    return Run(directory)
