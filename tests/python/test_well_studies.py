# SPDX-License-Identifier: BSD-3-Clause
"""The studies of wells and chains (tools/critical_point.py, tools/chain_relaxation.py): their fits, and a dumbbell that turns."""

import pathlib
import sys

import carom
import numpy as np
import pytest

assert carom.Simulation  # the compiled part, before the tools import the package from its sources
ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))

import chain_relaxation
import critical_point


def test_the_critical_point_of_densities_that_obey_the_laws():
    T = np.array([0.95, 1.0, 1.05, 1.1])
    t, middle, error = 1 - T / 1.22, 0.31 + 0.2 * (1.22 - T), np.array([0.001, 0.001, 0.002, 0.004])
    for powers, half in (([0.326], 0.55 * t**0.326), ([0.326, 0.826], 0.6 * t**0.326 - 0.2 * t**0.826)):
        Tc, chi_squared, density = critical_point.critical_point(T, middle + half, middle - half, error, powers)
        assert (Tc, density) == pytest.approx((1.22, 0.31), abs=1e-4) and chi_squared < 1e-3


def test_the_time_in_which_a_correlation_falls_to_1_over_e():
    random = np.random.default_rng(1)
    X = [np.zeros(3)]
    for noise in random.normal(size=(40000, 3)):
        X.append(0.95 * X[-1] + 0.95**2 * noise)
    correlation = chain_relaxation.correlation(np.array(X), 100)
    direct = [(np.array(X)[:len(X) - lag] * np.array(X)[lag:]).sum(axis=1).mean() for lag in (0, 7)]
    assert correlation[[0, 7]] == pytest.approx(direct)
    assert chain_relaxation.fall([correlation])[0] == pytest.approx(-1 / np.log(0.95), rel=0.05)
    assert chain_relaxation.fall([np.exp(-np.arange(40) / 7.3)])[0] == pytest.approx(7.3)


def test_a_dumbbell_turns_as_the_diffusion_of_a_rod_predicts():
    """A rod of two beads forgets its direction in b^2 m rate / (4 kT), 3/2 of the time of the Rouse model."""
    rate, each = 16.0, []
    for seed in range(4):
        X = chain_relaxation.modes(2, 0.01, seed, rate, 200)
        each.append(chain_relaxation.correlation(X, 100))
    tau = chain_relaxation.fall(each)[0] / chain_relaxation.SAMPLES
    assert tau == pytest.approx(1.5, rel=0.07)
