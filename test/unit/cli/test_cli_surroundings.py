"""Commands whose surroundings are hostile: streams that cannot be written to, and files that are none."""

import os
import shutil
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from solfer.errors import SolferError
from solfer.simulation.bundle import read_bundle
from solfer.simulation.server.publications import robot_parameters
from solfer_tools.cli.main import ALL_COMMANDS, main

COMMAND = (sys.executable, str(Path(__file__).parents[3] / "nodes/solfer"))
SCENARIO = str(Path(__file__).parents[3] / "config/scenarios/straight.yaml")
ASCII = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0", "PYTHONIOENCODING": "ascii"}

HELPS = """
import sys
from contextlib import suppress
from solfer_tools.cli.main import main

for command in sys.argv[1:]:
    with suppress(SystemExit):
        main([command, "--help"])
"""
"""A program that prints the help of all commands."""

WITHOUT_DOCSTRINGS = """
from importlib.machinery import SourceFileLoader

usual = SourceFileLoader.get_code

def get_code(self, name):
    if name.partition(".")[0] not in ("solfer", "solfer_tools"):
        return usual(self, name)
    return compile(self.get_data(self.path), self.path, "exec", dont_inherit=True, optimize=2)

SourceFileLoader.get_code = get_code
"""
"""A `sitecustomize` with which our modules are those of `python -OO`; that flag compiles all that they import anew."""


def run(words, redirection="", **environment):
    """Run the command in a shell; returns its exit code and what it wrote to stderr."""
    done = subprocess.run(
        ["bash", "-c", f'set -o pipefail; "$@" {redirection}', "bash", *COMMAND, *words],
        capture_output=True,
        text=True,
        timeout=120,
        env={name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"} | environment,
        check=False,
    )
    assert "Traceback" not in done.stderr and "Exception ignored" not in done.stderr, done.stderr
    return done.returncode, done.stderr


@pytest.mark.slow
@pytest.mark.daily(2)
@pytest.mark.parametrize("words", [["scenario", SCENARIO], ["list", "joints", "--robot", "centauro"], ["--help"]])
def test_streams_that_cannot_be_written_to(words):
    assert run(words, ">&-")[0] == 0
    assert run(words, ">&- 2>&-")[0] == 0
    code, error = run(words, ">/dev/full")
    assert code == 2 and "error: standard output: No space left on device" in error
    assert run(words, ">/dev/full 2>/dev/full")[0] == 2
    assert run(words, "| head -1")[0] in (0, 141)
    assert run(words, "| true")[0] in (0, 141)
    assert run(["list", "joints", "--robot", "nobody"], ">&- 2>/dev/full")[0] == 2


@pytest.mark.slow
@pytest.mark.parametrize(
    "environment",
    [ASCII, *(pytest.param(each, marks=pytest.mark.soak) for each in ({}, {"PYTHONOPTIMIZE": "2"}))],
    ids=["ascii", "without docstrings", "optimized"],
)
def test_a_terminal_of_ascii_and_a_python_without_docstrings(tmp_path, environment):
    """Without docstrings, of solfer alone and of all, a library is compiled first, for 20 s."""
    if not environment:
        (tmp_path / "sitecustomize.py").write_text(WITHOUT_DOCSTRINGS)
        environment = {"PYTHONPATH": f"{tmp_path}:{os.environ.get('PYTHONPATH', '')}"}
    helped = subprocess.run(
        [sys.executable, "-c", HELPS, *ALL_COMMANDS],
        capture_output=True,
        check=False,
        env=os.environ | environment,
    )
    assert (helped.returncode, helped.stderr) == (0, b"")
    assert helped.stdout.count(b"usage: ") == len(ALL_COMMANDS)
    assert run(["scenario", SCENARIO], **environment)[0] == 0
    text = "text: \u4f60\n"
    (tmp_path / "\u4f60.yaml").write_text(text, encoding="utf-8")
    assert run(["check", str(tmp_path / "\u4f60.yaml")], **environment)[0] == 2


def special(kind, folder):
    """Make what is not a file, or not one that can be read whole."""
    path = folder / kind
    if kind == "fifo":
        os.mkfifo(path)
    elif kind == "device":
        path.symlink_to("/dev/zero")
    elif kind == "kernel":
        path.symlink_to("/proc/kmsg")
    elif kind == "folder":
        path.mkdir()
    elif kind == "socket":
        with socket.socket(socket.AF_UNIX) as made:
            made.bind(str(path))
    else:
        with path.open("wb") as file:
            file.truncate(1 << 30)
    return str(path)


@pytest.mark.parametrize("kind", ["fifo", "device", "kernel", "folder", "socket", "large"])
def test_what_is_no_file_is_one_error_at_once(tmp_path, monkeypatch, capsys, kind):
    """No command waits for a FIFO or a device, or reads one to its end, and none has a traceback."""
    monkeypatch.chdir(tmp_path)  # sockets have short names
    path = special(kind, Path())
    urdf = str(Path(__file__).parents[3] / "config/robots/centauro/centauro.urdf")
    commands = [
        ["check", path],
        ["show", path, "-n", "a"],
        ["graph", path, "-n", "a"],
        ["scenario", path],
        ["list", "plugins", path],
        ["list", "joints", "--urdf", path],
        ["list", "groups", "--urdf", urdf, "--srdf", path],
        ["cut", path, "--at", "a", "--keep", "upper"],
        ["log", "info", path],
        ["compare", path, path],
        ["plot", path, "-o", "out.png"],
        ["replay", path, "-n", "a"],
        ["rt", "record", path],
    ]
    for command in commands[: -1 if kind == "fifo" else None]:
        assert main(command) == 2, command
        assert capsys.readouterr().err.count("error:") == 1, command


def test_missing_packages_are_one_error():
    """Without the packages of the environment, as in a shell where it is not active."""
    done = subprocess.run([sys.executable, "-S", *COMMAND[1:], "check"], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (2, "")
    first, second, *rest = done.stderr.splitlines()
    assert first.startswith(f"error: {sys.executable} has no mcap, msgspec, numba, ") and not rest
    assert "python3 -m pip install mcap msgspec numba numpy pin pydantic" in second


@pytest.mark.parametrize("file", ["centauro.urdf", "centauro.srdf"])
def test_a_robot_of_devices_is_one_error(tmp_path, capsys, repository, file):
    """Where a configuration is checked, and where the robot is simulated."""
    shutil.copytree(repository / "config", tmp_path, dirs_exist_ok=True)
    damaged = tmp_path / "robots/centauro" / file
    damaged.unlink()
    damaged.symlink_to("/proc/kmsg")
    assert main(["check", str(tmp_path / "centauro.yaml"), "-n", "joint_states"]) == 2
    assert file in capsys.readouterr().err
    with pytest.raises(SolferError, match=file):
        robot_parameters(read_bundle(damaged.with_name("robot.yaml")))
