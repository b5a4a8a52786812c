# SPDX-License-Identifier: BSD-3-Clause
"""The exceptions and warnings of the package. `exit_code` is the exit code of the command for the same failure."""


class Error(Exception):
    """The base class. The message says what happened, where, and what to do about it."""

    exit_code = 1


class UsageError(Error, ValueError):
    """A wrong name, parameter or shape, a call at the wrong time, or a mistake in a deck."""

    exit_code = 2


class InitialStateError(Error, ValueError):
    """An impossible initial state: spheres that overlap or are outside the walls, or values that are not finite."""

    exit_code = 3


class NumericalError(Error, ArithmeticError):
    """The results of the run have become meaningless, in most cases because the step is too long."""

    exit_code = 4


class FileError(Error, OSError):
    """A file cannot be read or written, is damaged, or is of another kind."""

    exit_code = 5


class CaromWarning(UserWarning):
    """The category of the warnings of a deck and of a run. Simulation.warnings has their texts."""


def of_exit_code(code):
    return next((kind for kind in Error.__subclasses__() if kind.exit_code == code), Error)
