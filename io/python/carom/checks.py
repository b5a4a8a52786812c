# SPDX-License-Identifier: BSD-3-Clause
"""Checks of arguments, before they reach the engine."""

import numpy as np

from carom.errors import UsageError


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
