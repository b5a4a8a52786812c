# SPDX-License-Identifier: BSD-3-Clause
"""Where the tests in Python have their directories: in memory, where there is room, since syncs take no time there."""

import os
import shutil
import tempfile

MEMORY = "/dev/shm"
ROOM = 4 << 30  # bytes; what is written stays there while the tests of a file run

if "TMPDIR" not in os.environ and os.access(MEMORY, os.W_OK):
    there = os.statvfs(MEMORY)
    if there.f_bavail * there.f_frsize > ROOM and not there.f_flag & os.ST_NOEXEC:  # libraries are built there too
        tempfile.tempdir = MEMORY


def pytest_configure(config):
    config.addinivalue_line("markers", "kills_mpirun: ends mpirun or one of its ranks, after which mpirun itself may hang; "
                                       "runs as the CTest test cli.killed_mpirun")


def pytest_sessionfinish(session, exitstatus):
    """What is left in memory is there no longer, but for that of tests that have failed."""
    if exitstatus == 0 and tempfile.tempdir == MEMORY:
        shutil.rmtree(session.config._tmp_path_factory.getbasetemp(), ignore_errors=True)
