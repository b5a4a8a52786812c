"""Reads what a run of Carom leaves in its directory, and starts runs.

    from carom_files import Trajectory, read_summary, read_thermo, run_carom
    run_carom(find_carom(), "deck.toml", "runs/here")
    with Trajectory("runs/here") as trajectory:
        trajectory.position(-1)        # [particles, dimension]

Needs Debian's python3-h5py and python3-numpy. Everything is in the reduced units of the deck.
"""

import contextlib
import csv
import fcntl
import json
import os
import pathlib
import shutil
import struct
import subprocess
import zlib

import h5py
import numpy as np

TRAJECTORY = "trajectory.h5md"


class RunFailed(Exception):
    """`carom run` ended with an exit code other than 0; carries its code and its last words."""

    def __init__(self, code, message):
        super().__init__(f"carom run ended with exit code {code}: {message}")
        self.code = code


def find_carom(given=None):
    """The carom command: the one given, $CAROM, the build of tools/run, or what is on the PATH."""
    if given or os.environ.get("CAROM"):
        return pathlib.Path(given or os.environ["CAROM"]).resolve()
    built = pathlib.Path(__file__).resolve().parent.parent / "build" / "release" / "io" / "carom"
    if built.exists():
        return built
    installed = shutil.which("carom")
    if not installed:
        raise SystemExit("There is no carom command: build it with tools/run, or name it with --carom.")
    return pathlib.Path(installed)


def run_carom(carom, deck, directory, overrides=(), launcher=(), environment=None):
    """Runs a deck, by a launcher such as mpirun where one is given, and returns its summary. Raises RunFailed."""
    command = [*launcher, str(carom), "run", str(deck), "-o", str(directory), "--quiet"]
    for override in overrides:
        command += ["--set", override]
    done = subprocess.run(command, capture_output=True, text=True, env=environment)
    if done.returncode != 0:
        raise RunFailed(done.returncode, (done.stderr or done.stdout).strip())
    return read_summary(directory)


@contextlib.contextmanager
def reading(path):
    """What goes wrong while a file is read ends the tool with one line that names the file, and exit code 1."""
    try:
        yield
    except BlockingIOError as error:
        raise SystemExit(f"{path}: a process is writing this file; wait for its end, or copy the file") from error
    except UnicodeDecodeError as error:
        raise SystemExit(f"{path}: is not a text file") from error
    except OSError as error:
        raise SystemExit(f"{path}: {os.strerror(error.errno) if error.errno else error}") from error
    except (KeyError, ValueError, IndexError, TypeError, RuntimeError, AttributeError) as error:
        raise SystemExit(f"{path}: is not a file that Carom left there, or damaged: {error}") from error


def open_hdf5(path):
    """A file of HDF5, opened for reading; a flush that a kill has interrupted is completed first."""
    complete_flush(path)
    return h5py.File(path, "r")


def complete_flush(path):
    """Writes what a complete journal beside the file holds to the file, and removes the journal (io/files/journal.h)."""
    journal = pathlib.Path(f"{path}.journal")
    if not journal.exists():
        return
    with open(path, "r+b") as file:
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
    """thermo.csv as a dictionary of columns; an empty cell becomes NaN."""
    return read_table(pathlib.Path(directory) / "thermo.csv")


def read_table(path):
    """A CSV file of a run (thermo.csv, rdf.csv, msd.csv) as a dictionary of columns; an empty cell becomes NaN."""
    with reading(path), open(path, newline="") as file:
        rows = list(csv.reader(line for line in file if line.endswith("\n")))  # a kill may have left a part of a row
        values = np.array([[float(cell) if cell else np.nan for cell in row] for row in rows[1:]])
        values = values.reshape(len(rows) - 1, len(rows[0]))
        return {name: values[:, column] for column, name in enumerate(rows[0])}


class Trajectory:
    """A trajectory.h5md, opened for reading; takes the file or the directory of its run.

    Frames are numbered from 0; -1 is the last. Arrays have as many columns as the run had dimensions.
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

    @property
    def periodic(self):
        return np.array([rule == "periodic" for rule in self.boundary])

    def position(self, frame):
        """Centres, wrapped into the box along its periodic axes [length]."""
        return self._read("position", frame)

    def velocity(self, frame):
        return self._read("velocity", frame)

    def unwrapped(self, frame):
        """Centres, followed through the periodic boundaries [length]."""
        return self.position(frame) + self._read("image", frame) * self.edges(frame)

    def edges(self, frame=0):
        """Edge lengths of the box [length]."""
        with reading(self.path):
            return np.diag(self._group["box/edges/value"][frame])[: self.dimension].copy()

    def _read(self, name, frame):
        with reading(self.path):
            return self._group[name]["value"][frame][:, : self.dimension]


def as_text(value):
    """The text of a string of HDF5."""
    return value.decode() if isinstance(value, bytes) else str(value)


def toml_text(deck):
    """A deck given as a dictionary (as tomllib reads it) in TOML."""
    lines = [f"{key} = {_toml_value(value)}" for key, value in deck.items() if not _is_table(value)]
    for key, value in deck.items():
        if not _is_table(value):
            continue
        header = f"[[{key}]]" if isinstance(value, list) else f"[{key}]"
        for table in value if isinstance(value, list) else [value]:
            lines += ["", header] + [f"{name} = {_toml_value(entry)}" for name, entry in table.items()]
    return "\n".join(lines) + "\n"


def _is_table(value):
    return isinstance(value, dict) or (isinstance(value, list) and bool(value) and isinstance(value[0], dict))


def _toml_value(value):
    if isinstance(value, list):
        return "[" + ", ".join(map(_toml_value, value)) + "]"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key} = {_toml_value(entry)}" for key, entry in value.items()) + "}"
    if isinstance(value, (bool, str)):
        return json.dumps(value, ensure_ascii=False)  # a JSON string or boolean is one of TOML
    return repr(value)
