"""What the tests of going on share: to take a run up again, and to compare it with an undisturbed one."""

import subprocess
import sys
import time

from runs import CAROM, ROOT, mpirun

sys.path.insert(0, str(ROOT / "tools"))
from carom_files import toml_text  # noqa: F401
from compare import compare, summary_differences

INTERRUPTED = 75


def go_on(output, arguments=(), code=0, ranks=1, environment=None):
    """Continues the run of a directory."""
    what = [CAROM, "run", "--continue", str(output), "--quiet", *arguments]
    if ranks > 1:
        return mpirun(ranks, what, code)
    done = subprocess.run(what, capture_output=True, text=True, timeout=120, env=environment)
    assert done.returncode == code, done.stderr
    return done


def expect_same(whole, continued):
    """All files of two runs, but what they say of the machine."""
    assert compare(whole, continued) + summary_differences(whole, continued) == []
    of_one = {path.name for path in whole.iterdir()}
    assert of_one == {path.name for path in continued.iterdir()} - {"checkpoint.previous.h5"} | (of_one & {"checkpoint.previous.h5"})
    for name in of_one:
        if name.endswith(".csv"):
            assert (whole / name).read_bytes() == (continued / name).read_bytes(), name


def wait_for_rows(job, output, rows=4):
    while not (output / "thermo.csv").exists() or (output / "thermo.csv").read_text().count("\n") <= rows:
        assert job.poll() is None, job.stderr.read()
        time.sleep(0.005)
