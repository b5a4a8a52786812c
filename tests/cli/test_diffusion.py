# SPDX-License-Identifier: BSD-3-Clause
"""The diffusion coefficient of tools/plot_msd.py: of random walks with known D, and of hard spheres."""

import re
import sys

import numpy as np
import pytest

from runs import CAROM, ROOT, needs_carom

sys.path.insert(0, str(ROOT / "tools"))
import plot_msd
from carom_files import Trajectory, run_carom
from synthetic_run import write_run


def test_diffusion_of_random_walks_is_within_its_error(tmp_path):
    """Random walks with known D: errors are as large as stated, and long lags do not dominate."""
    pulls = []
    for seed in range(12):
        steps = np.random.default_rng(seed).normal(scale=0.1, size=(401, 20, 3))
        x = np.cumsum(steps, axis=0)
        write_run(tmp_path / str(seed), np.ones(401), x=x, v=x, edges=np.full(3, 1e3), boundary=["open"] * 3, dt=0.5)
        with Trajectory(tmp_path / str(seed)) as trajectory:
            lag, windows, msd, of_blocks = plot_msd.mean_squared_displacement(trajectory)
        value = plot_msd.diffusion_coefficient(lag, windows, msd, 3)
        error = plot_msd.error_of_blocks(lag, windows, of_blocks, 3)
        pulls.append((value / 0.01 - 1, error / 0.01))
        last = np.polyfit(lag[-2:], msd[-2:], 1)[0] / 6
        assert plot_msd.diffusion_coefficient(lag, windows, np.where(lag < 50, msd, 10 * msd), 3) == pytest.approx(value), last
    deviation, stated = np.sqrt(np.mean(np.square(pulls), axis=0))
    assert 0.5 < deviation / stated < 2 and stated < 0.1, (deviation, stated)


@needs_carom
def test_diffusion_of_hard_spheres_against_the_literature(tmp_path, capsys):
    """Speedy, Mol. Phys. 62 (1987) 509: D = D0/n (1 - n/1.09) (1 + n^2 (0.4 - 0.83 n^2)), D0 = 3/8 sqrt(kT/(pi m)) sigma."""
    deck = ROOT / "inputs" / "hard-sphere-fluid.toml"
    run_carom(CAROM, deck, tmp_path / "run", ["particles.0.count=500", f"placement.packing_fraction={np.pi / 12}",
                                              "run.end_time=60", "output.frame_interval=0.5", "output.sample_start=2",
                                              "output.msd_interval=0.1"])
    plot_msd.main([str(tmp_path / "run")])
    value, error = map(float, re.search(r"D = (\S+) ± (\S+)", capsys.readouterr().out).groups())
    n = 0.5
    speedy = 0.375 / np.sqrt(np.pi) / n * (1 - n / 1.09) * (1 + n**2 * (0.4 - 0.83 * n**2))
    assert speedy == pytest.approx(0.2401, abs=1e-4)
    assert error < 0.03 * value * 3 and value == pytest.approx(speedy, rel=0.1)
    plot_msd.main([str(tmp_path / "run" / "msd.csv")])
    of_table, error = map(float, re.search(r"msd: D = (\S+) ± (\S+)", capsys.readouterr().out).groups())
    assert of_table == pytest.approx(value, rel=0.1) and 0 < error < 0.1 * value
