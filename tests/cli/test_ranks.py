"""`mpirun carom run`: the same files on any number of ranks; what happens when one of them fails."""

import copy
import filecmp
import os
import pathlib
import re
import resource
import signal
import subprocess
import sys
import time
import tomllib

import pytest

from runs import (CAROM, MPIRUN, ROOT, SPHERES, SPRINGS, command, data_sets, frames_are_sound, mpi_environment, mpirun, needs_carom,
                  run, summary, thermo, write_deck)

sys.path.insert(0, str(ROOT / "tools"))
import compare
from carom_files import toml_text

pytestmark = needs_carom

# Before a command: only rank 0 finds files by their names alone.
RANK_0_AT_HOME = ["sh", "-c", 'if [ $OMPI_COMM_WORLD_RANK != 0 ]; then cd /; fi; exec "$@"', "sh"]

# Discs of two sizes between walls, falling.
DISCS = toml_text(tomllib.loads(SPHERES) | {
    "title": "discs",
    "system": {"dimension": 2, "box": [30.0, 20.0], "boundary": ["periodic", "wall"]},
    "particles": [{"name": "large", "count": 120, "temperature": 1.0, "radius": 0.6, "mass": 2.0},
                  {"name": "small", "count": 80, "temperature": 1.0, "radius": 0.4}],
    "placement": {"type": "random", "seed": 3},
    "interaction": [{"type": "uniform-field", "acceleration": [0.0, -0.2]}],
    "integrator": {"type": "free-flight", "step": 2.0},
    "run": {"collisions": 1500},
    "output": {"directory": "unused", "frame_interval": 0.7, "thermo_interval": 0.3}})
# No end of it, and little to see.
ENDLESS = ["run.end_time=1e7", "integrator.step=1.0", "output.frame_interval=10.0", "output.thermo_interval=10.0"]


def start(ranks, arguments):
    return subprocess.Popen(MPIRUN + [str(ranks)] + [str(argument) for argument in arguments], env=mpi_environment(),
                            stderr=subprocess.PIPE, text=True)


def running(output):
    """The processes of the run that writes there, by rank."""
    found = {}
    for process in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            arguments = (process / "cmdline").read_bytes().split(b"\0")
            rank = re.search(rb"(?:^|\0)OMPI_COMM_WORLD_RANK=(\d+)", (process / "environ").read_bytes())
        except OSError:  # it has just ended, or belongs to another user
            continue
        if rank and str(output).encode() in arguments and arguments[0] == CAROM.encode():
            found[int(rank[1])] = int(process.name)
    return found


def when_it_has_ended(output):
    """mpirun does not wait for those it kills."""
    for _ in range(1000):
        if not running(output):
            return
        time.sleep(0.01)
    raise AssertionError("processes are left")


def when_it_runs(job, output):
    """The processes, by rank, once three frames are written: the fourth row comes after the third frame."""
    while not (output / "thermo.csv").exists() or len((output / "thermo.csv").read_text().splitlines()) < 5:
        assert job.poll() is None, job.stderr.read()
        time.sleep(0.01)
    return running(output)


@pytest.mark.parametrize("text", [SPHERES, DISCS], ids=["spheres", "discs"])
def test_any_number_of_ranks_gives_the_same_files(text, tmp_path):
    output = ["output.events=true", "output.rdf_interval=0.17", "output.msd_interval=0.11", "output.profile_interval=0.13"]
    if text is SPHERES:
        output += ["particles.0.count=500", "run.end_time=1.0"]
    run(write_deck(tmp_path, text), tmp_path / "plain", output)
    assert summary(tmp_path / "plain")["events"]["sphere_sphere"] >= 1500
    for ranks in 1, 2, 3, 4, 8:
        out = tmp_path / str(ranks)
        done = mpirun(ranks, RANK_0_AT_HOME + command("input.toml", out, output), cwd=tmp_path)
        assert done.stderr == ""
        assert compare.compare(tmp_path / "plain", out) == []
        assert (out / "events.h5").exists()
        for name in "thermo.csv", "rdf.csv", "msd.csv", "profile.csv":
            assert filecmp.cmp(tmp_path / "plain" / name, out / name, shallow=False)
        assert sorted(path.name for path in out.iterdir()) == sorted(path.name for path in (tmp_path / "plain").iterdir())
        assert summary(out)["ranks"] == ranks
        assert ("least" in (out / "run.log").read_text()) == (ranks > 1)


NODES = ROOT / "tools" / "simulated-nodes"
can_simulate = subprocess.run([NODES, "1", "1", "true"], capture_output=True).returncode == 0 if CAROM else False


@pytest.mark.skipif(not can_simulate, reason="may not make network namespaces here (not root, no user namespaces)")
def test_nodes(tmp_path):
    deck = write_deck(tmp_path, SPHERES)
    run(deck, tmp_path / "plain", ["output.events=true"])
    job = ["timeout", "-k", "10", "100", NODES, "3", "2"] + command(deck, tmp_path / "nodes", ["output.events=true"])
    done = subprocess.run(job, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "host node1, " in (tmp_path / "nodes" / "run.log").read_text()
    assert summary(tmp_path / "nodes")["ranks"] == 6
    assert compare.compare(tmp_path / "plain", tmp_path / "nodes") == []


def test_positions_from_a_file_that_rank_0_sees(tmp_path):
    (tmp_path / "places").write_text("".join(f"{2 * n} 1 1\n" for n in range(9)))
    deck = SPHERES.replace("[placement]", "[placement]\nfile = \"places\"").replace("packing_fraction = 0.3\n", "")
    deck = deck.replace("fcc", "file").replace("108", "9").replace("3\nboundary", "3\nbox = [18.0, 3.0, 3.0]\nboundary")
    run(write_deck(tmp_path, deck), tmp_path / "plain")
    mpirun(2, RANK_0_AT_HOME + command("input.toml", tmp_path / "two"), cwd=tmp_path)
    assert compare.compare(tmp_path / "plain", tmp_path / "two") == []


@pytest.mark.parametrize("method", ["psa", "cva", "mcva", "cdda", "edda"])
def test_forces_are_shared(method, tmp_path):
    deck = ROOT / "inputs" / "yukawa-fluid.toml"
    shorter = ["particles.count=256", "interaction.0.cutoff=2.5", "run.steps=20", "output.events=true", f"integrator.type={method}", "integrator.step=0.01",
               "output.frame_interval=0.1", "output.rdf_interval=0.07", "output.profile_interval=0.05"]
    run(deck, tmp_path / "plain", shorter)
    assert summary(tmp_path / "plain")["events"]["sphere_sphere"] > 0
    for ranks in 2, 3:
        done = mpirun(ranks, command(deck, tmp_path / str(ranks), shorter))
        assert done.stderr == ""
        assert compare.compare(tmp_path / "plain", tmp_path / str(ranks)) == []
        for name in "rdf.csv", "profile.csv":
            assert filecmp.cmp(tmp_path / "plain" / name, tmp_path / str(ranks) / name, shallow=False)


def test_bonds_across_ranks(tmp_path):
    deck = ROOT / "inputs" / "spring-lattice.toml"
    stiff = ["particles.count=2500", "interaction.0.stiffness=60.0", "integrator.step=0.05", "run.steps=20",
             "output.events=true", "output.frame_interval=0.2", "output.msd_interval=0.15"]
    plain = run(deck, tmp_path / "plain", stiff)
    assert "is long for the shortest period at the start" in plain.stderr
    for ranks in 2, 4:
        done = mpirun(ranks, command(deck, tmp_path / str(ranks), stiff))
        assert done.stderr == plain.stderr
        assert compare.compare(tmp_path / "plain", tmp_path / str(ranks)) == []


def test_bonded_pairs_left_out_and_tables_across_ranks(tmp_path):
    (tmp_path / "potential.csv").write_text("r,V\n0.9,3.0\n1.2,0.8\n1.5,0.3\n2.0,0.0\n")
    bonds = {"type": "harmonic-bond", "chain": True, "chain_length": 8, "stiffness": 50.0, "rest_length": 1.1}
    table = {"type": "table", "file": "potential.csv", "exclude": "bonded"}
    attraction = {"type": "lennard-jones", "epsilon": 0.5, "sigma": 1.0, "cutoff": 2.0, "exclude": "bonded", "tail": True}
    chains = tomllib.loads(SPHERES) | {
        "particles": [{"name": "bead", "count": 512, "temperature": 1.0, "radius": 0.5}],
        "placement": {"type": "simple-cubic", "packing_fraction": 0.3},
        "interaction": [table, attraction, bonds],
        "integrator": {"type": "psa", "step": 0.005},
        "run": {"steps": 40},
        "output": {"directory": "unused", "frame_interval": 0.1, "thermo_interval": 0.05, "events": True}}
    run(write_deck(tmp_path, toml_text(chains)), tmp_path / "plain")
    done = summary(tmp_path / "plain")
    assert done["events"]["sphere_sphere"] > 0 and done["tail"]["energy"] < 0
    for ranks in 2, 3:
        mpirun(ranks, RANK_0_AT_HOME + command("input.toml", tmp_path / str(ranks)), cwd=tmp_path)
        assert compare.compare(tmp_path / "plain", tmp_path / str(ranks)) == []
        assert summary(tmp_path / str(ranks))["tail"] == done["tail"]
    run(tmp_path / "input.toml", tmp_path / "narrow", env=os.environ | {"CAROM_SIMD": "sse2"})
    assert compare.compare(tmp_path / "plain", tmp_path / "narrow") == []
    chains["interaction"] = [dict(table, exclude="none"), attraction, bonds]
    run(write_deck(tmp_path, toml_text(chains)), tmp_path / "all")
    assert summary(tmp_path / "all")["energy"]["initial"] > done["energy"]["initial"]  # the bonded repel each other


def test_too_few_particles_to_share(tmp_path):
    deck = write_deck(tmp_path, SPRINGS)
    run(deck, tmp_path / "one")
    done = mpirun(3, command(deck, tmp_path / "three"))
    assert "4 particles under forces are too few to be shared; one rank works, the other 2 wait" in done.stderr
    assert summary(tmp_path / "three")["ranks"] == 3
    assert compare.compare(tmp_path / "one", tmp_path / "three") == []


def test_more_ranks_than_there_is_work_for(tmp_path):
    done = mpirun(3, command(write_deck(tmp_path, SPHERES), tmp_path / "three", ["particles.0.count=20"]))
    assert "there is work for 2 of 3 ranks only" in done.stderr


def idle_seconds(output):
    """Processor time so far of each rank other than 0 of the run that writes there."""
    seconds = []
    for rank, pid in running(output).items():
        times = pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[11:13]
        if rank > 0:
            seconds.append(sum(map(int, times)) / os.sysconf("SC_CLK_TCK"))
    return seconds


def test_idle_ranks_sleep_and_share_the_exit_code(tmp_path):
    deck, out = write_deck(tmp_path, SPRINGS), tmp_path / "out"
    endless = command(deck, out, ["run.steps=100000000", "output.frame_interval=0.0"])
    job = start(4, endless)
    when_it_runs(job, out)
    before = idle_seconds(out)
    time.sleep(2)
    after = idle_seconds(out)
    job.terminate()
    job.wait()
    assert len(before) == len(after) == 3
    assert sum(after) - sum(before) < 0.3  # together; ranks that spin would take what the cores can give
    mpirun(4, endless + ["--max-wall", "00:00:01"], code=75)


def test_rank_0_stops_all(tmp_path):
    out = tmp_path / "out"
    mpirun(3, command(write_deck(tmp_path, SPHERES), out, ENDLESS, ("--quiet", "--max-wall", "00:00:01")), code=75)
    assert summary(out)["status"] == "interrupted" and summary(out)["steps"] > 0
    assert frames_are_sound(out) > 0


@pytest.mark.parametrize("change, code, words", [
    ("integrator.stpe=0.1", 2, "stpe"),
    ("placement.packing_fraction=0.9", 3, "overlap"),
    ("integrator.max_events_per_step=1", 4, "max_events_per_step"),
])
def test_an_error_of_all_ranks_is_reported_once(change, code, words, tmp_path):
    deck, out = write_deck(tmp_path, SPHERES), tmp_path / "out"
    errors = run(deck, tmp_path / "plain", [change], code=code).stderr
    done = mpirun(3, command(deck, out, [change]), code=code)
    assert words in errors
    # Of a step that cannot be done, one rank may know more than several.
    assert code == 4 or done.stderr.count(errors.strip()) == 1
    assert done.stderr.count(words) == errors.count(words)
    assert "carom: rank" not in done.stderr and "MPI_ABORT" not in done.stderr
    assert out.exists() == (tmp_path / "plain").exists() == (code == 4)
    assert code != 4 or summary(out)["status"] == "failed"


# 800 discs far from each other, of which the ranks have halves of the box. What is wrong is wrong at its right end.
APART = {
    "format": 1, "title": "an error that one rank meets",
    "system": {"dimension": 2, "box": [80.0, 40.0], "boundary": ["periodic", "periodic"]},
    "particles": [{"name": "disc", "radius": 0.5, "velocity": [[0.0, 0.0]] * 800,
                   "position": [[1 + 2.0 * (k // 20), 1 + 2.0 * (k % 20)] for k in range(800)]}],
    "interaction": [{"type": "lennard-jones", "epsilon": 1.0, "sigma": 1.0, "cutoff": 1.5}],
    "integrator": {"type": "verlet", "step": 0.01},
    "run": {"steps": 10},
    "output": {"directory": "unused", "frame_interval": 0.05, "thermo_interval": 0.05}}


def on_each_other(deck):
    deck["particles"][0]["position"][797] = deck["particles"][0]["position"][796][:]


def far_apart(deck):
    deck["integrator"]["type"] = "edda"
    deck["particles"][0]["velocity"][785:795] = [[0.0, -8.0]] + 8 * [[0.0, 0.0]] + [[0.0, 8.0]]
    deck["interaction"] = [{"type": "harmonic-bond", "pairs": [[785, 794]], "stiffness": 1e-3, "rest_length": 18.0}]


def too_many_collisions(deck):
    deck["integrator"] = {"type": "edda", "step": 0.5, "max_events_per_step": 1}
    deck["particles"][0]["velocity"][794:798] = 2 * [[0.0, 3.0], [0.0, -3.0]]


@pytest.mark.parametrize("spoil, words, of_one", [
    (on_each_other, "the force between particles 796 and 797, 0 apart, is too large or no number", True),
    (far_apart, "the bond of particles 785 and 794 spans nearly half the periodic box", True),
    (too_many_collisions, "more than max_events_per_step = 1 collisions in one step, the last between", False),
])
def test_an_error_of_one_rank_ends_all(spoil, words, of_one, tmp_path):
    deck = copy.deepcopy(APART)
    spoil(deck)
    path = write_deck(tmp_path, toml_text(deck))
    assert words in run(path, tmp_path / "plain", code=4).stderr
    for ranks in 2, 4:
        done = mpirun(ranks, command(path, tmp_path / str(ranks)), code=4)
        assert done.stderr.count(words) == 1
        assert ("carom: rank" in done.stderr) == of_one


def test_other_commands_speak_once(tmp_path):
    deck = write_deck(tmp_path, SPHERES)
    for arguments, code, words in [(["validate", deck], 0, "valid"), (["validate", tmp_path / "missing"], 5, "cannot read"),
                                   (["run", tmp_path / "missing"], 5, "cannot read"), (["--version"], 0, "compiler:"),
                                   (["run", deck, "--nonsense"], 2, "--nonsense")]:
        done = mpirun(3, [CAROM, *arguments], code=code)
        assert (done.stdout + done.stderr).count(words) == 1


def test_a_killed_rank(tmp_path):
    out = tmp_path / "out"
    job = start(3, command(write_deck(tmp_path, SPHERES), out, ENDLESS))
    os.kill(when_it_runs(job, out)[1], signal.SIGKILL)
    errors = job.communicate(timeout=60)[1]
    assert job.returncode != 0 and "rank 1" in errors and "Killed" in errors
    when_it_has_ended(out)
    assert len(data_sets(out / "trajectory.h5md")["particles/trajectory/position/step"]) >= 3
    assert len(thermo(out)["time"]) >= 3


def test_a_stopped_rank(tmp_path):
    out = tmp_path / "out"
    job = start(3, command(write_deck(tmp_path, SPHERES), out, ENDLESS, ("--quiet", "--silence", "2")))
    os.kill(when_it_runs(job, out)[1], signal.SIGSTOP)
    errors = job.communicate(timeout=60)[1]
    assert job.returncode == 70 and "no answer from rank 1 of 3 for 2 s" in errors
    assert summary(out)["status"] == "failed" and "rank 1 of 3" in summary(out)["error"]
    assert frames_are_sound(out) >= 3


def test_rank_0_cannot_write(tmp_path):
    out = tmp_path / "out"
    often = ["output.frame_interval=1.0", "output.thermo_interval=1.0"]
    job = start(3, command(write_deck(tmp_path, SPHERES), out, ENDLESS[:2] + often))
    rank_0 = when_it_runs(job, out)[0]
    room = (out / "trajectory.h5md").stat().st_size + 1000000
    resource.prlimit(rank_0, resource.RLIMIT_FSIZE, (room, resource.RLIM_INFINITY))
    errors = job.communicate(timeout=60)[1]
    assert job.returncode == 5 and "carom: rank 0 of 3: " in errors and "File too large" in errors
    assert summary(out)["status"] == "failed" and "File too large" in summary(out)["error"]
    assert frames_are_sound(out) >= 3


def test_a_rank_without_memory(tmp_path):
    out = tmp_path / "out"
    job = start(2, command(write_deck(tmp_path, SPHERES), out, ENDLESS))
    status = pathlib.Path(f"/proc/{when_it_runs(job, out)[1]}/status").read_text()
    job.terminate()
    job.communicate()
    # What a small run takes, and a little; a sphere takes some 300 bytes.
    limit = int(re.search(r"VmPeak:\s+(\d+) kB", status)[1]) + 20000
    limited = ["sh", "-c", f'if [ $OMPI_COMM_WORLD_RANK = 1 ]; then ulimit -v {limit}; fi; exec "$@"', "sh"]
    done = mpirun(2, limited + command(tmp_path / "input.toml", tmp_path / "large", ["particles.0.count=256000"]), code=70)
    assert "carom: rank 1 of 2: out of memory" in done.stderr


# Decks with fewer spheres than ranks.
FEW = {
    "one": ([[2.0, 2.0, 2.0]], [[1.0, 0.5, 0.25]]),
    "three": ([[1.0, 1.0, 1.0], [3.5, 3.5, 3.5], [1.0, 3.5, 1.0]], [[1.0, 0.5, 0.25], [-1.0, 0.3, 0.2], [0.2, 1.0, 0.3]])}


@pytest.mark.parametrize("boundary", ["periodic", "wall"])
@pytest.mark.parametrize("which", FEW)
def test_fewer_spheres_than_ranks(which, boundary, tmp_path):
    position, velocity = FEW[which]
    few = tomllib.loads(SPHERES) | {
        "system": {"dimension": 3, "box": [5.0, 5.0, 5.0], "boundary": ["periodic", boundary, "periodic"]},
        "particles": [{"name": "sphere", "position": position, "velocity": velocity, "radius": 0.5}],
        "run": {"end_time": 20.0},
        "output": {"directory": "unused", "frame_interval": 1.0, "thermo_interval": 1.0, "events": True,
                   "msd_interval": 0.5}}
    del few["placement"]
    run(write_deck(tmp_path, toml_text(few)), tmp_path / "plain")
    for ranks in 2, 4:
        mpirun(ranks, command("input.toml", tmp_path / str(ranks)), cwd=tmp_path)
        assert compare.compare(tmp_path / "plain", tmp_path / str(ranks)) == []
        assert filecmp.cmp(tmp_path / "plain" / "msd.csv", tmp_path / str(ranks) / "msd.csv", shallow=False)


def light_and_heavy(boundary):
    """Spheres of which the light ones fly through many boxes while the heavy ones move by a diameter."""
    deck = tomllib.loads(SPHERES) | {
        "system": {"dimension": 3, "box": [6.0, 6.0, 6.0], "boundary": ["periodic", boundary, "periodic"]},
        "particles": [
            {"name": "heavy", "radius": 0.5, "mass": 1000.0, "temperature": 1.0,
             "position": [[1.0, 1.0, 1.0], [1.0, 3.0, 3.0], [3.0, 1.0, 5.0], [5.0, 5.0, 5.0], [5.0, 3.0, 1.0]]},
            {"name": "light", "radius": 0.1, "mass": 0.001, "temperature": 1.0,
             "position": [[2.0, 2.0, 2.0], [4.0, 4.0, 4.0], [2.5, 4.5, 2.5]]}],
        "run": {"collisions": 1000}}
    del deck["placement"]
    return deck


# Heavy discs that fill the height of the box, and a light one between them: any number of collisions in any time.
WEDGED = {
    "format": 1, "system": {"dimension": 2, "boundary": ["periodic", "periodic"], "box": [5.141516051556095, 1.7138386838520316]},
    "particles": [{"name": "disc", "radius": 0.4284596709630079, "temperature": 0.2665408484358747,
                   "mass": [0.007280965091287921, 208.83535954699647, 0.0020785470182544726],
                   "position": [[1.2853790128890237, 1.2853790128890237], [0.4284596709630079, 1.2853790128890237],
                                [0.4284596709630079, 0.4284596709630079]]}],
    "integrator": {"type": "free-flight"}, "run": {"collisions": 30000},
    "output": {"directory": "unused", "frame_interval": 0.0, "thermo_interval": 0.0}}


@pytest.mark.parametrize("deck", [light_and_heavy("periodic"), light_and_heavy("wall"), WEDGED], ids=["light", "light-walled", "wedged"])
def test_what_one_rank_can_fly_so_can_several(deck, tmp_path):
    path = write_deck(tmp_path, toml_text(deck))
    run(path, tmp_path / "plain")
    for ranks in 2, 3:
        mpirun(ranks, command(path, tmp_path / str(ranks)))
        assert compare.compare(tmp_path / "plain", tmp_path / str(ranks)) == []


def test_too_many_collisions_in_a_window(tmp_path):
    path, limit = write_deck(tmp_path, toml_text(WEDGED)), ["integrator.max_events_per_step=9000"]
    plain = run(path, tmp_path / "plain", limit, code=4)
    done = mpirun(2, command(path, tmp_path / "two", limit), code=4)
    for text in plain.stderr, done.stderr:
        assert "more than max_events_per_step = 27000 collisions in one step" in text
