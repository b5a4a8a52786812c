# SPDX-License-Identifier: BSD-3-Clause
"""tools/setup.sh on machines that are not available here: the packages that it would install, and its commands."""

import os
import pathlib
import subprocess

import pytest

SETUP = pathlib.Path(__file__).resolve().parents[2] / "tools" / "setup.sh"
WANTED = [line for name in ("build-packages.txt", "packages.txt") for line in (SETUP.parent / name).read_text().split("\n")
          if line and not line.startswith("#")]


@pytest.fixture
def machine(tmp_path):
    """A machine with some packages installed; returns its exit code, its output, and the apt-get calls."""
    calls = tmp_path / "calls"

    def install(installed, uid, sudo):
        stubs = {
            "dpkg-query": "\n".join(f"echo 'installed {name}'" for name in installed) + "\nexit 1",
            "id": f"echo {uid}",
            "sudo": 'shift; exec "$@"' if sudo else "exit 1",
            "apt-get": f'echo "${{DEBIAN_FRONTEND:-}} $*" >> {calls}',
        }
        for name, body in stubs.items():
            (tmp_path / name).write_text(f"#!/bin/bash\n{body}\n")
            (tmp_path / name).chmod(0o755)
        environment = os.environ | {"PATH": f"{tmp_path}:{os.environ['PATH']}"}
        environment.pop("DEBIAN_FRONTEND", None)
        done = subprocess.run(["bash", "-euo", "pipefail", "-c", f"source {SETUP}; install_packages; echo built"],
                              env=environment, capture_output=True, text=True)
        return done, calls.read_text().splitlines() if calls.exists() else []

    return install


def test_nothing_is_installed_twice(machine):
    done, calls = machine(WANTED, uid=0, sudo=False)
    assert (done.returncode, done.stdout, done.stderr, calls) == (0, "built\n", "", [])


@pytest.mark.parametrize("uid", [0, 1000])
def test_only_what_is_missing_is_installed(machine, uid):
    done, calls = machine([name for name in WANTED if name not in ("cmake", "python3-h5py")], uid, sudo=True)
    assert done.returncode == 0 and done.stdout == "built\n"
    assert calls == [" update", "noninteractive install --yes --no-install-recommends cmake python3-h5py"]


def test_without_rights_one_command_is_printed(machine):
    done, calls = machine([name for name in WANTED if name != "cmake"], uid=1000, sudo=False)
    assert done.returncode == 1 and done.stdout == "" and calls == []
    assert "apt-get update && apt-get install --yes --no-install-recommends cmake'" in done.stderr
