# SPDX-License-Identifier: BSD-3-Clause
"""Decks as text."""

import json
import pathlib
import sys

import numpy as np

from carom.errors import FileError, UsageError


def toml_text(deck):
    """The TOML text of a deck given as a dictionary, in the form that tomllib returns."""
    lines = [f"{key} = {toml_value(value)}" for key, value in deck.items() if not _is_table(value)]
    for key, value in deck.items():
        if not _is_table(value):
            continue
        header = f"[[{key}]]" if isinstance(value, list) else f"[{key}]"
        for table in value if isinstance(value, list) else [value]:
            lines += ["", header] + [f"{name} = {toml_value(entry)}" for name, entry in table.items()]
    return "\n".join(lines) + "\n"


def toml_value(value):
    """A value in TOML; numbers have the fewest digits that reproduce them exactly."""
    if isinstance(value, (np.ndarray, np.generic)):
        value = value.tolist()
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(toml_value, value)) + "]"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key} = {toml_value(entry)}" for key, entry in value.items()) + "}"
    if isinstance(value, (bool, str)):
        return json.dumps(value, ensure_ascii=False)  # JSON and TOML write strings and booleans alike
    return repr(value)


def _is_table(value):
    return isinstance(value, dict) or (isinstance(value, list) and bool(value) and isinstance(value[0], dict))


def write_deck(sim, file, ends, every):
    """See Simulation.write_deck()."""
    if all(end is None for end in ends.values()):
        raise UsageError("write_deck: the deck has no end; give time, steps or collisions")
    if not sim._session.method:
        raise UsageError("write_deck: there is no integrator; call integrator(name, step=…) first")
    more = {"run": {name: end for name, end in ends.items() if end is not None}}
    output = sim._deck_output if sim._output is None else sim._output
    more["output"] = {key: output[key] for key in output if key not in ("directory", "overwrite")}  # another run has its own files
    if every is not None:
        more["output"] |= {"frame_interval": float(every), "thermo_interval": float(every)}
    try:
        pathlib.Path(file).write_text(sim._session.deck("write_deck", []) + toml_text(more))
    except OSError as error:
        raise FileError(f"{file}: cannot write the deck: {error.strerror}; check the path") from error


def overrides(values):
    """The values in the form of the option `--set`; texts are not quoted."""
    return [f"{key}={value if isinstance(value, str) else toml_value(value)}" for key, value in values.items()]


def script_name():
    """The file of the program that runs, relative to the working directory if it is below; simulation.py in a notebook."""
    file = getattr(sys.modules["__main__"], "__file__", None)
    if not file:
        return "simulation.py"
    path, here = pathlib.Path(file).resolve(), pathlib.Path.cwd()
    return str(path.relative_to(here) if path.is_relative_to(here) else path)
