# SPDX-License-Identifier: BSD-3-Clause
"""The Python tools against files with known contents."""

import fcntl
import re
import subprocess
import sys
import tomllib

import h5py
import matplotlib.pyplot as plt
import numpy as np
import pytest

from runs import CAROM, ROOT, needs_carom

sys.path.insert(0, str(ROOT / "tools"))

import check_h5md
import compare
import movie
import plot_energy
import plot_msd
import plot_profile
import plot_rdf
import plot_sk
import plot_transport
from carom_files import Trajectory, toml_text
from synthetic_run import write_run


def make_run(directory, dimension=2, boundary="periodic", particles=20, frames=12, **more):
    """Straight flights of points from random positions in a box of unequal edges."""
    random = np.random.default_rng(7)
    edges = np.array([4.0, 5.0, 6.0])[:dimension]
    v = np.tile(random.normal(size=(particles, dimension)), (frames, 1, 1))
    x = random.uniform(size=(particles, dimension)) * edges + 0.5 * np.arange(frames)[:, None, None] * v
    if boundary == "periodic":
        more["image"] = np.floor(x / edges).astype("i4")
        x = x - more["image"] * edges
    else:
        x = np.clip(x, 0.1, edges - 0.1)
    total = 1.0 + 1e-3 * np.sin(np.arange(frames))
    write_run(directory, total, x=x, v=v, edges=edges, boundary=[boundary] * dimension, **more)
    return directory


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("boundary", ["periodic", "wall", "open"])
def test_a_sound_file_conforms(tmp_path, dimension, boundary):
    assert check_h5md.violations(make_run(tmp_path / "run", dimension, boundary)) == []


def replace(file, name, value):
    del file[name]
    file[name] = value


P = "particles/trajectory"
DEFECTS = {
    "version": lambda f: f["h5md"].attrs.modify("version", np.array([1, 0], dtype="i4")),
    "/h5md/author": lambda f: f.__delitem__("h5md/author"),
    "variable length": lambda f: f["parameters"].attrs.__setitem__("note", "hello"),
    "'unit'": lambda f: f[f"{P}/position/value"].attrs.__setitem__("unit", np.bytes_("nm")),
    "one group": lambda f: f.create_group("particles/other"),
    "[3]": lambda f: replace(f, f"{P}/position/value", f[f"{P}/position/value"][:, :, :2]),
    "double precision": lambda f: replace(f, f"{P}/position/value", f[f"{P}/position/value"][:].astype("f4")),
    "velocity: shape": lambda f: replace(f, f"{P}/velocity/value", f[f"{P}/velocity/value"][:, :5]),
    "/particles/trajectory/image": lambda f: f.__delitem__(f"{P}/image"),
    "radius: must be": lambda f: replace(f, f"{P}/radius", np.ones(3)),
    "order of ids": lambda f: replace(f, f"{P}/id", np.arange(20)[::-1]),
    "hard link": lambda f: replace(f, f"{P}/box/edges/time", f[f"{P}/position/time"][:]),
    "[3][3]": lambda f: replace(f, f"{P}/box/edges/value", f[f"{P}/box/edges/value"][:, 0]),
    "'periodic' or 'none'": lambda f: f[f"{P}/box"].attrs.modify("boundary", np.array([b"wall"] * 3)),
    "dimension must be 3": lambda f: f[f"{P}/box"].attrs.modify("dimension", np.int32(2)),
    "must rise": lambda f: f[f"{P}/position/time"].write_direct(np.zeros(12)),
    "explicit": lambda f: replace(f, f"{P}/velocity/step", np.int64(1)),
    "differ in length": lambda f: replace(f, f"{P}/velocity/step", np.arange(5)),
    "not finite": lambda f: f[f"{P}/position/value"].__setitem__((3, 2, 1), np.nan),
    "outside [0, edge)": lambda f: f[f"{P}/position/value"].__setitem__((3, 2, 1), 5.0),
    "position along z must be 0": lambda f: f[f"{P}/position/value"].__setitem__((3, 2, 2), 0.5),
    "edge along z must be 1": lambda f: f[f"{P}/box/edges/value"].__setitem__((0, 2, 2), 2.0),
    "diagonal": lambda f: f[f"{P}/box/edges/value"].__setitem__((0, 0, 1), 2.0),
    "flat": lambda f: f["observables/kinetic_energy"].create_group("more"),
    "one value a frame": lambda f: replace(f, "observables/kinetic_energy/step", np.arange(12) + 1),
    "/parameters/dimension": lambda f: f.__delitem__("parameters/dimension"),
    "not a deck": lambda f: replace(f, "parameters/deck", np.bytes_("nothing")),
}


@pytest.mark.parametrize("symptom", DEFECTS)
def test_each_defect_is_found(tmp_path, symptom):
    run = make_run(tmp_path / "run")
    with h5py.File(run / "trajectory.h5md", "r+") as file:
        DEFECTS[symptom](file)
    found = check_h5md.violations(run, with_mdanalysis=False)
    assert any(symptom in line for line in found), found


def test_a_sphere_over_a_wall_is_found(tmp_path):
    run = make_run(tmp_path / "run", boundary="wall")
    with h5py.File(run / "trajectory.h5md", "r+") as file:
        file[f"{P}/position/value"][4, 3, 0] = 0.1 - 1e-9
    assert any("over the wall along x" in line for line in check_h5md.violations(run, with_mdanalysis=False))


def test_every_missing_object_is_found(tmp_path):
    run = make_run(tmp_path / "run", boundary="wall", frames=2)
    sound, names = (run / "trajectory.h5md").read_bytes(), []
    with h5py.File(run / "trajectory.h5md", "r") as file:
        file.visit(names.append)
    assert len(names) > 30
    names.remove("observables/kinetic_energy")  # no observable is required
    for name in names:
        (run / "trajectory.h5md").write_bytes(sound)
        with h5py.File(run / "trajectory.h5md", "r+") as file:
            # visit() gives one name of a linked data set; its other names remain.
            del file[name]
        assert check_h5md.violations(run, with_mdanalysis=False), name


def test_check_h5md_exit_codes(tmp_path, capsys):
    run = make_run(tmp_path / "run")
    assert check_h5md.main([str(run)]) == 0
    with h5py.File(run / "trajectory.h5md", "r+") as file:
        del file["observables"]
    assert check_h5md.main([str(run), "--no-mdanalysis"]) == 1
    assert "/observables" in capsys.readouterr().out


def corrupt(path):
    """Changes bytes in the middle, in tables of the file."""
    data = bytearray(path.read_bytes())
    start, end = len(data) // 4, len(data) // 2
    data[start:end] = b"\xa5" * (end - start)
    path.write_bytes(data)


def foreign(path):
    with h5py.File(path, "w") as file:
        file["particles/trajectory"] = np.zeros(3)
        file["events"] = np.zeros(3)


DAMAGES = {
    "missing": lambda path: path.unlink(),
    "empty": lambda path: path.write_bytes(b""),
    "text": lambda path: path.write_text("no HDF5\n1,2\n"),
    "bytes": lambda path: path.write_bytes(bytes(range(256))),
    "truncated": lambda path: path.write_bytes(path.read_bytes()[:len(path.read_bytes()) // 2]),
    "corrupt": corrupt,
    "foreign": foreign,
    "a directory": lambda path: (path.unlink(), path.mkdir()),
}
READERS = {
    "plot_rdf": (plot_rdf.main, "trajectory.h5md", []),
    "plot_msd": (plot_msd.main, "trajectory.h5md", []),
    "movie": (movie.main, "trajectory.h5md", []),
    "check_h5md": (check_h5md.main, "trajectory.h5md", ["--no-mdanalysis"]),
    "compare": (compare.main, "trajectory.h5md", ["sound"]),
    "compare thermo": (compare.main, "thermo.csv", ["sound"]),
    "plot_energy": (plot_energy.main, "thermo.csv", []),
    "plot_energy summary": (plot_energy.main, "summary.json", []),
}


@pytest.mark.parametrize("damage", DAMAGES)
@pytest.mark.parametrize("tool", READERS)
def test_a_damaged_file_is_one_line(tmp_path, monkeypatch, capsys, tool, damage):
    monkeypatch.chdir(tmp_path)
    main, name, arguments = READERS[tool]
    if (tool, damage) == ("plot_energy", "truncated"):
        return  # it is shorter, and its rows are complete
    make_run(tmp_path / "run"), make_run(tmp_path / "sound")
    DAMAGES[damage](tmp_path / "run" / name)
    with pytest.raises(SystemExit) as end:
        code = main(["run", *arguments])
        # A foreign file that can be read is a violation, or a difference.
        assert damage in ("foreign", "text", "corrupt", "truncated") and code == 1
        raise SystemExit(f"run/{name}: {capsys.readouterr().out.splitlines()[0]}")
    assert isinstance(end.value.code, str) and "\n" not in end.value.code, end.value.code
    assert end.value.code.startswith("run"), end.value.code


def test_a_file_that_is_being_written_can_be_read(tmp_path):
    make_run(tmp_path / "run")
    path = tmp_path / "run" / "trajectory.h5md"
    with open(path, "rb") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        for journal in (False, True):  # an unfinished run, before and after its second flush
            if journal:
                path.with_name("trajectory.h5md.journal").write_bytes(b"")
            assert not plot_rdf.main([str(tmp_path / "run"), "-o", str(tmp_path / "rdf.png")])
            if CAROM:
                assert subprocess.run([CAROM, "info", str(path)], capture_output=True, text=True).returncode == 0
                done = subprocess.run([CAROM, "convert", str(path), "--to", "extxyz"], capture_output=True, text=True)
                assert done.returncode == 5 and "a process is writing this file" in done.stderr


def test_a_picture_that_cannot_be_written_is_one_line(tmp_path):
    run = str(make_run(tmp_path / "run"))
    for tool, name in ((plot_rdf, "g.png"), (plot_msd, "msd.png"), (plot_energy, "energy.png"), (movie, "movie.gif")):
        with pytest.raises(SystemExit, match="^[^\n]*nowhere[^\n]*: No such file or directory$"):
            tool.main([run, "-o", str(tmp_path / "nowhere" / name)])
    with pytest.raises(SystemExit, match="^[^\n]*energy.xyz: Format 'xyz' is not supported[^\n]*$"):
        plot_energy.main([run, "-o", str(tmp_path / "energy.xyz")])


class Still:
    """The first frame of a moving picture."""

    def __init__(self, figure, draw, *_, **__):
        draw(0)
        self.figure = figure

    def save(self, file, **_):
        self.figure.savefig(file)


def test_pictures_say_what_they_show(tmp_path, monkeypatch):
    """Units on every axis, a title, and the command below."""
    shown = []
    monkeypatch.setattr(plt.Figure, "savefig", lambda figure, *_, **__: shown.append(figure))
    monkeypatch.setattr(movie, "FuncAnimation", Still)
    monkeypatch.setattr(plt, "close", lambda figure: None)
    run = str(make_run(tmp_path / "run"))
    for tool, title in ((plot_rdf, "radial distribution function"), (plot_energy, "Energy error"), (movie, "synthetic\nt = 0 [time]")):
        monkeypatch.setattr(sys, "argv", [f"{tool.__name__}.py", "run", "-o", "picture.png"])
        tool.main([run])
        figure = shown.pop()
        axes = figure.axes[0]
        assert title in axes.get_title() and "[" in axes.get_xlabel() and ("[" in axes.get_ylabel() or tool is plot_rdf)
        assert figure._supxlabel.get_text() == f"tools/{tool.__name__}.py run"


@needs_carom
def test_as_a_program_too(tmp_path):
    (tmp_path / "text").write_text("no HDF5")
    done = subprocess.run([sys.executable, ROOT / "tools" / "check_h5md.py", tmp_path / "text"], capture_output=True, text=True)
    assert done.returncode == 1 and done.stdout == "" and len(done.stderr.splitlines()) == 1
    for damage in DAMAGES:
        path = make_run(tmp_path / "runs" / damage) / "trajectory.h5md"
        DAMAGES[damage](path)
        info = subprocess.run([CAROM, "info", str(path)], capture_output=True, text=True)
        assert info.returncode == 5 and len(info.stderr.splitlines()) == 1 and str(path) in info.stderr, info


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("boundary", ["periodic", "wall"])
def test_g_of_r_of_an_ideal_gas_is_one(tmp_path, dimension, boundary):
    random = np.random.default_rng(11)
    edges = np.array([3.0, 4.0, 5.0])[:dimension]
    inside = (0.0, edges) if boundary == "periodic" else (0.1, edges - 0.1)
    x = random.uniform(*inside, size=(40, 400, dimension))
    names, species = ("a", "b"), np.repeat([0, 1], 200).astype("i4")
    write_run(tmp_path, np.ones(40), x=x, v=x, edges=edges, boundary=[boundary] * dimension, species=species, names=names)
    with Trajectory(tmp_path) as trajectory:
        for pair in (None, ["a", "b"], ["b", "b"]):
            r, g, error = plot_rdf.radial_distribution(trajectory, bins=10, species=pair)
            assert r[-1] > (1.3 if boundary == "periodic" else 2.5)
            assert g[2:] == pytest.approx(1.0, abs=0.03)
            assert np.sqrt(np.mean(((g[2:] - 1) / error[2:]) ** 2)) < 4  # the error from four parts is itself uncertain
            assert np.all(error[2:] < 0.03)


def test_g_of_r_finds_a_lattice(tmp_path):
    square = np.stack(np.meshgrid(np.arange(8.0), np.arange(8.0)), axis=-1).reshape(1, -1, 2)
    write_run(tmp_path, [1.0], x=square, v=square, edges=np.array([8.0, 8.0]), boundary=["periodic"] * 2)
    with Trajectory(tmp_path) as trajectory:
        r, g, error = plot_rdf.radial_distribution(trajectory, bins=40)
    assert np.isnan(error).all()  # one frame
    # 4 neighbours at 1, 4 at √2: g = 4 / (63/64 · 2πr·dr), r the middle of their bins.
    peak = {k: 4 / (63 / 64 * np.pi * (((k + 1) * 0.1) ** 2 - (k * 0.1) ** 2)) for k in (10, 14)}
    assert np.flatnonzero(g)[0] == 10
    assert g[[10, 14]] == pytest.approx(list(peak.values()))
    assert not g[[11, 12, 13]].any()


def test_msd_of_straight_flight(tmp_path):
    run = make_run(tmp_path / "run", dimension=3, frames=30)
    with Trajectory(run) as trajectory:
        lag, windows, msd, of_blocks = plot_msd.mean_squared_displacement(trajectory)
        v2 = np.mean(np.sum(trajectory.velocity(0) ** 2, axis=1))
    assert len(lag) == 15
    assert msd == pytest.approx(v2 * lag**2)
    assert of_blocks.shape == (4, 15) and of_blocks[0] == pytest.approx(msd)
    assert plot_msd.diffusion_coefficient(lag, windows, 6 * lag, 3) == pytest.approx(1.0)


def test_tables_of_a_run_are_drawn(tmp_path, capsys):
    (tmp_path / "rdf.csv").write_text("r,g,g_a_a,g_a_b,g_b_b\n" + "".join(f"{r},1,2,{r},nan\n" for r in (0.5, 1.5, 2.5)))
    r, curves = plot_rdf.curves_of_table(tmp_path / "rdf.csv", ["b", "a"])
    assert list(curves) == ["g_a_b"] and (curves["g_a_b"] == r).all()
    assert list(plot_rdf.curves_of_table(tmp_path / "rdf.csv")[1]) == ["g", "g_a_a", "g_a_b", "g_b_b"]
    with pytest.raises(SystemExit):
        plot_rdf.curves_of_table(tmp_path / "rdf.csv", ["a", "c"])
    (tmp_path / "msd.csv").write_text("time,origins,msd,msd_a\n" + "".join(f"{t},9,{4 * t},{8 * t}\n" for t in range(1, 9)))
    before = (tmp_path / "rdf.csv").read_text()
    plot_rdf.main([str(tmp_path / "rdf.csv")])
    plot_msd.main([str(tmp_path / "msd.csv"), "--dimension", "2"])
    assert "msd: D = 1\nmsd_a: D = 2\n" in capsys.readouterr().out
    for name in ("rdf.png", "msd.png"):
        assert (tmp_path / name).stat().st_size > 1000
    # Tables made from frames do not replace the run's own tables.
    run = make_run(tmp_path / "run", dimension=3)
    for name, tool in (("rdf", plot_rdf), ("msd", plot_msd)):
        (run / f"{name}.csv").write_text(before)
        tool.main([str(run)])
        assert (run / f"{name}.csv").read_text() == before
        assert (run / f"{name}-frames.csv").stat().st_size > 100


def test_errors_of_tables_are_bars(tmp_path, monkeypatch):
    drawn = []
    monkeypatch.setattr("matplotlib.axes.Axes.fill_between", lambda axes, x, low, high, **_: drawn.append((low, high)))
    monkeypatch.setattr("matplotlib.axes.Axes.errorbar", lambda axes, x, y, error, **named: drawn.append((y, error, named["label"])))
    (tmp_path / "rdf.csv").write_text("r,g,error_g,samples_g\n" + "".join(f"{r},1,0.25,40\n" for r in (0.5, 1.5, 2.5)))
    assert list(plot_rdf.curves_of_table(tmp_path / "rdf.csv")[1]) == ["g"]
    plot_rdf.main([str(tmp_path / "rdf.csv")])
    assert len(drawn) == 1 and (drawn[0][0] == 0.75).all() and (drawn[0][1] == 1.25).all()
    (tmp_path / "sk.csv").write_text("k,waves,S,S_charge,error_S,error_S_charge,samples_S,samples_S_charge\n0.5,3,0.1,2,0.01,0.3,40,50\n")
    plot_sk.main([str(tmp_path)])
    plot_sk.main([str(tmp_path / "sk.csv"), "--columns", "S_charge", "-o", str(tmp_path / "charge.png")])
    assert [(*y, *error, label) for y, error, label in drawn[1:]] == [(0.1, 0.01, "S"), (2, 0.3, "S_charge"), (2, 0.3, None)]
    assert all((tmp_path / name).stat().st_size > 1000 for name in ("rdf.png", "sk.png", "charge.png"))
    with pytest.raises(SystemExit, match="^There is no g in .*sk.csv, only S, S_charge.$"):
        plot_sk.main([str(tmp_path), "--columns", "g"])
    (tmp_path / "sk.csv").write_text("a,b\n1,2\n")
    with pytest.raises(SystemExit, match="sk.csv"):
        plot_sk.main([str(tmp_path)])


def test_transport_coefficients_are_drawn_from_the_averages_of_a_run(tmp_path, monkeypatch):
    (tmp_path / "transport.csv").write_text("time,vacf,diffusion,error_vacf,samples_vacf,error_diffusion,samples_diffusion\n"
                                            "0,3,nan,0.01,50,nan,nan\n0.5,1,0.5,0.02,50,0.01,40\n1,0.1,0.75,0.02,50,0.02,30\n")
    (tmp_path / "summary.json").write_text('{"transport": {"diffusion": {"mean": 0.75, "standard_error": 0.02}}}')
    drawn, values = [], []
    monkeypatch.setattr("matplotlib.axes.Axes.errorbar", lambda axes, x, y, error, **_: drawn.append((x.tolist(), y.tolist()[1:], error.tolist()[1:])))
    monkeypatch.setattr("matplotlib.axes.Axes.axhspan", lambda axes, low, high, **_: values.append((low, high)))
    plot_transport.main([str(tmp_path)])
    lags = [0, 0.5, 1]
    assert drawn == [(lags, [1, 0.1], [0.02, 0.02]), (lags, [0.5, 0.75], [0.01, 0.02])] and values == [pytest.approx((0.73, 0.77))]
    assert (tmp_path / "transport.png").stat().st_size > 1000
    with pytest.raises(SystemExit, match="There is no viscosity in .*, only vacf, diffusion"):
        plot_transport.main([str(tmp_path), "--columns", "viscosity"])


def test_profiles_are_drawn_by_quantity_with_one_curve_for_each_species(tmp_path, monkeypatch):
    (tmp_path / "profile.csv").write_text("x,density,temperature,density_A,density_B,error_density,error_density_A\n"
                                          "0.5,1,2,0.25,0.75,0.1,0.05\n1.5,3,2,1,2,0.2,0.15\n")
    drawn, bands = [], []
    plot = plt.Axes.plot
    monkeypatch.setattr("matplotlib.axes.Axes.plot", lambda axes, x, y, **kw: drawn.append((kw["label"], y.tolist())) or plot(axes, x, y, **kw))
    monkeypatch.setattr("matplotlib.axes.Axes.fill_between", lambda axes, x, low, high, **_: bands.append(((high - low) / 2).tolist()))
    plot_profile.main([str(tmp_path)])
    assert drawn == [("all", [1, 3]), ("A", [0.25, 1]), ("B", [0.75, 2]), (None, [2, 2])]
    assert bands == [pytest.approx([0.1, 0.2]), pytest.approx([0.05, 0.15])]
    assert (tmp_path / "profile.png").stat().st_size > 1000
    with pytest.raises(SystemExit, match="There is no g in .*profile.csv, only density, temperature, density_A, density_B"):
        plot_profile.main([str(tmp_path), "--columns", "g"])


def test_compare(tmp_path):
    a, b = make_run(tmp_path / "a"), make_run(tmp_path / "b")
    assert compare.compare(a, b) == []
    with h5py.File(b / "trajectory.h5md", "r+") as file:
        file[f"{P}/position/value"][5, 2, 0] += 1e-9
    assert len(compare.compare(a, b)) == 1
    assert compare.compare(a, b, tolerance=1e-8) == []
    assert compare.compare(a, b, tolerance=1e-10) != []
    assert compare.compare(a, b, last=True) == []
    with h5py.File(b / "trajectory.h5md", "r+") as file:
        file[f"{P}/velocity/value"][-1, 2, 0] *= 1 + 2.3e-16
    assert compare.main([str(a), str(b), "--last"]) == 1
    (b / "thermo.csv").write_text((b / "thermo.csv").read_text().replace("1.0,", "1.5,", 1))
    assert any("thermo.csv" in line for line in compare.compare(a, b))


def test_energy_errors_and_pictures(tmp_path, capsys):
    run = make_run(tmp_path / "run")
    time, error, shadow = plot_energy.energy_errors(run, relative=True)
    assert error == pytest.approx(0.5e-3 * np.sin(np.arange(12)), abs=1e-15)
    assert shadow is None
    for tool, name in ((plot_energy, "energy.png"), (plot_rdf, "rdf.png"), (plot_msd, "msd.png"), (movie, "movie.gif")):
        tool.main([str(run)])
        assert (run / name).stat().st_size > 1000
    movie.main([str(make_run(tmp_path / "deep", dimension=3, boundary="open", frames=3)), "--along", "x"])
    assert (tmp_path / "deep" / "movie.gif").stat().st_size > 1000


def test_discs_over_a_periodic_edge_are_drawn_twice():
    x = np.array([[0.05, 0.05], [5.0, 9.95], [5.0, 5.0]])
    index, drawn = movie.with_images(x, np.full(3, 0.1), np.array([10.0, 10.0]), np.array([True, True]))
    assert sorted(index) == [0, 0, 0, 0, 1, 1, 2]
    assert any(np.allclose(centre, [10.05, 10.05]) for centre in drawn)
    assert any(np.allclose(centre, [5.0, -0.05]) for centre in drawn)


def test_decks_survive_being_written():
    for file in sorted((ROOT / "inputs").glob("*.toml")):
        deck = tomllib.loads(file.read_text())
        assert tomllib.loads(toml_text(deck)) == deck


def test_the_site_has_every_page():
    """tools/docs ends with an error if a page is in no list of the home page; the tutorials make their own."""
    listed = re.findall(r"^(?:\w+ <)?([\w./-]+)>?$", (ROOT / "tools/site/index.md").read_text(), re.MULTILINE)
    listed += [f"inputs/guide/{page}" for page in re.findall(r"\]\(([a-z-]+)\.md\)", (ROOT / "inputs/guide/README.md").read_text())]
    pages = subprocess.run(["git", "ls-files", "*.md"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.split()
    pages = [page for page in pages if not page.startswith(("inputs/tutorials/", "tools/site/", ".github/PULL_REQUEST"))]
    assert len(pages) > 10 and [page for page in pages if page.removesuffix(".md") not in listed] == []
