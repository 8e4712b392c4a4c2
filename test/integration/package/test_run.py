"""The script `run`: its usage and its checks; everything else it does is done whenever these tests run by it."""

import os
import shutil
import subprocess

import pytest


@pytest.mark.parametrize(("arguments", "code"), [([], 2), (["exec"], 2), (["--help"], 0)])
def test_usage(repository, arguments, code):
    done = subprocess.run([repository / "run", *arguments], capture_output=True, text=True, timeout=30.0, check=False)
    assert done.returncode == code
    assert "usage: ./run COMMAND" in (done.stderr if code else done.stdout)


def refused(script, *arguments):
    """Return the error of the script, which is all that it prints."""
    done = subprocess.run([script, *arguments], capture_output=True, text=True, timeout=300.0, check=False)
    assert (done.returncode, done.stdout) == (2, "")
    what, expected = done.stderr.splitlines()[-2:]
    assert what.startswith("solfer: error: ") and expected.startswith("  expected: ")
    return what


def test_unknown_commands_and_programs_are_one_error(repository):
    assert "unknown command 'dmeo'" in refused(repository / "run", "dmeo")
    assert "no program 'nosuchprogram'" in refused(repository / "run", "exec", "nosuchprogram")


def test_a_folder_without_room_is_one_error(repository, tmp_path):
    script = shutil.copy(repository / "run", tmp_path)
    (tmp_path / "build").write_text("in the way")
    assert f"{tmp_path}/build cannot be made" in refused(script, "exec", "true")


def test_bytecode_is_kept_whatever_the_caller_sets(repository, tmp_path):
    (tmp_path / "kept.py").write_text(
        "import importlib.util, os; print(os.path.exists(importlib.util.cache_from_source(__file__)))"
    )
    done = subprocess.run(
        [repository / "run", "exec", "python", "-c", "import kept"],
        cwd=tmp_path,
        env=os.environ | {"PYTHONDONTWRITEBYTECODE": "1"},
        capture_output=True,
        text=True,
        timeout=300.0,
        check=False,
    )
    assert done.stdout == "True\n", done.stderr


@pytest.mark.soak
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
    assert done.returncode == 1
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
