# SPDX-License-Identifier: BSD-3-Clause
"""Views of the particles: they copy nothing, and never refer to freed memory."""

import gc
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import carom
from scenes import five_springs, gas


def address(array):
    return array.__array_interface__["data"][0]


@pytest.mark.parametrize("make", [five_springs, gas])
def test_a_view_follows_the_run_at_one_address(make):
    sim = make()
    x, v, image = sim.position, sim.velocity, sim.image
    start = x.copy()
    for end in (0.5, 1.0, 2.503):
        sim.run(time=end, every=0.1, callback=lambda s: None)
        for kept, now in ((x, sim.position), (v, sim.velocity), (image, sim.image)):
            assert address(kept) == address(now) and np.array_equal(kept, now)
    assert not np.array_equal(x, start)
    assert x.base is not None and not x.flags.writeable and x.flags.c_contiguous
    with pytest.raises(ValueError):
        x.setflags(write=True)


@pytest.mark.parametrize("make", [five_springs, gas])
def test_a_view_in_a_callback_is_the_view_after_the_run(make):
    sim, views, copies = make(), [], []
    sim.run(time=1, every=0.25, callback=lambda s: (views.append(s.position), copies.append(s.position.copy())))
    assert len({address(view) for view in views}) == 1
    assert all(np.array_equal(view, copies[-1]) for view in views) and not np.array_equal(copies[0], copies[1])


def test_views_outlive_names_and_runs():
    sim = five_springs()
    sim.run(steps=10)
    x, mass, copy = sim.position, sim.mass, sim.position.copy()
    del sim
    gc.collect()
    np.ones(100000)
    assert np.array_equal(x, copy) and mass.tolist() == [1] * 5


def test_views_of_before_more_particles_keep_what_they_showed():
    for names in (["position", "velocity", "image", "mass", "radius", "charge", "species"], ["image"], ["mass"]):
        sim = five_springs()
        views = {name: getattr(sim, name) for name in names}
        copies = {name: view.copy() for name, view in views.items()}
        for k in range(200):
            sim.add_particles([[0.6, 1.5 + 0.01 * k]], velocity=[[1, 1]], mass=3, species="light")
        np.full(100000, np.nan)
        for name, view in views.items():
            assert np.array_equal(view, copies[name]) and np.array_equal(getattr(sim, name)[:5], copies[name])
        assert sim.position.shape == (205, 2) and sim.mass.tolist() == 5 * [1] + 200 * [3]


def test_changing_the_method_keeps_the_address():
    sim = gas()
    x = sim.position
    for method, given in (("free-flight", {}), ("psa", {"step": 0.01}), ("free-flight", {}), ("edda", {"step": 0.01})):
        sim.integrator(method, **given)
        sim.run(time=0.5)
        assert address(x) == address(sim.position) and np.array_equal(x, sim.position)


def test_a_failed_run_keeps_the_address():
    sim = five_springs()
    x = sim.position
    sim.position = [[2, 3], [2.1, 3], [6, 3], [8, 3], [10, 3]]
    with pytest.raises(carom.InitialStateError):
        sim.run(steps=1)
    sim.position = [[2, 3], [4, 3], [6, 3], [8, 3], [10, 3]]
    sim.add_force("uniform-field", acceleration=[1e300, 0])
    with pytest.raises(carom.NumericalError):
        sim.run(steps=100)
    assert address(x) == address(sim.position)


def test_other_threads_may_look_while_a_run_goes_on():
    sim, begun, go_on = gas(512), threading.Event(), threading.Event()
    sim.integrator("psa", step=0.001)
    x = sim.position
    start = x.copy()

    def look(s):
        begun.set()
        if s.step == 1500:
            go_on.wait(600)

    worker = threading.Thread(target=lambda: sim.run(steps=2000, every=0.1, callback=look))
    worker.start()
    assert begun.wait(600)
    for change in (lambda: sim.add_particles([[0, 0, 0]]), lambda: sim.run(steps=9), lambda: setattr(sim, "velocity", start)):
        with pytest.raises(carom.UsageError, match="a run is going on"):
            change()
    assert np.isfinite(sim.position.sum()) and sim.time <= 1.5
    go_on.set()
    worker.join()
    assert sim.step == 2000 and not np.array_equal(x, start) and np.array_equal(x, sim.position)


def test_what_was_not_viewed_before_is_there_in_callbacks_only():
    sim, begun, told = gas(512), threading.Event(), []
    sim.integrator("psa", step=0.001)

    def look():
        assert begun.wait(600)
        try:
            start = time.process_time()
            while time.process_time() < start + 0.3:  # the callback has returned, and something has collided
                time.sleep(0.01)
            sim.velocity
        except carom.UsageError as error:
            told.append(str(error))
        finally:
            signal.raise_signal(signal.SIGINT)  # to the main thread, which runs

    worker = threading.Thread(target=look)
    worker.start()
    with pytest.raises(KeyboardInterrupt):
        sim.run(time=1e6, every=1e6, callback=lambda s: (s.position, begun.set()))
    worker.join()
    assert told == ["a run is going on; look at the particles in its callback, or after it"]
    assert not np.array_equal(sim.velocity, gas(512).velocity)


MEMORY = """
import resource, sys
import numpy as np
import carom
n = 1_000_000
rows = lambda: int(next(l for l in open("/proc/self/status") if l.startswith("VmHWM")).split()[1]) / 1024
carom.Simulation(box=[1, 1, 1])
k = np.arange(n)
x = np.stack([k % 100, k // 100 % 100, k // 10000], 1) * 1.5 + 0.75
v = np.ones_like(x)
sim = carom.Simulation(box=[150, 150, 150], boundary="periodic")
before = rows()
sim.add_particles(position=x, velocity=v)
inside = rows()
views = [sim.position, sim.velocity, sim.image, sim.mass, sim.radius]
total = sum(float(view[::1000].sum()) for view in views)
print(inside - before, rows() - inside)
"""


def test_a_million_particles_go_in_by_one_copy_and_are_viewed_without():
    out = subprocess.run([sys.executable, "-c", MEMORY], check=True, capture_output=True, text=True).stdout
    going_in, viewing = map(float, out.split())
    own = 1e6 * (24 + 24 + 12 + 8 + 8 + 8 + 2) / 2**20  # the engine's memory for the particles [MB]
    assert going_in < own + 12 and viewing < 2
