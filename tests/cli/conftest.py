# SPDX-License-Identifier: BSD-3-Clause
import os
import pathlib
import shutil
import subprocess

import pytest


@pytest.fixture(scope="module")
def browser():
    """Chromium without a window, if it is installed (tools/test-packages.txt)."""
    import browsing  # noqa: F401, finds the tools
    from view_picture import chromium
    missing = [name for name in ("chromium", "chromedriver") if not shutil.which(name)]
    if missing and not os.environ.get("CI"):
        pytest.exit(f"skipped: {' and '.join(missing)} not installed; tools/test installs tools/test-packages.txt", returncode=77)
    with chromium(1000, 600) as window:
        yield window


@pytest.fixture(scope="session")
def killer(tmp_path_factory):
    """The library that kills at a change of a file (kill_at_write.c)."""
    library = tmp_path_factory.mktemp("library") / "kill_at_write.so"
    subprocess.run(["cc", "-Wall", "-shared", "-fPIC", "-o", str(library), str(pathlib.Path(__file__).with_name("kill_at_write.c"))],
                   check=True)
    return library
