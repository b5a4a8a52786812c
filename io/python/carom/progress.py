# SPDX-License-Identifier: BSD-3-Clause
"""A line that shows how far a run has come, in terminals and notebooks."""

import sys
import time as clock

from carom import notebook
from carom.notebook import in_notebook

QUIET = 0.5  # seconds that a run may take without a line
WIDTH = 30


class Progress:
    """Called with the part of the run that is done and the simulated time; ends with close()."""

    def __init__(self, stream=None):
        self._stream = stream or sys.stderr
        self._start = clock.monotonic()
        self._shown, self._bar = 0, None

    @staticmethod
    def wanted():
        """In a terminal or a notebook."""
        return in_notebook() or sys.stderr.isatty()

    def __call__(self, done, time):
        spent = clock.monotonic() - self._start
        if spent < QUIET:
            return
        left = f"{spent * (1 - done) / done:.0f} s left" if done > 0 else ""
        text = f"{100 * done:3.0f} %  time {time:.6g}  {left}"
        if in_notebook():
            self._bar = notebook.show_progress(self._bar, done, text)
            return
        line = f"[{'#' * round(WIDTH * done):{WIDTH}}] {text}"
        self._stream.write("\r" + line.ljust(self._shown))
        self._stream.flush()
        self._shown = len(line)

    def close(self):
        """Takes the line away."""
        if self._bar:
            notebook.end_progress(self._bar)
        if self._shown:
            self._stream.write("\r" + " " * self._shown + "\r")
            self._stream.flush()
