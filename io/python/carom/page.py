# SPDX-License-Identifier: BSD-3-Clause
"""The page of `carom view`, which shows runs in a browser or in a notebook."""

import os
import pathlib
import subprocess
import sys

from carom.errors import FileError
from carom.notebook import in_notebook

SERVE = "import sys; from carom import _carom; _carom.view(sys.argv[3:], None, int(sys.argv[1]), sys.argv[2] == 'True', True)"


class Page:
    """A page that is served until close() is called or this Python ends. A notebook displays it below the cell.

    runs: directories. port: 0 chooses any free port. browser: whether to open the page in a browser; by default outside notebooks.
    address: the address of the page.
    """

    def __init__(self, runs, port=0, browser=None):
        from carom import _carom  # noqa: F401, an ImportError here is clearer than one in the other process
        package = pathlib.Path(__file__).absolute().parents[1]
        environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(package), os.environ.get("PYTHONPATH", "")])}
        browser = not in_notebook() if browser is None else browser
        self._process = subprocess.Popen(
            [sys.executable, "-c", SERVE, str(port), str(browser), *map(str, runs)], env=environment, text=True,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.address = self._process.stdout.readline().strip()
        if not self.address:
            problem = self._process.communicate()[1].strip().splitlines()
            raise FileError(problem[-1].partition("Error: ")[2] if problem else "the page ended before it had an address")

    def close(self):
        """Stops the server."""
        if self._process.poll() is None:
            self._process.stdin.close()
            self._process.wait(timeout=10)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def __repr__(self):
        return f"<page at {self.address}>"

    def _repr_html_(self):
        return f'<iframe src="{self.address}" width="100%" height="640" style="border: 0"></iframe>'


def export(runs, file):
    """Writes one file that shows the runs without a server."""
    from carom import _carom

    _carom.view([str(run) for run in runs], os.fspath(file), 0, False, False)
