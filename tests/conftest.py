# SPDX-License-Identifier: BSD-3-Clause
"""The directories of the tests in Python are in memory if there is space, because syncs take no time there."""

import os
import shutil
import tempfile

MEMORY = "/dev/shm"
FREE_BYTES = 4 << 30  # files stay there while the tests of a file run

if "TMPDIR" not in os.environ and os.access(MEMORY, os.W_OK):
    there = os.statvfs(MEMORY)
    if there.f_bavail * there.f_frsize > FREE_BYTES and not there.f_flag & os.ST_NOEXEC:  # libraries are built there too
        tempfile.tempdir = MEMORY


def pytest_configure(config):
    config.addinivalue_line("markers", "kills_mpirun: ends mpirun or one of its ranks, after which mpirun itself may hang; "
                                       "runs as the CTest test cli.killed_mpirun")
    config.addinivalue_line("markers", "slow: takes more than a quarter of a minute; runs as a CTest test with the label slow")


def pytest_sessionfinish(session, exitstatus):
    """Removes the directories in memory, except those of failed tests."""
    if exitstatus == 0 and tempfile.tempdir == MEMORY:
        shutil.rmtree(session.config._tmp_path_factory.getbasetemp(), ignore_errors=True)
