# SPDX-License-Identifier: BSD-3-Clause
"""Python ends while threads run simulations: real processes, which must end by themselves without errors."""

import pathlib
import subprocess
import sys

import pytest

from scenes import ROOT

SCRIPT = """
import atexit, itertools, os, sys, threading, time
sys.path.insert(0, {here!r})
{before}
import carom
{load}
from scenes import five_springs, gas
begun = threading.Event()
def work():
    try:
        {work}
    except BaseException as error:
        print(repr(error))
        raise
    print("went on")
for _ in range({threads}):
    threading.Thread(target=work, daemon=True).start()
assert begun.wait(600)
{after}
"""


def ends(work, before="", after="", load="carom.version", threads=2):
    """Standard output of a Python process that ends while daemon threads run this code."""
    script = SCRIPT.format(here=str(pathlib.Path(__file__).parent), work=work, before=before, after=after, load=load,
                           threads=threads)
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=1200)
    assert done.returncode == 0 and done.stderr == "" and "went on" not in done.stdout, (done.returncode, done.stderr, done.stdout)
    return done.stdout


WORK = {
    "steps": "begun.set(), five_springs().run(time=1e9)",
    "events": "begun.set(), gas(512).run(time=1e9)",
    "one long epoch": "begun.set(), gas(4096, step=1e9).run(time=1e9)",
    "callbacks": "five_springs().run(time=1e9, every=0.01, callback=lambda s: begun.set())",
    "a callback that sleeps": "five_springs().run(time=1e9, every=0.01, callback=lambda s: (begun.set(), time.sleep(1e6)))",
    "a callback that works": "five_springs().run(time=1e9, every=0.01, callback=lambda s: (begun.set(), [None for _ in iter(int, 1)]))",
    "a line of progress": "sys.stderr = open(os.devnull, 'w'), begun.set(), five_springs().run(time=1e9, progress=True)",
}


@pytest.mark.parametrize("work", WORK)
@pytest.mark.parametrize("after", ["", "time.sleep(0.3)"])
def test_python_ends_while_threads_run(work, after):
    ends(WORK[work], after=after)


def test_a_thread_whose_run_is_stopped_ends_too():
    """A thread ends by SystemExit, which is not reported; another function at exit gives it time to do so."""
    out = ends(WORK["steps"], before="atexit.register(lambda: [each.join() for each in threading.enumerate() if each.daemon])")
    assert out.count("SystemExit()") == 2, out


def test_the_thread_in_which_python_ends_may_still_run_one():
    before = """
def late():
    sim = five_springs()
    sim.run(time=1, every=0.1, callback=lambda s: s.energy)
    print(f"late {sim.step}")
atexit.register(late)"""
    assert "late 100" in ends(WORK["steps"], before=before)


def test_python_waits_until_no_run_is_in_the_engine():
    before = """
def late():
    for sim in sims:
        sim.velocity = sim.velocity  # UsageError while a run is going on
    print(f"{len(sims)} at rest")  # one string: the threads print as well, between two arguments too
sims = []
atexit.register(late)"""
    assert "2 at rest" in ends("sim = gas(4096, step=1e9); sims.append(sim); (len(sims) == 2 and begun.set()); sim.run(time=1e9)",
                               before=before, after="time.sleep(1)")


@pytest.mark.parametrize("runs", ["five_springs().run(time=1e9, every=0.01, callback=lambda s: running.set())",
                                  "sim = five_springs(); [(sim.run(steps=n), running.set()) for n in itertools.count(1)]"])
def test_threads_of_a_module_that_is_loaded_too_late_sleep(runs):
    ends(f"begun.set(), go.wait(); {runs}", load="", threads=4,
         before="go, running = threading.Event(), threading.Event(); atexit.register(lambda: (go.set(), running.wait(600)))")


def test_a_fork_has_no_threads_to_wait_for():
    out = ends(WORK["steps"], after="""
time.sleep(0.1)
if os.fork() == 0:
    five_springs().run(steps=5)
    print("child")
    sys.exit(0)
assert os.wait()[1] == 0
""")
    assert out.startswith("child\n")


@pytest.mark.parametrize("before, code", [("", 1), ("import sys, types; sys.modules['mpi4py'] = types.ModuleType('mpi4py')", 0)])
def test_several_processes_do_not_run_one_study_each(before, code):
    """By the real mpirun. A script that says by mpi4py that it divides the work is left alone; mpi4py itself need not be installed here."""
    script = f"{before}\nimport sys\nsys.path.insert(0, {str(pathlib.Path(__file__).parent)!r})\nfrom scenes import five_springs\nfive_springs().run(steps=1)"
    launch = ["sh", "-c", '. "$0"; exec mpirun --timeout 1000 -n 2 "$@"', ROOT / "tools/mpi-env.sh"]
    done = subprocess.run([*launch, sys.executable, "-c", script], capture_output=True, text=True, timeout=1200)
    assert done.returncode == code, done.stderr
    assert ("carom.errors.UsageError: Simulation: this is one of 2 processes" in done.stderr) == (code == 1)
    assert ("mpirun -n … carom run" in done.stderr) == (code == 1)
