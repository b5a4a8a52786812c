# SPDX-License-Identifier: BSD-3-Clause
"""Writes carom/__init__.pyi: the hints of the Python files, and a signature of add_force() and integrator() for each name.

    PYTHONPATH=build/release/io/python python3 -P make_stubs.py __init__.pyi

The package is imported, but not used, so a stand-in replaces numpy where it is not installed (yet).
"""

import importlib.util
import inspect
import pathlib
import sys
from unittest import mock

if importlib.util.find_spec("numpy") is None:
    sys.modules["numpy"] = mock.MagicMock()

from carom import _carom, simulation  # noqa: E402

HEAD = '''# Generated from the declarations of the engine by io/python/make_stubs.py.
import os
from typing import Any, Callable, Literal, Mapping, Sequence, overload

import numpy as np
import numpy.typing as npt

from carom.errors import Error as Error, FileError as FileError, InitialStateError as InitialStateError
from carom.errors import NumericalError as NumericalError, UsageError as UsageError
from carom.files import Run as Run, open as open
from carom.page import Page
from carom.potentials import Sampled

version: str
def describe(name: str | None = None) -> str: ...

'''
PATHS = "str | os.PathLike[str]"
# Of arguments whose default is None the type is this or None.
ARGUMENTS = {"box": "npt.ArrayLike", "boundary": "Boundary | Sequence[Boundary]", "dimension": "Literal[2, 3]",
             "position": "npt.ArrayLike", "velocity": "npt.ArrayLike", "radius": "npt.ArrayLike", "mass": "npt.ArrayLike",
             "display_radius": "npt.ArrayLike", "charge": "npt.ArrayLike", "species": "str", "count": "int", "temperature": "float | Sequence[float]",
             "rotational_temperature": "float",
             "deck": f"{PATHS} | Mapping[str, Any]", "file": PATHS, "set": "Mapping[str, Any]", "directory": PATHS,
             "take_over": "bool", "frame": "int", "time": "float", "steps": "int", "collisions": "int", "every": "float",
             "fixed": "bool", "callback": "Callable[[Simulation], object]", "progress": "bool", "type": "str", "packing_fraction": "float",
             "seed": "int", "parameters": "Any", "thermo_interval": "float", "keys": "Any", "port": "int", "browser": "bool",
             "expression": "str | Callable[..., Any]", "start": "float", "cutoff": "float", "tolerance": "float",
             "options": "Mapping[str, Any]", "constants": "Any", "name": "str", "normal": "npt.ArrayLike",
             "atom_style": "str", "one": "str", "other": "str", "rate": "float", "spin": "npt.ArrayLike", "inertia": "float",
             "ramp_time": "Sequence[float]", "friction": "float | Sequence[float]", "between": "str"}
RESULTS = {"__init__": "None", "from_deck": "Simulation", "from_run": "Simulation", "from_file": "Simulation",
           "add_particles": "range", "add_wall": "None", "add_contact": "None", "add_step": "None", "add_bath": "None", "place": "range",
           "thermalize": "None",
           "add_potential": "Sampled", "output": "None",
           "open": "Run", "view": "Page", "run": "None", "write_deck": "None", "__len__": "int", "__repr__": "str"}
PROPERTIES = {"position": "npt.NDArray[np.float64]", "velocity": "npt.NDArray[np.float64]",
              "spin": "npt.NDArray[np.float64]",
              "image": "npt.NDArray[np.int32]", "unwrapped": "npt.NDArray[np.float64]", "mass": "npt.NDArray[np.float64]",
              "radius": "npt.NDArray[np.float64]", "charge": "npt.NDArray[np.float64]",
              "species": "npt.NDArray[np.uint16]", "momentum": "npt.NDArray[np.float64]", "species_names": "list[str]",
              "box": "list[float]", "boundary": "list[str]", "walls": "list[dict[str, Any]]", "contacts": "list[dict[str, Any]]",
              "steps": "list[dict[str, Any]]",
              "wall_loads": "dict[str, float]",
              "bath": "dict[str, Any] | None", "bath_temperature": "float | list[float] | None",
              "title": "str", "description": "str", "step": "int", "collisions": "int", "directory": "str | None",
              "means": "dict[str, dict[str, float]]",
              "averages": "dict[str, dict[str, npt.NDArray[np.float64]]]"}
VALUES = {"list[float]": "npt.ArrayLike", "list[str]": "Sequence[str]", "list[tuple[int, int]]": "npt.ArrayLike"}


def text_of(doc, indent):
    lines = inspect.cleandoc(doc or "").replace("\\", "\\\\").split("\n")
    return [f'{indent}"""{lines[0]}'] + [indent + line if line else "" for line in lines[1:]] + [f'{indent}"""']


def argument(parameter):
    kind = " | ".join(f'"{choice}"' for choice in parameter["choices"])
    kind = f"Literal[{kind.replace(' | ', ', ')}]" if kind and parameter["type"] == "str" else \
        VALUES.get(parameter["type"], parameter["type"])
    name = parameter["name"]
    if parameter["default"] == "":
        return f"{name}: {kind}"
    if parameter["default"] == "none":
        return f"{name}: {kind} | None = None"
    return f"{name}: {kind} = {parameter['default'].replace('true', 'True').replace('false', 'False')}"


def overloads(method, declared):
    for one in declared:
        parameters = sorted(one["parameters"], key=lambda each: each["default"] != "")
        keywords = "".join(", " + argument(each) for each in parameters)
        yield "    @overload"
        yield f"    def {method}(self, type: Literal[\"{one['name']}\"]{', *' if keywords else ''}{keywords}) -> None:"
        yield from text_of(simulation.describe(one["name"]), "        ")


def signature(name, member):
    parts = []
    for each in inspect.signature(member).parameters.values():
        if each.name in ("self", "cls"):
            parts.append(each.name)
            continue
        kind = ARGUMENTS[each.name] + (" | None" if each.default is None else "")
        part = f"{'**' if each.kind is each.VAR_KEYWORD else ''}{each.name}: {kind}"
        parts.append(part if each.default is each.empty else f"{part} = {each.default!r}")
    return f"    def {name}({', '.join(parts)}) -> {RESULTS[name]}:"


def lines():
    declared = _carom.descriptors()
    names = ", ".join(f'"{one["name"]}"' for one in declared["boundaries"])
    yield f"Boundary = Literal[{names}]"
    yield ""
    yield "class Simulation:"
    yield from text_of(simulation.Simulation.__doc__, "    ")
    yield "    warnings: list[str]"
    yield "    bonds: npt.NDArray[np.int64]"
    for name, member in vars(simulation.Simulation).items():
        if isinstance(member, property):
            kind = PROPERTIES.get(name, "float")
            yield "    @property"
            yield f"    def {name}(self) -> {kind}:"
            yield from text_of(member.__doc__, "        ")
            if member.fset:
                yield f"    @{name}.setter"
                yield f"    def {name}(self, values: npt.ArrayLike) -> None: ..."
        elif name in ("add_force", "integrator"):
            yield from overloads(name, declared["forces" if name == "add_force" else "integrators"])
        elif name in RESULTS:
            if isinstance(member, classmethod):
                yield "    @classmethod"
                yield signature(name, member.__func__)
            else:
                yield signature(name, member)
            yield from text_of(inspect.unwrap(member).__doc__ if member.__doc__ else "", "        ")


def main():
    pathlib.Path(sys.argv[1]).write_text(HEAD + "\n".join(lines()) + "\n")


if __name__ == "__main__":
    main()
