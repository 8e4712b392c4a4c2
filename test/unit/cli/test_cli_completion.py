"""`solfer completion`: what bash offers at each place of a command line, and bash itself."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from solfer.config import module_names
from solfer_tools.cli.completion import finder
from solfer_tools.cli.main import ALL_COMMANDS, main, parser

REPOSITORY = Path(__file__).parents[3]
MODULES = module_names(REPOSITORY / "config/centauro.yaml")


@pytest.fixture(autouse=True)
def folder(monkeypatch):
    monkeypatch.chdir(REPOSITORY)


@pytest.mark.parametrize(
    ("line", "offered"),
    [
        ("", sorted(ALL_COMMANDS)),
        ("ch", ["check"]),
        ("list jo", ["joints"]),
        ("check config/cen", ["config/centauro.yaml"]),
        ("check conf", ["config/"]),
        ("check config/centauro.yaml -n joint_l", ["joint_lower"]),
        ("show config/centauro.yaml -n ", sorted(MODULES)),
        ("list joints --robot ", ["centauro"]),
        ("check --sy", ["--system"]),
        ("check --system ", ["HW", "SM"]),
        ("check --system SM config/centauro.y", ["config/centauro.yaml"]),
        ("new comp", ["component"]),
        ("rt sw", ["switch"]),
        ("rt switch --start joint", ["joint_states"]),
        ("check config/nothing.yaml -n x", []),
    ],
)
def test_a_word_is_completed(line, offered):
    *before, word = line.split(" ")
    found = finder(parser())._get_completions(["solfer", *before], word, "", None)
    assert sorted(each.rstrip() for each in found) == offered


def test_bash_completes_by_the_script(capsys, tmp_path):
    assert main(["completion"]) == 0
    script = capsys.readouterr().out
    (tmp_path / "solfer").write_text(f'#!/bin/sh\nexec "{sys.executable}" "{REPOSITORY}/nodes/solfer" "$@"\n')
    (tmp_path / "solfer").chmod(0o755)
    ask = "COMP_LINE='solfer list jo'; COMP_POINT=14; COMP_TYPE=9; _python_argcomplete solfer"
    ask += "; printf '%s\\n' \"${COMPREPLY[@]}\""
    command = f'PATH="{tmp_path}:$PATH"\n{script}\n{ask}; complete -p solfer'
    done = subprocess.run([shutil.which("bash"), "-c", command], capture_output=True, text=True, check=True, timeout=60)
    assert done.stdout.split() == [
        "joints",
        *"complete -o bashdefault -o default -o nospace -F _python_argcomplete solfer".split(),
    ]
