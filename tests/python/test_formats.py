# SPDX-License-Identifier: BSD-3-Clause
"""Files of other programs: written by the command and by the programs' own packages, read by from_file()."""

import builtins
import os
import subprocess

import numpy as np
import pytest

import carom
from scenes import ROOT, five_springs


def written(tmp_path, form, make):
    """A converted run, and its last frame."""
    sim = make()
    sim.output(tmp_path / "run", frame_interval=0.5)
    sim.run(time=1)
    file = tmp_path / f"frames.{'data' if form == 'lammps-data' else form}"
    subprocess.run([os.environ["CAROM"], "convert", tmp_path / "run", "--to", form, "-o", file], check=True, capture_output=True)
    return sim, file


def rough_mixture():
    """Spheres with spin, of two moments of inertia."""
    sim = carom.Simulation(box=[6, 7, 8], boundary="periodic")
    sim.add_particles(count=20, temperature=1.0, rotational_temperature=1.0, radius=0.4, species="Na")
    sim.add_particles(count=10, temperature=1.0, rotational_temperature=1.0, radius=0.3, mass=2.0, inertia=0.6, species="Cl")
    sim.place("random", seed=2)
    sim.add_contact("*", "*", tangential=0.5)
    sim.integrator("free-flight")
    return sim


def rough_discs():
    sim = carom.Simulation(box=[6, 7], boundary="periodic")
    sim.add_particles(count=10, temperature=1.0, rotational_temperature=1.0, radius=0.4)
    sim.place("random", seed=2)
    sim.add_contact("*", "*", tangential=0.5)
    sim.integrator("free-flight")
    return sim


def mixture():
    sim = carom.Simulation(box=[6, 7, 8], boundary="periodic")
    sim.add_particles(count=20, temperature=1.0, radius=0.4, charge=1.0, species="Na")
    sim.add_particles(count=10, temperature=1.0, radius=0.3, mass=2.0, charge=-2.0, species="Cl")
    sim.place("random", seed=2)
    sim.add_force("harmonic-bond", pairs=[[0, 25], [1, 2]], stiffness=1.0, rest_length=1.0)
    sim.integrator("psa", step=0.001)
    return sim


@pytest.mark.parametrize("form", ["gsd", "extxyz", "lammps-data"])
@pytest.mark.parametrize("make", [mixture, five_springs, rough_mixture, rough_discs])
def test_what_the_command_writes_comes_back(tmp_path, form, make):
    pytest.importorskip({"gsd": "gsd", "extxyz": "ase", "lammps-data": "numpy"}[form])
    sim, file = written(tmp_path, form, make)
    flat = len(sim.box) == 2
    back = carom.Simulation.from_file(file, boundary=sim.boundary)
    single = {"rtol": 0, "atol": 2e-6} if form == "gsd" else {"rtol": 1e-14, "atol": 1e-14}
    assert len(back) == len(sim) and np.allclose(back.box, sim.box, **single) and len(back.box) == (2 if flat else 3)
    order = np.lexsort((sim.position[:, 0], np.array(sim.species_names)[sim.species]))
    again = np.lexsort((back.position[:, 0], np.array(sim.species_names)[_kinds(sim, back)]))
    for name in ("position", "velocity", "mass", "radius", "charge", "spin"):
        assert np.allclose(getattr(back, name)[again], getattr(sim, name)[order], **single), name
    assert back.spin.any() == (make in (rough_mixture, rough_discs))
    if form != "extxyz" and sim._session.forces:
        old, new = np.argsort(order), np.argsort(again)
        bonds = sim._session.forces[0][1]["pairs"]
        assert sorted(sorted(old[list(pair)]) for pair in bonds) == sorted(sorted(new[list(pair)]) for pair in back.bonds)
    if form != "lammps-data" and not flat and len(sim.species_names) > 1:
        assert sorted(back.species_names) == ["Cl", "Na"]


def _kinds(sim, back):
    """The species of the imported particles, as numbers of the simulation: LAMMPS has only numbers, and one mass per species."""
    masses = [sim.mass[sim.species == k][0] for k in range(len(sim.species_names))]
    return np.array([int(np.argmin(np.abs(np.array(masses) - m))) for m in back.mass])


def test_what_gsd_and_ase_write_themselves(tmp_path):
    hoomd, ase = pytest.importorskip("gsd.hoomd"), pytest.importorskip("ase")
    from ase.io import write
    snapshot = hoomd.Snapshot()
    snapshot.particles.N, snapshot.configuration.box = 3, [10, 10, 10, 0, 0, 0]
    snapshot.particles.position, snapshot.particles.types, snapshot.particles.typeid = [[-5, 0, 0], [1, 1, 1], [2, 3, 4]], ["A", "B"], [1, 0, 1]
    snapshot.particles.diameter, snapshot.bonds.N, snapshot.bonds.group = [1, 1, 0.5], 1, [[0, 2]]
    with hoomd.open(name=str(tmp_path / "own.gsd"), mode="wb") as file:
        file.append(snapshot)
    sim = carom.Simulation.from_file(tmp_path / "own.gsd")
    assert sim.species_names == ["A", "B"] and sim.position.tolist() == [[6, 6, 6], [0, 5, 5], [7, 8, 9]]
    assert sim.radius.tolist() == [0.5, 0.5, 0.25] and sim.bonds.tolist() == [[1, 2]] and sim.boundary == ["periodic"] * 3
    # A quarter turn about x: L = (1, 2, 3) is (1, 3, -2) in the frame of the body; 2 q (0, L_body).
    s = np.sqrt(0.5)
    snapshot.particles.orientation, snapshot.particles.moment_inertia = [[s, s, 0, 0]] * 3, [[0.5, 0.5, 0.5]] * 3
    snapshot.particles.angmom = [[-2 * s, 2 * s, 10 * s, 2 * s]] * 3
    with hoomd.open(name=str(tmp_path / "turned.gsd"), mode="wb") as file:
        file.append(snapshot)
    assert np.allclose(carom.Simulation.from_file(tmp_path / "turned.gsd").spin, [2, 4, 6], atol=1e-6)
    write(tmp_path / "own.extxyz", ase.Atoms("NaCl", positions=[[1, 2, 3], [4, 5, 6]], cell=[9, 9, 9], pbc=[True, True, False]))
    with pytest.raises(carom.UsageError, match="there are no radii in it; give radius"):
        carom.Simulation.from_file(tmp_path / "own.extxyz")
    sim = carom.Simulation.from_file(tmp_path / "own.extxyz", radius=0.5)
    assert sim.species_names == ["Cl", "Na"] and sim.position.tolist() == [[4, 5, 6], [1, 2, 3]]
    assert sim.boundary == ["periodic", "periodic", "open"] and sim.mass[1] == pytest.approx(22.99, rel=1e-3)


def test_a_lammps_file_of_the_full_style(tmp_path):
    (tmp_path / "own.data").write_text("by hand\n\n2 atoms\n1 bonds\n2 atom types\n-1 9 xlo xhi\n0 10 ylo yhi\n0 10 zlo zhi\n\nMasses\n\n"
                                       "1 3.0\n2 5.0 # heavy\n\nAtoms # full\n\n7 1 2 0.5 1 2 3 0 0 0\n3 1 1 -0.5 4 5 6 0 0 0\n\nBonds\n\n1 1 3 7\n")
    sim = carom.Simulation.from_file(tmp_path / "own.data", radius=0.1)
    assert sim.mass.tolist() == [3, 5] and sim.charge.tolist() == [-0.5, 0.5] and sim.bonds.tolist() == [[0, 1]]
    assert sim.position.tolist() == [[5, 5, 6], [2, 2, 3]]
    text = (tmp_path / "own.data").read_text()
    (tmp_path / "own.data").write_text(text.replace("# full", "# ellipsoid"))
    with pytest.raises(carom.FileError, match="the atom style 'ellipsoid' is not known"):
        carom.Simulation.from_file(tmp_path / "own.data", radius=0)
    (tmp_path / "own.data").write_text(text.replace("\n\nMasses", "\n1 0 0 xy xz yz\n\nMasses"))
    with pytest.raises(carom.UsageError, match="not rectangular"):
        carom.Simulation.from_file(tmp_path / "own.data", radius=0)


def test_files_that_are_none(tmp_path):
    with pytest.raises(carom.FileError, match="there is no such file"):
        carom.Simulation.from_file(tmp_path / "nothing.gsd")
    with pytest.raises(carom.UsageError, match="the ending '.md' is not known"):
        carom.Simulation.from_file(ROOT / "README.md")
    for ending in ("gsd", "extxyz", "data"):
        (tmp_path / f"no.{ending}").write_text("words\n")
        with pytest.raises(carom.FileError, match=f"no.{ending}: cannot read it"):
            carom.Simulation.from_file(tmp_path / f"no.{ending}")


@pytest.mark.parametrize("ending, name", [("gsd", "gsd"), ("extxyz", "ase")])
def test_a_missing_package_is_named(tmp_path, monkeypatch, ending, name):
    def without(wanted, *others, **more):
        if wanted.partition(".")[0] == name:
            raise ImportError(wanted)
        return real(wanted, *others, **more)

    real = builtins.__import__
    monkeypatch.setattr(carom.formats.importlib, "import_module", without)
    (tmp_path / f"a.{ending}").write_text("")
    with pytest.raises(ImportError, match=f"needs the Python package {name}: install Debian's python3-{name}"):
        carom.Simulation.from_file(tmp_path / f"a.{ending}")
