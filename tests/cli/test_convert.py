# SPDX-License-Identifier: BSD-3-Clause
"""`carom convert`, and trajectories themselves: each file is opened by the readers of other programs."""

import os
import pathlib
import re
import shutil
import subprocess
import sys
import warnings
from xml.etree import ElementTree

import h5py
import numpy as np
import pytest

sys.path.insert(0, str(pathlib.Path(__file__).parents[2] / "tools"))
from carom_files import Trajectory
from runs import CAROM, ROUGH, SPHERES, SPRINGS, mpi_environment, mpirun, needs_carom, run, write_deck

warnings.filterwarnings("ignore", category=DeprecationWarning)
pytestmark = needs_carom

# Two species, one of them charged, in a periodic box.
ION = """
[[particles]]
name = "ion"
count = 8
temperature = 1.0
radius = 0.25
mass = 0.125
charge = -0.75
"""
SALT = SPHERES.replace("count = 108", "count = 100") + ION
ROUGH_SALT = ROUGH.replace("count = 108", "count = 100") + ION + "rotational_temperature = 0.5\ninertia = 0.6\n"
DECKS = {"springs": SPRINGS, "salt": ROUGH_SALT}


@pytest.fixture(scope="module", params=DECKS)
def trajectory(request, tmp_path_factory):
    directory = tmp_path_factory.mktemp(request.param)
    run(write_deck(directory, DECKS[request.param]), directory / "out")
    with Trajectory(directory / "out") as frames:
        assert len(frames) > 5 and (request.param == "springs" or images(frames).any())
        yield frames


def convert(trajectory, to, *arguments, code=0):
    done = subprocess.run([CAROM, "convert", str(trajectory.path.parent), "--to", to, *arguments], capture_output=True, text=True)
    assert done.returncode == code, done.stderr
    return done.stdout if code == 0 else done.stderr


def whole(trajectory, name, frame):
    """Reads a series of the file with its three columns."""
    return trajectory._group[name]["value"][frame]


def rough(trajectory):
    return "angular_velocity" in trajectory._group


def images(trajectory):
    return trajectory._group["image/value"][:]


def bonds(trajectory):
    group = trajectory._file["parameters/vmd_structure"]
    return np.stack([group["bond_from"][:], group["bond_to"][:]], axis=1) if "bond_from" in group else np.zeros((0, 2), int)


def test_ase_reads_extended_xyz(trajectory):
    ase_io = pytest.importorskip("ase.io")
    convert(trajectory, "extxyz")
    read = ase_io.read(trajectory.path.with_suffix(".extxyz"), index=":")
    assert len(read) == len(trajectory)
    for frame, atoms in enumerate(read):
        assert np.array_equal(atoms.positions, whole(trajectory, "position", frame))
        assert np.array_equal(atoms.arrays["velo"], whole(trajectory, "velocity", frame))
        assert np.array_equal(atoms.arrays["image"], whole(trajectory, "image", frame))
        assert ("angular_velocity" in atoms.arrays) == rough(trajectory)
        assert not rough(trajectory) or np.array_equal(atoms.arrays["angular_velocity"], whole(trajectory, "angular_velocity", frame))
        assert np.array_equal(atoms.arrays["radius"], trajectory.radius)
        assert np.array_equal(atoms.arrays["mass"], trajectory.mass)
        assert np.array_equal(atoms.get_initial_charges(), trajectory._group["charge"][:])
        assert np.array_equal(atoms.cell[:], trajectory._group["box/edges/value"][frame])
        assert list(atoms.pbc[:trajectory.dimension]) == list(trajectory.periodic)
        assert (atoms.info["Time"], atoms.info["Step"]) == (trajectory.time[frame], trajectory.step[frame])
    assert read[0].info["species_names"] == ",".join(trajectory.species_names)
    assert np.array_equal(read[0].numbers - 1, trajectory.species)  # symbols represent the names


def test_names_that_are_elements_stay(tmp_path):
    ase_io = pytest.importorskip("ase.io")
    run(write_deck(tmp_path, SALT.replace('"sphere"', '"Ar"').replace('"ion"', '"Kr"')), tmp_path / "out", ["run.end_time=0.5"])
    with Trajectory(tmp_path / "out") as frames:
        convert(frames, "extxyz", "--frames", "-1", "-o", str(tmp_path / "last.xyz"))
    assert ase_io.read(tmp_path / "last.xyz").get_chemical_symbols() == ["Ar"] * 100 + ["Kr"] * 8


def test_gsd_reads_gsd(trajectory):
    gsd = pytest.importorskip("gsd.hoomd")
    convert(trajectory, "gsd", "--frames", "1::2")
    chosen = range(1, len(trajectory), 2)
    flat, single = trajectory.dimension == 2, np.float32
    with gsd.open(str(trajectory.path.with_suffix(".gsd")), "rb") as read:
        assert len(read) == len(chosen) and read.file.schema == "hoomd" and read.file.application == "carom"
        for snapshot, frame in zip(read, chosen):
            edges = np.diag(trajectory._group["box/edges/value"][frame])
            middle = edges / 2 * [1, 1, 0 if flat else 1]
            assert np.array_equal(snapshot.particles.position, (whole(trajectory, "position", frame) - middle).astype(single))
            assert np.array_equal(snapshot.particles.velocity, whole(trajectory, "velocity", frame).astype(single))
            assert np.array_equal(snapshot.particles.image, whole(trajectory, "image", frame))
            assert np.array_equal(snapshot.configuration.box, (*edges[:2].astype(single), 0 if flat else single(edges[2]), 0, 0, 0))
            assert (snapshot.configuration.step, snapshot.configuration.dimensions) == (trajectory.step[frame], trajectory.dimension)
            p = snapshot.particles
            if rough(trajectory):  # I = kappa m r^2, of the salt 0.4 and 0.6
                moment = np.where(trajectory.species == 0, 0.4, 0.6) * trajectory.mass * trajectory.radius**2
                assert np.array_equal(p.moment_inertia, np.repeat(moment, 3).reshape(-1, 3).astype(single))
                assert (p.orientation == [1, 0, 0, 0]).all() and (p.angmom[:, 0] == 0).all()
                assert p.angmom[:, 1:] == pytest.approx(2 * moment[:, None] * whole(trajectory, "angular_velocity", frame), rel=1e-6)
            else:
                assert not p.angmom.any() and not p.moment_inertia.any()
            assert p.types == trajectory.species_names and np.array_equal(p.typeid, trajectory.species)
            for name, values in (("mass", trajectory.mass), ("diameter", 2 * trajectory.radius),
                                 ("charge", trajectory._group["charge"][:])):
                assert np.array_equal(getattr(p, name), values.astype(single)), name
            pairs = bonds(trajectory) - 1
            assert snapshot.bonds.N == len(pairs) and (len(pairs) == 0 or np.array_equal(snapshot.bonds.group, pairs))


def test_lammps_reads_its_data(trajectory, tmp_path):
    if not shutil.which("lmp"):
        pytest.skip("needs LAMMPS: apt install lammps")
    data, dump = tmp_path / "last.data", tmp_path / "dump"
    said = convert(trajectory, "lammps-data", "-o", str(data))
    script = [line.strip() for line in re.search("In LAMMPS: (.*)", said)[1].split(";")]
    paired = len(bonds(trajectory)) > 0
    # LAMMPS's 2-D runs are periodic along z, and pair style zero needs a cutoff.
    script += ["pair_style zero 2.5", "pair_coeff * *"] + (["bond_style zero", "bond_coeff *"] if paired else [])
    script += ["comm_modify cutoff 4.0", "compute b all property/local batom1 batom2"] if paired else []
    columns = "id type x y z vx vy vz ix iy iz omegax omegay omegaz radius mass" + (" q" if "charge" in said else "")
    script += [f"dump 1 all custom 1 {dump} {columns}", "dump_modify 1 sort id format float %.17g", "run 0"]
    if paired:
        script[-1:] = [f"dump 2 all local 1 {dump}.bonds c_b[1] c_b[2]", "run 0"]
    (tmp_path / "in").write_text("\n".join(script) + "\n")
    done = subprocess.run(["lmp", "-in", "in", "-log", "none"], cwd=tmp_path, capture_output=True, text=True, env=mpi_environment())
    assert done.returncode == 0, done.stdout + done.stderr
    lines = dump.read_text().splitlines()
    frame = len(trajectory) - 1
    edges = np.diag(trajectory._group["box/edges/value"][frame])
    box = np.array([line.split() for line in lines[5:8]], dtype=float)
    flat = trajectory.dimension == 2
    assert np.array_equal(box, [[0, edges[0]], [0, edges[1]], [-0.5, 0.5] if flat else [0, edges[2]]])
    assert lines[4].split()[-3:-1] == ["pp" if periodic else "ff" for periodic in trajectory.periodic[:2]]
    read = dict(zip(columns.split(), np.array([line.split() for line in lines[9:]], dtype=float).T))
    assert np.array_equal(read["type"], trajectory.species + 1)
    for name, series in (("", "position"), ("v", "velocity"), ("i", "image")):
        axes = ["x", "y", "z"] if name == "" else [name + axis for axis in "xyz"]
        assert np.array_equal(np.stack([read[axis] for axis in axes], axis=1), whole(trajectory, series, frame)), series
    spin = np.stack([read["omega" + axis] for axis in "xyz"], axis=1)
    assert np.array_equal(spin, whole(trajectory, "angular_velocity", frame)) if rough(trajectory) else not spin.any()
    assert np.array_equal(read["radius"], trajectory.radius)
    assert read["mass"] == pytest.approx(trajectory.mass, rel=1e-14)  # LAMMPS computes it from the density
    if "q" in read:
        assert np.array_equal(read["q"], trajectory._group["charge"][:])
    if paired:
        pairs = [line.split() for line in pathlib.Path(f"{dump}.bonds").read_text().splitlines()[9:]]
        assert {tuple(sorted(map(int, pair))) for pair in pairs} == {tuple(pair) for pair in bonds(trajectory)}


PARAVIEW_READ = """
import sys
import numpy as np
from paraview import servermanager, simple
from vtkmodules.util.numpy_support import vtk_to_numpy
reader = simple.OpenDataFile(sys.argv[1]) if sys.argv[3] == "xdmf" else simple.XDMFReader(FileNames=[sys.argv[1]])
reader.UpdatePipelineInformation()
found = {}
for k, time in enumerate(reader.TimestepValues):
    reader.UpdatePipeline(time)
    grid = servermanager.Fetch(reader)
    while hasattr(grid, "GetBlock"):
        grid = grid.GetBlock(0)
    found[f"time/{k}"] = time
    found[f"position/{k}"] = vtk_to_numpy(grid.GetPoints().GetData())
    for name in ("velocity", "image", "angular_velocity", "radius", "mass", "charge", "species"):
        if grid.GetPointData().HasArray(name):
            found[f"{name}/{k}"] = vtk_to_numpy(grid.GetPointData().GetArray(name))
np.savez(sys.argv[2], **found)
"""


@pytest.mark.parametrize("form", ["xdmf", "xdmf2"])
def test_paraview_reads_xdmf(trajectory, tmp_path, form):
    """Debian's VTK has no reader of XDMF, and its python3-xdmf cannot be loaded: this needs ParaView. Its reader of XDMF 3
    looks for the trajectory in the wrong folder if the name of the file has no folder."""
    if not shutil.which("pvpython"):
        pytest.skip("needs ParaView: apt install python3-paraview")
    convert(trajectory, form, "--frames", "2:6:3")
    file = trajectory.path.with_suffix(".xmf")
    (tmp_path / "read.py").write_text(PARAVIEW_READ)
    done = subprocess.run(["pvpython", "--force-offscreen-rendering", tmp_path / "read.py", f"./{file.name}", tmp_path / "read.npz", form],
                          cwd=file.parent, capture_output=True, text=True)
    assert done.returncode == 0 and (tmp_path / "read.npz").exists(), done.stdout + done.stderr
    read = np.load(tmp_path / "read.npz")
    assert [read[f"time/{k}"] for k in range(2)] == list(trajectory.time[[2, 5]]) and "time/2" not in read
    for k, frame in enumerate((2, 5)):
        for name in ("position", "velocity", "image", *(["angular_velocity"] if rough(trajectory) else [])):
            assert np.array_equal(read[f"{name}/{k}"], whole(trajectory, name, frame)), name
        for name in ("radius", "mass", "charge", "species"):
            assert np.array_equal(read[f"{name}/{k}"], trajectory._group[name][:]), name


@pytest.mark.parametrize("form", ["xdmf", "xdmf2"])
def test_what_xdmf_refers_to_is_there(trajectory, form):
    """Reads every data set that the file names with h5py and compares the shapes."""
    convert(trajectory, form, "-o", str(trajectory.path.parent / "all.xmf"))
    tree = ElementTree.parse(trajectory.path.parent / "all.xmf")
    assert [float(time.get("Value")) for time in tree.iter("Time")] == list(trajectory.time)
    sizes = {("Float", 8): "f8", ("Int", 4): "i4", ("UInt", 4): "u4"}
    items = [item for item in tree.iter("DataItem") if item.get("Format") == "HDF"]
    assert len(items) == (9 if rough(trajectory) else 8) * len(trajectory)
    for item in items:
        name, place, *selection = item.text.replace("|", ":").split(":")
        assert name == trajectory.path.name
        found = trajectory._file[place]
        shape = selection[3] if selection else item.get("Dimensions")
        assert list(found.shape) == [int(size) for size in shape.split()]
        assert found.dtype == sizes[item.get("NumberType"), int(item.get("Precision"))]
    slabs = [item[0].text.split() for item in tree.iter("DataItem") if item.get("ItemType") == "HyperSlab"] if form == "xdmf2" else \
        [" ".join(item.text.split("|")[1].split(":")[:3]).split() for item in items if "|" in item.text]
    n = str(len(trajectory.species))
    assert slabs == [[str(frame), "0", "0", "1", "1", "1", "1", n, "3"] for frame in range(len(trajectory)) for _ in range(4 if rough(trajectory) else 3)]


@pytest.mark.parametrize("length, factor", [("Angstrom", 1), ("nm", 10)])
def test_mdanalysis_opens_a_file_with_units_unaided(tmp_path, length, factor):
    MDAnalysis = pytest.importorskip("MDAnalysis")
    units = f'units = {{ length = "{length}", time = "ps" }}'
    run(write_deck(tmp_path, SALT.replace("[output]", "[output]\n" + units)), tmp_path / "units", ["run.end_time=1.0"])
    run(write_deck(tmp_path, SALT), tmp_path / "none", ["run.end_time=1.0"])
    assert f'units = {{ length = "{length}", time = "ps" }}' in (tmp_path / "units" / "deck.toml").read_text()
    universe = MDAnalysis.Universe(str(tmp_path / "units" / "trajectory.h5md"))
    with Trajectory(tmp_path / "units") as named, Trajectory(tmp_path / "none") as reduced:
        assert len(universe.trajectory) == len(named)
        for frame, now in enumerate(universe.trajectory):
            for name, read in (("position", now.positions), ("velocity", now.velocities)):
                assert np.array_equal(whole(named, name, frame), whole(reduced, name, frame))
                assert read == pytest.approx(factor * whole(named, name, frame), rel=1e-6, abs=1e-6)
            assert now.time == pytest.approx(named.time[frame])
            assert "unit" not in reduced._group["position/value"].attrs
    done = subprocess.run([sys.executable, pathlib.Path(__file__).parents[2] / "tools" / "check_h5md.py", tmp_path / "units"],
                          capture_output=True, text=True)
    assert done.returncode == 0, done.stdout


def test_units_that_are_wrong_are_named(tmp_path):
    bad = SALT.replace("[output]", '[output]\nunits = { length = "inch", tim = "ps" }')
    error = run(write_deck(tmp_path, bad), tmp_path / "out", code=2).stderr
    assert re.search(r"input.toml:\d+:\d+: error: 'length' cannot be 'inch'", error)
    assert re.search(r"input.toml:\d+:\d+: error: 'units' has no 'time'", error)
    assert re.search(r"input.toml:\d+:\d+: error: unknown key 'tim' in 'units'; did you mean 'time'", error)
    assert "'units' has the wrong type" in run(write_deck(tmp_path, SALT), tmp_path / "out", ["output.units=nm"], code=2).stderr


@pytest.mark.parametrize("ranks", [1, 2])
def test_a_trajectory_has_what_vmd_takes(tmp_path, ranks):
    """The names, kinds and shapes that h5mdplugin.c of github.com/h5md/VMD-h5mdplugin reads."""
    chain = SALT.replace("[integrator]\ntype = \"free-flight\"", """[[interaction]]
type = "harmonic-bond"
pairs = [[3, 1], [1, 107], [0, 5]]
stiffness = 1.0
rest_length = 1.0
[[interaction]]
type = "harmonic-bond"
pairs = [[5, 0]]
stiffness = 0.5
rest_length = 1.0
[integrator]
type = "psa"
step = 0.01""")
    arguments = [CAROM, "run", write_deck(tmp_path, chain), "-o", tmp_path / "out", "--quiet", "--set", "run.end_time=0.1"]
    if ranks > 1:
        mpirun(ranks, arguments)
    else:
        subprocess.run(arguments, check=True)
    with h5py.File(tmp_path / "out" / "trajectory.h5md") as file:
        particles, structure = file["particles/trajectory"], file["parameters/vmd_structure"]
        for name in ("species", "mass", "charge"):
            assert particles[name].shape == (108,)
        assert particles["image/value"].shape == particles["position/value"].shape
        present = np.unique(particles["species"][:])
        assert np.array_equal(structure["indexOfSpecies"][:], present)
        for name in ("name", "type"):
            assert list(structure[name][:]) == [b"sphere", b"ion"] and structure[name].dtype.itemsize < 16
        assert list(structure["radius"][:]) == [0.5, 0.25]
        assert [tuple(pair) for pair in zip(structure["bond_from"][:], structure["bond_to"][:])] == [(1, 6), (2, 4), (2, 108)]


def test_a_choice_of_frames(trajectory):
    count = len(trajectory)
    times = lambda choice: [line.split("Time=")[1].split()[0] for line in trajectory.path.with_suffix(".extxyz").read_text().splitlines()
                            if "Time=" in line] if convert(trajectory, "extxyz", "--frames", choice) else []
    everything = times(":")
    assert len(everything) == count and list(map(float, everything)) == list(trajectory.time)
    for choice, slice_ in (("2:", slice(2, None)), (":-2", slice(None, -2)), ("-3:", slice(-3, None)), ("1:999:3", slice(1, 999, 3))):
        assert times(choice) == everything[slice_], choice
    assert times("-1") == everything[-1:]
    for choice in ("99", "-99", "x", "", "3:3", "1:2:0", "1:2:3:4", "2:1"):
        if choice:
            error = convert(trajectory, "extxyz", "--frames", choice, code=2)
            assert error.startswith(f"--frames {choice}: error: ") and len(error.splitlines()) == 1


def test_an_open_box_and_mixed_radii(tmp_path):
    """Each particle has its own size in every format; an open direction extends as far as the particles, or as the box."""
    text = SPRINGS.replace('["wall", "wall"]', '["open", "wall"]').replace("radius = 0.5", "radius = [0.5, 0.2, 0.3, 0.4]")
    text = text[:text.index("[[interaction]]")] + text[text.index("[integrator]"):]
    fast = text.replace("[[0.3, 0.1], [1.1, -0.4], [-0.9, 0.7], [0.2, -0.3]]", "[[-3.0, 0.1], [-5.0, -0.4], [4.0, 0.7], [5.0, -0.3]]")
    run(write_deck(tmp_path, fast), tmp_path / "out", ["integrator.type=cva", "run.steps=50", "output.frame_interval=0.25"])
    outside = 0
    with Trajectory(tmp_path / "out") as frames:
        assert list(frames.radius) == [0.5, 0.2, 0.3, 0.4]
        for n in range(len(frames)):
            x = whole(frames, "position", n)
            convert(frames, "lammps-data", "--frames", str(n), "-o", str(tmp_path / "data"))
            data = (tmp_path / "data").read_text()
            bounds = [tuple(map(float, re.search(rf"^(\S+) (\S+) {axis}lo {axis}hi$", data, re.M).groups())) for axis in "xyz"]
            assert bounds == [(min(0, *(x[:, 0] - frames.radius)), max(9, *(x[:, 0] + frames.radius))), (0, 5), (-0.5, 0.5)]
            outside += bounds[0][0] < 0 and bounds[0][1] > 9
            atoms = np.array([line.split() for line in re.search(r"Atoms # sphere\n\n((?:.+\n)+)", data)[1].splitlines()], float)
            assert np.array_equal(atoms[:, 2], 2 * frames.radius) and np.array_equal(atoms[:, 4:7], x)
            assert atoms[:, 3] == pytest.approx(frames.mass / (4 / 3 * np.pi * frames.radius**3), rel=1e-14)
        convert(frames, "extxyz", "-o", str(tmp_path / "xyz"))
        rows = [line.split() for line in (tmp_path / "xyz").read_text().splitlines() if line.startswith("H ")]
        assert [float(row[7]) for row in rows] == list(frames.radius) * len(frames)
        convert(frames, "gsd", "-o", str(tmp_path / "gsd"))
        assert np.array(2 * frames.radius, "f4").tobytes() in (tmp_path / "gsd").read_bytes()
    assert 0 < outside < len(frames.time)


def test_links_and_pipes_are_written_to(trajectory, tmp_path):
    """`convert -o` and `view --export` write to links and pipes; if the file goes to standard output, messages go to stderr."""
    plain, target, link, pipe = (tmp_path / name for name in ("plain", "target", "link", "pipe"))
    export = [CAROM, "view", str(trajectory.path.parent), "--export"]
    commands = [[CAROM, "convert", str(trajectory.path), "--to", to, "-o"] for to in ("extxyz", "gsd")] + [export]
    link.symlink_to("target")
    os.mkfifo(pipe)
    for command in commands:
        subprocess.run([*command, str(plain)], check=True, capture_output=True)
        target.unlink(missing_ok=True)
        for text in (None, "an older file"):
            if text:
                target.write_text(text)
            subprocess.run([*command, str(link)], check=True, capture_output=True)
            assert link.is_symlink() and target.read_bytes() == plain.read_bytes()
        writer = subprocess.Popen([*command, str(pipe)], stdout=subprocess.PIPE)
        assert pipe.read_bytes() == plain.read_bytes() and pipe.is_fifo()
        assert writer.communicate()[0] != b"" and writer.returncode == 0
        done = subprocess.run([*command, "/dev/stdout"], check=True, capture_output=True)
        assert done.stdout == plain.read_bytes() and b"frames" in done.stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == ["link", "pipe", "plain", "target"]


def test_what_cannot_be_converted(trajectory, tmp_path):
    assert "takes one frame" in convert(trajectory, "lammps-data", "--frames", ":", code=2)
    assert "is the trajectory itself" in convert(trajectory, "gsd", "-o", str(trajectory.path), code=2)
    before = trajectory.path.stat().st_size
    assert "cannot" in convert(trajectory, "gsd", "-o", str(tmp_path / "missing" / "a.gsd"), code=5)
    convert(trajectory, "pdb", code=2)
    assert trajectory.path.stat().st_size == before and not list(trajectory.path.parent.glob("*.part"))
    text = tmp_path / "text"
    text.write_text("no HDF5")
    for path in (text, tmp_path, tmp_path / "nothing"):
        done = subprocess.run([CAROM, "convert", str(path), "--to", "gsd"], capture_output=True, text=True)
        assert done.returncode == 5 and len(done.stderr.splitlines()) == 1, done.stderr
