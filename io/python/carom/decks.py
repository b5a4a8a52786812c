# SPDX-License-Identifier: BSD-3-Clause
"""Writes decks as text."""

import itertools
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


def deck_of(sim, of, ends, whole=True):
    """The deck of a simulation: its present state without the images, forces, integrator, and the end of a run. If it is not `whole`,
    the number of particles replaces their positions and velocities."""
    if not sim._session.method:
        raise UsageError(f"{of}: there is no integrator; call integrator(name, step=…) first")
    deck = {"format": 1, "title": sim.title, "description": sim.description, "system": system_of(sim),
            "particles": species_of(sim, of) if whole else counts_of(sim)}
    if not whole and len(sim):
        deck["placement"] = {"type": "random"}
    if sim._session.method == "verlet":
        for species in deck["particles"]:
            species["display_radius"] = species.pop("radius")
    deck |= surroundings_of(sim)
    if sim._session.forces:
        deck["interaction"] = [{"type": name} | given for name, given in sim._session.forces]
    deck["integrator"] = {"type": sim._session.method} | sim._session.method_parameters
    deck["run"] = {name: end for name, end in ends.items() if end is not None}
    return deck


def system_of(sim):
    return {"dimension": len(sim.box), "box": sim.box, "boundary": sim.boundary}


def surroundings_of(sim):
    """The tables [[wall]], [[bath]] and [[contact]] of a deck."""
    baths = [one | {"ramp_time": [time - sim.time for time in one["ramp_time"]]} if "ramp_time" in one else one for one in sim._session.baths]
    tables = {"wall": sim.walls, "bath": baths, "contact": sim.contacts}
    return {name: given for name, given in tables.items() if given}


def species_of(sim, of):
    """The tables [[particles]] of a deck, one for each species."""
    kinds = sim.species
    if np.any(np.diff(kinds.astype(int)) < 0):
        raise UsageError(f"{of}: the particles of a species do not follow one another, which a deck needs; add species "
                         "after species")
    columns = {name: getattr(sim, name) for name in ("position", "velocity", "radius", "mass", "charge")}
    species = [{"name": name} | {key: values[kinds == kind] for key, values in columns.items()}
               for kind, name in enumerate(sim.species_names)]
    for one in species:
        if np.isinf(one["mass"]).any():
            if not np.isinf(one["mass"]).all():
                raise UsageError(f"{of}: some particles of the species '{one['name']}' are fixed, and others move, which a deck "
                                 "cannot say; give the fixed ones a species of their own")
            del one["mass"], one["velocity"]
            one["fixed"] = True
    if not any("tangential" in contact for contact in sim.contacts):
        return species
    spins = sim.spin.reshape(len(sim), -1)
    for kind, (one, inertia) in enumerate(itertools.zip_longest(species, sim._session.inertias, fillvalue=0)):
        one["spin"] = spins[kinds == kind]
        if inertia:
            one["inertia"] = inertia
    return species


def counts_of(sim):
    """The tables [[particles]] of a deck with counts in place of positions and velocities."""
    numbers, fixed = np.bincount(sim.species, minlength=len(sim.species_names)), np.isinf(sim.mass)
    radius = float(sim.radius.max(initial=0.5))
    return [{"name": name, "count": int(count), "temperature": 0.0, "radius": radius, "fixed": bool(fixed[sim.species == kind].all())}
            for kind, (name, count) in enumerate(zip(sim.species_names, numbers)) if count]


def write_deck(sim, file, ends, every):
    """See Simulation.write_deck()."""
    if all(end is None for end in ends.values()):
        raise UsageError("write_deck: the deck has no end; give time, steps or collisions")
    deck = deck_of(sim, "write_deck", ends)
    output = sim._deck_output if sim._output is None else sim._output
    deck["output"] = {key: output[key] for key in output if key not in ("directory", "overwrite")}  # another run has its own files
    if every is not None:
        deck["output"] |= {"frame_interval": float(every), "thermo_interval": float(every)}
    try:
        pathlib.Path(file).write_text(toml_text(deck))
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
