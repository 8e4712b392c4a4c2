"""The script `run`: its usage and its checks; everything else it does is done whenever these tests run by it."""

import subprocess

import pytest


@pytest.mark.parametrize(("arguments", "code"), [([], 2), (["dmeo"], 2), (["exec"], 2), (["--help"], 0)])
def test_usage(repository, arguments, code):
    done = subprocess.run([repository / "run", *arguments], capture_output=True, text=True, timeout=30.0, check=False)
    assert done.returncode == code
    assert "usage: ./run COMMAND" in (done.stderr if code else done.stdout)


@pytest.mark.parametrize(
    ("text", "finding"),
    [
        ('"""A module."""\n\nimport os\n', "F401"),
        ('"""A module."""\n\nvalue = (1,2)\n', "1 file would be reformatted"),
        ('"""A module."""\n\nvalue: int = "one"\n', "[assignment]"),
    ],
    ids=["ruff check", "ruff format", "mypy"],
)
def test_check_finds_each_kind_of_mistake(repository, tmp_path, text, finding):
    done = checked(repository, tmp_path, text)
    assert done.returncode == 1
    assert finding in done.stdout


def test_check_goes_on_after_a_mistake(repository, tmp_path):
    done = checked(repository, tmp_path, "import os\nvalue: int = 'one'\n")
    assert [step for step in ("ruff check", "ruff format", "mypy") if f"solfer: {step}\n" not in done.stderr] == []
    assert all(finding in done.stdout for finding in ("F401", "would be reformatted", "[assignment]"))


def test_check_passes_what_is_in_order(repository, tmp_path):
    assert checked(repository, tmp_path, '"""A module."""\n\nvalue: int = 1\n').returncode == 0


def checked(repository, folder, text):
    """`./run check` of one file with a text."""
    file = folder / "planted.py"
    file.write_text(text)
    command = [repository / "run", "check", file]
    return subprocess.run(command, capture_output=True, text=True, timeout=300.0, check=False)
