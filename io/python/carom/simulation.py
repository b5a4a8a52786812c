# SPDX-License-Identifier: BSD-3-Clause
"""Simulations. Arrays and keywords are checked here; the engine checks all other input and writes the messages about it."""

import collections.abc
import numbers as numbers_type
import operator
import os
import warnings

import numpy as np

from carom import files, formats, notebook, page, potentials
from carom.checks import name_of, numbers, one_or_each, refuse_masked, refuse_ranks
from carom.decks import overrides, script_name, toml_text, toml_value, write_deck
from carom.errors import CaromWarning, UsageError
from carom.progress import Progress

try:
    from carom import _carom
except ImportError as error:
    raise ImportError(
        "the compiled part of carom is missing, or was built for another Python: build it (cmake --build build/release "
        f"--target carom_python) and start tools/python, or install it (cmake --install); {error}") from error

version = _carom.version


def describe(name=None):
    """Describes a force, an integrator, a wall, a contact, a step or a bath, with its parameters, as text. Without a name: lists all names."""
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
    """Hard spheres in two or three dimensions, in a box whose lower corner is the origin.

    box: the lengths of the 2 or 3 edges. boundary: "wall", "periodic" or "open", one for all axes or one for each. dimension: 2 or 3,
    instead of `box`, if place() is to choose the box.

    Particles are numbered from 0 in the order in which they are added. If particles, forces or the integrator are changed after a
    run, a new run begins from the present state at time 0.
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
        self._start(kind([] if box is None else list(edges), rules * (len(edges) // len(rules))))

    def _start(self, session):
        refuse_ranks()
        self._session, self.warnings = session, []
        self._cores = False  # a radius was given
        self._deck_output, self._output = {}, None  # keys of [output]: the deck's, and those of runs; None: runs write no files
        self._every = False  # whether run(every=…) may set the thermo_interval, which is then the deck's
        self._counted, self._spinning, self._inertias, self.bonds = [], [], {}, np.empty((0, 2), int)

    def _warn(self, texts, level=3):
        self.warnings = list(texts)
        for text in texts:
            warnings.warn(text.replace("warning: ", "", 1), CaromWarning, stacklevel=level)

    @classmethod
    def from_deck(cls, deck, set=None):
        """The simulation that a deck describes. `set` changes values of the deck: set={"integrator.step": 0.02}.

        deck: the path of a file, or a dictionary in the form that tomllib.load() returns. Its [output] is kept for output(), without which
        run() writes no files.
        """
        self = cls.__new__(cls)
        refuse_masked("from_deck", set or {})
        text = toml_text(deck) if isinstance(deck, collections.abc.Mapping) else None
        session, texts, output = _carom.from_deck("deck" if text else os.fspath(deck), overrides(set or {}), text)
        self._start(session)
        self._deck_output = output
        self._warn(texts)
        return self

    @classmethod
    def from_run(cls, directory, take_over=False):
        """The simulation in the last checkpoint of a directory, which output() or the command `carom run` has written.

        The next run() to a later end continues the run and its files, with the bits of an undisturbed run. If particles, forces or the
        integrator are changed first, a new run begins from the state of the checkpoint, at time 0 and without files.
        take_over: as in `carom run --continue`. Raises FileError if there is no checkpoint.

            sim = carom.Simulation.from_run("runs/fluid")
            sim.run(time=200)
        """
        self = cls.__new__(cls)
        self._start(_carom.from_run(os.fspath(directory), take_over)[0])
        return self

    @classmethod
    def from_file(cls, file, frame=-1, radius=None, boundary=None, atom_style=None):
        """A simulation with the particles of a GSD, extended XYZ or LAMMPS data file; see carom.formats.read()."""
        return formats.read(cls, file, frame, radius, boundary, atom_style)

    def add_particles(self, position=None, velocity=None, radius=None, mass=1.0, charge=0.0, species="particle", count=None,
                      temperature=None, spin=None, inertia=None, rotational_temperature=None, fixed=False, display_radius=None):
        """Adds N particles; returns the range of their ids.

        position, velocity: arrays of shape (N, D) [length, length/time]; the default velocity is 0.
        radius, mass, charge: one number for all, or N numbers. The default radius is 0.5; leave it out for verlet, which has no hard
        cores. species: the name of their species, for forces between species.
        spin: angular velocities [1/time], (N,) in two dimensions, about z, and (N, 3) in three. Contacts with "tangential" change them.
        fixed: they never move, and others bounce off them; their mass is infinite. display_radius: with verlet, the radius in pictures.
        inertia: reduced moment of inertia 4I/(m sigma²) of the species; the default is that of a homogeneous body.
        count, temperature, rotational_temperature: replace positions, velocities and spins, which place() then chooses. Without
        rotational_temperature the particles do not spin.

            sim.add_particles(position=[[1, 1], [3, 1]], velocity=[[0, 0], [0.5, 0]], radius=0.5)
            sim.add_particles(count=500, temperature=1.0, radius=0.5, species="solvent")
        """
        if fixed:
            for name, value in (("velocity", velocity), ("temperature", temperature), ("spin", spin),
                                ("rotational_temperature", rotational_temperature)):
                if value is not None and np.any(value):
                    raise UsageError(f"add_particles: '{name}' of fixed particles; leave it out")
        if radius is not None and display_radius is not None:
            raise UsageError("add_particles: 'radius' and 'display_radius' exclude each other; verlet's particles, which are points, have "
                             "the second one")
        self._cores |= radius is not None
        radius = next((one for one in (radius, display_radius) if one is not None), 0.5)
        if count is not None:
            return self._count(count, position, velocity, temperature,
                               {"name": species, "radius": radius, "mass": mass, "charge": charge, "fixed": bool(fixed)},
                               spin, inertia, rotational_temperature)
        if position is None:
            raise UsageError("add_particles: there is no 'position'; give one of shape (N, D), or a count for place()")
        for name, value in (("temperature", temperature), ("rotational_temperature", rotational_temperature)):
            if value is not None:
                raise UsageError(f"add_particles: '{name}' goes with 'count'; call thermalize() after particles with positions")
        if "box" not in self._table("system"):
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
        if fixed:
            others[1] = np.array([np.inf])
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

    def _count(self, count, position, velocity, temperature, table, spin, inertia, rotational_temperature):
        if spin is not None:
            raise UsageError("add_particles: 'spin' goes with 'position'; give 'rotational_temperature' with 'count'")
        self._inertias[table["name"]] = self._inertia(inertia)
        if position is not None or velocity is not None:
            raise UsageError("add_particles: 'count' excludes 'position' and 'velocity'; leave it out, or them")
        if table["fixed"]:
            temperature = 0.0
        if temperature is None:
            raise UsageError("add_particles: 'count' needs a 'temperature'; 0 leaves the particles at rest")
        if rotational_temperature is not None and not 0 <= rotational_temperature < np.inf:
            raise UsageError(f"add_particles: 'rotational_temperature' is {rotational_temperature!r}; give 0 or more")
        first = self._session.size + sum(one["count"] for one in self._counted)
        for name in ("radius", "mass", "charge"):
            values = one_or_each("add_particles", name, table[name], count)
            table[name] = float(values[0]) if len(values) == 1 else values
        self._counted.append(table | {"count": int(count), "temperature": float(temperature)})
        self._spinning.append(np.full(int(count), np.nan if rotational_temperature is None else float(rotational_temperature)))
        return range(first, first + int(count))

    def place(self, type, packing_fraction=None, seed=1, **parameters):
        """Places the particles that were added by count, and draws their velocities and spins; returns the range of all ids.

        type: "fcc", "simple-cubic", "hexagonal", "square", "random" or "compressed". It and further parameters are those of
        [placement] in decks. packing_fraction: determines the box if the simulation was made without one.
        Raises InitialStateError if there is not enough room.

            sim = carom.Simulation(dimension=3, boundary="periodic")
            sim.add_particles(count=500, temperature=1.0, radius=0.5)
            sim.place("fcc", packing_fraction=0.3, seed=1)
        """
        if not self._counted:
            raise UsageError("place: no particles were given by count; call add_particles(count=…, temperature=…) first")
        session = self._session
        points = session.method == "verlet"
        more = {"particles": [{"display_radius" if points and key == "radius" else key: one[key] for key in one} for one in self._counted],
                "placement": {"type": name_of("place", type), "seed": seed} | parameters, "run": {"steps": 1}}
        if packing_fraction is not None:
            more["placement"]["packing_fraction"] = packing_fraction
        if not points:
            more["integrator"] = {"type": "free-flight"}
        others = session.deck("place", ["bath", "interaction"] + ["integrator"] * (not points))  # they have no part in the placement
        placed, texts, _ = _carom.from_deck("place", [], others + toml_text(more))
        first = len(self)
        session.take(placed)
        for name, inertia in self._inertias.items():
            if inertia:
                session.set_inertia(name, inertia)
        spinning = np.concatenate([np.full(first, np.nan)] + self._spinning)
        if not np.isnan(spinning).all():
            session.draw(spinning, seed, True)
        self._counted, self._spinning, self._inertias = [], [], {}
        self._warn(texts)
        return range(len(self))

    def thermalize(self, temperature, seed=1, species=None, rotational_temperature=None):
        """Draws Maxwell-Boltzmann velocities with zero total momentum and exactly this temperature [energy].

        rotational_temperature: draws spins, too, of exactly this mean energy, T/2 for each axis of rotation.
        species: the name of the only species that gets new velocities. May be called in a callback: see `velocity`.
        """
        each = np.full(len(self), np.nan)
        if species is not None and species not in self.species_names:
            raise UsageError(f"thermalize: there is no species '{species}'; give one of: {', '.join(self.species_names)}")
        chosen = slice(None) if species is None else self.species == self.species_names.index(species)
        each[chosen] = temperature
        each[np.isinf(self.mass)] = np.nan
        self._session.draw(each, seed, False)
        if rotational_temperature is not None:
            each[chosen] = rotational_temperature
            each[np.isinf(self.mass)] = np.nan
            self._session.draw(each, seed, True)

    def add_wall(self, name, normal=None, **parameters):
        """Adds a wall, or changes a face of the box whose boundary is a wall: "x-", "x+", "y-", …

        normal: the normal of a further wall, which points to the side of the spheres. Other parameters are those of [[wall]] in decks: offset,
        velocity (a number along the normal, or {"amplitude": …, "frequency": …}), one_sided, …; see carom.describe("wall").
        A later call for the same wall changes what it gives, and the wall stays where it is; its sine starts anew with a new velocity.

            sim.add_wall("x+", velocity=0.05)                         # a piston
            sim.add_wall("x+", velocity=0)                            # after a run: stops it
            sim.add_wall("ramp", normal=[1, 2], offset=3.0)           # normal·x = offset
        """
        given = refuse_masked("add_wall", parameters | {"name": name_of("add_wall", name)})
        self._session.set("wall", given if normal is None else given | {"normal": numbers("add_wall", "normal", normal)})

    def add_contact(self, one, other, **parameters):
        """Sets the law of contacts between two species, or between a species and a wall ("x-", or its name). "*" stands for all species and all walls.
        Add species and walls first; a later law replaces an earlier one. Between two runs, the second one continues the first.

        Parameters are those of [[contact]] in decks, which carom.describe("contact") lists.

            sim.add_contact("*", "*", restitution=0.9)
            sim.add_contact("*", "*", restitution=0.9, tangential=0.5, friction=0.3)     # rough spheres, which spin
            sim.add_contact("ice", "ice", restitution={"form": "power", "v0": 0.01, "exponent": 0.234})
        """
        given = refuse_masked("add_contact", dict(parameters))
        self._session.set("contact", given | {"between": [name_of("add_contact", one), name_of("add_contact", other)]})

    def add_step(self, *between, **parameters):
        """Makes the energy of pairs jump at distances: wells and shoulders between two species ("*" stands for all), or, by `pairs`,
        `chain` or `within`, bonds of particles.

        Parameters are those of [[step]] in decks, which carom.describe("step") lists.

            sim.add_step("*", "*", range=1.5, depth=1.0)                      # a square well of 1.5 diameters
            sim.add_step("*", "*", range=[1.2, 1.5], depth=[1.0, 0.5])        # two steps
            sim.add_step(pairs=[[0, 1], [1, 2]], tether=1.1, core=0.9)        # hard bonds
            sim.add_step(within=1.1, tether=1.3)                              # tethers between present neighbours
        """
        given = refuse_masked("add_step", dict(parameters))
        if between:
            given |= {"between": [name_of("add_step", each) for each in between]}
        self._session.set("step", given)

    def add_bath(self, type, temperature, rate=None, seed=1, ramp_time=None, friction=None):
        """Couples all particles to a heat bath, in place of an earlier one.

        type: "andersen": at random times a particle gets a new velocity from the distribution of Maxwell and Boltzmann;
        "rescaling": all velocities are scaled by a common random factor, so that the kinetic energy is canonical;
        "langevin": friction and noise at the end of each step or epoch.
        temperature: a number [energy], or [first, last] for a linear ramp. ramp_time: [start, end] of the ramp, before and after which
        the temperature is constant [time]; by default those of the next run(), so that later runs keep the last temperature.
        rate: kicks of a particle per unit time; for rescaling, 1/relaxation time. friction: for langevin, the rate at which velocities
        are damped [1/time], or a list with one for each species.

            sim.add_bath("andersen", temperature=1.0, rate=0.5)
            sim.run(time=100)
            sim.bath_temperature = 2.0       # the next run() continues the run
        """
        given = {"type": type, "temperature": temperature, "rate": rate, "seed": seed, "ramp_time": ramp_time, "friction": friction}
        self._session.set("bath", refuse_masked("add_bath", given))

    def _set_bath_temperature(self, value):
        self._session.set_bath_temperature(value)

    def add_force(self, type, **parameters):
        """Adds a term of V by its name in decks; see carom.describe(type). Add the particles and species that it names first."""
        if isinstance(parameters.get("file"), os.PathLike):
            parameters["file"] = os.fspath(parameters["file"])
        self._session.set("interaction", {"type": name_of("add_force", type)} | refuse_masked(type, parameters))

    def add_potential(self, expression, start, cutoff, tolerance=1e-8, options=None, **constants):
        """Adds a pair potential given as an expression of r; returns the points of its table and their errors, a Sampled.

        expression: a text such as "epsilon*exp(-(r/sigma)**2)", with functions of numpy and constants given by keyword, or a
        function of r [length] that returns V [energy]. start: the smallest distance at which it is sampled; pairs should not come
        nearer. cutoff: the distance at which it ends. tolerance: the largest error of V, relative to the largest |V|. options: other
        parameters of "table", such as {"species": ["a", "b"], "cut": "shifted"}.
        Raises UsageError if the tolerance cannot be met.

            print(sim.add_potential("epsilon*exp(-r**2)", start=0.2, cutoff=3.0, epsilon=2.0))
        """
        points = potentials.sample(expression, start, cutoff, tolerance, **constants)
        slope = {"slope": points.slope} if len(points.slope) else {}
        self.add_force("table", r=points.r, value=points.value, cutoff=cutoff, **slope, **(options or {}))
        return points

    def output(self, directory=None, thermo_interval=None, **keys):
        """Makes the next runs write the files of `carom run` to a directory: see carom.open().

        What is not given here is as in [output] of the deck: output() alone writes the files of the deck.
        thermo_interval: time between rows of thermo.csv; callbacks are then called at each row. Other keys are those of
        [output] in decks: frame_interval, events, rdf_interval, sk_interval, msd_interval, profile_interval,
        transport_interval, pressure_tensor_interval, start, sample_start, checkpoint_wall, units, … (`carom schema`). Each
        run() ends with a checkpoint, from which from_run() and `carom run --continue` continue. Begins a new run, at time
        0; the files of an earlier run in the directory are moved to its backup.N, or removed with
        overwrite=True.

            sim.output("runs/fluid", thermo_interval=0.1, frame_interval=1.0, rdf_interval=0.1)
            sim.run(time=100)
            print(sim.averages["rdf"]["g"].max(), len(sim.open().frames))
        """
        given = {"directory": directory, "thermo_interval": thermo_interval} | keys
        output = self._deck_output | {key: value for key, value in given.items() if value is not None}
        if "directory" not in output:
            raise UsageError("output: there is no 'directory'; give one, since there is no deck that does")
        refuse_masked("output", output)
        output["directory"] = os.path.abspath(os.fspath(output["directory"]))
        self._set_output(output)
        self._every = thermo_interval is None and "thermo_interval" in output

    def _set_output(self, output):
        self._session.set_output([f"output.{key}={toml_value(value)}" for key, value in output.items()],
                                 float(output.get("thermo_interval", 0)))
        self._output = output

    @property
    def directory(self):
        """The directory with the files of the run; None if it writes no files."""
        return self._session.directory or None

    def open(self):
        """Opens the directory of the run; returns a carom.Run."""
        return files.open(self._need_directory("open"))

    def view(self, port=0, browser=None):
        """Shows the run on a page, in a browser or in the notebook, also during the run. See carom.page.Page."""
        return page.Page([self._need_directory("view")], port, browser)

    def _need_directory(self, of):
        if self.directory is None:
            raise UsageError(f"{of}: the run writes no files; call output(directory, frame_interval=…) and run() first")
        return self.directory

    @property
    def averages(self):
        """The averages that output() has requested, up to now, by name and column: ["rdf"]["g"]. The arrays are copies; callbacks may
        read them, too."""
        return self._session.averages()

    @property
    def means(self):
        """Means over time with their standard errors, up to now: ["pressure"]["mean"], ["standard_error"], ["independent_samples"]; also
        of temperature, potential, collision_rate, mean_free_time and mean_free_path, and in a sheared box of shear_stress. Each step, or
        epoch of free flight, is a sample. A standard error is NaN if there are fewer than eight independent blocks of samples;
        ["needed_time"] is then the time to which the run must go at least, at the correlations seen so far."""
        return self._session.means()

    def integrator(self, type, **parameters):
        """Chooses the integrator by its name in decks; see carom.describe(type)."""
        self._session.set("integrator", {"type": name_of("integrator", type)} | refuse_masked(type, parameters))

    def run(self, time=None, steps=None, collisions=None, every=None, callback=None, progress=None):
        """Runs to a time, a number of steps or a number of pair collisions, all counted from the start of the run. A later call with a
        later end continues the run, with the bits of one undisturbed run; a bath's ramp keeps its end. Without any end: runs to the end
        of the deck.

        time [time], steps, collisions: the run ends at the first of them that it reaches.
        every: if the run writes files, this replaces the thermo_interval of a deck when the run begins, and must equal the
        thermo_interval that was given to output().
        callback(simulation) is called at intervals of `every` units of simulated time, and at the start and the end; it may set
        velocities. An exception in it ends the run at the end of the step (in free flight: after 500 000 collisions, or at the end of
        the epoch) and is passed on. So does Ctrl-C, as KeyboardInterrupt; the simulation can be used and continued afterwards.
        progress: whether to show the progress; by default in terminals and notebooks.
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
        if self._output and self._every and every is not None and not self._session.begun and every != self._session.interval:
            if not (isinstance(every, numbers_type.Real) and 0 < every < np.inf):
                raise UsageError(f"run: 'every' is {every!r}; give a positive number")
            self._set_output(self._output | {"thermo_interval": float(every)})
        try:
            self._session.run(ends, callback and (lambda: callback(self)), line, script_name())
        finally:
            if line:
                line.close()
            self._warn(self._session.warnings)

    def write_deck(self, file, time=None, steps=None, every=None, collisions=None):
        """Writes a deck for `carom run` and from_deck() with the present state (without images), the forces, the integrator, the keys
        of output() and this end; `every` is the time between frames, and between rows of thermo.csv."""
        write_deck(self, file, {"end_time": time, "steps": steps, "collisions": collisions}, every)

    @property
    def position(self):
        """Centres of the particles, wrapped into the box along periodic axes, (N, D) [length]. A read-only view that follows the run;
        .copy() keeps the present values. An assignment sets all rows."""
        return self._session.position()

    @position.setter
    def position(self, values):
        self._session.set_position(self._rows("position", values))

    @property
    def velocity(self):
        """Velocities, (N, D) [length/time]; a view like `position`. An assignment in a callback changes them from then on, and the run
        continues at its time; the energy that it adds to H is no part of energy_error. In free flight the callback must be called at the
        end of an epoch: integrator("free-flight", step=every)."""
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
        """How many box edges each particle has crossed along each periodic axis, (N, D); a view."""
        return self._session.image()

    @property
    def unwrapped(self):
        """Unwrapped centres, continuous across periodic boundaries, (N, D) [length]; a new array."""
        cell = np.diag(np.array(self.box, float))
        cell[1, 0] = self.tilt
        return self.position + self.image @ cell

    mass = property(lambda self: self._session.constant("mass"), doc="Masses, (N,) [mass]; a view.")
    radius = property(lambda self: self._session.constant("radius"), doc="Radii of the hard cores, (N,) [length]; a view.")
    charge = property(lambda self: self._session.constant("charge"), doc="Charges, (N,) [charge]; a view.")
    species = property(lambda self: self._session.constant("species"), doc="Indices into species_names, (N,); a view.")
    species_names = property(lambda self: self._session.species, doc="The names of the species.")
    box = property(lambda self: self._table("system").get("box", [1.0] * self._table("system")["dimension"]), doc="Edges of the box [length].")
    shear_rate = property(lambda self: self._session.shear_rate,
                          lambda self, rate: self._session.set_shear([(0.0, rate)] if np.ndim(rate) == 0 else rate, None),
                          doc="The present rate of Lees-Edwards boundaries: the velocity of the flow along x, divided by y [1/time]. Set it "
                              "between two runs; 0 ends the flow. A list of [time, rate] changes it in the runs that follow, at times from now.")
    tilt = property(lambda self: self._session.tilt, lambda self, tilt: self._session.set_shear(None, float(tilt)),
                    doc="Where the image of the box above is along x, between 0 and the edge [length]. A flow changes it.")
    steps = property(lambda self: self._session.tables("step"), doc="The steps of pairs, as dictionaries of their options.")
    contacts = property(lambda self: self._session.tables("contact"), doc="The laws of contacts, as dictionaries of their options.")
    bath = property(lambda self: next(iter(self._session.tables("bath")), None),
                    doc="The heat bath, as a dictionary of its options; None: there is none.")
    bath_temperature = property(lambda self: self.bath and self.bath["temperature"], _set_bath_temperature,
                                doc="The temperature of the bath [energy]. If it is set between two runs, the second one continues the first.")
    walls = property(lambda self: self._session.tables("wall"),
                     doc="The walls that were added, as dictionaries of their options; `moved` and `phase` are those of the present time.")
    wall_loads = property(lambda self: self._session.wall_loads,
                          doc="By wall: the pressure on a face of the box [energy/length^D], the force on a further wall, since "
                              "the last row or callback; between runs those of the last one.")
    boundary = property(lambda self: self._table("system")["boundary"], doc="The name of the boundary on each axis.")

    title, description = (
        property(lambda self, key=key: self._table("")[key], lambda self, text, key=key: self._session.set("", self._table("") | {key: text}),
                 doc=f"The {key} in decks and files.") for key in ("title", "description"))

    energy_error = property(lambda self: self._session.energy_error,
                            doc="The largest change of H + dissipated - work - heat since the first step, over max(|H_1|, K_1 + sum |V|).")
    force_passes = property(lambda self: self._session.force_passes, doc="Number of force passes: evaluations of pairs / interacting pairs.")
    wall_seconds = property(lambda self: self._session.wall_seconds, doc="Duration of the run [s].")

    def _table(self, name):
        return self._session.tables(name)[0]

    def __len__(self):
        return self._session.size

    def __reduce_ex__(self, protocol):
        raise TypeError("a Simulation cannot be copied or pickled; write_deck(file, time=…) writes its present state, and "
                        "Simulation.from_deck(file) makes another one from it")

    def __repr__(self):
        session = self._session
        return (f"<carom.Simulation: {session.size} particles in {len(self.box)} dimensions, forces: "
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
