# SPDX-License-Identifier: BSD-3-Clause
"""Checks of arguments, before they reach the engine."""

import os
import sys

import numpy as np

from carom.errors import UsageError

# What Open MPI, MPICH and Slurm's srun tell each process of a job of several. (SLURM_NTASKS stands in batch scripts, too.)
PROCESSES = ("OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "SLURM_STEP_NUM_TASKS")


def refuse_ranks():
    """Raises UsageError in one of several processes of an MPI job, unless the script divides the work itself by mpi4py."""
    found = next((name for name in PROCESSES if os.environ.get(name, "1") not in ("", "1")), None)
    if found and "mpi4py" not in sys.modules:
        raise UsageError(f"Simulation: this is one of {os.environ[found]} processes ({found}), and each would run the whole simulation; a "
                         "simulation in Python runs on one rank: start the script without mpirun, or write a deck by write_deck() and run "
                         "it on many ranks by mpirun -n … carom run. If each process has a simulation of its own, import mpi4py first")


def numbers(of, name, values):
    """The values as a contiguous array of doubles; an array that is one already is not copied."""
    refuse_masked(of, {name: values})
    try:
        array = np.asarray(values)
    except ValueError as error:
        raise UsageError(f"{of}: '{name}' has rows of different lengths; give each the same number of entries") from error
    if array.dtype.kind not in "iuf":
        raise UsageError(f"{of}: '{name}' has entries of type {array.dtype}; give real numbers")
    return np.asarray(array, dtype=np.float64, order="C")


def refuse_masked(of, given):
    """Returns `given`; raises UsageError if a value has masked entries, because numpy would use the numbers below the mask."""
    for name, values in given.items():
        rows = values if isinstance(values, (list, tuple)) else [values]
        if any(isinstance(row, np.ma.MaskedArray) and np.ma.is_masked(row) for row in rows):
            raise UsageError(f"{of}: '{name}' has masked entries; fill them, or leave out their rows, and give a plain array")
    return given


def one_or_each(of, name, values, n):
    array = numbers(of, name, values)
    if array.shape not in ((), (1,), (n,)):
        raise UsageError(f"{of}: '{name}' has shape {array.shape}; give one number, or {n}, one for each particle")
    return array.reshape(-1)


def name_of(of, type):
    if not isinstance(type, str):
        raise UsageError(f"{of}: the first argument is {type!r}; give a name, see carom.describe()")
    return type
