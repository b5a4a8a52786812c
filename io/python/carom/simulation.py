# SPDX-License-Identifier: BSD-3-Clause
"""Simulations: arrays and keywords checked here, everything else by the engine, with its texts."""

import collections.abc
import numbers as numbers_type
import operator
import os
import warnings

import numpy as np

from carom import files, formats, notebook, page, potentials
from carom.checks import name_of, numbers, one_or_each, refuse_masked
from carom.decks import deck_of, overrides, species_of, system_of, toml_text, toml_value, write_deck
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

    def __init__(self, box=None, boundary="wall", dimension=None):
        if box is None and dimension not in (2, 3):
            raise UsageError("Simulation: there is no 'box'; give its edges, or dimension=2 or 3 where place() is to choose them")
        edges = numbers("Simulation", "box", np.ones(dimension) if box is None else box)
        if edges.shape not in ((2,), (3,)):
            raise UsageError(f"Simulation: 'box' has shape {edges.shape}; give 2 or 3 edges")
        if dimension not in (None, len(edges)):
            raise UsageError(f"Simulation: 'dimension' is {dimension!r}, but 'box' has {len(edges)} edges; leave one of them out")
        rules = [boundary] if isinstance(boundary, str) else list(boundary)
        if not all(isinstance(rule, str) for rule in rules) or len(rules) not in (1, len(edges)):
            raise UsageError(f"Simulation: 'boundary' is {boundary!r}; give one name, or one for each of {len(edges)} axes")
        kind = _carom.Session2 if len(edges) == 2 else _carom.Session3
        self._start(kind(list(edges), rules))
        self._edges_known = box is not None

    def _start(self, session, title=""):
        self._session, self.title, self.warnings = session, title, []
        self._cores = False  # a radius was given
        self._edges_known, self._counted, self._inertias, self.bonds = True, [], {}, np.empty((0, 2), int)

    def _warn(self, texts, level=3):
        self.warnings = list(texts)
        for text in texts:
            warnings.warn(text, stacklevel=level)

    @classmethod
    def from_deck(cls, deck, set=None):
        """The simulation that a deck describes, with some of its values changed: set={"integrator.step": 0.02}.

        deck: the path of a file, or its tables as a dictionary, such as tomllib.load() reads them.
        """
        self = cls.__new__(cls)
        refuse_masked("from_deck", set or {})
        text = toml_text(deck) if isinstance(deck, collections.abc.Mapping) else None
        session, texts, title = _carom.from_deck("deck" if text else os.fspath(deck), overrides(set or {}), text)
        self._start(session, title)
        self._warn(texts)
        return self

    @classmethod
    def from_run(cls, directory, take_over=False):
        """The simulation that left its files in a directory, by output() or by the command, as its last checkpoint has it.

        The next run(), to a later end, goes on with its files and with the bits of an undisturbed run. A change of
        particles, forces or integrator instead begins a new run from that state, at time 0 and without files.
        take_over: as in `carom run --continue`. Raises FileError where there is no checkpoint.

            sim = carom.Simulation.from_run("runs/fluid")
            sim.run(time=200)
        """
        self = cls.__new__(cls)
        session, _, title = _carom.from_run(os.fspath(directory), take_over)
        self._start(session, title)
        return self

    @classmethod
    def from_file(cls, file, frame=-1, radius=None, boundary=None):
        """The particles of a GSD, extended XYZ or LAMMPS data file; see carom.formats.read()."""
        return formats.read(cls, file, frame, radius, boundary)

    def add_particles(self, position=None, velocity=None, radius=None, mass=1.0, charge=0.0, species="particle", count=None,
                      temperature=None, spin=None, inertia=None):
        """Adds N particles; returns their ids, a range.

        position, velocity: arrays of shape (N, D) [length, length/time]; velocities are 0 where there are none.
        radius, mass, charge: one number for all, or N; the radius is 0.5 if it is left out, as it is for verlet. species: a name, for forces between species.
        spin: angular velocities [1/time], (N,) in two dimensions and (N, 3) in three, which contacts with "tangential" change.
        inertia: reduced moment of inertia 4I/(m sigma²) of the species; of a homogeneous body where it is left out.
        count, temperature: instead of positions and velocities; place() then finds them, and returns all ids.

            sim.add_particles(position=[[1, 1], [3, 1]], velocity=[[0, 0], [0.5, 0]], radius=0.5)
            sim.add_particles(count=500, temperature=1.0, radius=0.5, species="solvent")
        """
        self._cores |= radius is not None
        radius = 0.5 if radius is None else radius
        if count is not None:
            return self._count(count, position, velocity, temperature,
                               {"name": species, "radius": radius, "mass": mass, "charge": charge}, spin, inertia)
        if position is None:
            raise UsageError("add_particles: there is no 'position'; give one of shape (N, D), or a count for place()")
        if temperature is not None:
            raise UsageError("add_particles: 'temperature' goes with 'count'; call thermalize() after particles with positions")
        if not self._edges_known:
            raise UsageError("add_particles: explicit positions need the 'box' of the simulation; give its edges")
        dimension = len(self.box)
        x = numbers("add_particles", "position", position)
        if x.shape == (dimension,):
            x = x.reshape(1, dimension)
        if x.ndim != 2 or x.shape[1] != dimension or len(x) == 0:
            raise UsageError(f"add_particles: 'position' has shape {x.shape}; give one of shape (N, {dimension}), "
                             "a row for each particle")
        v = np.empty(0) if velocity is None else numbers("add_particles", "velocity", velocity).reshape(-1)
        if v.size not in (0, x.size) or (velocity is not None and np.shape(velocity) not in (x.shape, (dimension,))):
            raise UsageError(f"add_particles: 'velocity' has shape {np.shape(velocity)}; give the shape of 'position', "
                             f"{x.shape}")
        others = [one_or_each("add_particles", name, values, len(x))
                  for name, values in (("radius", radius), ("mass", mass), ("charge", charge))]
        if not isinstance(species, str):
            raise UsageError(f"add_particles: 'species' is {species!r}; give one name, and call again for other species")
        turning = np.empty(0) if spin is None else self._spins("add_particles", spin, len(x))
        first = self._session.size
        self._session.add_particles(x, v, *others, turning, species, self._inertia(inertia))
        return range(first, self._session.size)

    @staticmethod
    def _inertia(value):
        if value is None:
            return 0.0
        if not isinstance(value, numbers_type.Real) or isinstance(value, bool) or not value > 0:
            raise UsageError(f"add_particles: 'inertia' is {value!r}; give one positive number for the species")
        return float(value)

    def _spins(self, of, values, count):
        array, shape = numbers(of, "spin", values), (count,) if len(self.box) == 2 else (count, 3)
        if array.shape != shape:
            raise UsageError(f"{of}: 'spin' has shape {array.shape}; give {shape}")
        return array

    def _count(self, count, position, velocity, temperature, table, spin, inertia):
        if spin is not None:
            raise UsageError("add_particles: 'spin' goes with 'position'; assign simulation.spin after place()")
        self._inertias[table["name"]] = self._inertia(inertia)
        if position is not None or velocity is not None:
            raise UsageError("add_particles: 'count' excludes 'position' and 'velocity'; leave it out, or them")
        if temperature is None:
            raise UsageError("add_particles: 'count' needs a 'temperature'; 0 leaves the particles at rest")
        first = self._session.size + sum(one["count"] for one in self._counted)
        for name in ("radius", "mass", "charge"):
            values = one_or_each("add_particles", name, table[name], count)
            table[name] = float(values[0]) if len(values) == 1 else values
        self._counted.append(table | {"count": int(count), "temperature": float(temperature)})
        return range(first, first + int(count))

    def place(self, type, packing_fraction=None, seed=1, **parameters):
        """Places the particles that add_particles() was given by count, and draws their velocities; returns all ids.

        type: "fcc", "simple-cubic", "hexagonal", "square", "random" or "compressed", as in the [placement] of decks, with
        its parameters. packing_fraction: sets the box, where the simulation was made without one.
        Raises InitialStateError where there is no room.

            sim = carom.Simulation(dimension=3, boundary="periodic")
            sim.add_particles(count=500, temperature=1.0, radius=0.5)
            sim.place("fcc", packing_fraction=0.3, seed=1)
        """
        if not self._counted:
            raise UsageError("place: no particles were given by count; call add_particles(count=…, temperature=…) first")
        old, spin = self._session, self._session.spin()
        system = system_of(self)
        if not self._edges_known:
            del system["box"]
        placed = species_of(self, "place") if old.size else []
        for one in placed:
            self._inertias[one["name"]] = one.pop("inertia", 0.0)
            one.pop("spin", None)
        deck = {"format": 1, "system": system, "particles": placed + self._counted,
                "placement": {"type": name_of("place", type), "seed": seed} | parameters,
                "integrator": {"type": "free-flight"}, "run": {"collisions": 1}}
        if packing_fraction is not None:
            deck["placement"]["packing_fraction"] = packing_fraction
        session, texts, _ = _carom.from_deck("place", [], toml_text(deck))
        session.forget_run()
        for one in old.walls:
            session.add_wall(one)
        for one in old.contacts:
            session.add_contact(one)
        for one in old.baths:
            session.set_bath(one)
        for name, inertia in self._inertias.items():
            if inertia:
                session.set_inertia(name, inertia)
        if spin.any():
            session.set_spin(np.concatenate([spin, np.zeros((session.size - len(spin),) + spin.shape[1:])]))
        for name, given in old.forces:
            session.add_force(name, given)
        if old.method:
            session.set_integrator(old.method, old.method_parameters)
        self._session, self._edges_known, self._counted, self._inertias = session, True, [], {}
        self._warn(texts)
        return range(len(self))

    def thermalize(self, temperature, seed=1, species=None):
        """Draws velocities of Maxwell and Boltzmann, of exactly this temperature [energy] and without total momentum.

        species: the name of the only one that gets them. In a callback, too: see `velocity`.
        """
        each = np.full(len(self), np.nan)
        if species is not None and species not in self.species_names:
            raise UsageError(f"thermalize: there is no species '{species}'; give one of: {', '.join(self.species_names)}")
        chosen = slice(None) if species is None else self.species == self.species_names.index(species)
        each[chosen] = temperature
        self._session.set_velocity(self._session.drawn_velocities(each, seed))

    def add_wall(self, name, normal=None, **parameters):
        """Adds a wall, or changes a face of the box: "x-", "x+", "y-", … where its boundary is a wall.

        normal: of a further wall, into the space of the spheres. Other parameters are those of [[wall]] in decks: offset,
        velocity (a number along the normal, or {"amplitude": …, "frequency": …}), one_sided, …; see carom.describe("wall").

            sim.add_wall("x+", velocity=0.05)                         # a piston
            sim.add_wall("ramp", normal=[1, 2], offset=3.0)           # normal·x = offset
        """
        given = refuse_masked("add_wall", parameters | {"name": name_of("add_wall", name)})
        self._session.add_wall(given if normal is None else given | {"normal": numbers("add_wall", "normal", normal)})

    def add_contact(self, one, other, **parameters):
        """Sets the law of contacts between two species, or a species and a wall ("x-", or its name); "*" for any. They must
        be there already; a later law replaces an earlier one.

        Parameters are those of [[contact]] in decks: restitution, tangential, friction, rest_speed; see
        carom.describe("contact").

            sim.add_contact("*", "*", restitution=0.9)
            sim.add_contact("*", "*", restitution=0.9, tangential=0.5, friction=0.3)     # rough spheres, which spin
            sim.add_contact("ice", "ice", restitution={"form": "power", "v0": 0.01, "exponent": 0.234})
        """
        given = refuse_masked("add_contact", dict(parameters))
        self._session.add_contact(given | {"between": [name_of("add_contact", one), name_of("add_contact", other)]})

    def add_bath(self, type, temperature, rate, seed=1):
        """Couples all particles to a heat bath, in place of an earlier one.

        type: "andersen": at random times a particle gets a new velocity from the distribution of Maxwell and Boltzmann;
        "rescaling": all velocities are scaled by a common random factor, so that the kinetic energy is canonical.
        temperature: a number [energy], or [first, last]: a linear ramp over the next run. rate: kicks of a particle per
        unit time; of rescaling 1/relaxation time.

            sim.add_bath("andersen", temperature=1.0, rate=0.5)
            sim.run(time=100)
            sim.bath_temperature = 2.0       # the next run() goes on
        """
        given = {"type": type, "temperature": temperature, "rate": rate, "seed": seed}
        self._session.set_bath(refuse_masked("add_bath", given))

    def _set_bath_temperature(self, value):
        self._session.set_bath_temperature(value)

    def add_force(self, type, **parameters):
        """Adds a term of V by its name in decks; see carom.describe(type). Ids and species in it must be there already."""
        self._session.add_force(name_of("add_force", type), refuse_masked(type, parameters))

    def add_potential(self, expression, start, cutoff, tolerance=1e-8, options=None, **constants):
        """Adds a pair potential given as an expression of r; returns the points of its table, with the errors.

        expression: a text such as "epsilon*exp(-(r/sigma)**2)", with functions of numpy and constants by keyword, or a
        function of r [length] that returns V [energy]. start: from this distance on it is sampled; no pair should come
        nearer. cutoff: where it ends. tolerance: the largest error of V, relative to the largest |V|. options: other
        parameters of "table", such as {"species": ["a", "b"], "cut": "shifted"}.
        Raises UsageError where the tolerance cannot be met.

            print(sim.add_potential("epsilon*exp(-r**2)", start=0.2, cutoff=3.0, epsilon=2.0))
        """
        points = potentials.sample(expression, start, cutoff, tolerance, **constants)
        slope = {"slope": points.slope} if len(points.slope) else {}
        self.add_force("table", r=points.r, value=points.value, cutoff=cutoff, **slope, **(options or {}))
        return points

    def output(self, directory, thermo_interval=0, **keys):
        """From the next run on, files are written to a directory, as the command writes them: see carom.open().

        thermo_interval: time between rows of thermo.csv; callbacks then come with each row. Other keys are those of
        [output] in decks: frame_interval, events, rdf_interval, msd_interval, profile_interval, sample_start,
        checkpoint_wall, units, … (`carom schema`). Each run() ends with a checkpoint, from which from_run() and
        `carom run --continue` go on. Begins a new run, at time 0; the files of an earlier run in the directory are moved
        to its backup.N.

            sim.output("runs/fluid", thermo_interval=0.1, frame_interval=1.0, rdf_interval=0.1)
            sim.run(time=100)
            print(sim.averages["rdf"]["g"].max(), len(sim.open().frames))
        """
        given = {"directory": os.path.abspath(os.fspath(directory)), "thermo_interval": thermo_interval} | keys
        refuse_masked("output", given)
        self._session.set_output([f"output.{key}={toml_value(value)}" for key, value in given.items()], float(thermo_interval))

    @property
    def directory(self):
        """Where the files of the run are; None where it leaves none."""
        return self._session.directory or None

    def open(self):
        """What the run has left in its directory, a carom.Run."""
        return files.open(self._need_directory("open"))

    def view(self, port=0, browser=None):
        """A page that shows the run in a browser, also while it goes on; in a notebook, in place. See carom.page.Page."""
        return page.Page([self._need_directory("view")], port, browser)

    def _need_directory(self, of):
        if self.directory is None:
            raise UsageError(f"{of}: the run leaves no files; call output(directory, frame_interval=…) and run() first")
        return self.directory

    @property
    def averages(self):
        """The averages up to now, by name and column: ["rdf"]["g"]; those that output() has asked for by an interval. New
        arrays, also in callbacks."""
        return self._session.averages()

    def integrator(self, type, **parameters):
        """Chooses the integrator by its name in decks; see carom.describe(type)."""
        self._session.set_integrator(name_of("integrator", type), refuse_masked(type, parameters))

    def run(self, time=None, steps=None, collisions=None, every=None, callback=None, progress=None):
        """Runs to a time, a number of steps, or a number of pair collisions, counted from the start of the run: a later
        call with a later end goes on, with the bits of one undisturbed run. Without any of them: to the end of the deck.

        time [time], steps, collisions: where the run ends; the first that is reached.
        callback(simulation) is called every so much simulated time, and at the start and the end; what it raises ends the
        run at the end of the step (in free flight: after 500 000 collisions of the epoch, or its end). So does
        Ctrl-C, with KeyboardInterrupt; the simulation can be looked at and run on. A callback may set velocities.
        progress: whether to show a line of progress; by default in terminals and notebooks.
        """
        if callback is not None and not callable(callback):
            raise UsageError(f"run: 'callback' is {callback!r}; give a function of one argument, the simulation")
        if callback is not None and every is None and self._session.interval == 0:
            raise UsageError("run: a callback needs 'every', the time between two calls; give the step for every step")
        line = Progress() if (Progress.wanted() if progress is None else progress) else None
        ends = refuse_masked("run", {"time": time, "steps": steps, "collisions": collisions, "every": every})
        if self._counted:
            raise UsageError("run: particles that were given by count have no positions; call place() first")
        if self._cores and self._session.method == "verlet":
            raise UsageError("run: verlet treats particles as points and would ignore 'radius'; take psa or edda, where spheres collide, "
                             "or leave radius out")
        try:
            self._session.run(ends, callback and (lambda: callback(self)), line,
                              lambda: toml_text(deck_of(self, "run", {"steps": 1})))
        finally:
            if line:
                line.close()
            self._warn(self._session.warnings)

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
        """Velocities, (N, D) [length/time]; like position. Assigned in a callback, they hold from then on, and the run goes on
        at its time: what this adds to H is no part of energy_error. In free flight the callback must come at the end of
        an epoch: integrator("free-flight", step=every)."""
        return self._session.velocity()

    @velocity.setter
    def velocity(self, values):
        self._session.set_velocity(self._rows("velocity", values))

    @property
    def spin(self):
        """Angular velocities [1/time], (N,), about z, in two dimensions and (N, 3) in three; like position. Only contacts with
        "tangential" change them; zeros where there are none."""
        values = self._session.spin()
        return values if len(values) == len(self) else np.zeros((len(self),) + values.shape[1:])

    @spin.setter
    def spin(self, values):
        self._session.set_spin(self._spins("Simulation", values, len(self)))

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
    contacts = property(lambda self: self._session.contacts, doc="The laws of contacts, as dictionaries of their options.")
    bath = property(lambda self: next(iter(self._session.baths), None),
                    doc="The heat bath, as a dictionary of its options; None: there is none.")
    bath_temperature = property(lambda self: self.bath and self.bath["temperature"], _set_bath_temperature,
                                doc="The temperature of the bath [energy]; may be set between runs, which go on.")
    walls = property(lambda self: self._session.walls, doc="The walls that were added, as dictionaries of their options.")
    boundary = property(lambda self: self._session.boundary, doc="The name of the boundary on each axis.")

    energy_error = property(lambda self: self._session.energy_error,
                            doc="The largest |H - H_1| so far, over max(|H_1|, K_1 + sum |V|).")
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

    def _repr_html_(self):
        return notebook.table_of(self)

    def _rows(self, name, values):
        array, shape = numbers("Simulation", name, values), (len(self), len(self.box))
        if array.shape != shape:
            raise UsageError(f"Simulation: '{name}' has shape {array.shape}; give {shape}")
        return array


# The numbers that runs write to thermo.csv: time, energy, temperature, …
for _name, _meaning in _carom.columns.items():
    _column = property(operator.attrgetter("_session." + _name), doc=_meaning)
    _column.__set_name__(Simulation, _name)  # for messages
    setattr(Simulation, _name, _column)
