"""`solfer new robot` as a user runs it: the test that it makes passes, unchanged, for a walker and for an arm."""

import os
import re
import subprocess
import sys
from importlib.metadata import distribution
from importlib.util import find_spec
from pathlib import Path
from xml.etree import ElementTree

import pytest
from support.processes import SOURCES

EXAMPLES = Path(distribution("example-robot-data").locate_file("cmeel.prefix/share/example-robot-data/robots"))
A1 = Path(find_spec("pybullet_data").origin).parent / "a1/a1.urdf"
ROBOTS = {
    "walker": ("--urdf", A1, "--floating-base"),
    "arm": (
        "--urdf",
        EXAMPLES / "z1_description/urdf/z1.urdf",
        "--srdf",
        EXAMPLES / "z1_description/srdf/z1.srdf",
    ),
}


def run(repository, folder, *command):
    """Run Python in a folder, as in a shell in which solfer is sourced."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST")}
    for name, path in (("PYTHONPATH", SOURCES), ("ROS_PACKAGE_PATH", repository)):
        environment[name] = os.pathsep.join(filter(None, [str(path), os.environ.get(name)]))
    command = [sys.executable, *map(str, command)]
    return subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, timeout=200, check=False
    )


@pytest.fixture(scope="module")
def packages(repository, tmp_path_factory):
    """Make a folder with a package for each robot."""
    folder = tmp_path_factory.mktemp("new")
    for name, files in ROBOTS.items():
        done = run(repository, folder, repository / "nodes/solfer", "new", "robot", name, *files)
        assert done.returncode == 0, done.stderr
    return folder


def test_their_tests_pass_unchanged(repository, packages):
    done = run(repository, packages, "-m", "pytest", "-q", *ROBOTS)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "4 passed" in done.stdout


def test_their_launch_files_name_files_that_exist(packages):
    for robot in ROBOTS:
        text = (
            (packages / robot / f"launch/{robot}.launch").read_text().replace(f"$(find {robot})", f"{packages}/{robot}")
        )
        folder = ElementTree.fromstring(text).find("arg[@name='folder']").get("default")
        names = re.findall(r'(?:textfile|value)="([^"]+\.(?:urdf|srdf|yaml))"', text.replace("$(arg folder)", folder))
        assert len(names) >= 3 and all(Path(name).is_file() for name in names), names


@pytest.mark.soak
def test_their_test_fails_without_strength(repository, packages):
    """A walker without stiffness falls onto its belly."""
    bundle = packages / "walker/config/robots/walker/robot.yaml"
    gains = bundle.with_name("gains.yaml")
    joints = [f"{leg}_{joint}_joint" for leg in ("FR", "FL", "RR", "RL") for joint in ("hip", "upper", "lower")]
    gains.write_text(
        "walker: {gains: {" + ", ".join(f"{joint}: {{stiffness: 0.0, damping: 0.0}}" for joint in joints) + "}}\n"
    )
    text = bundle.read_text()
    try:
        bundle.write_text(text + "gains: gains.yaml\n")
        done = run(repository, packages, "-m", "pytest", "-q", "walker", "-k", "stays")
    finally:
        bundle.write_text(text)
        gains.unlink()
    assert done.returncode == 1 and "1 failed" in done.stdout, done.stdout + done.stderr
