"""`solfer new component` as a user runs it: the test that it makes passes, unchanged."""

import os
import subprocess
import sys

import pytest

OTHERS = ("PYTEST_ADDOPTS", "PYTEST_CURRENT_TEST")


@pytest.fixture(scope="module")
def environment(repository):
    """Make the environment of a sourced workspace: solfer on the Python path, and its package for rospkg."""
    environment = {name: value for name, value in os.environ.items() if name not in OTHERS}
    paths = {"PYTHONPATH": repository / "src", "ROS_PACKAGE_PATH": repository}
    for name, path in paths.items():
        environment[name] = os.pathsep.join(filter(None, [str(path), os.environ.get(name)]))
    return environment


def run(command, folder, environment):
    """Run a command in a folder."""
    return subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, timeout=200, check=False
    )


@pytest.fixture(scope="module")
def package(repository, environment, tmp_path_factory):
    """Make a folder with the new package `swing_joint`."""
    folder = tmp_path_factory.mktemp("new")
    done = run(
        [sys.executable, str(repository / "nodes" / "solfer"), "new", "component", "swing_joint"], folder, environment
    )
    assert (done.returncode, done.stderr) == (0, "")
    return folder / "swing_joint"


def test_its_test_passes_unchanged(package, environment):
    done = run([sys.executable, "-m", "pytest", "-q", str(package)], package.parent, environment)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "2 passed" in done.stdout


def test_its_configuration_is_right(repository, package, environment):
    command = [sys.executable, str(repository / "nodes" / "solfer"), "check", "config/swing_joint.yaml"]
    built = {**environment, "PYTHONPATH": os.pathsep.join([environment["PYTHONPATH"], str(package / "src")])}
    done = run(command, package, built)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == "config/swing_joint.yaml: 1 configuration, no errors, no warnings\n"


def test_its_test_fails_when_nothing_moves(package, environment):
    component = package / "src" / "swing_joint" / "swing_joint.py"
    text = component.read_text()
    try:
        component.write_text(text.replace("self.tags.amplitude * math.sin", "0.0 * math.sin"))
        done = run([sys.executable, "-m", "pytest", "-q", str(package)], package.parent, environment)
    finally:
        component.write_text(text)
    assert done.returncode == 1 and "1 failed, 1 passed" in done.stdout
