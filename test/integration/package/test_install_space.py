"""A clone in an ordinary catkin workspace, beside another package: `catkin_make install`, then ROS's own tools.

The clone holds a `build/` folder as `./run` leaves it. The node in C++ that only a test runs is left out: `./run` has
compiled it.
"""

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from solfer.middleware.ros.node.launch import free_port

pytestmark = pytest.mark.soak

NEIGHBOUR = """<package format="2">
  <name>neighbour</name><version>0.0.1</version><description>Another package.</description>
  <maintainer email="nobody@example.org">nobody</maintainer><license>Zlib</license>
  <buildtool_depend>catkin</buildtool_depend>
</package>
"""
OVERLAID = ("CMAKE_PREFIX_PATH", "PYTHONPATH", "ROS_PACKAGE_PATH", "LD_LIBRARY_PATH", "PKG_CONFIG_PATH")


def clean_environment() -> dict[str, str]:
    """Return the environment without this workspace, and with the interpreter of this test as `python3`."""
    environment = {name: value for name, value in os.environ.items() if name not in OVERLAID}
    path = [folder for folder in os.environ["PATH"].split(os.pathsep) if "/devel/" not in folder]
    environment["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), *path])
    environment["NUMBA_DISABLE_JIT"] = "1"  # no command needs what is compiled, which takes a quarter of a minute
    return environment


def run(command: list[str]) -> subprocess.CompletedProcess[str]:
    """Run a command in the clean environment."""
    return subprocess.run(command, env=clean_environment(), capture_output=True, text=True, timeout=600.0, check=False)


def clone(repository: Path, target: Path) -> None:
    """Copy the repository as it is now, and lay out in `build/` what `./run` would."""
    shutil.copytree(repository, target, ignore=shutil.ignore_patterns("build", "out", ".*", "__pycache__"))
    links = target / "build" / "ws" / "src" / "solfer"
    links.mkdir(parents=True)
    for entry in target.iterdir():
        if entry.name != "build":
            (links / entry.name).symlink_to(Path("../../../..") / entry.name)


@pytest.fixture(scope="module")
def workspace(repository, tmp_path_factory):
    """Make a workspace with a devel and an install space."""
    folder = tmp_path_factory.mktemp("catkin")
    clone(repository, folder / "src" / "solfer")
    neighbour = folder / "src" / "neighbour"
    neighbour.mkdir()
    (neighbour / "package.xml").write_text(NEIGHBOUR)
    (neighbour / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.10)\nproject(neighbour)\nfind_package(catkin REQUIRED)\ncatkin_package()\n"
    )
    done = run(["catkin_make", "-C", str(folder), "-DCATKIN_ENABLE_TESTING=OFF", "install"])
    assert done.returncode == 0, done.stdout + done.stderr
    assert "CMake Warning" not in done.stderr, done.stderr
    return folder


COMMANDS = {
    "rospack find solfer": "solfer",
    "rospack find plugins": "share/plugins",
    "rosmsg show solfer/JointCommand": "float64[] stiffness",
    "rosmsg show control_msgs/FollowJointTrajectoryGoal": "goal_time_tolerance",
    "rossrv show solfer/MoveJoints": "float64 duration",
    "rosrun plugins plugin --help": "usage",
    "rosrun plugins shared --help": "usage",
    "rosrun solfer simulator --help": "usage",
    "rosrun solfer hardware --help": "usage",
    "solfer --help": "usage",
    "solfer list joints --robot centauro": "torso_yaw",
    "t=$(mktemp -d) && solfer new component swing_joint --package $t/swing_joint && "
    "ls $t/*/test && rm -r $t": "test_swing_joint.py",
    "python3 -c 'import solfer.msg, solfer.srv, solfer.middleware.ros; print(solfer.msg.__name__)'": "solfer.msg",
}
"""What is tried in both spaces, and what has to be part of the output."""


@pytest.mark.parametrize("space", ["devel", "install"])
@pytest.mark.parametrize(("command", "expected"), COMMANDS.items(), ids=COMMANDS)
def test_ros_tools_find_the_package(workspace, space, command, expected):
    script = f". {workspace}/{space}/setup.sh && {command}"
    done = run(["sh", "-c", script])
    assert (done.returncode, done.stderr) == (0, ""), done.stdout + done.stderr
    assert expected in done.stdout


MOVES = """
import rospy, sys
from sensor_msgs.msg import JointState
from solfer.srv import MoveJoints
rospy.init_node("mover")
rospy.wait_for_service("/{plugin}/trajectory", 120.0)
def read():
    message = rospy.wait_for_message("/joint_states", JointState, 60.0)
    return dict(zip(message.name, message.position))["{joint}"]
before = read()
move = rospy.ServiceProxy("/{plugin}/trajectory", MoveJoints)
reply = move(joints=["{joint}"], positions=[before + 0.2], speed=0.2)
while not reply.success:  # it waits for its feedback
    rospy.sleep(0.2)
    reply = move(joints=["{joint}"], positions=[before + 0.2], speed=0.2)
rospy.sleep(2.5)
print("moved by", round(read() - before, 2), reply)
"""
"""A program that moves a joint of a robot by a service of `plugin`."""


@pytest.fixture
def clean(workspace):
    """Remove what `./run` leaves in a clone: roslaunch finds its launch files there, too."""
    shutil.rmtree(workspace / "src" / "solfer" / "build", ignore_errors=True)
    return workspace


@contextmanager
def launched(setup, launch, log):
    """Run a launch file in a shell in which `setup` is sourced, on a master of its own; yield its environment."""
    port = free_port()
    environment = clean_environment() | {"ROS_MASTER_URI": f"http://localhost:{port}"}
    del environment["NUMBA_DISABLE_JIT"]
    with open(log, "w") as output:
        process = subprocess.Popen(
            ["sh", "-c", f". {setup} && exec roslaunch -p {port} {launch}"],
            env=environment,
            stdout=output,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
    try:
        yield environment
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(60.0)


@pytest.mark.parametrize("space", ["devel", "install"])
def test_the_robot_moves_without_its_source(clean, space, tmp_path):
    """In the install space the source is elsewhere."""
    setup, source = clean / space / "setup.sh", clean / "src"
    if space == "install":
        source.rename(clean / "elsewhere")
    try:
        with launched(setup, "solfer joint_states.launch", tmp_path / "log") as environment:
            program = MOVES.format(plugin="joint_states", joint="torso_yaw")
            done = subprocess.run(
                ["sh", "-c", f'. {setup} && exec python3 -c "$0"', program],
                env=environment,
                capture_output=True,
                text=True,
                timeout=150.0,
                check=False,
            )
        moved = re.search(r"moved by (\S+) ", done.stdout)
        assert moved, done.stdout + done.stderr + (tmp_path / "log").read_text()
        assert abs(float(moved[1]) - 0.2) < 0.03  # on springs
    finally:
        if space == "install":
            (clean / "elsewhere").rename(source)


def test_an_overlay_moves_the_robot_by_a_component_of_its_own(clean, tmp_path):
    """A component of a workspace above the installed one is found by its launch file, and moves joints."""
    setup, overlay = clean / "devel" / "setup.sh", tmp_path / "over"
    script = f"""set -e
. {setup}
mkdir -p {overlay}/src
solfer new component swing_joint --package {overlay}/src/swing_joint
catkin_make -C {overlay} -DPYTHON_EXECUTABLE={sys.executable}
"""
    done = run(["sh", "-c", script])
    assert done.returncode == 0, done.stdout + done.stderr
    setup = overlay / "devel" / "setup.sh"
    with launched(setup, "swing_joint swing_joint.launch", tmp_path / "log") as environment:
        deadline = time.monotonic() + 120.0
        spread = 0.0
        while spread < 0.05 and time.monotonic() < deadline:
            done = subprocess.run(
                ["sh", "-c", f". {setup} && timeout 20 rostopic echo -n 200 -p /joint_states/position"],
                env=environment,
                capture_output=True,
                text=True,
                check=False,
            )
            rows = [[float(number) for number in line.split(",")[1:]] for line in done.stdout.splitlines()[1:]]
            spread = float(np.ptp(rows, axis=0).max()) if rows else 0.0
        assert spread >= 0.05, (tmp_path / "log").read_text()


def test_what_nodes_read_is_installed(workspace):
    share = workspace / "install" / "share" / "solfer"
    for folder in ("config", "launch"):
        source = workspace / "src" / "solfer" / folder
        files = {path.relative_to(source) for path in source.rglob("*") if path.is_file()}
        assert files == {path.relative_to(share / folder) for path in (share / folder).rglob("*") if path.is_file()}


def test_what_only_pip_installs_is_not_there(workspace):
    """The command is catkin's own, and `config/` stands in `share/` alone."""
    install = workspace / "install"
    assert (install / "bin" / "solfer").read_text().splitlines()[1] == '"""The `solfer` command."""'
    assert not list((install / "lib").rglob("solfer/share"))
