# SPDX-License-Identifier: BSD-3-Clause
"""tools/scaling: the table, the check of the results, and a bundle that runs with its own libraries."""

import csv
import importlib.machinery
import importlib.util
import os
import re
import subprocess

import pytest

from runs import CAROM, ROOT, mpi_environment, needs_carom

pytestmark = needs_carom
SCALING = ROOT / "tools" / "scaling"


def module():
    loader = importlib.machinery.SourceFileLoader("scaling", str(SCALING))
    made = importlib.util.module_from_spec(importlib.util.spec_from_loader("scaling", loader))
    loader.exec_module(made)
    return made


def test_the_table_and_the_figure(tmp_path):
    done = subprocess.run([SCALING, "--ranks", "1,2", "--size", "0.005", "--repeat", "2", "--cases", "gas,fixed-gas,melt", "--carom", CAROM,
                           "-o", tmp_path / "out"], capture_output=True, text=True, env=mpi_environment())
    assert done.returncode == 0, done.stderr
    with open(tmp_path / "out/scaling.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [(row["case"], row["kind"], row["ranks"], row["particles"], row["same"]) for row in rows] == [
        ("gas", "weak", "1", "500", "yes"), ("gas", "weak", "2", "1000", "yes"), ("fixed-gas", "strong", "1", "5000", "yes"),
        ("fixed-gas", "strong", "2", "5000", "yes"), ("melt", "weak", "1", "160", "yes"), ("melt", "weak", "2", "320", "yes")]
    for one, two, share in ((0, 1, 1), (2, 3, 0.5), (4, 5, 1)):
        assert float(rows[two]["efficiency"]) == pytest.approx(share * float(rows[one]["seconds"]) / float(rows[two]["seconds"]), rel=0.1)
    assert (tmp_path / "out/scaling.png").stat().st_size > 10000


def test_results_that_differ_are_an_error(tmp_path, monkeypatch):
    scaling = module()
    monkeypatch.setattr(scaling, "seconds_of", lambda carom, deck, settings, ranks, output: (1.0, b"one" if ranks == 1 else b"other"))
    arguments = ["--ranks", "1,2", "--repeat", "1", "--carom", CAROM, "-o", str(tmp_path / "out"), "--cases"]
    scaling.main([*arguments, "gas"])  # two different systems
    with pytest.raises(SystemExit, match="Results differ"):
        scaling.main([*arguments, "fixed-gas"])


def test_wrong_arguments(tmp_path):
    for wrong, message in ((["--cases", "gass"], "there is no case gass"), (["--ranks", "two"], "give numbers"), (["--size", "0"], "must be positive")):
        done = subprocess.run([SCALING, *wrong], capture_output=True, text=True)
        assert done.returncode == 2 and message in done.stderr


def test_a_bundle_runs_with_its_own_libraries(tmp_path):
    """With an empty environment; the loader says which files it opens."""
    done = subprocess.run([SCALING, "--bundle", tmp_path / "bundle", "--carom", CAROM], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    size = sum(file.stat().st_size for file in (tmp_path / "bundle").rglob("*") if file.is_file())
    assert size < 60e6
    environment = {"PATH": "/usr/bin:/bin", "HOME": os.environ.get("HOME", "/tmp"), "OMPI_MCA_rmaps_base_oversubscribe": "1",
                   "LD_DEBUG": "files", "LD_DEBUG_OUTPUT": str(tmp_path / "loaded")}
    done = subprocess.run([tmp_path / "bundle/scaling", "--ranks", "1,2", "--size", "0.002", "--repeat", "1", "--cases", "fixed-gas",
                           "-o", tmp_path / "out"], capture_output=True, text=True, env=environment)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "out/scaling.csv").read_text().count("yes") == 2
    programs = 0
    for log in tmp_path.glob("loaded.*"):
        _, found, rest = log.read_text().partition(f"file={tmp_path}/bundle/bin/")  # after the shell that starts it
        programs += found != ""
        assert [file for file in re.findall(r"calling init: (/\S+)", rest) if not file.startswith(f"{tmp_path}/bundle/")] == []
    assert programs >= 5  # mpirun twice, the program three times
    again = subprocess.run([SCALING, "--bundle", tmp_path / "bundle", "--carom", CAROM], capture_output=True, text=True)
    assert again.returncode == 1 and "is there already" in again.stderr
