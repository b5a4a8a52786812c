# SPDX-License-Identifier: BSD-3-Clause
"""What goes wrong, by kind; `exit_code` is that of the command for the same failure."""


class Error(Exception):
    """The message says what happened, where, and what to do about it."""

    exit_code = 1


class UsageError(Error, ValueError):
    """Names, parameters, shapes, calls at the wrong time, or a deck with mistakes."""

    exit_code = 2


class InitialStateError(Error, ValueError):
    """A state that cannot be: overlapping spheres, spheres outside walls, values that are not finite."""

    exit_code = 3


class NumericalError(Error, ArithmeticError):
    """The run can mean nothing any more, mostly because its step is too long."""

    exit_code = 4


class FileError(Error, OSError):
    """A file that cannot be read or written, or is not what it should be."""

    exit_code = 5


def of_exit_code(code):
    return next((kind for kind in Error.__subclasses__() if kind.exit_code == code), Error)
