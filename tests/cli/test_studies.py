# SPDX-License-Identifier: BSD-3-Clause
"""The studies of errors, costs and many ranks in tools/, with the real command ($CAROM)."""

import csv
import re
import sys
import tomllib

import numpy as np
import pytest

from runs import ROOT, mpi_environment, needs_carom

sys.path.insert(0, str(ROOT / "tools"))

import cost_study
import energy_study
import piles
import rank_study
import step_study
import studies
from carom_files import Trajectory
from synthetic_run import write_run


def test_orders_are_slopes():
    rows = [{"method": "m", "step": step, "max_abs_energy_error": 3 * step**2 * factor, "relative_energy_error": 1.0}
            for step in (0.3, 0.1, 0.01, 0.001) for factor in (0.1, 10)]
    steps, errors = energy_study.curve(rows, "m")
    assert errors == pytest.approx(3 * steps**2)
    assert energy_study.fitted_order(steps, errors * np.where(steps > 0.1, 1e6, 1), 0.1) == pytest.approx(2.0)
    options = energy_study.parse_arguments(["deck.toml", "--end-time", "6"])
    assert energy_study.describe(rows, "m", options) == "m: order 2.00"


def test_perturbed_starts_are_seeded_and_bounded():
    deck = tomllib.loads((ROOT / "inputs" / "five-springs.toml").read_text())
    moved = [energy_study.perturbed(deck, start, 0.01, 1)["particles"][0]["position"] for start in (0, 1, 1, 2)]
    assert moved[0] == deck["particles"][0]["position"]
    assert moved[1] == moved[2] != moved[3]
    assert 0.005 < np.max(np.abs(np.subtract(moved[0], moved[1]))) <= 0.01


def test_integrator_tables():
    assert studies.integrator_table("cdda:order=4", 0.1) == {"type": "cdda", "step": 0.1, "order": 4}
    assert studies.integrator_table("mcva:variant=restart", 1.0)["variant"] == "restart"
    assert studies.integrator_table("edda:accuracy=1e-4", None) == {"type": "edda", "accuracy": 1e-4}


def rows_of(study, table, directory, deck, *options):
    """Runs a study of a deck of inputs/ and checks its table and picture."""
    study.main([str(ROOT / "inputs" / f"{deck}.toml"), *options, "-o", str(directory)])
    assert (directory / f"{table}.png").stat().st_size > 1000
    with open(directory / f"{table}.csv", newline="") as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize("study", [energy_study, cost_study, step_study, rank_study])
def test_a_deck_or_a_command_that_is_not_there_is_one_line(tmp_path, study):
    (tmp_path / "text.toml").write_text("no deck")
    sound, here = str(ROOT / "inputs" / "five-springs.toml"), ["-o", str(tmp_path / "out")]
    for arguments, told in (([str(tmp_path / "nowhere.toml")], "nowhere.toml: No such file or directory"),
                            ([str(tmp_path / "text.toml")], "text.toml: is not a deck"),
                            ([sound, "--carom", "/nowhere/carom"], "/nowhere/carom: there is no such command")):
        with pytest.raises(SystemExit, match=f"^[^\n]*{told}[^\n]*$"):
            study.main([*arguments, *([] if study is rank_study else ["--steps", "0.1"]), *here])


@needs_carom
def test_energy_study(tmp_path, capsys):
    rows = rows_of(energy_study, "energy", tmp_path, "five-springs", "--methods", "psa,cva,cdda",
                   "--steps", "0.1,0.05,0.025", "--end-time", "6", "--starts", "4")
    assert len(rows) == 3 * 3 * 4 and {row["status"] for row in rows} == {"done"}
    orders = {method: energy_study.fitted_order(*energy_study.curve(rows, method), 0.1) for method in ("psa", "cva")}
    assert orders["psa"] == pytest.approx(1.0, abs=0.5)
    assert orders["cva"] == pytest.approx(2.0, abs=0.5)
    assert max(float(row["relative_energy_error"]) for row in rows if row["method"] == "cdda") < 1e-12


@needs_carom
def test_cost_study(tmp_path, capsys):
    rows = rows_of(cost_study, "work", tmp_path, "five-springs", "--methods", "cva,cdda,edda",
                   "--steps", "0.02,0.01", "--end-time", "3", "--repeats", "1")
    assert len(rows) == 3 * 2
    for coarse, fine in zip(rows[::2], rows[1::2]):
        assert float(coarse["position_error"]) / float(fine["position_error"]) == pytest.approx(4, rel=0.5)
        assert float(fine["energy_error"]) < (1e-12 if fine["method"].endswith("dda") else 1e-3)
    rows = rows_of(cost_study, "cost", tmp_path, "spring-lattice", "--methods", "cdda,edda", "--counts", "16,144",
                   "--end-time", "1", "--repeats", "1")
    passes = [float(row["passes_per_step"]) for row in rows]
    assert passes[1] > 3 * passes[0]  # each collision cuts the step of all particles
    assert passes[3] == pytest.approx(passes[2], rel=0.3)


@needs_carom
def test_step_study(tmp_path, capsys):
    deck = str(ROOT / "inputs" / "five-springs.toml")
    step_study.main([deck, "--end-time", "3", "--methods", "psa,edda", "--steps", "0.1,0.05", "--accuracies", "1e-5,1e-3", "--means", "potential",
                     "--reference", "cdda:order=4:step=0.005", "-o", str(tmp_path)])
    with open(tmp_path / "steps.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [(row["method"], row["step or accuracy"]) for row in rows] == [
        ("psa", "step 0.1"), ("psa", "step 0.05"), ("edda", "step 0.1"), ("edda", "step 0.05"), ("edda", "accuracy 1e-03"), ("edda", "accuracy 1e-05")]
    assert [row["energy error"] == "rounding" for row in rows] == [False, False, True, True, True, True]
    assert [int(row["steps"]) for row in rows[:4]] == [30, 60, 30, 60] and [int(row["force passes"]) for row in rows[:2]] == [31, 61]
    for coarse, fine in (rows[2:4], rows[4:6]):
        assert float(fine["position error"]) < 0.5 * float(coarse["position error"])
        assert int(coarse["force passes"]) < int(fine["force passes"])
    assert all(re.fullmatch(r"0\.\d+ \+- \d\.\d+|0\.\d+ \+- \?", row["potential"]) for row in rows)
    assert len(capsys.readouterr().out.splitlines()) == 1 + len(rows)
    with pytest.raises(SystemExit, match="^There is no mean height, only pressure, "):
        step_study.main([deck, "--steps", "0.1", "--end-time", "1", "--means", "height", "-o", str(tmp_path)])


@needs_carom
def test_piles(tmp_path, capsys):
    assert piles.main(["balls", "--only", "e=0.5", "--methods", "edda,psa", "-o", str(tmp_path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 2 + 8 and lines[-1] == "8 runs, 0 not as they should be"
    rest = [re.search(r"rest after ([\d.]+), formula ([\d.]+)$", line).groups() for line in lines[1:-1]]
    assert [abs(float(found) - float(formula)) < 0.03 for found, formula in rest[::2]] == [True] * 4
    assert piles.main(["random", "--seeds", "2", "--only", "seed=2", "--methods", "edda", "-o", str(tmp_path)]) == 0
    assert piles.main(["balls", "--only", "e=0.5_rest=0.1", "--methods", "edda", "--carom", "/bin/false", "-o", str(tmp_path)]) == 1
    assert "FAILS" in capsys.readouterr().out


def test_overlaps_of_piles_are_those_of_all_frames(tmp_path):
    x = np.array([[[9.2, 1.0], [0.1, 1.0]], [[9.0, 1.0], [0.1, 1.0]]])  # 0.9 and 1.1 apart across the periodic edge
    write_run(tmp_path / "run", np.ones(2), x=x, v=np.zeros_like(x), edges=np.full(2, 10.0), boundary=["periodic", "wall"], radius=0.5)
    assert piles.deepest_overlap(tmp_path / "run") == pytest.approx(0.1)


def test_means_are_rounded_to_their_errors():
    assert step_study.with_error(-1004.2345, 0.4712) == "-1004.23 +- 0.47"
    assert step_study.with_error(1.14009, 0.00052) == "1.14009 +- 0.00052"
    assert step_study.with_error(1234.5, 31.4) == "1234 +- 31"
    assert step_study.with_error(1.23456, None) == "1.235 +- ?"


def test_bond_lengths_are_means_over_chains(tmp_path):
    x = np.zeros((3, 4, 3))  # two chains of two; bonds of 1 and 2, in the first frame of 5
    x[:, 1, 0], x[:, 3, 1], x[:, 2:, 2] = [5, 1, 1], [5, 2, 2], 3
    write_run(tmp_path / "run", np.ones(3), x=x, v=np.zeros_like(x), edges=np.full(3, 10.0), boundary=["wall"] * 3)
    with Trajectory(tmp_path / "run") as trajectory:
        mean, error = step_study.bond_length(trajectory, 2)
    assert mean == pytest.approx(1.5) and error == pytest.approx(0.5)


def test_the_model_of_ranks_takes_from_counts_what_is_in_them(capsys):
    log = ("pressure 2.28\n1795 windows, 2.02 rounds each; events at borders run twice 27.5%, redone 0.20%, "
           "imbalance 1.0%\npart  seconds")
    assert rank_study.counts_of(log) == pytest.approx(
        {"windows": 1795, "rounds": 2.02, "twice": 0.275, "redone": 0.002, "imbalance": 0.01})
    with pytest.raises(SystemExit):
        rank_study.counts_of("done at time 50\n")
    rows = [{"ranks": P, "per_rank": n, "windows": 30, "events": 0.15 * n, "rounds": 1 + 0.1 * np.log2(P * n ** (2 / 3)),
             "twice": (1 + 1.5 * n ** (-1 / 3)) ** 3 - 1, "redone": 0.04 * n ** (-1 / 3),
             "imbalance": 2 * np.sqrt(2 * np.log(P) / (4.5 * n))} for P in (8, 64) for n in (500, 4000)]
    rows.append(rows[0] | {"ranks": 2, "twice": 9.0})  # no neighbours on some sides: not in the fit
    fitted = rank_study.fit(rows, 3)
    assert fitted == pytest.approx({"dimension": 3, "h": 1.5, "r": 0.04, "a": 1.0, "b": 0.1, "events": 0.15, "imbalance": 2.0})
    options = rank_study.parse_arguments(["--rate", "1e6", "--latency", "1e-5", "--overhead", "1e-6"])
    row = rank_study.modelled(fitted, options, 1024, 10**6)
    assert row["rounds"] == pytest.approx(1 + 0.1 * (10 + 2 / 3 * 6 * np.log2(10)))
    messages = (row["rounds"] + 1 + 10 * (row["rounds"] + 3)) * 1e-5 + (row["rounds"] + 1) * 27e-6
    assert row["messages"] == pytest.approx(messages / 0.15)
    assert row["efficiency"] == pytest.approx(
        1 / (1.015**3 + 0.0004 + 2 * np.sqrt(2 * np.log(1024) / 0.15e6) + messages / 0.15))


@needs_carom
def test_rank_study(tmp_path, capsys, monkeypatch):
    for name, value in mpi_environment().items():
        monkeypatch.setenv(name, value)
    rows = rows_of(rank_study, "ranks", tmp_path, "hard-sphere-fluid", "--ranks", "2,8,16", "--per-rank", "100,400",
                   "--most", "3200", "--rate", "1e6")
    assert [(int(row["ranks"]), int(row["per_rank"])) for row in rows] == [
        (2, 100), (8, 100), (16, 100), (2, 400), (8, 400)]
    for row in rows:
        assert int(row["windows"]) > 20 and 1 <= float(row["rounds"]) < 4
        events = float(row["events"]) * int(row["windows"]) * int(row["ranks"])
        assert events == pytest.approx(5 * int(row["particles"]))
        assert 0 < float(row["redone"]) < 0.05
    twice = [float(row["twice"]) for row in rows]
    assert twice[0] < twice[1] and twice[4] < twice[1]  # larger for ranks with neighbours on all sides, and for small ranks
    printed = capsys.readouterr().out
    assert "One core: 1e+06 collisions/s (given)" in printed
    with open(tmp_path / "model.csv", newline="") as file:
        model = {(int(row["ranks"]), int(row["per_rank"])): float(row["efficiency"]) for row in csv.DictReader(file)}
    assert 0 < model[10000, 10**4] < model[64, 10**4] < model[64, 10**6] < 1
