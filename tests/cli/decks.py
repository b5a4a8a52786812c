# SPDX-License-Identifier: BSD-3-Clause
"""Common parts of the tests of bad input: two decks, changes of them, and the messages of the command."""

import subprocess

from runs import CAROM

GOOD = """\
format = 1
title = "two discs"

[system]
dimension = 2
box = [10.0, 10.0]
boundary = ["wall", "wall"]

[[particles]]
name = "disc"
position = [[2.0, 5.0], [5.0, 5.0]]
velocity = [[1.0, 0.0], [0.0, 0.0]]
radius = 0.5
mass = 1.0

[[interaction]]
type = "harmonic-bond"
pairs = [[0, 1]]
stiffness = 1.0
rest_length = 2.0

[integrator]
type = "cdda"
step = 0.01

[run]
steps = 10
"""

FLUID = """\
format = 1

[system]
dimension = 3
box = [6.0, 6.0, 6.0]
boundary = ["periodic", "periodic", "periodic"]

[[particles]]
name = "sphere"
count = 64
temperature = 1.0
radius = 0.5

[placement]
type = "fcc"

[integrator]
type = "free-flight"

[run]
collisions = 10
"""


def carom(*arguments, cwd=None):
    return subprocess.run([CAROM, *arguments], capture_output=True, text=True, timeout=600, cwd=cwd)


def validate(tmp_path, text, *arguments):
    (tmp_path / "deck.toml").write_text(text)
    return carom("validate", "deck.toml", *arguments, cwd=tmp_path)


def changed(old, new, deck=GOOD):
    assert deck.count(old) == 1, f"{old!r} stands {deck.count(old)} times in the deck"
    return deck.replace(old, new)


def lennard_jones(more):
    return changed("[integrator]\ntype = \"free-flight\"",
                   f'[[interaction]]\ntype = "lennard-jones"\nepsilon = 1\nsigma = 1\n{more}\n[integrator]\ntype = "verlet"\nstep = 0.1',
                   FLUID.replace("radius", "display_radius"))


def walled(keys):
    return changed("[[particles]]", f"[[wall]]\n{keys}\n[[particles]]")


def touching(keys):
    return changed("[[particles]]", f"[[contact]]\n{keys}\n[[particles]]")


def bathed(keys):
    return changed("[[particles]]", f"[[bath]]\n{keys}\n[[particles]]")


def stepped(keys, method="edda"):
    return changed('"cdda"', f'"{method}"', changed("[[particles]]", f"[[step]]\n{keys}\n[[particles]]"))


def rough(keys, of_particles=""):
    """GOOD with a contact between all, at line 9, and more keys of the particles."""
    return changed("mass = 1.0", f"mass = 1.0\n{of_particles}",
                   changed("[[particles]]", f'[[contact]]\nbetween = ["*", "*"]\n{keys}\n[[particles]]'))


def table(more):
    return lennard_jones(more).replace('"lennard-jones"\nepsilon = 1\nsigma = 1', '"table"')


def both(tmp_path, text, code, *parts):
    """`validate` and `run` refuse this deck with equal messages."""
    for answer in validate(tmp_path, text), carom("run", "deck.toml", "-o", "out", "--quiet", cwd=tmp_path):
        assert answer.returncode == code, answer.stderr
        for part in parts:
            assert part in answer.stderr
        assert len(answer.stderr.splitlines()) == 1
    assert not (tmp_path / "out").exists()
