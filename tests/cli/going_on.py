# SPDX-License-Identifier: BSD-3-Clause
"""Common parts of the tests of continued runs: to run, to continue, and to compare with an undisturbed run."""

import subprocess
import sys
import time

from runs import CAROM, ROOT, mpirun

sys.path.insert(0, str(ROOT / "tools"))
from carom_files import toml_text
from compare import compare, summary_differences

INTERRUPTED = 75
ALL_OUTPUT = ["output.events=true", "output.rdf_interval=0.07", "output.msd_interval=0.05", "output.profile_interval=0.11", "output.profile_pressure=true",
              "output.pressure_tensor_interval=0.06"]
CHECKPOINTS = ["output.checkpoint_wall=\"0\""]  # at every check of the clock


def go_on(output, arguments=(), code=0, ranks=1, environment=None):
    """Continues the run of a directory."""
    what = [CAROM, "run", "--continue", str(output), "--quiet", *arguments]
    if ranks > 1:
        return mpirun(ranks, what, code)
    done = subprocess.run(what, capture_output=True, text=True, timeout=1200, env=environment)
    assert done.returncode == code, done.stderr
    return done


def expect_same(whole, continued):
    """Compares all files of two runs, except what describes the machine."""
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


def box(method, dimension, steps, **more):
    """64 spheres between walls and periodic boundaries, with forces that the method handles."""
    free, points = method == "free-flight", method == "verlet"
    field = {"type": "uniform-field", "acceleration": [-0.3] + (dimension - 1) * [0.0]}
    forces = [{"type": "yukawa", "amplitude": 1.0, "kappa": 2.0, "cutoff": 1.9},
              {"type": "harmonic-bond", "within": 1.35, "stiffness": 30.0, "rest_length": 1.2}]
    return toml_text({
        "format": 1, "title": "continued",
        "system": {"dimension": dimension, "boundary": ["periodic" if points else "wall"] + (dimension - 1) * ["periodic"]},
        "particles": [{"name": name, "count": 32, "temperature": 1.0, "display_radius" if points else "radius": 0.5, "mass": mass}
                      for name, mass in (("light", 1.0), ("heavy", 3.0))],
        "placement": {"type": "square" if dimension == 2 else "simple-cubic", "packing_fraction": 0.5 if dimension == 2 else 0.3, "seed": 5},
        "interaction": ([] if points else [field]) + ([] if free else forces),
        "integrator": {"type": method, "step": 0.35 if free else 0.02} | more,
        "run": {"steps": steps},
        "output": {"directory": "unused", "frame_interval": 0.13, "thermo_interval": 0.06}})
