# SPDX-License-Identifier: BSD-3-Clause
"""The manual page and the completions that cmake/about.py makes from the command's own descriptions."""

import re
import subprocess
import sys

import pytest

from runs import CAROM, ROOT, needs_carom

pytestmark = needs_carom


@pytest.fixture(scope="module")
def about(tmp_path_factory):
    folder = tmp_path_factory.mktemp("about")
    subprocess.run([sys.executable, ROOT / "cmake" / "about.py", CAROM, folder], check=True, timeout=1200)
    return folder


def complete(about, *words):
    """The completions of bash for the last word."""
    script = f'. {about}/carom.bash; compopt() {{ :; }}; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _carom; echo "${{COMPREPLY[*]}}"'
    done = subprocess.run(["bash", "-c", script, "bash", *words], capture_output=True, text=True, timeout=600)
    assert done.returncode == 0 and not done.stderr, done.stderr
    return done.stdout.split()


def test_bash_completes_commands_options_and_keys(about):
    assert complete(about, "carom", "val") == ["validate"]
    assert complete(about, "carom", "run", "--max") == ["--max-wall"]
    assert complete(about, "carom", "convert", "-") == ["-h", "--help", "--to", "-o", "--output", "--frames"]
    assert complete(about, "carom", "run", "--set", "particles.0.ra") == ["particles.0.radius="]
    assert complete(about, "carom", "run", "--set", "integrator.st") == ["integrator.step="]
    assert complete(about, "carom", "run", "inp") == []  # then bash offers files


def test_every_option_stands_everywhere(about):
    pages = [(about / name).read_text() for name in ("carom.1", "carom.bash", "_carom", "carom.fish")]
    pages[0] = pages[0].replace("\\-", "-")
    pages[3] = re.sub(r" -l (\S+)", r" --\1", pages[3])
    for command in ("run", "branch", "validate", "schema", "info", "convert", "view", "demo"):
        text = subprocess.run([CAROM, command, "--help"], capture_output=True, text=True, timeout=600).stdout
        options = re.findall(r"^  (?:-\w,)?(--[a-z-]+)", text, re.MULTILINE)
        assert "--help" in options
        for page in pages:
            assert re.search(rf"\b{command}\b", page)
            for name in options:
                assert re.search(rf"{name}(?![a-z-])", page), (name, page)


def test_the_manual_page_has_all_parts(about):
    page = (about / "carom.1").read_text()
    assert re.findall(r"^\.SH (.*)", page, re.MULTILINE) == ["NAME", "SYNOPSIS", "DESCRIPTION", "COMMANDS", "EXIT STATUS", "SIGNALS",
                                                             "THE DECK", "METHODS"]
    assert "\n\\fB\\-\\-set\\fR \\fIKEY=VALUE\\fR\n" in page.replace(".TP\n", "\n")
    assert "integrator.step" in (about / "_carom").read_text()


@pytest.mark.parametrize("former, instead", [("bench", "carom_bench"), ("manual", "man carom"), ("completion", "installed")])
def test_former_commands_say_what_to_do_instead(former, instead):
    for more in ([], ["--n", "1000"], ["zsh"], ["--help"]):
        done = subprocess.run([CAROM, former, *more], capture_output=True, text=True, timeout=600)
        assert done.returncode == 2 and instead in done.stderr and not done.stdout
    assert former not in subprocess.run([CAROM, "--help"], capture_output=True, text=True, timeout=600).stdout
