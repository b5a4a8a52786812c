# SPDX-License-Identifier: BSD-3-Clause
"""Samples pair potentials that are given as expressions, so that the error of the resulting table is known."""

import math
import numbers

import numpy as np

from carom.errors import UsageError

LARGEST = 8192  # points
FUNCTIONS = {name: getattr(np, name) for name in (
    "exp", "expm1", "log", "log1p", "sqrt", "cbrt", "sin", "cos", "tan", "arcsin", "arccos", "arctan", "sinh", "cosh", "tanh",
    "minimum", "maximum", "where", "abs", "pi", "e")}
FUNCTIONS |= {name: np.vectorize(getattr(math, name), otypes=[float]) for name in ("erf", "erfc", "gamma", "lgamma")}


class Sampled:
    """The points of a table: r (N,) [length], value (N,) [energy], and slope at both ends [energy/length]. `error` [energy] and
    `force_error` [energy/length] are the largest differences between the spline and the expression from `start` to `cutoff`."""

    def __init__(self, r, value, slope, error, force_error):
        self.r, self.value, self.slope, self.error, self.force_error = r, value, slope, error, force_error

    def __repr__(self):
        return (f"<{len(self.r)} points from r = {self.r[0]:g} to {self.r[-1]:g}; the spline errs by {self.error:.1e} in V, "
                f"by {self.force_error:.1e} in the force>")


def function_of(expression, constants):
    """A function V(r) that accepts arrays, from an expression of r and constants or from a function of r."""
    if callable(expression):
        return lambda r: _values("the function", r, lambda: expression(r, **constants))
    if not isinstance(expression, str):
        raise UsageError(f"potential: the expression is {expression!r}; give a text such as '4*(r**-12 - r**-6)', or a function of r")
    try:
        code = compile(expression, "potential", "eval")
    except (SyntaxError, ValueError) as error:
        raise UsageError(f"potential: '{expression}' is no expression: {error}; give a text such as '4*(r**-12 - r**-6)'") from error
    names = set(code.co_names)
    unknown = names - set(FUNCTIONS) - set(constants) - {"r"}
    if unknown:
        raise UsageError(f"potential: unknown name '{min(unknown)}' in '{expression}'; give it as a keyword, or use r and "
                         f"{', '.join(FUNCTIONS)}")
    if "r" not in names:
        raise UsageError(f"potential: '{expression}' does not depend on r; give an expression of r, the distance")
    for name, number in constants.items():
        if not isinstance(number, numbers.Real):
            raise UsageError(f"potential: '{name}' is {number!r}; give a number")
    known = {"__builtins__": {}} | FUNCTIONS | constants
    return lambda r: _values(f"'{expression}'", r, lambda: eval(code, known | {"r": r}))


def _values(what, r, evaluate):
    """V at the distances r, from `evaluate`, which belongs to the user."""
    try:
        with np.errstate(all="ignore"):
            found = np.broadcast_to(np.asarray(evaluate()), np.shape(r))
    except Exception as error:
        raise UsageError(f"potential: {what} cannot be computed: {type(error).__name__}: {error}; it must give V for an array r") from error
    if found.dtype.kind not in "iuf":
        kind = {"c": "complex numbers", "b": "truth values"}.get(found.dtype.kind, f"values of type {found.dtype}")
        raise UsageError(f"potential: {what} gives {kind}; V must be real numbers")
    return found.astype(float)


def derivative(value, r):
    """dV/dr by central differences of sixth order."""
    h = 2e-3 * r
    weights = {1: 45 / 60, 2: -9 / 60, 3: 1 / 60}
    return sum(weight * (value(r + n * h) - value(r - n * h)) for n, weight in weights.items()) / h


def sample(expression, start, cutoff, tolerance=1e-8, **constants):
    """Samples V(r) from `start` to `cutoff` at as many points as the tolerance requires; returns a Sampled.

    expression: a text with r, functions of numpy (exp, sqrt, …) and constants given by keyword, or a function of r.
    start, cutoff: the ends of the table [length]; below `start` it continues as a parabola. tolerance: the largest error of the
    spline, relative to the largest |V| in this range. Raises UsageError if 8192 points do not suffice.

        sample("epsilon*exp(-(r/sigma)**2)", start=0.2, cutoff=3.0, epsilon=2.0, sigma=1.0)
    """
    from carom import _carom

    for name, number in (("start", start), ("cutoff", cutoff), ("tolerance", tolerance)):
        if not isinstance(number, numbers.Real):
            raise UsageError(f"potential: {name} is {number!r}; give a number")
    if not 0 < start < cutoff < math.inf:
        raise UsageError(f"potential: start is {start} and cutoff {cutoff}; give 0 < start < cutoff")
    value = function_of(expression, constants)
    points = 16
    while True:
        r = np.linspace(start, cutoff, points)
        at = np.linspace(start, cutoff, 8 * (points - 1) + 1)
        exact = value(at)
        if not np.all(np.isfinite(exact)):
            wrong = at[~np.isfinite(exact)][0]
            raise UsageError(f"potential: V is not finite at r = {wrong:.6g}; give a larger start, or another expression")
        if points == 16 and exact[0] != 0 and np.all(exact == exact[0]):
            raise UsageError(f"potential: V is {exact[0]:g} at every r, so there would be no force; give an expression of r, the distance")
        ends = derivative(value, np.array([start, cutoff]))
        slope = ends if np.all(np.isfinite(ends)) else np.empty(0)
        found, found_slope = _carom.spline(r, value(r), slope, at)
        scale = np.max(np.abs(exact)) or 1.0
        error = np.max(np.abs(found - exact))
        if error <= tolerance * scale:
            inner = at[1:-1]
            force_error = np.nanmax(np.abs(found_slope[1:-1] - derivative(value, inner)))
            return Sampled(r, value(r), slope, float(error), float(force_error))
        if points >= LARGEST:
            raise UsageError(f"potential: {points} points leave an error of {error / scale:.1e} of the largest |V|, more than the "
                             f"tolerance of {tolerance:g}; give a larger start, a larger tolerance, or an expression without corners")
        points *= 2
