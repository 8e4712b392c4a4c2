"""Files that version 0.2.0 made go on: a recording is replayed, a component's package passes its own test."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from support.modules import forget
from support.processes import SOURCES

from solfer_tools.cli.main import main

FILES = Path(__file__).parents[2] / "data/0.2.0"


def test_a_recording_is_replayed_to_the_same_commands(capsys):
    assert main(["replay", str(FILES / "run.mcap"), "-n", "first"]) == 0
    assert "the same commands" in capsys.readouterr().out


@pytest.mark.slow
def test_a_package_of_a_component_passes(repository, tmp_path, monkeypatch):
    """The tests and the configuration of a package that an earlier version wrote still pass."""
    shutil.unpack_archive(FILES / "swing_joint.zip", tmp_path)
    package = tmp_path / "swing_joint"
    paths = {"PYTHONPATH": f"{package / 'src'}{os.pathsep}{SOURCES}", "ROS_PACKAGE_PATH": str(repository)}
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST")}
    for name, path in paths.items():
        environment[name] = os.pathsep.join(filter(None, [path, os.environ.get(name)]))
    command = [sys.executable, "-m", "pytest", "-q", "."]
    done = subprocess.run(command, cwd=package, env=environment, capture_output=True, text=True, timeout=200)
    assert done.returncode == 0, done.stdout + done.stderr
    monkeypatch.syspath_prepend(package / "src")
    try:
        assert main(["check", str(package / "config/swing_joint.yaml")]) == 0
    finally:
        forget("swing_joint")
