#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes the manual page of the command and its completion in bash, zsh and fish, from what the command says of itself.

    about.py CAROM FOLDER        leaves carom.1, carom.bash, _carom and carom.fish in the folder
"""

import pathlib
import re
import subprocess
import sys
from collections import namedtuple

Option = namedtuple("Option", "names value meaning")
CAROM, FOLDER = sys.argv[1], pathlib.Path(sys.argv[2])
COLUMN = 30  # where meanings begin in the help
TITLE = "event-driven molecular dynamics with smooth forces"
ENDINGS = {0: "done", 2: "a mistake in the deck or on the command line", 3: "an impossible initial state",
           4: "a numerical failure", 5: "trouble with files", 70: "a fault of the program, no memory, or a rank lost",
           75: "interrupted by a signal or --max-wall, to be continued"}


def said(*arguments):
    return subprocess.run([CAROM, *arguments], capture_output=True, text=True, check=True).stdout


def entries(text, section):
    """The head and the meaning of each entry in a section of the help."""
    part = re.search(rf"^{section}:\n((?:  .*\n)*)", text, re.MULTILINE)
    return re.findall(rf"^  (\S.*?)(?:\n {{{COLUMN}}}| {{2,}})(\S.*)\n", part[1], re.MULTILINE) if part else []


def option(head, meaning):
    names, _, rest = head.partition(" ")
    value = re.match(r"(?!REQUIRED)[A-Z]+\b(?:=VALUE|:MM:SS)?", rest)
    return Option(names.split("{")[0].split(","), value[0] if value else "", meaning)


def keys():
    """Keys of decks as --set names them: integrator.step, and particles.0.radius in a list."""
    table, found = "", set()
    for line in said("schema", "--markdown").splitlines():
        if head := re.match(r"## `(.*)`", line):
            name = re.match(r"\[+(\w+)\]", head[1])
            table = name[1] + (".0." if head[1].startswith("[[") else ".") if name else ""
        if key := re.match(r"\| `(\w+)`", line):
            found.add(table + key[1])
    return " ".join(sorted(found))


def roff(text):
    text = text.replace("\\", "\\e").replace("-", "\\-")
    return "\\&" + text if text[:1] in (".", "'") else text


def manual():
    lines = [f'.TH CAROM 1 "" "{roff(said("--version").splitlines()[0])}" "User Commands"', ".SH NAME",
             "carom \\- " + roff(TITLE), ".SH SYNOPSIS"]
    for name, command in COMMANDS.items():
        lines += [f".B carom {roff(name)}", *(f".I {roff(a.value)}" for a in command["arguments"]), ".RI [ OPTION ]...", ".br"]
    lines += [".SH DESCRIPTION", "Hard spheres and discs that also feel springs, gravity, charges and fields, with integrators that keep "
              "the energy through collisions. A run is described by a deck, a file in TOML.", ".SH COMMANDS"]
    for name, command in COMMANDS.items():
        lines += [f".SS carom {roff(name)}", roff(command["meaning"]) + "."]
        for each in command["options"]:
            value = f" \\fI{roff(each.value)}\\fR" if each.value else ""
            lines += [".TP", f"\\fB{roff(', '.join(each.names))}\\fR{value}", roff(each.meaning)]
    lines.append(".SH EXIT STATUS")
    for code, meaning in ENDINGS.items():
        lines += [".TP", str(code), roff(meaning)]
    lines += [".SH SIGNALS", "TERM, INT, HUP and USR2 write a checkpoint and stop the run, USR1 writes one and lets it go on."]
    for title, page in ("THE DECK", "schema"), ("METHODS", "methods"):
        lines += [".SH " + title, ".nf", *map(roff, said(page).splitlines()), ".fi"]
    return lines


def bash():
    cases = [f"    {name}) words='{' '.join(n for o in command['options'] for n in o.names)}' ;;"
             for name, command in COMMANDS.items()]
    return ["# Completion of carom in bash.", "_carom() {",
            "  local word=${COMP_WORDS[COMP_CWORD]} words=", "  COMPREPLY=()", "  case ${COMP_WORDS[1]} in", *cases, "  esac",
            f"  if [ \"$COMP_CWORD\" = 1 ]; then words='{' '.join(COMMANDS)} --help --version'",
            f"  elif [ \"${{COMP_WORDS[COMP_CWORD - 1]}}\" = --set ]; then compopt -o nospace; words='{KEYS.replace(' ', '= ')}='",
            "  elif [[ $word != -* ]]; then return; fi",
            "  mapfile -t COMPREPLY < <(compgen -W \"$words\" -- \"$word\")", "}", "complete -o default -F _carom carom"]


def is_file(each):
    return re.search("FILE|DIR|DECK|RUN|CHECKPOINT", each.value)


def zsh():
    def quoted(text):  # within '…' and […]
        return re.sub(r"([\[\]:\\])", r"\\\1", text).replace("'", "'\\''")

    lines = ["#compdef carom", "# Completion of carom in zsh.", "_carom() {", f"  local -a keys=({KEYS})",
             "  if (( CURRENT == 2 )); then", "    local -a commands=(",
             *(f"      '{name}:{quoted(command['meaning'])}'" for name, command in COMMANDS.items()),
             "    )", "    _describe command commands", "    return", "  fi", "  local command=$words[2]",
             "  shift words", "  (( CURRENT-- ))", "  case $command in"]
    for name, command in COMMANDS.items():
        words = []
        for each in command["options"]:
            then = ":key:compadd -S = -a keys" if "--set" in each.names else \
                f":{each.value.replace(':', '')}:{'_files' if is_file(each) else ' '}" if each.value else ""
            words += [f"'{'*' * ('--set' in each.names)}{n}[{quoted(each.meaning)}]{then}'" for n in each.names]
        words += [f"'*:{quoted(a.names[0])}:_files'" for a in command["arguments"]]
        lines.append(f"    {name}) _arguments -s " + " \\\n      ".join(words) + " ;;")
    return lines + ["  esac", "}", '_carom "$@"']


def fish():
    def quoted(text):
        return text.replace("\\", "\\\\").replace("'", "\\'")

    lines = ["# Completion of carom in fish."]
    for name, command in COMMANDS.items():
        lines.append(f"complete -c carom -n __fish_use_subcommand -f -a {name} -d '{quoted(command['meaning'])}'")
        for each in command["options"]:
            names = " ".join(("-l " if n.startswith("--") else "-s ") + n.lstrip("-") for n in each.names)
            values = (" -r" if is_file(each) else " -x") if each.value else ""
            set_keys = f" -a '{KEYS.replace(' ', '= ')}='" if "--set" in each.names else ""
            lines.append(f"complete -c carom -n '__fish_seen_subcommand_from {name}' {names}{values}{set_keys}"
                         f" -d '{quoted(each.meaning)}'")
    return lines


COMMANDS = {}
for name, meaning in entries(said("--help"), "Subcommands"):
    text = said(name, "--help")
    COMMANDS[name] = {"meaning": meaning, "options": [option(*each) for each in entries(text, "Options")],
                      "arguments": [option(*each) for each in entries(text, "Positionals")]}
KEYS = keys()
FOLDER.mkdir(parents=True, exist_ok=True)
for file, lines in ("carom.1", manual()), ("carom.bash", bash()), ("_carom", zsh()), ("carom.fish", fish()):
    (FOLDER / file).write_text("\n".join(lines) + "\n")
