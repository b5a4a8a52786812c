# SPDX-License-Identifier: BSD-3-Clause
"""Runs the real command on files that decks name, and on decks, that cannot be read or are too large for the machine."""

import pytest

from decks import FLUID, both, carom, changed, lennard_jones, table, validate
from runs import needs_carom

pytestmark = needs_carom

PLACES = changed('type = "fcc"', 'type = "file"\nfile = "places.csv"', FLUID).replace("count = 64", "count = 2")


def test_positions_file(tmp_path):
    answer = validate(tmp_path, PLACES)
    assert (answer.returncode, "places.csv" in answer.stderr) == (5, True)
    (tmp_path / "places.csv").write_text("x,y,z\n1,1,1\n2.5 1 oops\n")
    answer = validate(tmp_path, PLACES)
    assert answer.returncode == 2
    assert "places.csv:3:7: error: not a position: 'oops' is no finite number; give 3 finite numbers" in answer.stderr
    (tmp_path / "places.csv").write_text("x,y,z\n1,1,1\n")
    answer = validate(tmp_path, PLACES)
    assert answer.returncode == 2
    assert "1 positions for 2 particles" in answer.stderr
    for good in (b"x,y,z\n1,1,1\n2.5 1 +1  # on the floor\n", b"x,y,z\r\n1,1,1\r\n2.5,1,1\r\n", b"\n# places\n\"x\" \"y\" \"z\"\n1;1;1\n2.5;1;1"):
        (tmp_path / "places.csv").write_bytes(good)
        assert validate(tmp_path, PLACES).returncode == 0


@pytest.mark.parametrize("contents, words", [
    (b"", "0 positions for 2 particles"),
    (b"nan 1 1\n2 2 2\n", "places.csv:1:1: error: not a position: 'nan' is no finite number"),
    (b"1 1 1\n2 -inf 2\n", "places.csv:2:3: error: not a position: '-inf' is no finite number"),
    (b"1 1 1\n2 2 1e999\n", "places.csv:2:5: error: not a position: '1e999' is no finite number"),
    (b"1 1 1.o\n2 2 2\n", "places.csv:1:5: error: not a position: '1.o' is no finite number"),
    (b"x y z\nin nm\n1 1 1\n2 2 2\n", "places.csv:2:1: error: not a position: 'in' is no finite number"),
    (b"1 1\n2 2\n", "places.csv:1:1: error: not a position: there are 2 numbers"),
    (b"1 1 1 1\n2 2 2 2\n", "places.csv:1:1: error: not a position: there are 4 numbers"),
    (b"1 1 1\n" + 1000000 * b"\x80\xff", "places.csv:2:1: error: not a position: '" + 20 * "?" + "…' is no finite number"),
    (b"1 1 1\n" + 1000000 * b"1 ", "places.csv:2:1: error: not a position: there are 1000000 numbers"),
    (b"1 1 1\n" + 100000 * b"2 2\n", "places.csv:11:1: error: not a position: there are 2 numbers"),
], ids=[str(n) for n in range(11)])  # the contents are too long for names
def test_odd_positions_files(contents, words, tmp_path):
    (tmp_path / "places.csv").write_bytes(contents)
    answer = validate(tmp_path, PLACES)
    assert answer.returncode == 2 and words in answer.stderr, answer.stderr[:500]
    assert len(answer.stderr) < 3000  # no message for each line of a wrong file


def test_potential_from_a_file(tmp_path):
    deck = changed("collisions = 10", "steps = 10", table('file = "potential.csv"'))
    answer = validate(tmp_path, deck)
    assert (answer.returncode, "potential.csv" in answer.stderr) == (5, True)
    (tmp_path / "potential.csv").write_text("r,V\n0.9,1\n1.2\n")
    answer = validate(tmp_path, deck)
    assert answer.returncode == 2
    assert "potential.csv:3:1: error: not a point of a potential: there is 1 number; give 2 finite numbers" in answer.stderr
    (tmp_path / "potential.csv").write_text("r,V\n0.9,1\n1.2,0.5\n1.2,0\n")
    answer = validate(tmp_path, deck)
    assert answer.returncode == 2
    assert "deck.toml:17:1: error: table: the distances do not ascend" in answer.stderr
    (tmp_path / "potential.csv").write_text("r,V\n0.9 1\n1.2 0.5 # there\n1.5 0\n")
    assert validate(tmp_path, deck).returncode == 0
    run = carom("run", "deck.toml", "-o", "one", "--quiet", cwd=tmp_path)
    assert run.returncode == 0, run.stderr
    resolved = (tmp_path / "one" / "deck.toml").read_text()
    assert "r = [0.9, 1.2, 1.5]\nvalue = [1.0, 0.5, 0.0]" in resolved and "cutoff = 1.5" in resolved and "file = " not in resolved


def test_unreadable_deck(tmp_path):
    for path in ("nowhere.toml", "."):
        answer = carom("validate", path, cwd=tmp_path)
        assert answer.returncode == 5
        assert "cannot read this deck" in answer.stderr


def test_more_than_there_is_memory_for(tmp_path):
    huge = changed("count = 64", "count = 900000000", changed("[6.0, 6.0, 6.0]", "[6000.0, 6000.0, 6000.0]", FLUID))
    both(tmp_path, huge, 3, "deck.toml:8:", "error: a run of 900000000 particles needs about ", "GB of memory; ", "GB are free here")
    both(tmp_path, changed("collisions = 10", "steps = 10", lennard_jones("cutoff = 5.5e12")), 3, "deck.toml:17:", "GB of memory; ", "take a shorter cutoff")


def test_inputs_without_end_and_other_than_text(tmp_path):
    zero = carom("validate", "/dev/zero", cwd=tmp_path)
    assert (zero.returncode, zero.stderr) == (5, "/dev/zero: error: this is no text, it has zero bytes; check the path\n")
    places = changed('type = "fcc"', 'type = "file"\nfile = "/dev/zero"', FLUID)
    both(tmp_path, places, 5, "/dev/zero: error: this is no text")
    both(tmp_path, changed("collisions = 10", "steps = 10", table('file = "/dev/zero"')), 5, "/dev/zero: error: this is no text")
