# SPDX-License-Identifier: BSD-3-Clause
"""pip install ./io/python in a virtual environment, without any index of packages."""

import os
import pathlib
import subprocess

from scenes import ROOT

BUILD = pathlib.Path(os.environ["CAROM"]).parents[1]


def test_pip_installs_the_package_and_the_command(tmp_path):
    def call(*command):
        done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, env=environment)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"} | {"CAROM_PIP_BUILD": str(BUILD / "pip")}
    call("/usr/bin/python3", "-m", "venv", "--system-site-packages", tmp_path / "venv")
    call(tmp_path / "venv/bin/pip", "install", "--no-index", ROOT / "io/python")
    where = call(tmp_path / "venv/bin/python", "-c", "import carom; carom.Simulation(box=[3, 3]); print(carom.__file__, carom.version)")
    assert where.startswith(str(tmp_path / "venv"))
    version = call(tmp_path / "venv/bin/carom", "--version")
    assert version.split()[1] in where and "no MPI" in version
    package = pathlib.Path(where.split()[0]).parent
    assert (package / "__init__.pyi").exists() and (package / "py.typed").exists()
    assert f"Version: {where.split()[1]}" in call(tmp_path / "venv/bin/pip", "show", "carom")
    call(tmp_path / "venv/bin/pip", "uninstall", "-y", "carom")
    assert not package.exists() and not (tmp_path / "venv/bin/carom").exists()
