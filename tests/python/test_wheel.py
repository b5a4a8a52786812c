# SPDX-License-Identifier: BSD-3-Clause
"""What the build backend decides about a wheel; test_pip.py (slow) and `tools/newcomer wheel` make one."""

import os
import re
import subprocess
import sys
import sysconfig
import zipfile

import pytest
from scenes import ROOT

sys.path.insert(0, str(ROOT / "io/python"))
import build_backend  # noqa: E402


def program(folder, source, *flags):
    (folder / "program.c").write_text(source)
    subprocess.run(["gcc", "-o", folder / "program", folder / "program.c", *flags], check=True)
    return folder / "program"


def test_what_needs_glibc_alone_runs_on_that_glibc_and_later_ones(tmp_path):
    """arc4random is as new as glibc 2.36, which Debian 12 has."""
    machine = os.uname().machine
    small = build_backend.platform(program(tmp_path, "int main(void) { return 0; }"))
    assert re.fullmatch(rf"manylinux_2_\d+_{machine}", small) and small != f"manylinux_2_36_{machine}"
    new = program(tmp_path, "#include <stdlib.h>\nint main(void) { return arc4random() == 7; }")
    assert build_backend.platform(new) == f"manylinux_2_36_{machine}"
    assert build_backend.platform("/usr/bin/true", new) == f"manylinux_2_36_{machine}"


def test_what_needs_another_library_runs_on_this_machine_alone(tmp_path):
    needs_z = program(tmp_path, "int main(void) { return 0; }", "-Wl,--no-as-needed", "-l:libz.so.1")
    assert build_backend.platform("/usr/bin/true", needs_z) == re.sub(r"\W", "_", sysconfig.get_platform())


@pytest.fixture
def made(tmp_path, monkeypatch):
    """Makes a wheel of a module and a command that a test has put into the build's folder; returns CMake's arguments."""
    (tmp_path / "io/python/carom").mkdir(parents=True)
    os.rename(program(tmp_path, "int main(void) { return 0; }"), tmp_path / "io/carom")
    calls = []
    monkeypatch.setenv("CAROM_PIP_BUILD", str(tmp_path))
    monkeypatch.setattr(build_backend, "run", lambda *command: calls.append([str(part) for part in command]) or (
        command[1] == "--install" and os.makedirs(f"{command[4]}/lib/python3.11/site-packages/carom")))

    def make():
        return zipfile.ZipFile(tmp_path / build_backend.build_wheel(tmp_path)), calls[0]
    return make


def test_a_wheel_has_the_command_and_the_licences_of_what_it_contains(made):
    wheel, arguments = made()
    assert "-DCAROM_PORTABLE=ON" in arguments
    version, = re.findall(r"carom-([\d.]+)-cp", wheel.filename)
    command = wheel.getinfo(f"carom-{version}.data/scripts/carom")
    assert command.external_attr >> 16 & 0o111
    licences = {name.split("/")[-1] for name in wheel.namelist() if "/licenses/" in name}
    assert licences >= {"libhdf5-dev", "libaec-dev", "zlib1g-dev", "libdeflate-dev", "headers"}
    assert f"Tag: {re.search('cp.*(?=.whl)', wheel.filename)[0]}\n" in wheel.read(f"carom-{version}.dist-info/WHEEL").decode()


def test_cmake_args_come_last_so_that_they_prevail(made, monkeypatch):
    monkeypatch.setenv("CMAKE_ARGS", "-DCAROM_PORTABLE=OFF '-DCMAKE_CXX_FLAGS=-g -O1'")
    _, arguments = made()
    assert arguments[-2:] == ["-DCAROM_PORTABLE=OFF", "-DCMAKE_CXX_FLAGS=-g -O1"]
