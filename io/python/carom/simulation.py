# SPDX-License-Identifier: BSD-3-Clause
"""Simulations: arrays and keywords checked here, everything else by the engine, with its texts."""

import os
import warnings

import numpy as np

from carom.decks import toml_value, write_deck
from carom.errors import UsageError
from carom.progress import Progress

try:
    from carom import _carom
except ImportError as error:
    raise ImportError(
        "the compiled part of carom is not there, or does not fit this Python: build it (cmake --build build/release "
        f"--target carom_python) and start tools/python, or install it (cmake --install); {error}") from error

version = _carom.version


def describe(name=None):
    """What a force or an integrator is and can be given, as text; without a name, the names there are."""
    known = {one["name"]: (kind, one) for kind, all in _carom.descriptors().items() for one in all}
    if name is None:
        kinds = {}
        for each, (kind, _) in known.items():
            kinds.setdefault(kind, []).append(each)
        return "\n".join(f"{kind}: {', '.join(names)}" for kind, names in kinds.items())
    if name not in known:
        raise UsageError(f"unknown name '{name}'; give one of: {', '.join(known)}")
    kind, one = known[name]
    text = [f"{name}: {one.get('title') or one.get('formula') or one.get('meaning')}"]
    text += [one[key] for key in ("documentation", "source") if one.get(key)]
    for each in one.get("parameters", []):
        default = {"": "must be given", "none": "may be left out"}.get(each["default"], f"default {each['default']}")
        text.append(f"  {each['name']} ({each['type']}, {each['unit']}, {default}): {each['meaning']}")
    return "\n".join(text)


class Simulation:
    """Hard spheres, in two or three dimensions, in a box from the origin to `box`.

    box: the edges, 2 or 3 lengths. boundary: "wall", "periodic" or "open", one for all axes or one each.

    Particles are numbered from 0 in the order of their addition. A change of particles, forces or integrator after a run
    begins a new run, at time 0, from the present state.
    """

    def __init__(self, box, boundary="wall"):
        edges = _numbers("Simulation", "box", box)
        if edges.shape not in ((2,), (3,)):
            raise UsageError(f"Simulation: 'box' has shape {edges.shape}; give 2 or 3 edges")
        rules = [boundary] if isinstance(boundary, str) else list(boundary)
        if not all(isinstance(rule, str) for rule in rules) or len(rules) not in (1, len(edges)):
            raise UsageError(f"Simulation: 'boundary' is {boundary!r}; give one name, or one for each of {len(edges)} axes")
        kind = _carom.Session2 if len(edges) == 2 else _carom.Session3
        self._session = kind(list(edges), rules)
        self.title, self.warnings = "", []

    @classmethod
    def from_deck(cls, deck, set=None):
        """The simulation that a deck describes, with some of its values changed: set={"integrator.step": 0.02}."""
        self = cls.__new__(cls)
        _refuse_masked("from_deck", set or {})
        changes = [f"{key}={value if isinstance(value, str) else toml_value(value)}" for key, value in (set or {}).items()]
        self._session, self.warnings, self.title = _carom.from_deck(os.fspath(deck), changes)
        for text in self.warnings:
            warnings.warn(text, stacklevel=2)
        return self

    def add_particles(self, position, velocity=None, radius=0.5, mass=1.0, charge=0.0, species="particle"):
        """Adds N particles; returns their ids, a range.

        position, velocity: arrays of shape (N, D) [length, length/time]; velocities are 0 where there are none.
        radius, mass, charge: one number for all, or N. species: a name, for forces between species.
        """
        dimension = len(self.box)
        x = _numbers("add_particles", "position", position)
        if x.shape == (dimension,):
            x = x.reshape(1, dimension)
        if x.ndim != 2 or x.shape[1] != dimension or len(x) == 0:
            raise UsageError(f"add_particles: 'position' has shape {x.shape}; give one of shape (N, {dimension}), "
                             "a row for each particle")
        v = np.empty(0) if velocity is None else _numbers("add_particles", "velocity", velocity).reshape(-1)
        if v.size not in (0, x.size) or (velocity is not None and np.shape(velocity) not in (x.shape, (dimension,))):
            raise UsageError(f"add_particles: 'velocity' has shape {np.shape(velocity)}; give the shape of 'position', "
                             f"{x.shape}")
        others = [_one_or_each("add_particles", name, values, len(x))
                  for name, values in (("radius", radius), ("mass", mass), ("charge", charge))]
        if not isinstance(species, str):
            raise UsageError(f"add_particles: 'species' is {species!r}; give one name, and call again for other species")
        first = self._session.size
        self._session.add_particles(x, v, *others, species)
        return range(first, self._session.size)

    def add_force(self, type, **parameters):
        """Adds a term of V by its name in decks; see carom.describe(type). Ids and species in it must be there already."""
        self._session.add_force(_name("add_force", type), _refuse_masked(type, parameters))

    def integrator(self, type, **parameters):
        """Chooses the integrator by its name in decks; see carom.describe(type)."""
        self._session.set_integrator(_name("integrator", type), _refuse_masked(type, parameters))

    def run(self, time=None, steps=None, collisions=None, every=None, callback=None, progress=None):
        """Runs to a time, a number of steps, or a number of pair collisions, counted from the start of the run: a later
        call with a later end goes on, with the bits of one undisturbed run. Without any of them: to the end of the deck.

        callback(simulation) is called every so much simulated time, and at the start and the end; what it raises ends the
        run at the end of the step (in free flight: after 500 000 collisions of the epoch, or its end). So does
        Ctrl-C, with KeyboardInterrupt; the simulation can be looked at and run on.
        progress: whether to show a line of progress; by default in terminals and notebooks.
        """
        if callback is not None and not callable(callback):
            raise UsageError(f"run: 'callback' is {callback!r}; give a function of one argument, the simulation")
        if callback is not None and every is None and self._session.interval == 0:
            raise UsageError("run: a callback needs 'every', the time between two calls; give the step for every step")
        line = Progress() if (Progress.wanted() if progress is None else progress) else None
        ends = _refuse_masked("run", {"time": time, "steps": steps, "collisions": collisions, "every": every})
        try:
            self._session.run(ends, callback and (lambda: callback(self)), line)
        finally:
            if line:
                line.close()

    def write_deck(self, file, time=None, steps=None, every=None):
        """Writes a deck that `carom run` and from_deck() take: the present state, forces, integrator and this end, with
        frames and rows of thermo `every` so much time. Images are not in it."""
        write_deck(self, file, {"end_time": time, "steps": steps}, every or 0)

    @property
    def position(self):
        """Centres, wrapped into the box along periodic axes, (N, D) [length]: a read-only view, no copy, which follows the
        run; .copy() keeps it. Assigning sets all of them."""
        return self._session.position()

    @position.setter
    def position(self, values):
        self._session.set_position(self._rows("position", values))

    @property
    def velocity(self):
        """Velocities, (N, D) [length/time]; like position."""
        return self._session.velocity()

    @velocity.setter
    def velocity(self, values):
        self._session.set_velocity(self._rows("velocity", values))

    @property
    def image(self):
        """How many times each particle has been carried round each periodic axis, (N, D); a view."""
        return self._session.image()

    @property
    def unwrapped(self):
        """Centres, followed through the periodic boundaries, (N, D) [length]; a new array."""
        return self.position + self.image * np.array(self.box)

    mass = property(lambda self: self._session.constant("mass"), doc="(N,) [mass]; a view")
    radius = property(lambda self: self._session.constant("radius"), doc="Of the hard cores, (N,) [length]; a view")
    charge = property(lambda self: self._session.constant("charge"), doc="(N,) [charge]; a view")
    species = property(lambda self: self._session.constant("species"), doc="Indices into species_names, (N,); a view")
    species_names = property(lambda self: self._session.species, doc="The names of the species.")
    box = property(lambda self: self._session.box, doc="Edges [length].")
    boundary = property(lambda self: self._session.boundary, doc="The name of the boundary on each axis.")

    time = property(lambda self: self._session.time, doc="Simulated time since the start of the run [time].")
    step = property(lambda self: self._session.step, doc="Steps done; of free-flight, epochs begun or done.")
    collisions = property(lambda self: self._session.collisions, doc="Pair collisions so far.")
    kinetic = property(lambda self: self._session.kinetic, doc="K [energy]")
    potential = property(lambda self: self._session.potential, doc="V with its long-range corrections [energy]")
    energy = property(lambda self: self._session.energy, doc="H = K + V [energy]")
    shadow_energy = property(lambda self: self._session.shadow, doc="S_h of Verlet types [energy]; else NaN")
    energy_error = property(lambda self: self._session.energy_error,
                            doc="The largest |H - H_1| so far, over max(|H_1|, K_1 + sum |V|).")
    temperature = property(lambda self: self._session.temperature, doc="2K/(D N), k_B = 1 [energy]")
    pressure = property(lambda self: self._session.pressure,
                        doc="Virial, with the collisions since the call before [energy/length^D]")
    momentum = property(lambda self: np.array(self._session.momentum), doc="The total, (D,) [mass length/time]")
    force_passes = property(lambda self: self._session.force_passes, doc="Pair evaluations / interacting pairs.")
    wall_seconds = property(lambda self: self._session.wall_seconds, doc="What the run has taken [s].")

    def __len__(self):
        return self._session.size

    def __reduce_ex__(self, protocol):
        raise TypeError("a Simulation cannot be copied or pickled; write_deck(file, time=…) writes its present state, and "
                        "Simulation.from_deck(file) makes another one from it")

    def __repr__(self):
        session = self._session
        return (f"<carom.Simulation: {session.size} particles in {len(session.box)} dimensions, forces: "
                f"{', '.join(name for name, _ in session.forces) or 'none'}, integrator: {session.method or 'none'}>")

    def _rows(self, name, values):
        array, shape = _numbers("Simulation", name, values), (len(self), len(self.box))
        if array.shape != shape:
            raise UsageError(f"Simulation: '{name}' has shape {array.shape}; give {shape}")
        return array


def _numbers(of, name, values):
    """Numbers as an array of doubles without gaps; one that is so already is not copied."""
    _refuse_masked(of, {name: values})
    try:
        array = np.asarray(values)
    except ValueError as error:
        raise UsageError(f"{of}: '{name}' has rows of different lengths; give each the same number of entries") from error
    if array.dtype.kind not in "iuf":
        raise UsageError(f"{of}: '{name}' has entries of type {array.dtype}; give real numbers")
    return np.asarray(array, dtype=np.float64, order="C")


def _refuse_masked(of, given):
    """The given values by name; numpy would take what stands below a mask, too."""
    for name, values in given.items():
        rows = values if isinstance(values, (list, tuple)) else [values]
        if any(isinstance(row, np.ma.MaskedArray) and np.ma.is_masked(row) for row in rows):
            raise UsageError(f"{of}: '{name}' has masked entries; fill them, or leave out their rows, and give a plain array")
    return given


def _one_or_each(of, name, values, n):
    array = _numbers(of, name, values)
    if array.shape not in ((), (1,), (n,)):
        raise UsageError(f"{of}: '{name}' has shape {array.shape}; give one number, or {n}, one for each particle")
    return array.reshape(-1)


def _name(of, type):
    if not isinstance(type, str):
        raise UsageError(f"{of}: the first argument is {type!r}; give a name, see carom.describe()")
    return type
