# SPDX-License-Identifier: BSD-3-Clause
"""Trajectories opened by MDAnalysis without conversion."""

import subprocess
import sys

import numpy as np
import pytest

from scenes import five_springs, gas

pytest.importorskip("MDAnalysis")
OPEN = """
import sys, warnings
warnings.simplefilter("ignore")
import MDAnalysis
if sys.argv[2] == "carom":
    import carom.mdanalysis
u = MDAnalysis.Universe(sys.argv[1])
print(len(u.trajectory), u.trajectory[-1].time, u.atoms.positions[1].tolist(), len(getattr(u, "bonds", [])))
"""


def opened(file, way):
    return subprocess.run([sys.executable, "-c", OPEN, file, way], capture_output=True, text=True)


@pytest.mark.parametrize("units, factor", [(None, 1), ({"length": "nm", "time": "ps"}, 10)])
def test_a_universe_has_bonds_with_and_without_units(tmp_path, units, factor):
    sim = five_springs()
    sim.output(tmp_path / "run", frame_interval=0.5, **({"units": units} if units else {}))
    sim.run(time=1)
    file = tmp_path / "run/trajectory.h5md"
    shown = f"3 1.0 {[float(x) * factor for x in np.append(np.float32(sim.position[1]), 0)]} 4"
    done = opened(file, "carom")
    assert done.returncode == 0, done.stderr
    words, expected = done.stdout.replace(",", "").replace("[", "").replace("]", "").split(), shown.replace(",", "").strip().split()
    assert np.allclose([float(w) for w in words], [float(w.strip("[]")) for w in expected], rtol=1e-6)
    alone = opened(file, "alone")
    assert (alone.returncode == 0) == (units is not None), "what MDAnalysis does without the import has changed"
    u = sim.open().universe()
    assert u.atoms.bonds.to_indices().tolist() == [[0, 1], [1, 2], [2, 3], [3, 4]] and len(u.atoms.fragments) == 1
    assert np.allclose(u.trajectory[-1].positions[:, :2], sim.position, atol=1e-6) and u.atoms.radii.tolist() == [0.5] * 5


def test_spheres_without_bonds(tmp_path):
    sim = gas()
    sim.output(tmp_path / "run", frame_interval=0.5)
    sim.run(time=1)
    u = sim.open().universe()
    assert len(u.atoms) == 64 and set(u.atoms.names) == {"particle"} and not hasattr(u, "bonds") and len(sim.open().bonds) == 0
