# SPDX-License-Identifier: BSD-3-Clause
"""Placement, temperatures, potentials from expressions."""

import numpy as np
import pytest

import carom
from scenes import five_springs, gas


def test_particles_are_placed_as_in_decks():
    sim = carom.Simulation(dimension=3, boundary="periodic")
    assert sim.add_particles(count=100, temperature=0.5, radius=0.5, species="a") == range(100)
    assert sim.add_particles(count=8, temperature=2.0, radius=0.25, mass=3.0, species="b") == range(100, 108)
    assert sim.place("fcc", packing_fraction=0.3, seed=7) == range(108)
    deck = {"format": 1, "system": {"dimension": 3, "boundary": ["periodic"] * 3},
            "particles": [{"name": "a", "count": 100, "temperature": 0.5, "radius": 0.5},
                          {"name": "b", "count": 8, "temperature": 2.0, "radius": 0.25, "mass": 3.0}],
            "placement": {"type": "fcc", "packing_fraction": 0.3, "seed": 7},
            "integrator": {"type": "free-flight"}, "run": {"collisions": 1000}}
    same = carom.Simulation.from_deck(deck)
    for name in ("position", "velocity", "mass", "radius", "species"):
        assert np.array_equal(getattr(sim, name), getattr(same, name)), name
    assert sim.box == same.box and np.sum(np.pi / 6 * (2 * sim.radius) ** 3) / np.prod(sim.box) == pytest.approx(0.3)
    with pytest.raises(carom.UsageError, match="there is no integrator"):
        sim.run(time=1)
    sim.integrator("free-flight")
    with pytest.raises(carom.UsageError, match="no end"):
        sim.run()
    sim.run(collisions=10)
    same.run(collisions=10)
    assert np.array_equal(sim.position, same.position) and sim.temperature == pytest.approx((100 * 0.5 + 8 * 2) / 108)


def test_particles_are_placed_between_others_that_have_bonds():
    sim = five_springs()
    sim.add_particles(count=6, temperature=0.0, radius=0.3, species="gas")
    with pytest.raises(carom.UsageError, match="call place"):
        sim.run(time=1)
    sim.place("random", seed=3)
    assert len(sim) == 11 and np.array_equal(sim.position[:5], five_springs().position) and not sim.velocity[5:].any()
    sim.run(time=1)
    assert sim.energy == pytest.approx(five_springs().energy) and sim.energy_error < 1e-13


def test_walls_contacts_baths_and_files_stay_when_particles_are_placed(tmp_path):
    sim = carom.Simulation(box=[8, 8, 8], boundary="wall")
    sim.add_particles(position=[[4, 4, 4]], radius=0.5, species="a")
    sim.add_wall("x+", velocity=0.25)
    sim.add_contact("a", "*", restitution=0.9)
    sim.add_bath("andersen", temperature=1.0, rate=0.5)
    sim.integrator("free-flight")
    sim.output(tmp_path / "run")
    before = sim.walls, sim.contacts, sim.bath
    sim.add_particles(count=20, temperature=1.0, radius=0.5, species="b")
    sim.place("random", seed=1)
    assert (sim.walls, sim.contacts, sim.bath) == before
    sim.run(time=2)
    assert sim.work > 0 and sim.dissipated > 0 and sim.heat != 0 and len(sim.open().frames) == 2


def test_species_keep_their_inertia_and_views_what_they_showed_when_others_are_placed():
    sim = carom.Simulation(box=[8, 8])
    sim.add_particles([[2, 2]], radius=0.5, species="ring", inertia=0.9, spin=[1.5])
    sim.add_particles(count=3, temperature=1.0, radius=0.5, inertia=0.6)
    views = [sim.position, sim.velocity, sim.spin, sim.mass]
    copies = [view.copy() for view in views]
    sim.place("random")
    np.full(100000, np.nan)
    assert all(np.array_equal(view, copy) for view, copy in zip(views, copies))
    assert sim.spin.tolist() == [1.5, 0, 0, 0] and sim.position[0].tolist() == [2, 2] and len(sim) == 4
    sim.add_contact("*", "*", tangential=0.5)
    sim.spin = [1.0, 0.0, 0.0, 2.0]
    assert sim.rotational_energy == pytest.approx(0.5 * 0.5**2 * (0.9 * 1.0**2 + 0.6 * 2.0**2))


def test_bonds_that_were_found_stay_where_particles_are_moved_and_added():
    sim = carom.Simulation(box=[12, 6])
    sim.add_particles([[2, 3], [4, 3]])
    sim.add_force("harmonic-bond", within=2.5, stiffness=1.0, rest_length=2.0)
    sim.position = [[2, 3], [5, 3]]
    sim.add_particles([[7, 3]])
    assert sim.potential == pytest.approx(0.5) and sim._session.forces[0][1]["pairs"] == [[0, 1]]


def test_the_files_of_a_deck_have_this_deck_and_not_the_particles_that_it_placed(tmp_path):
    sim = carom.Simulation.from_deck(
        {"format": 1, "system": {"dimension": 2, "box": [12.0, 12.0], "boundary": ["periodic", "periodic"]},
         "particles": [{"name": "disc", "count": 16, "temperature": 1.0, "radius": 0.5}], "placement": {"type": "square"},
         "interaction": [{"type": "harmonic-bond", "within": 3.5, "stiffness": 1.0, "rest_length": 3.0}],
         "integrator": {"type": "psa", "step": 0.01}, "run": {"steps": 1}})
    for change, counted in ((lambda: None, True), (lambda: sim.thermalize(2.0), False)):
        change()
        sim.output(tmp_path / str(counted))
        sim.run(steps=1)
        text = (tmp_path / str(counted) / "deck.toml").read_text()
        assert ("count = 16" in text, "[placement]" in text, "within = 3.5" in text, "position = " in text) == (counted,) * 3 + (not counted,)


@pytest.mark.parametrize("call, message", [
    (lambda s: s.place("fcc"), "no particles were given by count"),
    (lambda s: s.add_particles(count=3), "needs a 'temperature'"),
    (lambda s: s.add_particles(count=3, temperature=1, position=[[1, 1]]), "'count' excludes"),
    (lambda s: s.add_particles(temperature=1, position=[[1, 1]]), "call thermalize"),
    (lambda s: s.add_particles(rotational_temperature=1, position=[[1, 1]]), "call thermalize"),
    (lambda s: s.add_particles(), "there is no 'position'"),
    (lambda s: (s.add_particles(count=3, temperature=1, species="b"), s.place("fcc")), "'fcc' is a lattice of 3 dimensions"),
    (lambda s: carom.Simulation(), "give its edges, or dimension"),
    (lambda s: carom.Simulation(dimension=2).add_particles([[1, 1]]), "need the 'box'"),
])
def test_mistakes_of_placement(call, message):
    with pytest.raises(carom.UsageError, match=message):
        call(five_springs())


def test_no_room():
    sim = carom.Simulation(box=[4, 4])
    sim.add_particles(count=100, temperature=1.0, radius=0.5)
    with pytest.raises(carom.InitialStateError, match="random insertion found no place"):
        sim.place("random")


def test_temperatures_are_exact_and_of_one_species():
    sim = gas()
    sim.thermalize(2.5, seed=4)
    assert sim.temperature == pytest.approx(2.5, rel=1e-14) and np.abs(sim.momentum).max() < 1e-12
    drawn = sim.velocity.copy()
    sim.thermalize(2.5, seed=5)
    assert not np.allclose(drawn, sim.velocity)
    sim = carom.Simulation(box=[9, 9])
    sim.add_particles([[1, 1], [3, 3]], species="a")
    sim.add_particles([[5, 5], [7, 7]], species="b", mass=4)
    sim.thermalize(3.0, species="b")
    assert not sim.velocity[:2].any() and 0.5 * 4 * (sim.velocity[2:] ** 2).sum() == pytest.approx(2 * 3.0)
    sim.add_contact("a", "b", tangential=0.5)
    sim.thermalize(3.0, species="b", rotational_temperature=2.0)
    moment = 0.5 * 4 * 0.25
    assert not sim.spin[:2].any() and moment * (sim.spin[2:] ** 2).sum() == pytest.approx(2 * 2.0)
    for bad in (-1.0, np.inf):
        with pytest.raises(carom.UsageError, match="give 0 or more"):
            sim.thermalize(bad)
        with pytest.raises(carom.UsageError, match="give 0 or more"):
            sim.thermalize(1.0, rotational_temperature=bad)
        with pytest.raises(carom.UsageError, match="'rotational_temperature' is .*; give 0 or more"):
            sim.add_particles(count=3, temperature=1.0, rotational_temperature=bad)
    with pytest.raises(carom.UsageError, match="no species 'c'; give one of: a, b"):
        sim.thermalize(1.0, species="c")


def pair(expression, **given):
    """Two particles in a periodic box at a distance that can be set, and the return value of adding the potential."""
    sim = carom.Simulation(box=[20, 20, 20], boundary="periodic")
    sim.add_particles([[5, 5, 5], [6, 5, 5]], radius=0.1)
    return sim, sim.add_potential(expression, **given)


@pytest.mark.parametrize("expression, constants", [
    ("epsilon*exp(-(r/sigma)**2)", {"epsilon": 2.0, "sigma": 1.0}), (lambda r, q: q / r * np.exp(-r), {"q": -3.0}),
    ("4*(r**-12 - r**-6)", {}), ("erfc(r)/r", {})])
def test_a_table_is_as_near_the_expression_as_it_says(expression, constants):
    start, cutoff = 0.8, 3.0
    sim, points = pair(expression, start=start, cutoff=cutoff, tolerance=1e-7, options={"cut": "shifted"}, **constants)
    value = carom.potentials.function_of(expression, constants)
    off = []
    for r in np.random.default_rng(1).uniform(start, cutoff, 200):
        sim.position = [[5, 5, 5], [5 + r, 5, 5]]
        off.append(sim.potential - (value(r) - value(cutoff)))
    scale = np.abs(value(np.linspace(start, cutoff, 99))).max()
    assert 0.01 * points.error < np.abs(off).max() <= 2.2 * points.error + 1e-15 * scale and points.error <= 1e-7 * scale
    assert f"{points.error:.1e}" in repr(points) and points.force_error < 1e-3 * scale


def test_an_expression_keeps_its_energy():
    sim = gas(packing=0.05)
    sim.add_potential("epsilon*exp(-r**2)", start=0.5, cutoff=2.0, epsilon=1.5)
    sim.integrator("edda", step=0.01)
    sim.run(time=1)
    assert sim.energy_error < 1e-12 and sim.potential > 0


@pytest.mark.parametrize("expression, given, message", [
    ("epsilon*r", {}, "unknown name 'epsilon' in 'epsilon\\*r'"), ("r.__class__", {}, "unknown name '__class__'"),
    ("r +", {}, "is no expression"), ("log(r - 1)", {}, "not finite at r = 0.5"), (3, {}, "give a text such as"),
    ("r*1j", {}, "'r\\*1j' gives complex numbers; V must be real"),
    ("1/0", {}, "'1/0' does not depend on r"), ("1/(r - r)", {}, "not finite"), ("r > 1", {}, "gives truth values"),
    (lambda: 1, {}, "cannot be computed: TypeError: .* takes 0 positional arguments"), (lambda r: 1, {}, "V is 1 at every r, so there"),
    (lambda r: [1, 2], {}, "it must give V for an array r"), ("sigma/r", {"sigma": "x"}, "'sigma' is 'x'; give a number"),
    ("exp(r, r, r)", {}, "cannot be computed: TypeError"), ("1/r", {"start": "a"}, "start is 'a'; give a number"),
    ("1/r", {"cutoff": np.inf}, "give 0 < start < cutoff"),
    ("abs(r - 1.234)", {"tolerance": 1e-9}, "8192 points leave an error of"), ("r", {"start": 0}, "give 0 < start < cutoff"),
])
def test_mistakes_in_expressions(expression, given, message):
    with pytest.raises(carom.UsageError, match=message):
        pair(expression, **({"start": 0.5, "cutoff": 2.0} | given))


def test_points_of_a_potential_come_from_a_file(tmp_path):
    (tmp_path / "points.txt").write_text("# r V\n0.5 3.0\n1.0 1.0\n2.0 0.0\n")
    sim = carom.Simulation(box=[12, 6])
    sim.add_particles(position=[[2, 3], [3.5, 3]])
    sim.add_force("table", file=str(tmp_path / "points.txt"))
    assert sim._session.forces == [("table", {"r": [0.5, 1.0, 2.0], "value": [3.0, 1.0, 0.0], "cutoff": 2.0, "exclude": "none", "cut": "switch"})]
    with pytest.raises(carom.UsageError, match="exclude each other; leave one of them out"):
        sim.add_force("table", file="points.txt", r=[1.0, 2.0], value=[1.0, 0.0])
    with pytest.raises(carom.FileError, match="no.txt: error: cannot read the points"):
        sim.add_force("table", file="no.txt")


def test_simulations_by_calls_get_the_warnings_of_decks():
    sim = five_springs()
    sim.integrator("edda", step=1.0)
    with pytest.warns(carom.CaromWarning, match="^step 1 is long for the shortest period at the start, 3.30"):
        sim.run(steps=1)
    assert [warning.split(":")[0] for warning in sim.warnings] == ["warning", "warning"] and "the steps are long" in sim.warnings[1]
    sim = five_springs()
    sim.run(steps=1)
    assert sim.warnings == []


def test_the_radius_of_points_in_pictures(tmp_path):
    sim = carom.Simulation(box=[12, 6], boundary="periodic")
    sim.add_particles(position=[[2, 3], [3.5, 3]], display_radius=0.2)
    sim.integrator("verlet", step=0.01)
    sim.run(steps=1)
    assert sim.radius.tolist() == [0.2, 0.2]
    with pytest.raises(carom.UsageError, match="'radius' and 'display_radius' exclude each other"):
        sim.add_particles(position=[[5, 3]], radius=0.5, display_radius=0.2)
