# SPDX-License-Identifier: BSD-3-Clause
"""A simulation made by a deck and one made by calls are the same, for every key that a deck can have."""

import copy
import tomllib

import pytest

import carom
from carom import _carom

PLACED = [[2.0, 3.0], [4.0, 3.0], [6.0, 3.0], [8.0, 3.0]]
DISCS = {"name": "disc", "position": PLACED, "radius": 0.5, "charge": [0.5, -0.5, 0.5, -0.5]}
COUNTED = {"name": "disc", "count": 16, "temperature": 1.0, "radius": 0.5}
FLAT = {"dimension": 2, "box": [12.0, 6.0], "boundary": ["wall", "wall"]}
ROUGH = {"between": ["*", "*"], "restitution": 0.9, "tangential": 0.5}
CUT = {"cutoff": 1.5, "cut": "shifted", "species": ["disc", "disc"], "exclude": "none"}
SMOOTH = {"cutoff": 2.0, "cut": "switch", "switch_from": 1.5, "tail": True}


def deck(**change):
    """A deck of four discs; the tables given replace its own, None removes one."""
    all = {"format": 1, "system": FLAT, "particles": [DISCS], "integrator": {"type": "psa", "step": 0.01}, "run": {"steps": 3}}
    return {name: table for name, table in (all | change).items() if table is not None}


def force(type, **given):
    periodic = given.pop("periodic", False)
    change = {"system": FLAT | {"boundary": ["periodic", "periodic"]}} if periodic else {}
    return deck(interaction=[{"type": type} | given], **change)


def deep(type, walls=False, **given):
    """The same discs as spheres."""
    return deck(system={"dimension": 3, "box": [12.0, 6.0, 6.0], "boundary": ["periodic", "periodic", "wall" if walls else "periodic"]},
                particles=[DISCS | {"position": [[*x, 3.0] for x in PLACED]}], interaction=[{"type": type} | given])


def placed(type, dimension=2, **given):
    box = {} if "packing_fraction" in given else {"box": [12.0, 12.0, 12.0][:dimension]}
    count = 108 if type == "fcc" else 64 if type == "simple-cubic" else 16
    return deck(system={"dimension": dimension, "boundary": ["periodic"] * dimension} | box, particles=[COUNTED | {"count": count}],
                placement={"type": type} | given)


def method(type, **given):
    return deck(integrator={"type": type} | given)


POINTS = {"r": [0.5, 1.0, 1.5, 2.0], "value": [3.0, 1.0, 0.25, 0.0]}
PAIR = {"species": ["disc", "disc"], "exclude": "none"}
# Decks by what they show; together they have every key.
DECKS = [
    deck(title="four discs", description="they fly", run={"end_time": 0.5, "collisions": 7}),
    deck(contact=[ROUGH | {"friction": 0.3}, {"between": ["disc", "x+"], "restitution": 0.8, "rest_speed": 1e-3}],
         particles=[DISCS | {"velocity": [[1.0, 0.0]] * 4, "spin": [[0.5]] * 4, "mass": 2.0, "inertia": 0.6}]),
    deck(particles=[DISCS, {"name": "post", "position": [[10.0, 5.0]], "radius": 0.25, "fixed": True}]),
    deck(particles=[DISCS | {"temperature": 1.5, "rotational_temperature": 0.5}], contact=[ROUGH]),
    deck(particles=[{"name": "point", "position": PLACED, "display_radius": 0.2}], integrator={"type": "verlet", "step": 0.01},
         system=FLAT | {"boundary": ["periodic", "periodic"]}),
    deck(wall=[{"name": "x+", "velocity": 0.01, "moved": 0.1, "until": 3.0}, {"name": "y-", "temperature": 2.0, "seed": 5},
               {"name": "x-", "velocity": {"amplitude": 0.1, "frequency": 2.0}, "phase": 0.25},
               {"name": "ramp", "normal": [0.6, 0.8], "offset": 1.0, "one_sided": False},
               {"name": "valve", "normal": [1.0, 0.0], "offset": 10.0, "one_way": True}]),
    deck(wall=[{"name": "cavity", "shape": "sphere", "centre": [10.0, 5.0], "radius": 30.0, "inside": True}]),
    deck(system={"dimension": 3, "box": [12.0, 6.0, 6.0], "boundary": ["periodic", "wall", "open"]},
         particles=[DISCS | {"position": [[*x, 3.0] for x in PLACED]}],
         wall=[{"name": "tube", "shape": "cylinder", "centre": [0.0, 3.0, 3.0], "axis": [2.0, 0.0, 0.0], "radius": 30.0}]),
    deck(bath=[{"type": "andersen", "temperature": [1.0, 2.0], "ramp_time": [0.0, 5.0], "rate": 0.5, "seed": 3}]),
    deck(bath=[{"type": "langevin", "temperature": 1.0, "friction": 0.5, "seed": 1}]),
    deck(step=[{"between": ["*", "*"], "range": [1.2, 1.5], "depth": [1.0, 0.5], "unit": "contact"}]),
    deck(step=[{"pairs": [[0, 1]], "range": 3.0, "depth": 0.1, "unit": "length", "tether": 9.0, "core": 0.9}]),
    deck(step=[{"chain": True, "chain_length": 2, "tether": 9.0}]),
    deck(step=[{"within": 2.5, "tether": 9.0}]),
    placed("fcc", 3, packing_fraction=0.3), placed("simple-cubic", 3, seed=4), placed("hexagonal", packing_fraction=0.3),
    placed("square", seed=2), placed("compressed", growth_rate=0.2, max_collisions=5000.0), placed("file", file="places.txt"),
    deck(system=FLAT | {"boundary": ["periodic", "periodic"]}, integrator={"type": "verlet", "step": 0.01},
         particles=[{"name": "point", "count": 9, "temperature": 1.0}], placement={"type": "random", "distance": 0.4}),
    force("harmonic-bond", pairs=[[0, 1], [2, 3]], stiffness=1.0, rest_length=2.0),
    force("harmonic-bond", chain=True, chain_length=2, stiffness=1.0, rest_length=2.0),
    force("harmonic-bond", within=2.5, stiffness=1.0, rest_length=2.0),
    force("gravity", constant=2.0, form="plain", **PAIR),
    deep("gravity", form="ewald", accuracy=1e-5, constant=0.5),
    force("coulomb", constant=2.0, form="damped-shifted", damping=0.5, cutoff=2.5, **PAIR),
    deep("coulomb", form="ewald", accuracy=1e-5, surface="vacuum"),
    deep("coulomb", walls=True, form="ewald", accuracy=1e-5, wall_charges=[0.0, 0.0]),
    force("yukawa", amplitude=1.0, kappa=2.0, charges=True, **PAIR, **SMOOTH, periodic=True),
    force("lennard-jones", epsilon=1.0, sigma=0.9, **PAIR, **SMOOTH, periodic=True),
    force("wca", epsilon=1.0, sigma=0.9, **PAIR),
    force("morse", depth=1.0, alpha=2.0, r0=1.2, **PAIR, **SMOOTH, periodic=True),
    force("inverse-power", epsilon=1.0, sigma=0.9, exponent=12.0, **PAIR, **SMOOTH, periodic=True),
    force("table", **POINTS, slope=[-5.0, 0.0], **PAIR, cutoff=2.0, cut="switch", switch_from=1.5),
    force("table", file="points.txt"),
    deck(interaction=[{"type": "harmonic-bond", "pairs": [[0, 1]], "stiffness": 1e4, "rest_length": 2.0}]),  # with a warning
    force("uniform-field", acceleration=[0.0, -1.0]), force("uniform-field", electric_field=[0.0, -1.0]),
    force("harmonic-trap", stiffness=1.0, centre=[6.0, 3.0]),
    method("free-flight", step=0.5, lengthen=False, max_events_per_step=1000),
    method("psa", step=0.01, longest_step=0.02, max_events_per_step=1000),
    method("cva", step=0.01, longest_step=0.02, max_events_per_step=1000),
    method("mcva", step=0.01, longest_step=0.02, variant="restart", max_events_per_step=1000),
    method("cdda", step=0.01, longest_step=0.02, accuracy=1e-3, shortest_step=1e-6, order=4, max_events_per_step=1000),
    method("edda", step=0.01, longest_step=0.02, accuracy=1e-3, shortest_step=1e-6, tolerance=1e-11, max_events_per_step=1000),
    deck(output={"directory": "files", "overwrite": True, "frame_interval": 0.1, "thermo_interval": 0.01, "start": "equilibrated",
                 "rdf_interval": 0.1, "rdf_range": 2.0, "rdf_bins": 20, "sk_interval": 0.1, "sk_range": 20.0, "sk_bins": 10, "sk_waves": 5,
                 "msd_interval": 0.1, "profile_interval": 0.1, "profile_bins": 5, "profile_axis": 1, "profile_pressure": True,
                 "transport_interval": 0.1, "transport_longest": 1.0, "pressure_tensor_interval": 0.1, "sample_start": 0.1,
                 "checkpoint_wall": "00:10:00", "units": {"length": "nm", "time": "ps"}, "events": True},
         system=FLAT | {"boundary": ["periodic", "periodic"]}, integrator={"type": "free-flight", "step": 0.01}),
    deck(system=FLAT | {"boundary": ["periodic", "periodic"], "shear": {"rate": 0.1}, "tilt": 1.5},
         integrator={"type": "free-flight", "step": 0.01}),
]


def by_calls(deck):
    """The simulation of a deck, made without it."""
    system = deck["system"]
    sim = carom.Simulation(box=system.get("box"), boundary=system["boundary"], dimension=system["dimension"])
    sim.title, sim.description = deck.get("title", ""), deck.get("description", "")
    for table in copy.deepcopy(deck["particles"]):
        heat = {key: table.pop(key, None) for key in ("temperature", "rotational_temperature")} if "position" in table else {}
        if "spin" in table:
            table["spin"] = [row[0] for row in table["spin"]]  # about z
        sim.add_particles(species=table.pop("name"), **table)
        if heat.get("temperature"):
            sim.thermalize(**heat)
    if "shear" in system:
        sim.shear_rate, sim.tilt = system["shear"]["rate"], system["tilt"]
    if "placement" in deck:
        if deck["integrator"]["type"] == "verlet":
            sim.integrator(**deck["integrator"])  # its particles have no cores
        sim.place(**deck["placement"])
    for table in deck.get("wall", []):
        sim.add_wall(**table)
    for table in deck.get("contact", []):
        sim.add_contact(*table["between"], **{key: value for key, value in table.items() if key != "between"})
    for table in deck.get("step", []):
        sim.add_step(*table.get("between", []), **{key: value for key, value in table.items() if key != "between"})
    for table in deck.get("bath", []):
        sim.add_bath(**table)
    for table in deck.get("interaction", []):
        sim.add_force(**table)
    sim.integrator(**deck["integrator"])
    if "output" in deck:
        sim.output(**deck["output"])
    return sim


def keys_of(deck):
    """All (table, key, type of the table) of a deck."""
    for name, table in deck.items():
        for one in table if isinstance(table, list) else [table] if isinstance(table, dict) else []:
            yield from ((name, key, one.get("type", "")) for key in one)
        if not isinstance(table, (list, dict)):
            yield "", name, ""


def test_the_decks_have_every_key():
    tried = {each for deck in DECKS for each in keys_of(deck)}
    general = {(table, key) for table, key, _ in tried}
    for table, variants in _carom.schema().items():
        for variant, keys in variants.items():
            for key in (each["name"] for each in keys):
                assert (table, key, variant) in tried if variant else (table, key) in general, f"no deck has {table}.{variant}.{key}"


@pytest.mark.parametrize("number", range(len(DECKS)))
def test_a_deck_and_calls_make_the_same_simulation(number, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "places.txt").write_text("".join(f"{2 + 3 * (n % 4)} {2 + 3 * (n // 4)}\n" for n in range(16)))
    (tmp_path / "points.txt").write_text("".join(f"{r} {v}\n" for r, v in zip(POINTS["r"], POINTS["value"])))
    deck = DECKS[number]
    end = {"time" if key == "end_time" else key: value for key, value in deck["run"].items()}
    texts, states = [], []
    for name, sim in (("deck", carom.Simulation.from_deck(deck)), ("calls", by_calls(deck))):
        sim.write_deck(f"{name}.toml", **end)
        texts.append(tomllib.loads((tmp_path / f"{name}.toml").read_text()))
        warned = {text.split("warning: ")[-1] for text in sim.warnings}
        if "output" not in deck:
            sim.run(steps=2)
        warned |= {text.split("warning: ")[-1] for text in sim.warnings}
        states.append((sim.energy, sim.position.tobytes(), sim.velocity.tobytes(), sim.collisions, warned))
    assert texts[0] == texts[1] and states[0] == states[1]
    if "output" in deck:  # whose resolved decks are files
        resolved = []
        one = carom.Simulation.from_deck(deck)
        one.output()
        for sim in (one, by_calls(deck)):
            sim.run(steps=200)
            resolved.append(tomllib.loads((tmp_path / "files/deck.toml").read_text()))
            del resolved[-1]["particles"]  # with and without velocities of zero
        assert resolved[0] == resolved[1]
