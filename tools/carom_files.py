# SPDX-License-Identifier: BSD-3-Clause
"""Common functions of the tools: the readers of the package carom, from the source tree, and functions that start runs.

    from carom_files import Trajectory, one_line, read_thermo, run_carom
    run_carom(find_carom(), "deck.toml", "runs/here")
    with Trajectory("runs/here") as trajectory:
        trajectory.position(-1)        # [particles, dimension]

Needs Debian's python3-h5py and python3-numpy. All numbers are in the reduced units of the deck.
"""

import functools
import os
import pathlib
import shutil
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "io" / "python"))

from carom import Error
from carom.decks import toml_text
from carom.files import TRAJECTORY, Trajectory, as_text, complete_flush, open_hdf5, read_summary, read_table, read_thermo, reading

__all__ = ["Error", "TRAJECTORY", "RunFailed", "Trajectory", "as_text", "complete_flush", "find_carom", "one_line", "open_hdf5", "read_summary",
           "read_table", "read_thermo", "reading", "run_carom", "split_errors", "toml_text"]


def split_errors(columns):
    """The means of a table of averages, and their standard errors by the same names; without the numbers of samples."""
    means = {name: values for name, values in columns.items() if not name.startswith(("error_", "samples_"))}
    return means, {name: columns["error_" + name] for name in means if "error_" + name in columns}


class RunFailed(Exception):
    """`carom run` ended with an exit code other than 0; has the code and the last line of the output."""

    def __init__(self, code, message):
        super().__init__(f"carom run ended with exit code {code}: {message}")
        self.code = code


def one_line(main):
    """A main() that reports errors of files and of runs in one line with the name, and ends with exit code 1."""
    @functools.wraps(main)
    def ending(*arguments):
        try:
            return main(*arguments)
        except (Error, RunFailed) as error:
            raise SystemExit(str(error)) from error
        except OSError as error:
            raise SystemExit(f"{error.filename}: {error.strerror}") from error
    return ending


def find_carom(given=None):
    """The carom command: the given one, $CAROM, the build of tools/run, or the one on the PATH."""
    if given := given or os.environ.get("CAROM"):
        if not pathlib.Path(given).exists():
            raise SystemExit(f"{given}: there is no such command.")
        return pathlib.Path(given).resolve()
    built = pathlib.Path(__file__).resolve().parent.parent / "build" / "release" / "io" / "carom"
    if built.exists():
        return built
    installed = shutil.which("carom")
    if not installed:
        raise SystemExit("There is no carom command: build it with tools/run, or name it with --carom.")
    return pathlib.Path(installed)


def run_carom(carom, deck, directory, overrides=(), launcher=(), environment=None):
    """Runs a deck, with a launcher such as mpirun if one is given, and returns its summary. Raises RunFailed."""
    command = [*launcher, str(carom), "run", str(deck), "-o", str(directory), "--quiet"]
    for override in overrides:
        command += ["--set", override]
    done = subprocess.run(command, capture_output=True, text=True, env=environment)
    if done.returncode != 0:
        raise RunFailed(done.returncode, (done.stderr or done.stdout).strip())
    return read_summary(directory)
