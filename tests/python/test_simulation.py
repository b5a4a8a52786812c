# SPDX-License-Identifier: BSD-3-Clause
"""Simulations from Python against the command, and against each other."""

import copy
import pickle
import time as clock

import numpy as np
import pytest

import carom
from scenes import ROOT, five_springs, gas, run_command, same_state

THESIS = ["inputs/five-springs.toml", "inputs/nine-gravity.toml"]


@pytest.mark.parametrize("deck", THESIS)
@pytest.mark.parametrize("method", ["cdda", "psa"])
def test_a_deck_has_the_bits_of_the_command(tmp_path, deck, method):
    run = run_command(ROOT / deck, tmp_path / "run", "--set", f"integrator.type={method}", "--set", "run.steps=500",
                      "--set", "output.frame_interval=0.5", "--set", "output.thermo_interval=0.5")
    sim = carom.Simulation.from_deck(ROOT / deck, set={"integrator.type": method, "run.steps": 500})
    seen, rows = [], []

    def look(s):
        seen.append((s.position.copy(), s.velocity.copy()))
        rows.append([s.time, s.step, s.collisions, s.kinetic, s.potential, s.energy, s.temperature, s.pressure])

    sim.run(every=0.5, callback=look)
    assert len(seen) == len(run.frames) == 11
    for (x, v), frame in zip(seen, run.frames):
        assert np.array_equal(x, frame.position) and np.array_equal(v, frame.velocity)
    names = ["time", "step", "collisions", "kinetic", "potential", "total", "temperature", "pressure"]
    assert np.array_equal(np.array(rows).T, [run.thermo[name] for name in names])
    energy = run.summary["energy"]
    assert sim.energy_error == energy["max_abs_error"] / energy["reference"]
    assert sim.collisions == run.summary["events"]["sphere_sphere"] > 0


def test_the_first_experiment_by_hand_has_the_bits_of_the_deck():
    deck = carom.Simulation.from_deck(ROOT / THESIS[0], set={"integrator.type": "edda"})
    hand = five_springs()
    for sim in (deck, hand):
        sim.run(steps=1000)
    assert same_state(deck, hand) and hand.time == 10 and hand.collisions > 0
    assert 0 < hand.energy_error < 1e-13


def test_free_flight_calls_back_at_the_exact_times_with_the_bits_of_the_command(tmp_path):
    deck = ROOT / "inputs/hard-sphere-fluid.toml"
    change = {"particles.0.count": 108, "run.end_time": 1.0, "output.frame_interval": 0.2}
    run = run_command(deck, tmp_path / "run", *[part for key, value in change.items() for part in ("--set", f"{key}={value}")])
    sim, seen = carom.Simulation.from_deck(deck, set=change), []
    sim.run(every=0.2, callback=lambda s: seen.append((s.time, s.position.copy(), s.image.copy())))
    assert [time for time, *_ in seen] == list(run.trajectory.time)
    for (_, x, image), frame in zip(seen, run.frames):
        assert np.array_equal(x, frame.position) and np.array_equal(image, frame.image)
    assert np.array_equal(sim.unwrapped, run.frames[-1].unwrapped) and run.frames[-1].image.any()


@pytest.mark.parametrize("make, first, last", [
    (five_springs, 2.0, 4.0), (five_springs, 2.005, 4.0), (five_springs, 2.005, 4.001), (gas, 0.7, 3.0), (gas, 30.0, 60.0)])
def test_a_later_end_goes_on_with_the_bits_of_one_run(make, first, last):
    one, two, times = make(), make(), {}
    for sim, ends in ((one, [last]), (two, [first, last])):
        for end in ends:
            sim.run(time=end, every=0.1, callback=lambda s: times.setdefault(id(s), []).append(s.time))
            assert sim.time == end
    assert same_state(one, two)
    assert sorted(set(times[id(one)]) | {first}) == times[id(two)]


def test_another_interval_counts_from_where_the_run_is():
    sim, times = five_springs(), []
    sim.run(time=2, every=0.1, callback=lambda s: None)
    sim.run(time=5, every=1, callback=lambda s: times.append(round(s.time, 9)))
    assert times == [3, 4, 5]


def test_a_change_begins_a_new_run():
    sim = five_springs()
    sim.run(time=1)
    sim.velocity = 2 * sim.velocity
    assert sim.time == 0 and sim.step == 0 and sim.collisions == 0
    kinetic = sim.kinetic
    sim.integrator("psa", step=0.01)
    sim.run(steps=1)
    assert sim.step == 1 and sim.kinetic != kinetic and sim.kinetic == pytest.approx(kinetic, rel=0.1)


def test_energies_are_known_before_the_run():
    sim = five_springs()
    before = sim.kinetic, sim.potential, sim.energy, sim.temperature, sim.pressure
    assert before[0] == pytest.approx(0.5 * (1.1**2 + 0.4**2 + 0.7**2 + 0.9**2)) and before[1] == 0
    first = []
    sim.run(steps=1, every=1, callback=lambda s: first.append((s.kinetic, s.potential, s.energy, s.temperature, s.pressure)))
    assert first[0] == before


def test_species_and_arrays_of_each_particle():
    sim = carom.Simulation(box=[10, 10, 10], boundary=["periodic", "wall", "open"])
    ions = sim.add_particles([[2, 2, 2], [4, 4, 4]], charge=[1, -1], species="ion", mass=[2, 3])
    solvent = sim.add_particles(np.array([[6, 6, 6]], dtype="f4"), radius=0.25)
    assert (ions, solvent, len(sim)) == (range(2), range(2, 3), 3)
    assert sim.species_names == ["ion", "particle"] and sim.species.tolist() == [0, 0, 1]
    assert sim.mass.tolist() == [2, 3, 1] and sim.radius.tolist() == [0.5, 0.5, 0.25] and sim.charge.tolist() == [1, -1, 0]
    sim.add_force("coulomb", constant=1.0, species=["ion", "ion"], form="damped-shifted", cutoff=4.0,
                  damping=0.2)
    assert sim.potential < 0
    assert sim.boundary == ["periodic", "wall", "open"]


def test_bonds_within_a_distance_are_found_once():
    sim = five_springs()
    sim.add_force("harmonic-bond", within=2.5, stiffness=0.1, rest_length=2.0)
    before = sim.potential
    sim.position = sim.position * [0.9, 1] + [1, 0]
    stretched = 0.5 * 1.1 * 4 * (1.8 - 2) ** 2
    assert before == 0 and sim.potential == pytest.approx(stretched)


def test_positions_that_are_set_have_images_of_their_own():
    sim = gas()
    sim.run(time=10)
    assert sim.image.any()
    inside = sim.position.copy()
    sim.position = inside
    assert not sim.image.any() and np.array_equal(sim.unwrapped, inside)
    turns = np.random.default_rng(3).integers(-3, 4, inside.shape)
    far = inside + turns * sim.box
    sim.position = far
    assert np.array_equal(sim.image, turns) and np.allclose(sim.position, inside) and np.allclose(sim.unwrapped, far)


COPIES = {"copy": copy.copy, "deepcopy": copy.deepcopy, "pickle": lambda one: pickle.loads(pickle.dumps(one))}


@pytest.mark.parametrize("way", COPIES)
def test_a_simulation_is_not_copied(way):
    """A shallow copy of the Python object would be another name of one simulation."""
    with pytest.raises(TypeError, match=r"cannot be copied or pickled; write_deck\(file, time=…\) writes"):
        COPIES[way](five_springs())


@pytest.mark.parametrize("make", [five_springs, gas])
def test_a_simulation_becomes_a_deck(tmp_path, make):
    sim = make()
    sim.run(time=1)
    sim.write_deck(tmp_path / "deck.toml", time=2, every=0.5)
    sim.velocity = sim.velocity  # a new run
    sim.run(time=2, every=0.5)
    run = run_command(tmp_path / "deck.toml", tmp_path / "run")
    assert np.array_equal(run.frames[-1].position, sim.position) and np.array_equal(run.frames[-1].velocity, sim.velocity)
    assert run.summary["status"] == "done" and len(run.frames) == 5
    again = carom.Simulation.from_deck(tmp_path / "deck.toml")
    again.run()
    assert np.array_equal(again.position, sim.position)


def test_a_callback_that_raises_ends_the_run_which_then_goes_on():
    sim, undisturbed = five_springs(), five_springs()
    with pytest.raises(ZeroDivisionError):
        sim.run(time=3, every=0.5, callback=lambda s: 1 / (s.time < 1))
    assert sim.time == 1
    sim.run(time=3)
    undisturbed.run(time=3)
    assert same_state(sim, undisturbed)


def test_a_callback_that_raises_within_an_epoch_ends_the_run_at_its_end():
    sim, undisturbed, times = gas(), gas(), []
    with pytest.raises(ZeroDivisionError):
        sim.run(steps=2, every=0.5, callback=lambda s: 1 / (s.time < 1))
    assert sim.time > 1 and sim.step == 1
    sim.run(steps=2, every=0.5, callback=lambda s: times.append(s.time))
    undisturbed.run(steps=2)
    assert same_state(sim, undisturbed) and sim.step == 2 and len(times) == len(set(times))


def test_a_number_of_collisions_ends_within_an_epoch_and_the_run_goes_on():
    sim, undisturbed = gas(), gas()
    for collisions in (10, 20):
        sim.run(collisions=collisions)
        assert sim.collisions == collisions
    undisturbed.run(collisions=20)
    assert same_state(sim, undisturbed)


def test_fixed_particles(tmp_path):
    def scene():
        sim = carom.Simulation(box=[12, 8], boundary="wall")
        sim.add_particles(position=[[4, 4], [4.5, 4.2], [0.1, 2]], fixed=True, species="peg")
        sim.add_particles(position=[[8, 4.3], [9, 6]], velocity=[[-1, 0], [0.5, 0.2]])
        sim.integrator("edda", step=0.05)
        return sim

    sim, again = scene(), scene()
    pegs = sim.position[:3].copy()
    assert np.isinf(sim.mass[:3]).all() and (sim.mass[3:] == 1).all()
    sim.thermalize(2.0, seed=3)
    assert not sim.velocity[:3].any() and sim.temperature == pytest.approx(2.0, rel=1e-14)
    again.thermalize(2.0, seed=3)
    sim.run(time=20)
    assert sim.collisions > 2 and np.array_equal(sim.position[:3], pegs) and sim.energy_error < 1e-12
    again.write_deck(tmp_path / "deck.toml", time=20, every=5)
    assert "fixed = true" in (tmp_path / "deck.toml").read_text()
    run = run_command(tmp_path / "deck.toml", tmp_path / "run")
    assert np.array_equal(run.frames[-1].position, sim.position)
    placed = carom.Simulation(box=[10, 10], boundary="periodic")
    placed.add_particles(count=10, radius=0.4, fixed=True, species="peg")
    placed.add_particles(count=10, radius=0.4, temperature=1.0)
    placed.place("random", seed=2)
    assert np.isinf(placed.mass[:10]).all() and not placed.velocity[:10].any() and placed.velocity[10:].any()
    with pytest.raises(carom.UsageError, match="'velocity' of fixed particles"):
        sim.add_particles(position=[[1, 1]], velocity=[[1, 0]], fixed=True)


def test_progress_is_a_line_that_goes_away(capsys, monkeypatch):
    monkeypatch.setattr(carom.progress, "QUIET", 0)
    sim = gas(512)
    sim.integrator("psa", step=0.001)
    sim.run(steps=500, every=0.1, callback=lambda _: clock.sleep(0.06), progress=True)
    line = capsys.readouterr().err
    assert "%" in line and line.endswith("\r") and "\n" not in line
    sim.run(steps=600, progress=False)
    assert capsys.readouterr().err == ""


def test_walls_move_and_stay_where_they_are_in_the_next_run():
    sim = carom.Simulation(box=[10, 6])
    sim.add_particles([[2, 3], [5, 3], [8, 3]], velocity=[[1, 0.2], [0, -0.1], [-0.5, 0]], radius=0.5)
    sim.add_wall("x+", velocity=0.25)
    sim.add_wall("ramp", normal=[1, 1], offset=1.5)
    sim.add_wall("y+", velocity={"amplitude": 0.1, "frequency": 0.5})
    assert [wall["name"] for wall in sim.walls] == ["x+", "ramp", "y+"]
    sim.integrator("edda", step=0.05)
    before = sim.energy
    sim.run(time=8)
    assert sim.energy > before and sim.energy_error < 1e-13
    assert sim.position[:, 0].max() <= 10 - 8 * 0.25 - 0.5 + 1e-9
    assert (sim.position.sum(axis=1) / np.sqrt(2)).min() >= 1.5 / np.sqrt(2) + 0.5 - 1e-9
    sim.velocity = -sim.velocity
    sim.run(time=4)
    assert sim.position[:, 0].max() <= 10 - 12 * 0.25 - 0.5 + 1e-9
    with pytest.raises(carom.UsageError, match="the wall 'x-' is a face of the box"):
        sim.add_wall("x-", normal=[1, 0])


def test_a_motion_that_ends_and_a_new_one():
    sim = carom.Simulation(box=[10, 6])
    sim.add_particles([[2, 3]], velocity=[[0, 0]], radius=0.5)
    sim.add_wall("x+", velocity=0.25, until=4)
    sim.add_wall("post", shape="sphere", centre=np.array([8.0, 3.0]), radius=0.5, inside=False)
    sim.integrator("edda", step=0.05)
    sim.run(time=8)
    wall = sim.walls[0]
    assert wall["moved"] == pytest.approx(1) and wall["until"] == 0
    sim.add_wall("x+", velocity=0.5)
    assert "until" not in sim.walls[0]
    sim.run(time=2)
    assert sim.walls[0]["moved"] == pytest.approx(2)
    with pytest.raises(carom.UsageError, match="leave 'radius' out"):
        sim.add_wall("post", radius=1.0)


def in_moving_walls():
    """Two discs under a field between a shaken floor and a moving ramp."""
    sim = carom.Simulation(box=[10, 10], boundary="wall")
    sim.add_particles([[5, 5], [4, 3]], velocity=[[-1, 0.3], [0.5, 0.2]], radius=0.5)
    sim.add_wall("y-", velocity={"amplitude": 0.1, "frequency": 0.3})
    sim.add_wall("ramp", normal=[1, 1], offset=1, velocity=0.05)
    sim.add_force("uniform-field", acceleration=[0, -0.5])
    return sim


@pytest.mark.parametrize("method", ["free-flight", "edda"])
def test_a_deck_of_the_present_state_has_walls_and_ramps_as_they_are(method, tmp_path):
    sim = in_moving_walls()
    sim.integrator(method, step=0.01)
    sim.run(time=2.3)
    assert sim.walls[0]["phase"] == pytest.approx(0.69) and sim.walls[1]["moved"] == pytest.approx(0.115)
    sim.write_deck(tmp_path / "deck.toml", time=3)
    from_deck = carom.Simulation.from_deck(tmp_path / "deck.toml")
    from_deck.run()
    sim.run(time=5.3)
    assert np.abs(from_deck.position - sim.position).max() < 1e-9
    # A new run of the same simulation goes on likewise, in the time since its start.
    again = in_moving_walls()
    again.integrator(method, step=0.01)
    again.run(time=2.3)
    again.velocity = again.velocity.copy()
    again.run(time=3)
    assert np.abs(again.position - sim.position).max() < 1e-9
    heated = gas(step=1.0)
    heated.add_bath("andersen", temperature=[1.0, 5.0], rate=1.0, ramp_time=[1, 5])
    heated.run(time=2)
    heated.write_deck(tmp_path / "deck.toml", time=3)
    assert carom.Simulation.from_deck(tmp_path / "deck.toml").bath["ramp_time"] == [-1, 3]


def test_a_moved_wall_can_be_stopped():
    sim = carom.Simulation(box=[10, 6])
    sim.add_particles([[2, 3], [5, 3]], velocity=[[1, 0.2], [0, -0.1]], radius=0.5)
    sim.add_wall("x+", velocity=0.25)
    sim.add_wall("y-", velocity={"amplitude": 0.2, "frequency": 0.1})
    sim.integrator("free-flight", step=1.0)
    sim.run(time=8)
    floor = 0.2 * np.sin(2 * np.pi * 0.8)
    for velocity in (0, {"amplitude": 0.1, "frequency": 1.0}):
        sim.add_wall("x+", velocity=0)
        sim.add_wall("y-", velocity=velocity)
        assert sim.walls[0]["moved"] == 2 and sim.walls[1]["moved"] == pytest.approx(floor)
        assert sim.time == 0
        before = sim.energy
        sim.run(time=40)
        assert sim.position[:, 0].max() <= 7.5 + 1e-9 and (velocity != 0 or sim.energy == pytest.approx(before, rel=1e-12))
        floor += 0.1 * np.sin(2 * np.pi * 40) if velocity else 0
    with pytest.raises(carom.UsageError, match="the wall 'x\\+' is there already and stays where it is; leave 'offset' out, or give 'moved'"):
        sim.add_wall("x+", offset=1.0)


@pytest.mark.parametrize("step", [0.01, 0.1, 0.07, 0.3])
def test_a_run_to_a_multiple_of_the_step_ends_at_a_whole_step(step):
    """However 10 steps of this length are rounded, the run goes on from its end."""
    time = round(10 * step, 2)
    sims = [five_springs(), five_springs()]
    for sim in sims:
        sim.integrator("edda", step=step)
        sim.add_bath("andersen", temperature=1.0, rate=1.0)
    for end in (time, 2 * time):
        sims[0].run(time=end)
    sims[1].run(time=2 * time)
    assert (sims[0].position == sims[1].position).all()
    sims[0].add_contact("*", "*", restitution=0.9)
    sims[0].bath_temperature = 2.0
    sims[0].run(time=3 * time)
    assert sims[0].energy_error < 1e-12
    sims[0].run(time=3 * time + 0.4 * step)
    with pytest.raises(carom.UsageError, match="within a step"):
        sims[0].bath_temperature = 1.0


def test_a_ramp_has_its_own_times():
    def heated(ends, **ramp):
        sim = gas(step=0.5)
        sim.add_bath("andersen", temperature=[1.0, 4.0], rate=5.0, **ramp)
        for end in ends:
            sim.run(time=end)
        return sim

    whole = heated([4])
    assert whole.bath["ramp_time"] == [0, 4]
    assert (heated([2, 4], ramp_time=[0, 4]).position == whole.position).all()
    first = heated([2, 4])  # over the first run
    assert first.bath["ramp_time"] == [0, 2] and (first.position == heated([4], ramp_time=[0, 2]).position).all()
    first.bath_temperature = 2.0
    assert "ramp_time" not in first.bath
    with pytest.raises(carom.UsageError, match="ramp_time of the bath is not two times, one after the other"):
        heated([1], ramp_time=[2, 1])
    placed = carom.Simulation(box=[9, 9, 9])
    placed.add_bath("andersen", temperature=[1.0, 4.0], rate=5.0)
    placed.add_particles(count=8, temperature=1.0, radius=0.5)
    placed.place("random")
    assert placed.bath["temperature"] == [1, 4]


def test_a_bath_changes_its_temperature_between_runs():
    def heated(first, second):
        sim = gas(step=1.0)
        sim.add_bath("andersen", temperature=1.0, rate=5.0)
        assert sim.bath["type"] == "andersen" and sim.bath_temperature == 1.0
        sim.run(time=4)
        assert sim.time == 4
        sim.bath_temperature = second
        assert sim.bath_temperature == second
        sim.run(time=8)
        assert sim.time == 8 and sim.energy_error < 1e-12
        return sim

    hot, cool = heated(1.0, 4.0), heated(1.0, 1.0)
    assert hot.temperature > 3 and 0.5 < cool.temperature < 1.5      # N = 64 and more: the standard deviation is below 0.11 T
    sim = gas()
    with pytest.raises(carom.UsageError, match="there is no bath; call add_bath"):
        sim.bath_temperature = 2.0
    with pytest.raises(carom.UsageError, match="'type' cannot be 'nose'"):
        sim.add_bath("nose", temperature=1.0, rate=1.0)
    with pytest.raises(carom.UsageError, match="'rate' must be positive"):
        sim.add_bath("rescaling", temperature=1.0, rate=0)
    sim.add_bath("rescaling", temperature=[1.0, 2.0], rate=10.0)
    sim.run(time=5)
    assert 1.4 < sim.temperature < 2.6


def test_a_law_of_contacts_changes_between_runs(tmp_path):
    def cooled(second, directory=None):
        sim = gas(step=1.0)
        sim.add_contact("*", "*", restitution=0.7)
        if directory:
            sim.output(directory, thermo_interval=0.5)
        sim.run(time=2)
        before = sim.dissipated
        assert before > 0
        sim.add_contact("*", "*", restitution=second)
        assert [law["restitution"] for law in sim.contacts] == [0.7, second]
        sim.run(time=4)
        assert sim.time == 4 and sim.energy_error < 1e-12
        return sim, before

    elastic, before = cooled(1.0)
    assert elastic.dissipated == before
    other, before = cooled(0.6)
    assert other.dissipated > before
    # A continued run has the law that it had, not that of its deck.
    first, before = cooled(1.0, tmp_path / "run")
    again = carom.Simulation.from_run(tmp_path / "run")
    again.run(time=6)
    first.run(time=6)
    assert again.dissipated == first.dissipated == before
    assert np.array_equal(again.position, first.position)
    with pytest.raises(carom.UsageError, match="a run is going on; change the laws of contacts before it or after it"):
        elastic.run(time=8, every=1.0, callback=lambda s: s.add_contact("*", "*", restitution=0.5))
    unready = gas()
    unready.add_contact("*", "*", restitution=0.7)
    unready.run(time=2)
    with pytest.raises(carom.UsageError, match="a law of contacts: the last run ended at time 2, within a step or an epoch"):
        unready.add_contact("*", "*", restitution=1.0)
    for given, text in [({"restitution": 1.5}, "'restitution' is 1.5; take at most 1"), ({"restitution": -1.0}, "'restitution'"),
                        ({"rest_speed": -1.0}, "'rest_speed'")]:
        with pytest.raises(carom.UsageError, match=text):
            gas().add_contact("*", "*", **given)
    with pytest.raises(carom.UsageError, match="'sand' is neither a species nor a wall"):
        gas().add_contact("sand", "*", restitution=0.5)
    hasty = gas()
    hasty.add_contact("*", "*", restitution=0.5, rest_speed=5.0)
    with pytest.raises(carom.UsageError, match="rest_speed 5 of a contact is above the thermal speed"):
        hasty.run(time=1)


def test_walls_carry_a_load(tmp_path):
    sim = carom.Simulation(box=[10, 6])
    sim.add_particles([[5, 3]], velocity=[[2, 0]], radius=0.5)
    sim.add_wall("middle", normal=[1, 0], offset=-1.0)
    sim.integrator("free-flight")
    loads = []
    sim.output(tmp_path / "run", thermo_interval=9.0)
    sim.run(time=90, callback=lambda s: loads.append(s.wall_loads))
    # Each face is hit every 9 units of time with an impulse of 4, and has an area of 6.
    assert loads[0] == dict.fromkeys(["x-", "x+", "y-", "y+", "middle"], 0)
    assert all(load["x-"] == pytest.approx(4 / 9 / 6) and load["x+"] == pytest.approx(4 / 9 / 6) for load in loads[1:])
    assert all(load["y+"] == load["middle"] == 0 for load in loads)
    thermo = sim.open().thermo
    assert thermo["pressure_x-"][1:] == pytest.approx(4 / 9 / 6) and "force_middle" in thermo and len(thermo["pressure_y+"]) == 11


def test_thermal_walls_heat():
    sim = carom.Simulation(box=[10, 6])
    sim.add_particles([[2, 3], [5, 3], [8, 3]], velocity=[[1, 0.2], [0, -0.1], [-0.5, 0]], radius=0.5)
    sim.add_wall("x+", temperature=5.0, seed=3)
    sim.integrator("edda", step=0.05)
    before = sim.energy
    sim.run(time=100)
    assert sim.energy > 2 * before and sim.energy_error < 1e-12


def test_rough_spheres_spin():
    sim = carom.Simulation(box=[10, 6])
    sim.add_particles([[2, 3], [5, 3], [8, 3]], velocity=[[1, 0.2], [0, -0.1], [-0.5, 0]], radius=0.5, spin=[0, 1, -2], inertia=0.8)
    assert (sim.spin == [0, 1, -2]).all()
    sim.add_contact("*", "*", restitution=0.95, tangential=0.5, friction=0.4)
    sim.integrator("edda", step=0.05)
    seen = []
    sim.run(time=20, every=5, callback=lambda s: seen.append(s.spin.copy()))
    assert len(seen) == 5 and (seen[0] == [0, 1, -2]).all() and (seen[1] != seen[0]).any() and (seen[-1] == sim.spin).all()
    moment = 0.8 * sim.mass * sim.radius**2
    assert sim.rotational_energy == pytest.approx(0.5 * (moment * sim.spin**2).sum(), rel=1e-14)
    assert sim.rotational_temperature == pytest.approx(2 * sim.rotational_energy / 3, rel=1e-14)
    assert sim.dissipated > 0 and sim.energy_error < 1e-13
    sim.spin = [1.0, 2.0, 3.0]
    assert (sim.spin == [1, 2, 3]).all() and not (seen[0] == sim.spin).all()
    with pytest.raises(carom.UsageError, match=r"'spin' has shape \(3, 2\); give \(3,\)"):
        sim.spin = np.zeros((3, 2))
    with pytest.raises(carom.UsageError, match="'inertia' is 1.5, more than the 1 of a ring"):
        sim.add_particles([[2, 1]], radius=0.5, inertia=1.5)


def test_placed_spheres_spin_as_in_a_deck(tmp_path):
    """The same spins, drawn by place() before the contacts are known; spheres that stand there already keep theirs."""
    (tmp_path / "deck.toml").write_text("""format = 1
[system]
dimension = 3
box = [8.0, 8.0, 8.0]
boundary = ["periodic", "periodic", "periodic"]
[[contact]]
between = ["grain", "shell"]
tangential = 0.5
[[particles]]
name = "grain"
position = [[1.0, 2.0, 3.0]]
radius = 0.5
spin = [[1.0, 2.0, 3.0]]
[[particles]]
name = "shell"
count = 40
temperature = 1.0
rotational_temperature = 0.7
inertia = 0.6
radius = 0.4
[placement]
type = "random"
seed = 3
[integrator]
type = "free-flight"
[run]
end_time = 1.0
""")
    deck = carom.Simulation.from_deck(tmp_path / "deck.toml")
    sim = carom.Simulation(box=[8, 8, 8], boundary="periodic")
    sim.add_particles([[1, 2, 3]], radius=0.5, species="grain", spin=[[1, 2, 3]])
    sim.add_particles(count=40, temperature=1.0, rotational_temperature=0.7, inertia=0.6, radius=0.4, species="shell")
    sim.place("random", seed=3)
    assert (sim.spin[0] == [1, 2, 3]).all() and (sim.spin == deck.spin).all()
    assert 0.6 * 0.4**2 * (sim.spin[1:] ** 2).sum() == pytest.approx(3 * 40 * 0.7, rel=1e-13)


def test_rough_spheres_that_are_placed_and_written(tmp_path):
    def grains():
        sim = carom.Simulation(dimension=3, boundary="periodic")
        sim.add_particles(count=108, temperature=1.0, radius=0.5, species="grain", inertia=0.6)
        sim.place("fcc", packing_fraction=0.3)
        sim.add_contact("grain", "grain", tangential=0.8)
        sim.integrator("free-flight")
        return sim

    sim, whole = grains(), grains()
    assert sim.spin.shape == (108, 3) and not sim.spin.any()
    sim.output(tmp_path / "run", frame_interval=0.2)
    sim.run(time=1)
    with carom.files.Trajectory(tmp_path / "run") as trajectory:
        spin = trajectory.spin(-1)
    assert spin.shape == (108, 3) and (spin == sim.spin).all() and sim.spin.any()
    sim.write_deck(tmp_path / "deck.toml", time=1.0)
    other = carom.Simulation.from_deck(tmp_path / "deck.toml")
    assert (other.spin == sim.spin).all() and other.rotational_energy == sim.rotational_energy
    sim.run(time=2)
    again = carom.Simulation.from_run(tmp_path / "run")
    again.run(time=3)
    whole.run(time=3)
    assert (again.spin == whole.spin).all() and again.energy_error < 1e-13


@pytest.mark.parametrize("files", [False, True])
def test_long_steps_are_a_warning(tmp_path, files):
    sim = carom.Simulation(box=[12, 6], boundary="wall")
    sim.add_particles(position=[[4, 3], [6, 3]], velocity=[[0, 0], [1.1, -0.4]], radius=0.5)
    sim.add_force("harmonic-bond", pairs=[[0, 1]], stiffness=1.0, rest_length=2.0)
    sim.integrator("edda", step=0.1)
    if files:
        sim.output(tmp_path / "files")
    sim.run(time=2)
    assert sim.warnings == []
    sim.integrator("edda", step=0.6)
    if files:
        sim.output(tmp_path / "long")
    with pytest.warns(UserWarning, match="the steps are long: about time"):
        sim.run(time=20)


def test_a_method_may_choose_its_steps():
    sim = carom.Simulation(box=[12, 6], boundary="wall")
    sim.add_particles(position=[[4, 3], [6, 3]], velocity=[[0, 0], [1.1, -0.4]], radius=0.5)
    sim.add_force("harmonic-bond", pairs=[[0, 1]], stiffness=1.0, rest_length=2.0)
    sim.integrator("edda")
    sim.run(time=2)
    few = sim.step
    sim.integrator("edda", accuracy=1e-6)
    sim.run(time=4)
    assert 2 < few < sim.step / 2


@pytest.mark.parametrize("method", ["verlet", "psa", "cva", "mcva", "cdda", "edda"])
def test_a_crystal_has_one_energy_however_much_of_it_is_in_the_box(tmp_path, method):
    """A simple cubic crystal of Lennard-Jones particles with 1, 8 and 27 of them in the box; the cutoff is longer than it."""
    radius = {} if method == "verlet" else {"radius": 0.5}
    cutoff, a, tail = 2.5, 1.1, {}
    images = np.stack(np.meshgrid(*[np.arange(-3, 4) * a] * 3, indexing="ij"), -1).reshape(-1, 3)
    r = np.linalg.norm(images, axis=1)
    r = r[(r > 0) & (r < cutoff)]
    energy = 0.5 * (4 * (r**-12 - r**-6) - 4 * (cutoff**-12 - cutoff**-6)).sum()
    pressure = 0.5 * (48 * r**-12 - 24 * r**-6).sum() / (3 * a**3)
    tail["energy"] = 8 * np.pi / a**3 * (cutoff**-9 / 9 - cutoff**-3 / 3)
    tail["pressure"] = 32 * np.pi / 9 / a**6 * (cutoff**-9 - 1.5 * cutoff**-3)
    for n in 1, 2, 3:
        x = np.stack(np.meshgrid(*[np.arange(n) * a] * 3, indexing="ij"), -1).reshape(-1, 3)
        sim = carom.Simulation(box=[n * a] * 3, boundary="periodic")
        sim.add_particles(position=x, **radius)
        sim.add_force("lennard-jones", epsilon=1.0, sigma=1.0, cutoff=cutoff, cut="shifted", tail=True)
        sim.integrator(method, step=0.001)
        sim.output(tmp_path / str(n), pressure_tensor_interval=0.001, thermo_interval=0.001)
        sim.run(steps=2)
        assert sim.energy / n**3 == pytest.approx(energy + tail["energy"], rel=1e-12)
        assert sim.pressure == pytest.approx(pressure + tail["pressure"], rel=1e-12)
        means = carom.open(tmp_path / str(n)).summary["pressure_tensor"]
        for axis in "xx", "yy", "zz":
            assert means[axis]["mean"] == pytest.approx(pressure + tail["pressure"], rel=1e-12)
        assert abs(means["xy"]["mean"]) < 1e-12


def test_wells_and_friction_are_those_of_a_deck(tmp_path):
    """V counts the pairs in the well, also before the first run; steps grow with species, and bad ones change nothing."""
    deck = carom.Simulation.from_deck(ROOT / "inputs/square-well.toml", set={"particles.0.count": 108, "run.end_time": 1.0})
    hand = carom.Simulation(dimension=3, boundary="periodic")
    hand.add_particles(count=108, temperature=1.5, radius=0.5, species="sphere")
    hand.place("fcc", packing_fraction=0.2617993877991494, seed=7)
    hand.add_step("sphere", "sphere", range=1.5, depth=1.0)
    hand.add_bath("andersen", temperature=1.5, rate=0.1, seed=7)
    hand.integrator("free-flight")
    assert hand.potential == deck.potential == -6 * 108  # the neighbours of an fcc lattice, of which each pair counts once
    for sim in (deck, hand):
        sim.run(time=1.0)
    assert same_state(deck, hand) and hand.potential == deck.potential != -6 * 108
    with pytest.raises(carom.UsageError, match="'ion' is no species; give one of: sphere"):
        hand.add_step("ion", "*", range=1.5, depth=1.0)
    assert len(hand.steps) == 1 and hand.time == deck.time and same_state(deck, hand)

    brownian = gas(27)
    brownian.add_bath("langevin", temperature=2.0, friction=[5.0])
    with pytest.raises(carom.UsageError, match="needs 'friction'"):
        brownian.add_bath("langevin", temperature=2.0)
