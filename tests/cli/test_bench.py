"""`carom bench`, tiny: what it reports, states written and read back, bad usage. And what tools/count-instructions makes
of it, with a stand-in for valgrind. No times are checked."""

import json
import os
import subprocess
import sys

import pytest

from runs import CAROM, ROOT, needs_carom

pytestmark = needs_carom

QUICK = ["--equilibrate", "5", "--collisions", "2000"]


def bench(*arguments, code=0):
    done = subprocess.run([CAROM, "bench", *map(str, arguments)], capture_output=True, text=True, timeout=120)
    assert done.returncode == code, (done.returncode, done.stdout, done.stderr)
    return done


def points(tmp_path, *arguments):
    table = bench(*arguments, "--json", tmp_path / "bench.json").stdout
    results = json.loads((tmp_path / "bench.json").read_text())
    assert results["version"] and "flags" in results["compiler"]
    for point in results["points"]:  # a line of the table for each
        assert any(line.split()[:2] == [str(point["n"]), f"{point['packing_fraction']:.3f}"]
                   for line in table.splitlines() if line.strip())
    return results["points"]


def check(point):
    """Relations that hold for any event core."""
    assert point.keys() == {"n", "dimension", "packing_fraction", "epoch", "equilibration_epochs", "equilibration_collisions", "collisions",
                            "collisions_per_second", "repeats", "bytes_per_particle", "per_collision",
                            "candidates_per_prediction", "stale_fraction", "compressibility_factor", "max_overlap"}
    rate, per = point["collisions_per_second"], point["per_collision"]
    assert 0 < rate["min"] <= rate["median"] <= rate["max"]
    assert point["collisions"] == sum(repeat["collisions"] for repeat in point["repeats"])
    assert all(repeat["collisions"] >= 2000 and repeat["seconds"] > 0 for repeat in point["repeats"])
    assert per.keys() == {"crossings", "rebuilds", "stale", "predictions", "scheduled"}
    assert per["predictions"] >= 2  # both partners of a collision
    assert per["scheduled"] >= 1 and per["stale"] >= 0
    assert per["crossings"] + per["rebuilds"] > 0  # no core sees everybody all the time
    assert point["candidates_per_prediction"] > 0
    assert 0 <= point["stale_fraction"] < 1
    assert point["bytes_per_particle"] is None or point["bytes_per_particle"] > 0
    assert point["max_overlap"] < 1e-12


def test_table(tmp_path):
    table = points(tmp_path, "--n", 256, 500, "--packing-fraction", 0.1, 0.3, "--repeat", 2, *QUICK)
    assert [(p["n"], round(p["packing_fraction"], 12)) for p in table] == [(256, 0.1), (256, 0.3), (500, 0.1), (500, 0.3)]
    for point in table:
        check(point)
        assert point["dimension"] == 3 and len(point["repeats"]) == 2
        assert point["equilibration_epochs"] == 5
        assert point["equilibration_collisions"] > 10 * point["n"]  # ten mean free times an epoch
        filled = point["packing_fraction"]  # Carnahan–Starling: it is the fluid that was asked for
        expected = (1 + filled + filled**2 - filled**3) / (1 - filled) ** 3
        assert abs(point["compressibility_factor"] / expected - 1) < 0.1


def test_discs(tmp_path):
    (point,) = points(tmp_path, "--dimension", 2, "--n", 200, "--packing-fraction", 0.5, "--repeat", 1, *QUICK)
    check(point)
    assert point["dimension"] == 2


@pytest.mark.parametrize("dimension", [2, 3])
def test_state(dimension, tmp_path):
    one, other = tmp_path / "one", tmp_path / "other"
    (made,) = points(tmp_path, "--dimension", dimension, "--n", 100, "--packing-fraction", 0.3, "--save-state", one, *QUICK)
    lines = one.read_text().splitlines()
    assert lines[0] == "100" and len(lines) == 102
    edges = list(map(float, lines[1].split()))
    assert len(edges) == dimension
    for line in lines[2:]:
        row = list(map(float, line.split()))
        assert len(row) == 2 * dimension + 1 and row[-1] == 0.5
        assert all(0 <= x < edge for x, edge in zip(row, edges))
    (measured,) = points(tmp_path, "--state", one, "--save-state", other, "--collisions", 2000)
    check(measured)
    assert measured["n"] == 100 and measured["dimension"] == dimension and measured["equilibration_collisions"] == 0
    assert one.read_bytes() == other.read_bytes()
    assert abs(measured["packing_fraction"] - made["packing_fraction"]) < 1e-12
    for key in ("epoch", "collisions", "per_collision", "candidates_per_prediction", "compressibility_factor"):
        assert measured[key] == made[key]  # the same run


@pytest.mark.parametrize("arguments, words", [
    (["--n", "0"], "--n"),
    (["--n", "many"], "--n"),
    (["--packing-fraction", "1.5"], "--packing-fraction"),
    (["--packing-fraction", "-0.1"], "--packing-fraction"),
    (["--dimension", "4"], "--dimension"),
    (["--collisions", "0"], "--collisions"),
    (["--repeat", "0"], "--repeat"),
    (["--equilibrate", "-1"], "--equilibrate"),
    (["--fast"], "--fast"),
    (["--n", "100", "200", "--packing-fraction", "0.3", "--save-state", "x"], "--save-state"),
    (["--n", "100", "--state", "x"], "--state"),
])
def test_bad_usage(arguments, words):
    assert words in bench(*arguments, code=2).stderr


def test_no_such_lattice():
    done = bench("--n", 1000, "--packing-fraction", 0.8, code=3)
    assert "overlap" in done.stderr and "packing fraction" in done.stderr


@pytest.mark.parametrize("text, line, code", [
    ("", 1, 2),
    ("two\n", 1, 2),
    ("2\n5 5 -5\n", 2, 2),
    ("2\n5 5 5 5\n", 2, 2),
    ("2\n5 5 5\n1 1 1 0 0 1 0.5\n", 4, 2),
    ("2\n5 5 5\n1 1 1 0 0 1 0.5\n3 1 1 0 0 nan 0.5\n", 4, 2),
    ("2\n5 5 5\n1 1 1 0 0 1 0.5\n3 1 1 0 0 1 0\n", 4, 2),
    ("2\n5 5 5\n1 1 1 0 0 0 0.5\n3 1 1 0 0 0 0.5\n", None, 3),  # at rest
    ("2\n5 5 5\n1 1 1 0 0 1 0.5\n1.5 1 1 0 0 1 0.5\n", None, 3),  # overlap
])
def test_bad_state(text, line, code, tmp_path):
    state = tmp_path / "state"
    state.write_text(text)
    done = bench("--state", state, *QUICK, code=code)
    assert (f"{state}:{line}: error" if line else str(state)) in done.stderr


def test_files_that_cannot_be_used(tmp_path):
    assert "missing" in bench("--state", tmp_path / "missing", code=5).stderr
    done = bench("--n", 100, "--packing-fraction", 0.3, "--json", tmp_path / "nowhere" / "bench.json", *QUICK, code=5)
    assert "nowhere" in done.stderr and done.stdout == ""  # said before any work


# Runs the command and counts a set-up of 10⁷ instructions and $COST instructions a collision.
VALGRIND = f"""#!{sys.executable}
import json, os, subprocess, sys
command = [word for word in sys.argv[1:] if not word.startswith("--tool") and not word.startswith("--callgrind")]
subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
results = json.load(open(command[command.index("--json") + 1]))
out = next(word.split("=")[1] for word in sys.argv if word.startswith("--callgrind-out-file="))
open(out, "w").write(f"totals: {{10**7 + int(os.environ['COST']) * results['points'][0]['collisions']}}\\n")
assert os.environ["CAROM_SIMD"] == "avx2"
"""


def test_count_instructions(tmp_path):
    (tmp_path / "valgrind").write_text(VALGRIND)
    (tmp_path / "valgrind").chmod(0o755)
    record = tmp_path / "record.json"

    def count(cost, *arguments, path=f"{tmp_path}:{os.environ['PATH']}"):
        return subprocess.run([sys.executable, ROOT / "tools" / "count-instructions", "--n", "1000", "--record", record,
                               *arguments], env=os.environ | {"PATH": path, "COST": str(cost)},
                              capture_output=True, text=True, timeout=120)

    assert count(1000).returncode == 2  # nothing to compare with
    bench("--n", 100, "--packing-fraction", 0.3, "--json", tmp_path / "bench.json", *QUICK)
    compiler = json.loads((tmp_path / "bench.json").read_text())["compiler"]
    values = [{"n": 1000, "packing_fraction": f, "instructions_per_collision": 1000.0} for f in (0.1, 0.3, 0.49)]
    record.write_text(json.dumps({"compiler": compiler, "points": values}))
    for cost, code in ((1000, 0), (1029, 0), (1031, 1), (500, 0)):
        done = count(cost)
        assert done.returncode == code, (cost, done.stdout, done.stderr)
    assert f"{0.031:+.1%}" in count(1031).stdout
    assert count(1000, "--renew").returncode == 2  # part of the points only
    record.write_text(json.dumps({"compiler": "another", "points": values}))
    assert count(2000).returncode == 77
    assert count(2000, path=str(tmp_path / "empty")).returncode == 77  # no valgrind
