#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Runs the code blocks of a Markdown page, top to bottom, and compares their output with the page.

    tools/run_page.py inputs/tutorials/1-equation-of-state.md             # in a temporary directory
    tools/run_page.py PAGE -o build/page                                  # in this one; pictures stay there
    tools/run_page.py --renew PAGE                                        # writes the output into the page, its pictures beside it

Blocks marked `sh` are run by bash, those marked `python` by python3, both with the command, the tools and `import carom` at hand; a block
marked `toml` is written to the file that its first line names (`# deck.toml`). A block marked `text` holds the exact output of the block
before it. The decks in inputs/ are there.

Exit codes: 0 all output as on the page; 1 different output, or a block failed; 2 usage. The command is build/release/io/carom, or the
value of the environment variable CAROM.
"""

import argparse
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

from PIL import Image

from carom_files import one_line

ROOT = pathlib.Path(__file__).resolve().parents[1]
BLOCK = re.compile(r"^```(sh|python|toml|text)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def environment():
    command = pathlib.Path(os.environ.get("CAROM", ROOT / "build/release/io/carom")).resolve()
    path = f"{command.parent}:{ROOT / 'tools'}:{os.environ['PATH']}"
    modules = f"{command.parent / 'python'}:{os.environ.get('PYTHONPATH', '')}"
    mpi = dict(line.removeprefix("export ").split("=") for line in (ROOT / "tools/mpi-env.sh").read_text().splitlines()
               if line.startswith("export "))
    return os.environ | mpi | {"PATH": path, "PYTHONPATH": modules, "CAROM": str(command), "MPLBACKEND": "Agg"}


def run(kind, code, folder):
    """The output of a block; exits if the block fails."""
    if kind == "toml":
        first = code.splitlines()[0]
        (folder / first.removeprefix("# ")).write_text(code)
        return ""
    command = ["bash", "-euo", "pipefail", "-c", code] if kind == "sh" else ["/usr/bin/python3", "-c", code]
    done = subprocess.run(command, cwd=folder, env=environment(), stdout=subprocess.PIPE, text=True)
    if done.returncode:
        sys.exit(f"{done.stdout}\nthis block ended with exit code {done.returncode}:\n{code}")
    return done.stdout


@one_line
def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("page", type=pathlib.Path)
    parser.add_argument("-o", "--output", type=pathlib.Path, help="the directory to run in")
    parser.add_argument("--renew", action="store_true", help="write what was printed into the page, and the PNG pictures it shows beside it")
    options = parser.parse_args()
    text = options.page.read_text()
    with tempfile.TemporaryDirectory() as scratch:
        folder = options.output or pathlib.Path(scratch)
        folder.mkdir(parents=True, exist_ok=True)
        for deck in (ROOT / "inputs").rglob("*.toml"):
            (copy := folder / deck.relative_to(ROOT / "inputs")).parent.mkdir(exist_ok=True)
            shutil.copy(deck, copy)
        renewed, at, printed, wrong = [], 0, "", 0
        for block in BLOCK.finditer(text):
            kind, body = block[1], block[2]
            renewed.append(text[at:block.start()])
            at = block.end()
            if kind != "text":
                printed = run(kind, body, folder)
                renewed.append(block[0])
                continue
            renewed.append(f"```text\n{printed}```")
            if printed != body and not options.renew:
                print(f"{options.page}: the page says\n{body}and this was printed:\n{printed}")
                wrong = 1
        for picture in folder.glob("*.png"):
            if options.renew and f"]({picture.name})" in text:
                Image.open(picture).convert("RGB").quantize(64).save(options.page.with_name(picture.name), optimize=True)
    if options.renew:
        options.page.write_text("".join(renewed) + text[at:])
    sys.exit(wrong)


if __name__ == "__main__":
    main()
