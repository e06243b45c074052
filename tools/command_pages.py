#!/usr/bin/env python3
"""Make manual page and completion of a command from what its --help says.

usage: command_pages.py FOLDER perigeo PROGRAM | command_pages.py FOLDER perigeo-post

Below FOLDER: man/man1/COMMAND.1, bash-completion/completions/COMMAND,
zsh/site-functions/_COMMAND and fish/vendor_completions.d/COMMAND.fish. Needs the standard library,
for perigeo-post also the package itself.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

VERSION = (Path(__file__).parents[1] / "VERSION").read_text(encoding="utf-8").strip()
COLUMN = 22  # of the help of perigeo, where meanings begin


@dataclass
class Option:
    """An option: its names, the word for its value, its meaning, the values it can have."""

    names: list[str]
    value: str = ""
    meaning: str = ""
    choices: list[str] = field(default_factory=list)


@dataclass
class Command:
    """A command, or a command of a command."""

    name: str
    usage: str
    about: str
    options: list[Option] = field(default_factory=list)
    files: list[str] = field(default_factory=list)  # endings of what it works on
    rest: str = ""  # paragraphs behind the options, as they are
    parts: list[Command] = field(default_factory=list)


# --------------------------------------------------------------------------- what --help says


def from_help(name: str, program: str) -> Command:
    """The command that `PROGRAM --help` describes: perigeo."""
    text = subprocess.run([program, "--help"], check=True, capture_output=True, text=True).stdout
    lines = text.splitlines()
    usage = next(k for k, line in enumerate(lines) if line.startswith("usage: "))
    command = Command(name, lines[usage][len("usage: ") :], " ".join(lines[:usage]).strip())
    command.files = re.findall(r"[A-Z]+(\.\w+)", command.usage)
    last = max(k for k, line in enumerate(lines) if line.startswith("  --"))
    while last + 1 < len(lines) and lines[last + 1].startswith(" " * COLUMN):
        last += 1
    first = next(k for k, line in enumerate(lines) if line.startswith("  --"))
    for line in lines[first : last + 1]:
        if line.startswith("  --"):
            names, _, meaning = line[2:].partition("  ")
            command.options += named(names)
            command.options[-1].meaning = meaning.strip()
        else:
            option = command.options[-1]
            option.meaning = f"{option.meaning} {line.strip()}".strip()
    between = [line for line in lines[usage + 1 : first] if not line.startswith("  ")]
    command.rest = "\n".join([*between, *lines[last + 1 :]]).strip("\n")
    return command


def named(words: str) -> list[Option]:
    """Options of a line of help: '--threads N', '--version, --help'."""
    found = []
    for part in words.split(","):
        name, _, value = part.strip().partition(" ")
        if name.startswith("--"):
            found.append(Option([name], value.strip()))
    return found


def from_parser(parser: argparse.ArgumentParser, about: str = "") -> Command:
    """The command that a parser reads: perigeo-post."""
    usage = " ".join(parser.format_usage().split()[1:])
    command = Command(parser.prog, usage, about or (parser.description or ""))
    command.rest = parser.epilog or ""
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            words = {choice.dest: choice.help or "" for choice in action._choices_actions}
            command.parts = [from_parser(p, words[name]) for name, p in action.choices.items()]
        elif action.option_strings:
            choices = [str(choice) for choice in action.choices or []]
            value = "" if action.nargs == 0 else worded(action)
            meaning = (action.help or "") % {"default": action.default, "prog": parser.prog}
            command.options.append(Option(list(action.option_strings), value, meaning, choices))
        else:
            command.files += re.findall(r"(\.\w+)", worded(action))
    return command


def worded(action: argparse.Action) -> str:
    """The word for the value of an argument."""
    if isinstance(action.metavar, tuple):
        return " ".join(action.metavar)
    return action.metavar or (action.dest or "").upper()


# --------------------------------------------------------------------------- manual page


def roff(text: str) -> str:
    """A text as roff takes it, line by line."""
    text = text.replace("\\", "\\e").replace("-", "\\-")
    return "\n".join("\\&" + line if line[:1] in ("'", ".") else line for line in text.split("\n"))


def manual(command: Command) -> str:
    """The manual page."""
    short = re.split(r"[.:] ", command.about.removeprefix(command.name + ": "))[0].rstrip(".")
    lines = [
        f'.TH "{command.name.upper()}" 1 "" "perigeo {VERSION}" "perigeo"',
        ".SH NAME",
        f"{roff(command.name)} \\- {roff(short)}",
        ".SH SYNOPSIS",
        roff(command.usage),
        ".SH DESCRIPTION",
        roff(command.about),
        ".SH OPTIONS",
        *described(command.options),
    ]
    if command.parts:
        lines.append(".SH COMMANDS")
    for part in command.parts:
        lines += [f".SS {roff(part.name)}", roff(part.about[:1].upper() + part.about[1:]) + "."]
        lines += [".PP", roff(part.usage), *described(part.options)]
        lines += [".PP", ".nf", roff(part.rest), ".fi"]
    if command.rest:
        lines += [".SH NOTES", ".nf", roff(command.rest), ".fi"]
    return "\n".join(lines) + "\n"


def described(options: list[Option]) -> list[str]:
    """The options of a page."""
    lines = []
    for option in options:
        names = ", ".join(f"\\fB{roff(name)}\\fR" for name in option.names)
        value = f" \\fI{roff(option.value)}\\fR" if option.value else ""
        lines += [".TP", names + value, roff(option.meaning)]
    return lines


# --------------------------------------------------------------------------- completion


def kind(option: Option) -> str:
    """What the value of an option is: words, folder, file, or anything."""
    if option.choices:
        return "words"
    if re.search(r"\bDIR\b", option.value):
        return "folder"
    return "file" if re.search(r"FILE|PATH|FIGURE|PAGE|CSV|\.\w+$", option.value) else "any"


def bash(command: Command) -> str:
    """Completion for bash; without the package bash-completion too."""
    function = "_" + command.name.replace("-", "_")
    parts = command.parts or [command]
    cases = []
    for part in parts:
        cases += bash_case(part, part.name.split()[-1] if command.parts else "*")
    first = []
    if command.parts:
        words = " ".join(part.name.split()[-1] for part in parts)
        options = " ".join(name for option in command.options for name in option.names)
        first = [
            "  if [[ $COMP_CWORD -eq 1 ]]; then",
            f"    COMPREPLY=($(compgen -W '{words} {options}' -- \"$cur\")); return",
            "  fi",
        ]
    which = '"${COMP_WORDS[1]}"' if command.parts else '""'
    return "\n".join(
        [
            f"# Completion of {command.name} for bash; made from its --help.",
            "shopt -s extglob",
            f"{function}() {{",
            '  local cur="${COMP_WORDS[COMP_CWORD]}" prev="${COMP_WORDS[COMP_CWORD-1]}"',
            "  compopt -o filenames 2>/dev/null",
            *first,
            f"  case {which} in",
            *cases,
            "  esac",
            "}",
            f"complete -F {function} {command.name}",
            "",
        ]
    )


def bash_case(part: Command, word: str) -> list[str]:
    """What bash offers behind one command."""
    values = []
    for option in part.options:
        if not option.value:
            continue
        reply = {
            "words": f"COMPREPLY=($(compgen -W '{' '.join(option.choices)}' -- \"$cur\"))",
            "folder": 'COMPREPLY=($(compgen -d -- "$cur"))',
            "file": 'COMPREPLY=($(compgen -f -- "$cur"))',
            "any": "COMPREPLY=()",
        }[kind(option)]
        values.append(f"        {'|'.join(option.names)}) {reply}; return ;;")
    names = " ".join(name for option in part.options for name in option.names)
    suffix = "|".join(dict.fromkeys(ending[1:] for ending in part.files))
    files = [
        '      COMPREPLY=($(compgen -d -S / -- "$cur"))',
        f"      COMPREPLY+=($(compgen -f -X '!*.@({suffix})' -- \"$cur\"))",
    ]
    return [
        f"    {word})",
        '      case "$prev" in',
        *values,
        "      esac",
        '      if [[ "$cur" == -* ]]; then',
        f"        COMPREPLY=($(compgen -W '{names}' -- \"$cur\")); return",
        "      fi",
        *(files if suffix else []),
        "      ;;",
    ]


def zsh(command: Command) -> str:
    """Completion for zsh."""

    def argument(option: Option) -> list[str]:
        text = re.sub(r"([\[\]:'\\])", " ", option.meaning)
        value = re.sub(r"[:'\[\]]", " ", option.value)
        action = {
            "words": f"({' '.join(option.choices)})",
            "folder": "_files -/",
            "file": "_files",
            "any": " ",
        }[kind(option)]
        tail = f":{value}:{action}" if option.value else ""
        return [f"'*{name}[{text}]{tail}'" for name in option.names]

    def arguments(part: Command) -> str:
        words = [word for option in part.options for word in argument(option)]
        endings = list(dict.fromkeys(ending[1:] for ending in part.files))
        if endings:
            # Brackets at the end of a pattern would be taken for what a file has to be.
            glob = f"*.({'|'.join(endings)})" if len(endings) > 1 else f"*.{endings[0]}"
            words.append(f"'*:file:_files -g \"{glob}(-.)\"'")
        return "_arguments " + " \\\n      ".join(words)

    lines = [f"#compdef {command.name}", f"# Completion of {command.name}; made from its --help."]
    if not command.parts:
        return "\n".join([*lines, arguments(command), ""])
    words = [f"'{p.name.split()[-1]}:{p.about.replace(chr(39), '')}'" for p in command.parts]
    lines += [
        "local -a commands",
        "commands=(" + "\n  ".join(words) + ")",
        "if (( CURRENT == 2 )); then",
        "  _describe command commands",
        "else",
        "  local part=$words[2]",
        "  shift words; (( CURRENT-- ))",
        "  case $part in",
    ]
    for part in command.parts:
        lines += [f"    {part.name.split()[-1]})", f"      {arguments(part)} ;;"]
    return "\n".join([*lines, "  esac", "fi", ""])


def fish(command: Command) -> str:
    """Completion for fish."""

    def quoted(text: str) -> str:
        return "'" + text.replace("\\", "\\\\").replace("'", "\\'") + "'"

    def lines_of(part: Command, condition: str) -> list[str]:
        found = []
        for option in part.options:
            flags = " ".join(
                f"-l {name[2:]}" if name.startswith("--") else f"-s {name[1:]}"
                for name in option.names
            )
            takes = ""
            if option.value:
                takes = {
                    "words": f" -x -a {quoted(' '.join(option.choices))}",
                    "folder": " -x -a '(__fish_complete_directories)'",
                    "file": " -r",
                    "any": " -x",
                }[kind(option)]
            found.append(f"{start}{condition} {flags}{takes} -d {quoted(option.meaning)}")
        return found

    start = f"complete -c {command.name}"
    lines = [f"# Completion of {command.name} for fish; made from its --help."]
    lines += lines_of(command, " -n __fish_use_subcommand" if command.parts else "")
    for part in command.parts:
        word = part.name.split()[-1]
        lines.append(f"{start} -n __fish_use_subcommand -f -a {word} -d {quoted(part.about)}")
        lines += lines_of(part, f" -n '__fish_seen_subcommand_from {word}'")
    return "\n".join([*lines, ""])


def main() -> None:
    """Write the pages of a command."""
    folder, name = Path(sys.argv[1]), sys.argv[2]
    if name == "perigeo":
        command = from_help(name, sys.argv[3])
    else:
        from perigeo_post.cli.command_line import parser

        command = from_parser(parser())
    for place, text in (
        (f"man/man1/{name}.1", manual(command)),
        (f"bash-completion/completions/{name}", bash(command)),
        (f"zsh/site-functions/_{name}", zsh(command)),
        (f"fish/vendor_completions.d/{name}.fish", fish(command)),
    ):
        path = folder / place
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
