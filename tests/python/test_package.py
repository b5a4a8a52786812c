# SPDX-License-Identifier: BSD-3-Clause
"""The package as users find it: hints, the first example, the starter, the installation."""

import ast
import os
import pathlib
import re
import subprocess
import sys

import numpy as np

import carom
from carom import _carom
from scenes import ROOT

BUILD = pathlib.Path(os.environ["CAROM"]).parents[1]
PACKAGE = pathlib.Path(carom.__file__).parent


def test_the_hints_have_every_parameter_of_every_name():
    tree = ast.parse((PACKAGE / "__init__.pyi").read_text())
    hinted = next(node for node in tree.body if isinstance(node, ast.ClassDef) and node.name == "Simulation")
    found = {}
    for function in (node for node in hinted.body if isinstance(node, ast.FunctionDef) and node.decorator_list):
        if function.name in ("add_force", "integrator"):
            name = ast.literal_eval(function.args.args[1].annotation.slice)
            required = [each.arg for each, default in zip(function.args.kwonlyargs, function.args.kw_defaults) if default is None]
            found[function.name, name] = {each.arg for each in function.args.kwonlyargs}, set(required)
    declared = {}
    for kind, method in (("forces", "add_force"), ("integrators", "integrator")):
        for one in _carom.descriptors()[kind]:
            declared[method, one["name"]] = ({each["name"] for each in one["parameters"]},
                                             {each["name"] for each in one["parameters"] if each["default"] == ""})
    assert found == declared and len(found) > 15
    assert (PACKAGE / "py.typed").exists()
    public = {name for name in vars(carom.Simulation) if not name.startswith("_")}
    assert public == {node.name for node in hinted.body if isinstance(node, ast.FunctionDef)} - {"__init__", "__len__", "__repr__"}


def test_the_hints_are_written_without_numpy(tmp_path):
    """A build before numpy is installed has them, too."""
    blind = ("import importlib.util, runpy, sys; del sys.argv[0]; find = importlib.util.find_spec;"
             "importlib.util.find_spec = lambda name, *more: None if name == 'numpy' else find(name, *more);"
             "runpy.run_path(sys.argv[0], run_name='__main__'); assert 'Mock' in repr(sys.modules['numpy'])")
    subprocess.run([sys.executable, "-c", blind, ROOT / "io/python/make_stubs.py", tmp_path / "hints.pyi"], check=True)
    assert (tmp_path / "hints.pyi").read_text() == (PACKAGE / "__init__.pyi").read_text()


def test_everything_is_described():
    names = [name for line in carom.describe().splitlines() for name in line.split(": ")[1].split(", ")]
    assert "edda" in names and "yukawa" in names and "periodic" in names
    assert all(carom.describe(name).startswith(name) for name in names)
    assert "step (float, time, must be given): length of one step" in carom.describe("psa")


def test_the_first_example_of_the_readme(tmp_path):
    example = re.findall(r"```python\n(.*?)```", (ROOT / "io/python/README.md").read_text(), re.S)[0]
    out = subprocess.run([sys.executable, "-c", example], check=True, capture_output=True, text=True, cwd=tmp_path).stdout.splitlines()
    energies = [float(line.split()[2]) for line in out[:-1]]
    assert len(energies) == 6 and np.ptp(energies) < 1e-11
    assert float(out[-1].split()[-1]) < 1e-12


def test_the_installed_package(tmp_path):
    subprocess.run(["cmake", "--install", BUILD, "--prefix", tmp_path, "--component", "python"], check=True, capture_output=True)
    folder, = tmp_path.glob("lib/python3*/*-packages")
    environment = os.environ | {"PYTHONPATH": str(folder)}
    script = "import carom; s = carom.Simulation(box=[3, 3]); print(carom.__file__, carom.version)"
    out = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True, env=environment).stdout
    assert out.startswith(str(folder)) and out.split(maxsplit=1)[1].strip() == carom.version
    assert (folder / "carom/__init__.pyi").exists() and (folder / "carom/py.typed").exists()


def test_no_mpi_is_started():
    script = "import carom, ctypes; carom.Simulation(box=[3, 3]); f = ctypes.c_int(); " \
             "ctypes.CDLL('libmpi.so.40').MPI_Initialized(ctypes.byref(f)); print(f.value)"
    assert subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True).stdout == "0\n"
