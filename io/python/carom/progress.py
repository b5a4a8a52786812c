# SPDX-License-Identifier: BSD-3-Clause
"""Shows the progress of a run in terminals and notebooks."""

import sys
import time as clock

from carom import notebook
from carom.notebook import in_notebook

QUIET = 0.5  # seconds of a run before the line appears
WIDTH = 30


class Progress:
    """To be called with the fraction of the run that is done and the simulated time; close() removes the line."""

    def __init__(self, stream=None):
        self._stream = stream or sys.stderr
        self._start = clock.monotonic()
        self._shown, self._bar = 0, None

    @staticmethod
    def wanted():
        """Whether progress is shown by default: in terminals and notebooks."""
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
        """Removes the line."""
        if self._bar:
            notebook.end_progress(self._bar)
        if self._shown:
            self._stream.write("\r" + " " * self._shown + "\r")
            self._stream.flush()
