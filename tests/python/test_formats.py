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
    assert sim.boundary == ["periodic", "periodic", "open"]
    assert sim.mass.tolist() == [1, 1] and "states no masses; all are 1" in sim.warnings[0]  # not those of the elements


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
    for ending, words in (("gsd", ": cannot read it"), ("extxyz", ":1: here must stand the number of particles"), ("data", ": there is no section 'Atoms'")):
        (tmp_path / f"no.{ending}").write_text("words\n")
        with pytest.raises(carom.FileError, match=f"no.{ending}{words}"):
            carom.Simulation.from_file(tmp_path / f"no.{ending}")


LAMMPS = """a title, 99 atoms

3 atoms
1 bonds
2 atom types
1 bond types

-1.0 9.0 xlo xhi
0.0 10.0 ylo yhi
0.0 10.0 zlo zhi

Atom Type Labels

1 Na
2 Cl

Masses

Cl 35.45
Na 22.99

Pair Coeffs # lj/cut

1 0.1 3.0
2 0.2 3.0

Atoms # full

7 1 Na 1.0 1.0 2.0 3.0 1 0 -2
3 1 2 -1.0 4.0 5.0 6.0 0 0 0
12 2 Na 1.0 7.0 8.0 9.0 0 0 0

Velocities

3 0.3 0 0
12 0.12 0 0
7 0.7 0 0

Bonds

1 1 12 7
"""


def test_a_lammps_file_with_labels_images_and_ids_in_any_order(tmp_path):
    (tmp_path / "own.data").write_text(LAMMPS)
    with pytest.warns(UserWarning, match="own.data: not read: 'Pair Coeffs'"):
        sim = carom.Simulation.from_file(tmp_path / "own.data", radius=0.5)
    assert sim.species_names == ["Na", "Cl"] and sim.mass.tolist() == [22.99, 22.99, 35.45] and sim.charge.tolist() == [1, 1, -1]
    assert sim.unwrapped.tolist() == [[12, 2, -17], [8, 8, 9], [5, 5, 6]] and sim.image[0].tolist() == [1, 0, -2]
    assert sim.velocity[:, 0].tolist() == [0.7, 0.12, 0.3] and sim.bonds.tolist() == [[1, 0]]
    with pytest.raises(carom.UsageError, match="image numbers along axis 0, which is not periodic"):
        carom.Simulation.from_file(tmp_path / "own.data", radius=0.5, boundary=["wall", "periodic", "periodic"])
    # Without the comment the style must be given.
    (tmp_path / "own.data").write_text(LAMMPS.replace("Atoms # full", "Atoms"))
    with pytest.raises(carom.FileError, match="own.data:29: no comment behind 'Atoms' .* rows of 10 columns may be full or sphere; give atom_style='full'"):
        carom.Simulation.from_file(tmp_path / "own.data", radius=0.5)
    assert carom.Simulation.from_file(tmp_path / "own.data", radius=0.5, atom_style="full").charge.tolist() == [1, 1, -1]
    # Only atomic has rows of five columns.
    (tmp_path / "own.data").write_text("\n\n1 atoms\n1 atom types\n0 5 xlo xhi\n0 5 ylo yhi\n0 5 zlo zhi\n\nAtoms\n\n1 1 1.0 2.0 3.0\n")
    assert carom.Simulation.from_file(tmp_path / "own.data", radius=0.5).position.tolist() == [[1, 2, 3]]


def test_a_lammps_file_of_hybrid_spheres_and_a_box_by_vectors(tmp_path):
    text = ("\n\n2 atoms\n1 atom types\n8.0 0.0 0.0 avec\n0.0 9.0 0.0 bvec\n0.0 0.0 10.0 cvec\n1.0 2.0 3.0 abc origin\n\n"
            "Atoms # hybrid sphere charge\n\n1 1 2.0 3.0 4.0 1.0 6.0 0.5\n2 1 5.0 6.0 7.0 1.0 6.0 -0.5\n")
    (tmp_path / "own.data").write_text(text)
    sim = carom.Simulation.from_file(tmp_path / "own.data")
    assert sim.box == [8, 9, 10] and sim.position.tolist() == [[1, 1, 1], [4, 4, 4]] and sim.radius.tolist() == [0.5, 0.5]
    assert sim.charge.tolist() == [0.5, -0.5] and sim.mass == pytest.approx([np.pi, np.pi])
    (tmp_path / "own.data").write_text(text.replace("0.0 9.0 0.0 bvec", "0.5 9.0 0.0 bvec"))
    with pytest.raises(carom.UsageError, match="own.data:5: the box is not rectangular"):
        carom.Simulation.from_file(tmp_path / "own.data")


@pytest.mark.parametrize("old, new, words", [
    ("3 atoms", "5 atoms", ":3: the header states 5 atoms, and there are 3 rows under 'Atoms'; is the file cut off"),
    ("3 1 2 -1.0", "7 1 2 -1.0", ":30: the atom 7 was in line 29 already"),
    ("7 1 Na 1.0 1.0 2.0 3.0 1 0 -2", "7 1 Na 1.0 1.0 2.0", ":29: there are 6 columns; the atom style 'full' has 7, or 10 with images"),
    ("7 1 Na 1.0 1.0", "7 1 K 1.0 1.0", ":29: 'K' is no whole number"),
    ("3 1 2 -1.0", "3 1 5 -1.0", ":30: the type 5 is not one of the 2 atom types"),
    ("-1.0 4.0 5.0", "-1.0 4.0x 5.0", ":30: '4.0x' is no number; look at column 5"),
    ("-1.0 4.0 5.0", "-1.0 nan 5.0", ":30: column 5 is nan, which is not finite"),
    ("12 0.12 0 0", "9 0.12 0 0", ":36: there is no atom 9"),
    ("12 0.12 0 0", "3 0.12 0 0", ":36: the atom 3 has a velocity in line 35 already"),
    ("7 0.7 0 0\n", "", ":36: there are 2 velocities of 3 atoms, and none of atom 7"),
    ("7 0.7 0 0", "7 0.7 0", ":37: there are 3 columns where 4 or more are needed"),
    ("1 1 12 7", "1 1 12 8", ":41: there is no atom 8 .*for this bond"),
    ("1 bonds", "2 bonds", ":4: the header states 2 bonds"),
    ("Cl 35.45\n", "", ":19: the section 'Masses' has no mass of the type 2"),
    ("-1.0 9.0 xlo", "9.0 9.0 xlo", ": the edges of the box are 0.0"),
    ("Bonds\n", "Ellipsoids\n\n3 1 1 2 1 0 0 0\n\nBonds\n", ":41: the file has particles that are no spheres"),
    ("1 Na\n2 Cl", "Na 1\n2 Cl", ":14: 'Na' is no whole number"),
    ("Bonds\n", "Velocities\n", ":39: there is a second section 'Velocities'"),
])
def test_lammps_files_at_odds_with_themselves(tmp_path, old, new, words):
    assert LAMMPS.count(old) >= 1
    (tmp_path / "odd.data").write_text(LAMMPS.replace(old, new))
    with pytest.raises(carom.FileError, match=f"odd.data{words}"):
        carom.Simulation.from_file(tmp_path / "odd.data", radius=0.5)


EXTXYZ = """2
Lattice="10 0 0 0 10 0 0 0 10" Properties=species:S:1:pos:R:3:momenta:R:3:mass:R:1 pbc="T T T"
A 1.0 2.0 3.0 0.2 0.0 0.0 2.0
Bead 4.0 5.0 6.0 0.0 0.1 0.0 1.0
"""


def test_extended_xyz_of_any_species(tmp_path):
    (tmp_path / "own.extxyz").write_text(EXTXYZ + EXTXYZ.replace("1.0 2.0 3.0", "1.5 2.0 3.0"))
    sim = carom.Simulation.from_file(tmp_path / "own.extxyz", radius=0.5)
    assert sim.species_names == ["A", "Bead"] and sim.velocity.tolist() == [[0.1, 0, 0], [0, 0.1, 0]] and sim.mass.tolist() == [2, 1]
    assert sim.position[0].tolist() == [1.5, 2, 3] and not sim.warnings
    assert carom.Simulation.from_file(tmp_path / "own.extxyz", frame=0, radius=0.5).position[0].tolist() == [1, 2, 3]


@pytest.mark.parametrize("tilt, warned", [("6.123e-16", 0), ("2e-7", 1), ("1e-3", None)])
def test_boxes_that_are_rectangular_but_for_rounding(tmp_path, tilt, warned):
    (tmp_path / "own.extxyz").write_text(EXTXYZ.replace("0 0 10 0", f"{tilt} 0 10 {tilt}"))
    if warned is None:
        with pytest.raises(carom.UsageError, match="not rectangular"):
            carom.Simulation.from_file(tmp_path / "own.extxyz", radius=0.5)
        return
    sim = carom.Simulation.from_file(tmp_path / "own.extxyz", radius=0.5)
    assert sim.box == [10, 10, 10] and len(sim.warnings) == warned and all("taken for rounding" in text for text in sim.warnings)


def test_extended_xyz_without_a_lattice_and_in_two_dimensions(tmp_path):
    (tmp_path / "open.xyz").write_text("2\nsome words\nC 1.0 2.0 3.0\nC 4.0 5.0 7.0\n")
    sim = carom.Simulation.from_file(tmp_path / "open.xyz", radius=0.5)
    assert sim.boundary == ["open"] * 3 and sim.position.tolist() == [[1, 2, 3], [4, 5, 7]]
    (tmp_path / "odd.xyz").write_text('1\nProperties=species:S:1:pos:R:3 pbc="T T T"\nC 1.0 2.0 3.0\n')
    with pytest.raises(carom.FileError, match="odd.xyz:2: there is no Lattice"):
        carom.Simulation.from_file(tmp_path / "odd.xyz", radius=0.5)
    for properties, row in (("pos:R:2:vel:R:2", "1.0 2.0 0.5 0.25"), ("pos:R:3:vel:R:3", "1.0 2.0 0.0 0.5 0.25 0.0")):
        (tmp_path / "flat.xyz").write_text(f'1\nLattice="8 0 0 0 9 0 0 0 3" Properties={properties} pbc="T T F"\n{row}\n')
        sim = carom.Simulation.from_file(tmp_path / "flat.xyz", radius=0.5)
        assert sim.box == [8, 9] and sim.position.tolist() == [[1, 2]] and sim.velocity.tolist() == [[0.5, 0.25]]


@pytest.mark.parametrize("old, new, words", [
    ("2\n", "3\n", ":1: here must stand the number"),
    ("4.0 5.0 6.0", "4.0 5.0", ":4: there are 7 columns, and Properties names 8"),
    ("4.0 5.0", "4.0 five", ":4: '4.0 five 6.0' is no number where Properties has 'pos'"),
    ("pos:R:3:momenta", "pos:R:momenta", ":2: Properties is"),
    ("0 0 10\"", "0 10\"", ":2: .*Lattice"),
])
def test_extended_xyz_at_odds_with_itself(tmp_path, old, new, words):
    (tmp_path / "odd.extxyz").write_text(EXTXYZ.replace(old, new, 1))
    with pytest.raises(carom.FileError, match=f"odd.extxyz{words}"):
        carom.Simulation.from_file(tmp_path / "odd.extxyz", radius=0.5)


def touching_chain(edge):
    """A zigzag of touching spheres of two sizes, far from the origin, across the border of the box."""
    radius = np.array([0.5, 0.3] * 10)
    steps = np.array([[np.cos(a), np.sin(a), 0.3 * np.sin(5 * a)] for a in 0.7 * np.sin(1.3 * np.arange(19))])
    steps *= ((radius[:-1] + radius[1:]) * (1 + 1e-14) / np.linalg.norm(steps, axis=1))[:, None]
    x = np.vstack([np.zeros(3), np.cumsum(steps, axis=0)]) + edge - [7.3, 1.7, 0.1]
    sim = carom.Simulation(box=[edge] * 3, boundary="periodic")
    sim.add_particles(position=x % edge, radius=radius, velocity=np.random.default_rng(1).normal(size=(20, 3)))
    sim.integrator("free-flight")
    return sim


@pytest.mark.parametrize("edge", [20.0, 2000.0])
def test_touching_spheres_of_our_own_gsd_can_be_read_again(tmp_path, edge):
    pytest.importorskip("gsd")
    sim, file = written(tmp_path, "gsd", lambda: touching_chain(edge))
    with pytest.warns(UserWarning, match="overlap by the rounding of GSD to single precision were pushed apart"):
        back = carom.Simulation.from_file(file, frame=0)
    assert np.abs((back.position - touching_chain(edge).position + edge / 2) % edge - edge / 2).max() < 4 * np.spacing(np.float32(edge))
    back.integrator("free-flight")
    back.run(time=1)
    assert back.energy_error < 1e-14


def test_spheres_that_overlap_by_more_are_not_pushed_apart(tmp_path):
    hoomd = pytest.importorskip("gsd.hoomd")
    snapshot = hoomd.Snapshot()
    snapshot.particles.N, snapshot.configuration.box = 2, [10, 10, 10, 0, 0, 0]
    snapshot.particles.position, snapshot.particles.diameter = [[0, 0, 0], [0.999, 0, 0]], [1, 1]
    with hoomd.open(name=str(tmp_path / "own.gsd"), mode="wb") as file:
        file.append(snapshot)
    sim = carom.Simulation.from_file(tmp_path / "own.gsd")
    assert np.ptp(sim.position[:, 0]) == pytest.approx(0.999, abs=1e-7) and not sim.warnings
    sim.integrator("free-flight")
    with pytest.raises(carom.InitialStateError, match="overlap"):
        sim.run(time=1)


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


def test_a_lammps_file_as_mdanalysis_reads_it(tmp_path):
    """Where its reader keeps everything: ids in order, the style full, single precision."""
    mda = pytest.importorskip("MDAnalysis")
    rng = np.random.default_rng(5)
    rows = [f"{k + 1} {k // 2 + 1} {k % 2 + 1} {(-1) ** k * 0.5} {x} {y} {z} 0 0 0" for k, (x, y, z) in enumerate(rng.uniform(0, 9, (20, 3)))]
    speeds = [f"{k + 1} {x} {y} {z}" for k, (x, y, z) in enumerate(rng.normal(size=(20, 3)))]
    bonds = [f"{k + 1} 1 {2 * k + 1} {2 * k + 2}" for k in range(10)]
    (tmp_path / "own.data").write_text("\n".join(
        ["title", "", "20 atoms", "10 bonds", "2 atom types", "1 bond types", "0 9 xlo xhi", "0 9 ylo yhi", "0 9 zlo zhi", "", "Masses", "", "1 1.0", "2 3.0",
         "", "Atoms # full", "", *rows, "", "Velocities", "", *speeds, "", "Bonds", "", *bonds, ""]))
    sim = carom.Simulation.from_file(tmp_path / "own.data", radius=0.01)
    there = mda.Universe(str(tmp_path / "own.data"), format="DATA", convert_units=False).atoms
    order = np.argsort(there.types.astype(int), kind="stable")  # species by species
    for mine, theirs in ((sim.position, there.positions), (sim.velocity, there.velocities), (sim.mass, there.masses), (sim.charge, there.charges)):
        assert np.allclose(mine, theirs[order], atol=1e-5)
    rank = np.argsort(order)
    assert sorted(map(sorted, sim.bonds.tolist())) == sorted(sorted(rank[list(bond)]) for bond in there.universe.bonds.indices)


def test_two_dimensions_and_images_of_other_programs(tmp_path):
    (tmp_path / "flat.data").write_text("\n\n1 atoms\n1 atom types\n0 5 xlo xhi\n0 4 ylo yhi\n-0.1 0.1 zlo zhi\n\nAtoms # atomic\n\n1 1 1.0 2.0 0.0\n")
    assert carom.Simulation.from_file(tmp_path / "flat.data", radius=0.5).box == [5, 4]
    hoomd = pytest.importorskip("gsd.hoomd")
    snapshot = hoomd.Snapshot()
    snapshot.particles.N, snapshot.configuration.box = 1, [10, 8, 6, 0, 0, 0]
    snapshot.particles.position, snapshot.particles.diameter, snapshot.particles.image = [[0, 0, 0]], [1], [[2, 0, -1]]
    with hoomd.open(name=str(tmp_path / "own.gsd"), mode="wb") as file:
        file.append(snapshot)
    sim = carom.Simulation.from_file(tmp_path / "own.gsd")
    assert sim.image.tolist() == [[2, 0, -1]] and sim.unwrapped.tolist() == [[25, 4, -3]]
    (tmp_path / "thin.xyz").write_text('1\nLattice="8 0 0 0 0 0 0 0 9" pbc="T T T"\nC 1 2 3\n')
    with pytest.raises(carom.FileError, match="thin.xyz: the edges of the box are 8.0, 0.0, 9.0"):
        carom.Simulation.from_file(tmp_path / "thin.xyz", radius=0.5)
