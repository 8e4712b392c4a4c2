"""`pip install .` in an environment without ROS: what it brings, what it runs, and what it says is missing.

Nothing is fetched: the environment gets the wheel, and links to what the wheel says it depends on, and to nothing else.
"""

import importlib.metadata
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest
from packaging.requirements import Requirement

PLUGINS = ("joint_states", "joint_lower", "whole_body")
"""Configurations of centauro.yaml without warnings."""


class Environment:
    """A virtual environment, used from a folder of its own, with the variables of nobody's ROS.

    Attributes:
        folder: Where commands run.
        packages: Its site-packages.
    """

    def __init__(self, folder: Path):
        self.folder = folder / "elsewhere"
        self.folder.mkdir()
        done = call([sys.executable, "-m", "venv", "--without-pip", str(folder / "venv")], folder)
        assert done.returncode == 0, done.stderr
        self._programs = folder / "venv" / "bin"
        self.packages = next((folder / "venv" / "lib").glob("python3*/site-packages"))

    def install(self, wheel: Path) -> None:
        """Install a wheel, and link what it depends on."""
        python = str(self._programs / "python")
        options = ("--no-index", "--no-deps", "--quiet")
        done = call([sys.executable, "-m", "pip", "--python", python, "install", *options, str(wheel)], self.folder)
        assert done.returncode == 0, done.stderr
        (installed,) = importlib.metadata.distributions(name="solfer", path=[str(self.packages)])
        for path in set().union(*map(top_level, dependencies(installed))):
            (self.packages / path.name).symlink_to(path)

    def run(self, *command: str | Path) -> subprocess.CompletedProcess[str]:
        """Run one of its programs, without what numba compiles: none needs it, and it takes a quarter of a minute."""
        path = f"{self._programs}:/usr/bin:/bin"
        variables = {"PATH": path, "HOME": str(self.folder), "LANG": "C.UTF-8", "NUMBA_DISABLE_JIT": "1"}
        return call([str(self._programs / command[0]), *map(str, command[1:])], self.folder, variables)


def call(command: list[str], folder: Path, variables: dict[str, str] | None = None) -> subprocess.CompletedProcess[str]:
    """Run a command in a folder."""
    return subprocess.run(
        command, cwd=folder, env=variables, capture_output=True, text=True, timeout=300.0, check=False
    )


def dependencies(distribution: importlib.metadata.Distribution) -> list[importlib.metadata.Distribution]:
    """Find what a distribution depends on, directly or not, without its extras, as this process has it."""
    found: dict[str, importlib.metadata.Distribution] = {}
    waiting = list(distribution.requires or ())
    while waiting:
        requirement = Requirement(waiting.pop())
        if requirement.name not in found and (requirement.marker is None or requirement.marker.evaluate({"extra": ""})):
            found[requirement.name] = importlib.metadata.distribution(requirement.name)
            waiting += found[requirement.name].requires or ()
    return list(found.values())


def top_level(distribution: importlib.metadata.Distribution) -> set[Path]:
    """Files and folders that a distribution has put into site-packages; some share a folder."""
    names = set((distribution.read_text("top_level.txt") or "").split())
    names |= {path.parts[0] for path in distribution.files or ()} - {os.pardir, "__pycache__"}
    return {path for path in map(Path, map(distribution.locate_file, names)) if path.exists()}


@pytest.fixture(scope="module")
def environment(repository, tmp_path_factory):
    """Make an environment with nothing but solfer and what it depends on."""
    folder = tmp_path_factory.mktemp("pip")
    unwanted = shutil.ignore_patterns("build", "out", ".*", "__pycache__", "*.egg-info", "test", "docs")
    shutil.copytree(repository, folder / "source", ignore=unwanted)
    options = ("--no-deps", "--no-build-isolation", "--no-index", "--quiet", "--wheel-dir", str(folder / "wheels"))
    done = call([sys.executable, "-m", "pip", "wheel", *options, "."], folder / "source")
    assert done.returncode == 0, done.stdout + done.stderr
    environment = Environment(folder)
    environment.install(next((folder / "wheels").glob("solfer-*.whl")))
    return environment


@pytest.fixture
def config(environment):
    """Return the shipped configurations as they were installed."""
    return environment.packages / "solfer" / "share" / "config"


@pytest.mark.parametrize("module", ["rospy", "rospkg", "genpy", "catkin_pkg", "pybullet"])
def test_neither_ros_nor_the_simulation_is_there(environment, module):
    assert f"No module named '{module}'" in environment.run("python", "-c", f"import {module}").stderr


def test_the_version_is_that_of_the_catkin_package(environment, repository):
    (installed,) = importlib.metadata.distributions(name="solfer", path=[str(environment.packages)])
    assert installed.version == ElementTree.parse(repository / "package.xml").findtext("version")


def test_all_that_ships_is_installed_once(config, repository):
    """Programs that once made a robot's files stay behind."""
    shipped = {path.relative_to(repository / "config") for path in (repository / "config").rglob("*") if path.is_file()}
    expected = {path for path in shipped if path.suffix not in (".py", ".pyc")}
    assert expected == {path.relative_to(config) for path in config.rglob("*") if path.is_file()}


def test_a_shipped_configuration_is_checked(environment, config):
    file = config / "centauro.yaml"
    done = environment.run("solfer", "check", file, *(word for name in PLUGINS for word in ("-n", name)))
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == f"{file}: {len(PLUGINS)} configurations, no errors, no warnings\n"


def test_a_shipped_robot_is_found_by_name(environment):
    done = environment.run("solfer", "list", "joints", "--robot", "centauro")
    assert (done.returncode, done.stderr) == (0, "")
    assert "torso_yaw" in done.stdout


def test_a_robot_is_loaded_and_moved(environment):
    program = (
        "from solfer import Robot; from solfer.config.yaml.files import located; "
        "robot = Robot.load(located('package://solfer/config/robots/centauro/centauro.urdf', '.')); "
        "robot.state.position[:] = 0.1; robot.update(); print(robot.size)"
    )
    done = environment.run("python", "-c", program)
    assert (done.returncode, done.stdout, done.stderr) == (0, "48\n", "")


def test_a_command_that_needs_ros_says_so(environment, tmp_path):
    file = tmp_path / "main.yaml"
    file.write_text("mwoibn: {modules: {m: {class: 'a:B', secondary_file: {path: package://arms, file: a.yaml}}}}\n")
    done = environment.run("solfer", "check", file)
    assert done.returncode == 2 and "Traceback" not in done.stderr
    assert "package 'arms' is looked up with rospkg, which is not installed\n  expected: ROS 1, or" in done.stderr


def test_a_program_that_needs_the_simulation_says_so(environment, repository):
    name = f"without_bullet_{os.getpid()}"
    done = environment.run("python", repository / "nodes" / "xbot_simulator", "--namespace", name)
    assert done.returncode == 2 and "Traceback" not in done.stderr
    assert re.match(r"error: the simulation needs PyBullet\n  expected: \S+ -m pip install pybullet", done.stderr)


def test_what_needs_ros_names_it_when_it_is_imported(environment):
    done = environment.run("python", "-c", "import solfer.middleware.ros")
    assert "MissingDependency: this needs ROS 1, and there is no module 'rospy'\n  expected: ROS 1" in done.stderr
