# SPDX-License-Identifier: BSD-3-Clause
"""Mistakes of users: each raises an exception of its kind, with a message that names the error and gives advice."""

import numpy as np
import pytest

import carom
from scenes import ROOT, five_springs

NAN = float("nan")
HERE = [[2.0, 3.0]]


def masked(values, hidden=0):
    """An array with one entry masked."""
    array = np.ma.array(values)
    array[np.unravel_index(hidden, array.shape)] = np.ma.masked
    return array


def add(**change):
    carom.Simulation(box=[12, 6]).add_particles(**({"position": HERE} | change))


def finished():
    sim = five_springs()
    sim.run(steps=2)
    sim.run(steps=2)


def while_running(change):
    sim = five_springs()
    sim.run(steps=2, every=0.01, callback=lambda s: change(s))


def failed():
    sim = five_springs()
    sim.add_force("uniform-field", acceleration=[1e300, 0])
    with pytest.raises(carom.NumericalError):
        sim.run(steps=100)
    sim.run(steps=200)


def never_ending():
    sim = carom.Simulation(box=[12, 6], boundary="periodic")
    sim.add_particles(position=HERE)
    sim.integrator("verlet", step=0.01)
    sim.run(collisions=1)


def without(what):
    sim = carom.Simulation(box=[12, 6])
    if what != "particles":
        sim.add_particles(position=HERE)
    if what != "integrator":
        sim.integrator("psa", step=0.01)
    sim.run(steps=1)


def alone(x, **box):
    sim = carom.Simulation(**({"box": [12, 6]} | box))
    sim.add_particles(position=x)
    sim.integrator("psa", step=0.01)
    sim.run(steps=1)


USAGE, STATE = carom.UsageError, carom.InitialStateError
MISTAKES = {
    "box of one edge": (USAGE, "'box' has shape (1,); give 2 or 3 edges", lambda: carom.Simulation(box=[3])),
    "box of texts": (USAGE, "'box' has entries of type <U2; give real numbers", lambda: carom.Simulation(box=["12", "6"])),
    "negative box": (STATE, "the edge of the box along axis 1 is -6; give a positive length",
                     lambda: carom.Simulation(box=[12, -6])),
    "unknown boundary": (USAGE, "unknown boundary 'walls'; give one of: wall, periodic, open",
                         lambda: carom.Simulation(box=[12, 6], boundary="walls")),
    "boundaries of three axes": (USAGE, "give one name, or one for each of 2 axes",
                                 lambda: carom.Simulation(box=[12, 6], boundary=["wall"] * 3)),
    "columns": (USAGE, "'position' has shape (1, 3); give one of shape (N, 2), a row for each particle",
                lambda: add(position=[[1, 2, 3]])),
    "transposed": (USAGE, "'position' has shape (2, 5); give one of shape (N, 2)", lambda: add(position=np.ones((2, 5)))),
    "flat": (USAGE, "'position' has shape (6,)", lambda: add(position=np.ones(6))),
    "no particles": (USAGE, "'position' has shape (0, 2)", lambda: add(position=np.empty((0, 2)))),
    "ragged": (USAGE, "'position' has rows of different lengths", lambda: add(position=[[1, 2], [3]])),
    "texts": (USAGE, "'position' has entries of type <U1; give real numbers", lambda: add(position=[["a", "b"]])),
    "complex": (USAGE, "type complex128; give real numbers", lambda: add(position=np.ones((1, 2)) * 1j)),
    "nan": (STATE, "the position of particle 0 cannot be; give finite coordinates", lambda: add(position=[[NAN, 1]])),
    "velocity of another length": (USAGE, "'velocity' has shape (2, 2); give the shape of 'position', (1, 2)",
                                   lambda: add(velocity=[[1, 0], [0, 1]])),
    "masked box": (USAGE, "Simulation: 'box' has masked entries; fill them, or leave out their rows, and give a plain array",
                   lambda: carom.Simulation(box=masked([12.0, 6.0]))),
    "masked positions": (USAGE, "add_particles: 'position' has masked entries", lambda: add(position=masked(HERE, 1))),
    "rows that are masked": (USAGE, "'position' has masked entries", lambda: add(position=[np.ma.array(HERE[0]), masked(HERE[0])])),
    "masked velocities": (USAGE, "'velocity' has masked entries", lambda: add(velocity=masked(HERE))),
    "masked radii": (USAGE, "'radius' has masked entries", lambda: add(radius=masked([0.5]))),
    "masked number": (USAGE, "'mass' has masked entries", lambda: add(mass=np.ma.masked)),
    "masked positions that are set": (USAGE, "'position' has masked entries",
                                      lambda: setattr(five_springs(), "position", masked(five_springs().position))),
    "masked bonds": (USAGE, "harmonic-bond: 'pairs' has masked entries",
                     lambda: five_springs().add_force("harmonic-bond", pairs=masked([[0, 1]]), stiffness=1, rest_length=2)),
    "masked step": (USAGE, "edda: 'step' has masked entries", lambda: five_springs().integrator("edda", step=np.ma.masked)),
    "masked end": (USAGE, "run: 'time' has masked entries", lambda: five_springs().run(time=np.ma.masked)),
    "masked value of a deck": (USAGE, "from_deck: 'particles.0.position' has masked entries", lambda: carom.Simulation.from_deck(
        ROOT / "inputs/five-springs.toml", set={"particles.0.position": masked(five_springs().position)})),
    "infinite velocity": (STATE, "the velocity of particle 0 cannot be", lambda: add(velocity=[[np.inf, 0]])),
    "radii of other particles": (USAGE, "'radius' has shape (3,); give one number, or 1, one for each particle",
                                 lambda: add(radius=[0.5, 0.5, 0.5])),
    "negative radius": (STATE, "the radius of particle 0 cannot be; give a positive one", lambda: add(radius=-0.5)),
    "no mass": (STATE, "the mass of particle 0 cannot be; give a positive one", lambda: add(mass=0)),
    "species as a number": (USAGE, "'species' is 1; give one name", lambda: add(species=1)),
    "no position": (USAGE, "there is no 'position'; give one of shape (N, D), or a count for place()",
                    lambda: carom.Simulation(box=[12, 6]).add_particles()),
    "positions": (TypeError, "unexpected keyword argument 'positions'",
                  lambda: carom.Simulation(box=[12, 6]).add_particles(positions=HERE)),
    "unknown force": (USAGE, "unknown interaction 'spring'; give one of: harmonic-bond, ",
                      lambda: five_springs().add_force("spring")),
    "unknown parameter": (USAGE, "unknown parameter of harmonic-bond 'k'; give one of: pairs, ",
                          lambda: five_springs().add_force("harmonic-bond", k=1.0)),
    "missing parameter": (USAGE, "harmonic-bond: missing parameter 'stiffness'; give it: ",
                          lambda: five_springs().add_force("harmonic-bond", pairs=[[0, 1]], rest_length=2)),
    "id that is not there": (USAGE, "pair [0, 7] names particle 7, but there are only 5 particles",
                             lambda: five_springs().add_force("harmonic-bond", pairs=[[0, 7]], stiffness=1, rest_length=2)),
    "negative id": (USAGE, "'pairs' names particle -1, which cannot be; ids count from 0",
                    lambda: five_springs().add_force("harmonic-bond", pairs=[[0, -1]], stiffness=1, rest_length=2)),
    "triples": (USAGE, "'pairs' is an array of shape (1, 3) and type int64; give a list[tuple[int, int]], of shape (bonds, 2)",
                lambda: five_springs().add_force("harmonic-bond", pairs=[[0, 1, 2]], stiffness=1, rest_length=2)),
    "text for a number": (USAGE, "'stiffness' is a text; give a number",
                          lambda: five_springs().add_force("harmonic-bond", chain=True, stiffness="1", rest_length=2)),
    "unknown species": (USAGE, "'species' names 'ion', which is not there; known species: 'particle'",
                        lambda: five_springs().add_force("gravity", constant=1.0, species=["ion", "ion"])),
    "force without particles": (USAGE, "gravity: there are no particles yet; call add_particles() first",
                                lambda: carom.Simulation(box=[12, 6]).add_force("gravity", constant=1.0)),
    "unknown integrator": (USAGE, "unknown integrator 'leapfrog'; give one of: free-flight, ",
                           lambda: five_springs().integrator("leapfrog", step=0.1)),
    "no step": (USAGE, "psa: missing parameter 'step'; give it: length of one step", lambda: five_springs().integrator("psa")),
    "negative step": (USAGE, "edda: 'step' must be positive (is -0.01)", lambda: five_springs().integrator("edda", step=-0.01)),
    "step that is nan": (USAGE, "'step' must be finite", lambda: five_springs().integrator("edda", step=NAN)),
    "class for a name": (USAGE, "the first argument is <class 'int'>; give a name", lambda: five_springs().integrator(int)),
    "forces in free flight": (USAGE, "free-flight knows no forces but a uniform-field",
                              lambda: [sim := five_springs(), sim.integrator("free-flight"), sim.run(time=1)]),
    "no end": (USAGE, "the run has no end; give ", lambda: five_springs().run()),
    "negative time": (USAGE, "run: 'time' must be positive (is -1)", lambda: five_springs().run(time=-1)),
    "half a step": (USAGE, "run: 'steps' is a number; give a whole number", lambda: five_springs().run(steps=0.5)),
    "callback without an interval": (USAGE, "a callback needs 'every'", lambda: five_springs().run(time=1, callback=print)),
    "callback that is none": (USAGE, "'callback' is 3; give a function", lambda: five_springs().run(time=1, every=1, callback=3)),
    "interval far too short": (USAGE, "an output interval is shorter than a millionth of the step",
                               lambda: five_springs().run(time=1, every=1e-12, callback=print)),
    "no integrator": (USAGE, "there is no integrator; call integrator(name, step=…) first", lambda: without("integrator")),
    "run without particles": (USAGE, "there are no particles; call add_particles() first", lambda: without("particles")),
    "overlap": (STATE, "particles 0 and 1 overlap, at distance 0.5; move them apart", lambda: alone([[3, 3], [3.5, 3]])),
    "outside": (STATE, "particle 0 reaches 1 beyond the upper wall of axis 0; keep it a radius from every wall",
                lambda: alone([[12.5, 3]])),
    "sphere larger than the box": (STATE, "the periodic box is 0.9 long on axis 1, less than a diameter of 1",
                                   lambda: alone([[3, 0.5]], box=[12, 0.9], boundary="periodic")),
    "finished": (USAGE, "the run is at time 0.02, step 2 already; give a later end", finished),
    "add while running": (USAGE, "a run is going on; add particles before it or after it",
                          lambda: while_running(lambda s: s.add_particles([[1, 1]]))),
    "force while running": (USAGE, "a run is going on; add forces before it or after it",
                            lambda: while_running(lambda s: s.add_force("gravity", constant=1.0))),
    "integrator while running": (USAGE, "a run is going on; choose the integrator before it or after it",
                                 lambda: while_running(lambda s: s.integrator("psa", step=0.1))),
    "position while running": (USAGE, "a run is going on; set positions before it or after it",
                               lambda: while_running(lambda s: setattr(s, "position", np.zeros((5, 2))))),
    "run while running": (USAGE, "a run is going on; wait for its end", lambda: while_running(lambda s: s.run(steps=9))),
    "write into a view": (ValueError, "read-only", lambda: five_springs().position.__setitem__(0, 1.0)),
    "position of another shape": (USAGE, "'position' has shape (4, 2); give (5, 2)",
                                  lambda: setattr(five_springs(), "position", np.ones((4, 2)))),
    "set a result": (AttributeError, "energy", lambda: setattr(five_springs(), "energy", 1.0)),
    "run that has failed": (USAGE, "the last run has failed (", failed),
    "deck that is not there": (carom.FileError, "cannot read this deck; check the path",
                               lambda: carom.Simulation.from_deck("nowhere.toml")),
    "unknown key of a deck": (USAGE, "--set integrator.steps", lambda: carom.Simulation.from_deck(
        ROOT / "inputs/five-springs.toml", set={"integrator.steps": 0.1})),
    "directory that is not there": (carom.FileError, "nowhere: is not the directory of a run", lambda: carom.open("nowhere")),
    "directory of something else": (carom.FileError, "has no deck.toml", lambda: carom.open(ROOT)),
    "end that never comes": (USAGE, "'verlet' has no collisions, the run would never end; give steps or end_time", never_ending),
    "deck without an end": (USAGE, "write_deck: the deck has no end", lambda: five_springs().write_deck("a.toml")),
    "deck in no folder": (carom.FileError, "cannot write the deck", lambda: five_springs().write_deck("no/where.toml", time=1)),
    "unknown name": (USAGE, "unknown name 'verlets'; give one of: ", lambda: carom.describe("verlets")),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_has_a_clear_exception(mistake):
    kind, text, make = MISTAKES[mistake]
    with pytest.raises(kind) as caught:
        make()
    assert text in str(caught.value)


def test_a_mistake_leaves_the_simulation_as_it_was():
    sim, untouched = five_springs(), five_springs()
    for wrong in (lambda: sim.add_particles([[NAN, 1]], species="b"), lambda: sim.add_force("harmonic-bond"),
                  lambda: sim.integrator("psa"), lambda: setattr(sim, "velocity", np.full((5, 2), NAN)),
                  lambda: sim.add_force("gravity", constant=1.0, species=["a", "b"]), lambda: sim.run()):
        with pytest.raises(carom.Error):
            wrong()
    for each in (sim, untouched):
        each.run(steps=100)
    assert np.array_equal(sim.position, untouched.position) and sim.species_names == ["particle"]


def test_a_masked_array_without_masked_entries_is_an_array():
    plain, sim = five_springs(), five_springs(position=np.ma.array(five_springs().position), radius=np.ma.array([0.5] * 5, mask=False))
    assert np.array_equal(sim.position, plain.position) and np.array_equal(sim.radius, plain.radius)


def test_errors_have_kinds_and_exit_codes():
    kinds = [carom.UsageError, carom.InitialStateError, carom.NumericalError, carom.FileError]
    assert [kind.exit_code for kind in kinds] == [2, 3, 4, 5]
    assert all(issubclass(kind, carom.Error) for kind in kinds)
    assert issubclass(carom.UsageError, ValueError) and issubclass(carom.FileError, OSError)


def test_a_step_far_too_long_is_a_numerical_error():
    sim = five_springs()
    sim.integrator("psa", step=50.0)
    with pytest.raises(carom.NumericalError, match="use a smaller integrator.step|smaller"):
        sim.run(steps=1000)
    sim.integrator("edda", step=0.01)
    assert sim.time == 0
