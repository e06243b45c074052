"""Completion for bash, zsh and fish, asked in these shells where they are there."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

# A shell on a terminal of its own, in which TAB writes down what would be offered. Of the way that
# `_arguments` asks for matches only to look at them (-O, -A, -D) nothing is written.
ZSH = """\
zmodload zsh/zpty
zpty inner zsh -f -i
zpty -w inner "source $1"
zpty -r -m inner line '*ready*'
zpty -w -n inner "$2"$'\\t'
while [[ ! -e $3.done ]]; do sleep 0.02; done
"""
ZSH_INNER = """\
PROMPT=
fpath=('{functions}' $fpath)
autoload -U compinit && compinit -u -D
bindkey '^I' complete-word
finish() {{ : > '{hits}.done'; exit }}
comppostfuncs=(finish)
compadd() {{
  if [[ ${{@[1,(i)(-|--)]}} != *-(O|A|D)\\ * ]]; then
    typeset -a found
    builtin compadd -A found "$@"
    print -rl -- $found >> '{hits}'
  fi
  builtin compadd "$@"
}}
print ready
"""


@pytest.fixture(scope="module")
def scripts(program, tmp_path_factory):
    """Return the folder with the completions of both commands."""
    folder = tmp_path_factory.mktemp("completion") / "with a blank"
    for words in (["perigeo", str(program)], ["perigeo-post"]):
        make = [sys.executable, str(ROOT / "tools/command_pages.py"), str(folder), *words]
        subprocess.run(make, check=True)
    return folder


def say(words, folder):
    """Return the lines that a command prints in a folder."""
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, timeout=60, check=True)
    assert done.stderr == ""
    return done.stdout.splitlines()


def bash(scripts, line, folder):
    words = line.split(" ")
    script = scripts / "bash-completion/completions" / words[0]
    text = (
        f"source '{script}'; COMP_WORDS=({line}); COMP_CWORD={len(words) - 1}; "
        f"_{words[0].replace('-', '_')}; printf '%s\\n' \"${{COMPREPLY[@]}}\""
    )
    return set(say(["bash", "-c", text], folder))


def zsh(scripts, line, folder):
    hits = folder.parent / "hits"
    (folder.parent / "outer").write_text(ZSH)
    inner = ZSH_INNER.format(functions=scripts / "zsh/site-functions", hits=hits)
    (folder.parent / "inner").write_text(inner)
    outer = str(folder.parent / "outer")
    say(["zsh", "-f", outer, str(folder.parent / "inner"), line, str(hits)], folder)
    lines = hits.read_text().splitlines() if hits.exists() else []
    return {name.rstrip("/") for name in lines if name}


def fish(scripts, line, folder):
    script = scripts / "fish/vendor_completions.d" / f"{line.split()[0]}.fish"
    lines = say(["fish", "--no-config", "-c", f"source '{script}'; complete -C '{line}'"], folder)
    return {offer.partition("\t")[0] for offer in lines}


SHELLS = {"bash": bash, "zsh": zsh, "fish": fish}


@pytest.mark.parametrize("shell", SHELLS)
@pytest.mark.parametrize(
    ("line", "offered"),
    [
        ("perigeo --re", {"--restart"}),
        ("perigeo --check ca", {"case.nml", "case"}),
        ("perigeo --output c", {"case"}),
        ("perigeo --threads c", set()),
        ("perigeo-post cu", {"curves"}),
        ("perigeo-post curves run.h5 --pl", {"--platen"}),
        ("perigeo-post curves --platen f", {"first"}),
        ("perigeo-post curves ru", {"run.h5"}),
    ],
)
def test_a_shell_completes(shell, line, offered, scripts, tmp_path):
    if not shutil.which(shell):
        pytest.skip(f"no {shell}")
    folder = tmp_path / "here"
    (folder / "case").mkdir(parents=True)
    for name in ("case.nml", "case.txt", "run.h5", "run.log"):
        (folder / name).touch()
    found = {name.rstrip("/") for name in SHELLS[shell](scripts, line, folder) if name}
    # Fish puts files of another kind behind those that fit, and does not leave them out.
    assert offered <= found
    assert found - offered <= ({"case.txt", "run.log"} if shell == "fish" else set())
