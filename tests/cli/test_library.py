# SPDX-License-Identifier: BSD-3-Clause
"""The installed library, with the examples built with it."""

import os
import pathlib
import re
import subprocess

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ["CAROM"]).parents[1]


def run(*command):
    """Standard output; pytest shows what a command that fails writes to standard error."""
    return subprocess.run([str(part) for part in command], check=True, stdout=subprocess.PIPE, text=True).stdout


@pytest.fixture(scope="module")
def examples(tmp_path_factory):
    """The folder of the built examples."""
    prefix, folder = tmp_path_factory.mktemp("prefix"), tmp_path_factory.mktemp("examples")
    run("cmake", "--install", BUILD, "--prefix", prefix)
    run("cmake", "-G", cached("CMAKE_GENERATOR"), "-S", ROOT / "engine/examples", "-B", folder, f"-DCMAKE_PREFIX_PATH={prefix}",
        "-DCMAKE_BUILD_TYPE=Release", f"-DCMAKE_CXX_FLAGS={sanitizers()}")
    run("cmake", "--build", folder, "-j2")
    assert not list(prefix.rglob("*_kernel.h"))
    return folder


def cached(name):
    """The value that CMake keeps of a variable of the build: its generator is installed, make, CMake's own choice, need not be."""
    found = re.search(rf"^{name}:\w+=(.+)$", (BUILD / "CMakeCache.txt").read_text(), re.M)
    return found and found[1]


def sanitizers():
    """The dependencies of the library must be linked into the examples, too."""
    return f"-fsanitize={cached('CAROM_SANITIZE')}" if cached("CAROM_SANITIZE") else ""


def test_five_springs_keep_their_energy(examples):
    out = run(examples / "five_springs")
    assert float(re.search(r"energy error (\S+)", out)[1]) < 1e-12
    assert len(out.splitlines()) == 6


def test_nine_gravity_compares_the_methods(examples):
    error = {line.split()[0]: float(re.search(r"energy error ([^,]+)", line)[1])
             for line in run(examples / "nine_gravity", "0.01").splitlines()}
    assert error["edda"] < 1e-12 and error["cdda"] < 1e-12 and error["psa"] > 1e-6


def test_the_fluid_has_a_first_peak_at_contact(examples):
    out = run(examples / "fluid", "256")
    assert float(re.search(r"energy error ([^,]+)", out)[1]) < 1e-12
    rows = [[float(x) for x in line.split()] for line in out.splitlines() if not line.startswith("#")]
    assert all(g == 0 for r, g in rows if r < 0.97)
    assert 2 < max(g for r, g in rows) == max(g for r, g in rows if 1 < r < 1.1)


def test_an_integrator_of_ones_own_has_order_one(examples):
    errors = [float(re.search(r"energy error ([^,]+)", line)[1]) for line in run(examples / "own_integrator").splitlines()]
    assert all(1.7 < a / b < 2.3 for a, b in zip(errors, errors[1:]))


def test_a_potential_of_ones_own_has_its_quotient_and_its_forces(examples):
    error = {line.split(":")[0]: float(re.search(r"energy error ([^,]+)", line)[1])
             for line in run(examples / "own_potential").splitlines()}
    assert error["edda, step 0.02"] < 1e-12 and error["edda, step 0.01"] < 1e-12
    assert 1e-7 < error["psa, step 0.01"] < error["psa, step 0.02"] < 1e-2


def test_a_slow_piston_keeps_to_the_adiabat(examples):
    *rows, account = run(examples / "piston").splitlines()
    values = [[float(x) for x in re.findall(r"[-\d.]+", row)] for row in rows]
    assert [edge for edge, *_ in values] == [40, 35, 30, 25, 20]
    assert all(abs(temperature / adiabat - 1) < 0.01 for _, temperature, adiabat, _ in values)
    assert values[-1][1] > 1.7 and abs(values[-1][3] / (750 * (values[-1][1] - 1)) - 1) < 1e-3  # work: 3/2 N (T - 1)
    assert float(re.search(r"error (\S+)", account)[1]) < 1e-12


def test_the_engine_alone_needs_neither_mpi_nor_hdf5(tmp_path):
    absent = [f"-DCMAKE_DISABLE_FIND_PACKAGE_{name}=ON" for name in ("MPI", "HDF5", "spdlog", "CLI11", "nlohmann_json")]
    run("cmake", "-G", cached("CMAKE_GENERATOR"), "-S", ROOT, "-B", tmp_path, "-DCAROM_ENGINE_ONLY=ON", *absent)
    commands = (tmp_path / "compile_commands.json").read_text()
    assert "/engine/" in commands and "/io/" not in commands and "/parallel/" not in commands
