# SPDX-License-Identifier: BSD-3-Clause
"""Common systems for the tests of the package."""

import os
import pathlib
import subprocess

import numpy as np

import carom

ROOT = pathlib.Path(__file__).resolve().parents[2]


def five_springs(**change):
    """The first experiment of the thesis, by edda; `change` replaces arguments of add_particles()."""
    sim = carom.Simulation(box=[12, 6], boundary="wall")
    particles = {"position": [[2, 3], [4, 3], [6, 3], [8, 3], [10, 3]],
                 "velocity": [[0, 0], [1.1, -0.4], [0, 0], [-0.7, 0.9], [0, 0]], "radius": 0.5} | change
    sim.add_particles(**particles)
    sim.add_force("harmonic-bond", pairs=[[0, 1], [1, 2], [2, 3], [3, 4]], stiffness=1.0, rest_length=2.0)
    sim.integrator("edda", step=0.01)
    return sim


def gas(n=64, seed=1, boundary="periodic", packing=0.1, **epoch):
    """Hard spheres on a cubic lattice with random velocities, by free flight; `epoch` is the length step=…"""
    sites = round(n ** (1 / 3))
    assert sites ** 3 == n
    edge = (n * np.pi / 6 / packing) ** (1 / 3)
    x = (np.stack(np.meshgrid(*[np.arange(sites)] * 3, indexing="ij"), -1).reshape(-1, 3) + 0.5) * edge / sites
    v = np.random.default_rng(seed).normal(size=x.shape)
    sim = carom.Simulation(box=[edge] * 3, boundary=boundary)
    sim.add_particles(position=x, velocity=v - v.mean(axis=0))
    sim.integrator("free-flight", **epoch)
    return sim


def run_command(deck, directory, *more):
    """Runs the command and opens its run."""
    done = subprocess.run([os.environ["CAROM"], "run", str(deck), "-o", str(directory), "--quiet", *more],
                          capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return carom.open(directory)


def same_state(a, b):
    return (np.array_equal(a.position, b.position) and np.array_equal(a.velocity, b.velocity)
            and np.array_equal(a.image, b.image) and a.time == b.time and a.step == b.step
            and a.collisions == b.collisions and a.energy_error == b.energy_error)
