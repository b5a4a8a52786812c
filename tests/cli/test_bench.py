# SPDX-License-Identifier: BSD-3-Clause
"""Tiny runs of carom_bench: its reports, forces, bad usage; and tools/count-instructions, with a substitute for
valgrind. No times are checked."""

import json
import math
import os
import subprocess
import sys

import pytest

from runs import ROOT

BENCH = os.environ.get("CAROM_BENCH", "")
pytestmark = pytest.mark.skipif(not BENCH, reason="needs the program: CAROM_BENCH=build/release/tests/benchmarks/carom_bench")

QUICK = ["--equilibrate", "5", "--collisions", "2000"]


def bench(*arguments, code=0):
    done = subprocess.run([BENCH, *map(str, arguments)], capture_output=True, text=True, timeout=1200)
    assert done.returncode == code, (done.returncode, done.stdout, done.stderr)
    return done


def points(tmp_path, *arguments):
    table = bench(*arguments, "--json", tmp_path / "bench.json").stdout
    results = json.loads((tmp_path / "bench.json").read_text())
    assert results["version"] and "flags" in results["compiler"]
    for point in results["points"]:  # each has a line in the table
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
    assert per["crossings"] + per["rebuilds"] > 0  # no core always has all spheres as candidates
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
        assert point["equilibration_collisions"] > 10 * point["n"]  # an epoch has ten mean free times
        filled = point["packing_fraction"]  # Carnahan–Starling: this is the required fluid
        expected = (1 + filled + filled**2 - filled**3) / (1 - filled) ** 3
        assert abs(point["compressibility_factor"] / expected - 1) < 0.1


def test_discs(tmp_path):
    (point,) = points(tmp_path, "--dimension", 2, "--n", 200, "--packing-fraction", 0.5, "--repeat", 1, *QUICK)
    check(point)
    assert point["dimension"] == 2


def test_curve(tmp_path):
    """Each gas at each packing fraction, of lattices, at random and compressed."""
    quick = ["--n", 108, "--packing-fraction", 0.01, 0.35, "--collisions", 500, "--json", tmp_path / "bench.json"]
    table = bench("--curve", *quick).stdout
    points = json.loads((tmp_path / "bench.json").read_text())["points"]
    assert [(p.pop("n"), p.pop("packing_fraction")) for p in points] == [(108, 0.01), (108, 0.35)]
    for point in points:
        assert len(point) == 5 and all(rate > 0 for rate in point.values())
        assert all(name in table for name in point)
    assert "excludes" in bench("--curve", "--dimension", 2, code=2).stderr


def force_results(tmp_path, *arguments, **environment):
    done = subprocess.run([BENCH, "--forces", "--json", tmp_path / "bench.json", *map(str, arguments)],
                          capture_output=True, text=True, timeout=1200, env=os.environ | environment)
    assert done.returncode == 0, (done.stdout, done.stderr)
    results = json.loads((tmp_path / "bench.json").read_text())
    assert results["version"] and "flags" in results["compiler"]
    assert sum(line.split()[:1] == ["108"] for line in done.stdout.splitlines()) == len(results["forces"] + results["steps"])
    for entry in results["forces"] + results["steps"]:
        rate = entry["pairs_per_second" if "pairs" in entry else "steps_per_second"]
        assert 0 < rate["min"] <= rate["median"] <= rate["max"]
        assert entry["n"] == 108 and len(entry["repeats"]) == 2
        assert all(repeat["seconds"] > 0 for repeat in entry["repeats"])
    return results


def test_forces(tmp_path):
    quick = ["--n", 108, "--pairs", 5000, "--steps", 5, "--repeat", 2]
    results = force_results(tmp_path, *quick)
    potentials = ["lennard-jones", "wca", "yukawa", "inverse-power", "coulomb"]
    widths = [entry["width"] for entry in results["steps"]]
    assert widths[-1] == "sse2" and set(widths) <= {"sse2", "avx2", "avx512"}
    assert ([(e["potential"], e["kind"], e["width"]) for e in results["forces"]]
            == [(p, kind, width) for p in potentials for kind in ("forces", "mean forces") for width in widths])
    outcomes = {}  # all widths give identical bits
    for entry in results["forces"] + results["steps"]:
        assert all(repeat.get("passes", 0) * entry.get("pairs", 0) >= 5000 or repeat.get("steps") == 5
                   for repeat in entry["repeats"])
        key = entry["potential"], entry.get("kind")
        outcomes.setdefault(key, set()).add((entry["energy"], entry["checksum"], entry.get("pairs")))
    assert all(len(each) == 1 for each in outcomes.values()), outcomes
    assert len(set.union(*outcomes.values())) == len(outcomes) == 11
    pairs = [e["pairs"] for e in results["forces"] if e["potential"] == "yukawa" and e["kind"] == "forces"][0]
    assert abs(pairs / (108 / 2 * 0.8442 * 4 / 3 * math.pi * 2.5**3) - 1) < 0.1

    few = force_results(tmp_path, "--n", 108, "--pairs", 5000, "--repeat", 2, "--steps", 0, "--potential", "wca",
                        "--kind", "mean forces", CAROM_SIMD="sse2")
    (entry,) = few["forces"]
    assert (entry["potential"], entry["kind"], entry["width"]) == ("wca", "mean forces", "sse2") and not few["steps"]
    assert outcomes["wca", "mean forces"] == {(entry["energy"], entry["checksum"], entry["pairs"])}


@pytest.mark.parametrize("arguments, words", [
    (["--forces", "--collisions", "10"], "--collisions"),
    (["--forces", "--potential", "gravity"], "--potential"),
    (["--forces", "--kind", "strong"], "--kind"),
    (["--potential", "wca"], "--forces"),
    (["--n", "0"], "--n"),
    (["--n", "many"], "--n"),
    (["--packing-fraction", "1.5"], "--packing-fraction"),
    (["--packing-fraction", "-0.1"], "--packing-fraction"),
    (["--dimension", "4"], "--dimension"),
    (["--collisions", "0"], "--collisions"),
    (["--repeat", "0"], "--repeat"),
    (["--equilibrate", "-1"], "--equilibrate"),
    (["--fast"], "--fast"),
    (["--state", "x"], "--state"),
])
def test_bad_usage(arguments, words):
    assert words in bench(*arguments, code=2).stderr


def test_no_such_lattice():
    done = bench("--n", 1000, "--packing-fraction", 0.8, code=3)
    assert "overlap" in done.stderr and "packing fraction" in done.stderr


def test_files_that_cannot_be_used(tmp_path):
    done = bench("--n", 100, "--packing-fraction", 0.3, "--json", tmp_path / "nowhere" / "bench.json", *QUICK, code=5)
    assert "nowhere" in done.stderr and done.stdout == ""  # reported before any work


# Runs the program and reports $COST instructions per collision or pair.
VALGRIND = f"""#!{sys.executable}
import json, os, subprocess, sys
command = [word for word in sys.argv[1:] if not word.startswith(("--tool=", "--callgrind-out-file=", "--toggle-collect="))]
assert len(sys.argv) - len(command) == 4
subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
results = json.load(open(command[command.index("--json") + 1]))
out = next(word.split("=")[1] for word in sys.argv if word.startswith("--callgrind-out-file="))
forces = results.get("forces")
count = forces[0]["pairs"] * forces[0]["repeats"][0]["passes"] if forces else results["points"][0]["collisions"]
open(out, "w").write(f"totals: {{int(os.environ['COST']) * count}}\\n")
assert os.environ["CAROM_SIMD"] == (forces[0]["width"] if forces else "avx2")
"""


def test_count_instructions(tmp_path):
    (tmp_path / "valgrind").write_text(VALGRIND)
    (tmp_path / "valgrind").chmod(0o755)
    record = tmp_path / "record.json"

    def count(cost, *arguments, path=f"{tmp_path}:{os.environ['PATH']}", part=("--n", "1000")):
        return subprocess.run([sys.executable, ROOT / "tools" / "count-instructions", *part, "--record", record, *arguments],
                              env=os.environ | {"PATH": path, "COST": str(cost)}, capture_output=True, text=True,
                              timeout=1200)

    assert count(1000).returncode == 2  # nothing to compare
    bench("--n", 100, "--packing-fraction", 0.3, "--json", tmp_path / "bench.json", *QUICK)
    compiler = json.loads((tmp_path / "bench.json").read_text())["compiler"]
    values = [{"n": 1000, "packing_fraction": f, "instructions_per_collision": 1000.0} for f in (0.1, 0.3, 0.49)]
    values += [{"potential": potential, "kind": kind, "width": width, "instructions_per_pair": 100.0}
               for potential, kind in (("lennard-jones", "forces"), ("yukawa", "mean forces")) for width in ("sse2", "avx2")]
    record.write_text(json.dumps({"compiler": compiler, "points": values}))
    for cost, code in ((1000, 0), (1029, 0), (1031, 1), (500, 0)):
        done = count(cost)
        assert done.returncode == code, (cost, done.stdout, done.stderr)
    assert f"{0.031:+.1%}" in count(1031).stdout
    for cost, code in ((100, 0), (104, 1)):
        done = count(cost, part=["--forces"])
        assert done.returncode == code and done.stdout.count(f"{cost / 100 - 1:+.1%}") == 4, (done.stdout, done.stderr)
    assert count(1000, "--renew").returncode == 2  # part of the points only
    record.write_text(json.dumps({"compiler": "another", "points": values}))
    assert count(2000).returncode == 77
    assert count(2000, path=str(tmp_path / "empty")).returncode == 77  # no valgrind
