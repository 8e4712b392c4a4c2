#!/usr/bin/env python3
"""An arm under ros_control, by the node and the commands of its page: it moves, holds, and stops."""

import contextlib
import re
import shlex
import signal
import sys
import tempfile
import unittest
from collections.abc import Callable
from importlib.metadata import distribution
from pathlib import Path

import numpy as np
import rospy
import rostest
import yaml
from ros_tools import shown
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import JointState
from system import NODES, START, program, started, wait_for

from solfer.model import Description, Kinematics
from solfer_tools.cli.main import main

ROOT = NODES.parent
PAGE = ROOT / "docs/how-to/ros_control.md"
URDF = distribution("example-robot-data").locate_file(
    "cmeel.prefix/share/example-robot-data/robots/ur_description/urdf/ur5_robot.urdf"
)
NEAR = 0.001  # [rad], [m]


class RosControlTest(unittest.TestCase):
    """What the page promises, for both kinds of drives; the plugin outlives the change of the driver."""

    def setUp(self):
        rospy.init_node("ros_control_test")
        self.kinematics = Kinematics(Description.from_file(Path(str(URDF))))
        self.positions: dict[str, float] = {}
        self.logged: list[str] = []
        rospy.Subscriber("/joint_states", JointState, self.receive, queue_size=1, tcp_nodelay=True)
        rospy.Subscriber("/rosout", Log, lambda message: self.logged.append(message.msg))
        rospy.set_param("/robot_description", Path(str(URDF)).read_text())
        rospy.set_param("/arm_controller/joints", list(self.kinematics.dofs))
        folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        package = folder / "my_robot"
        self.assertEqual(main(["new", "robot", "my_robot", "--urdf", str(URDF), "--package", str(package)]), 0)
        self.file = str(package / "config/my_robot.yaml")
        lines = re.findall(r"^ros(?:run|service) .*$", PAGE.read_text(), re.MULTILINE)
        self.starts, self.requests = lines[::2], lines[1::2]

    def receive(self, message):
        self.positions = dict(zip(message.name, message.position, strict=True))

    def plugin(self, line: str):
        """Start a plugin by the command of the page."""
        words = shlex.split(line)
        self.assertEqual(words[5:], ["-c", "my_robot/config/my_robot.yaml", "--system", "HW"])
        return started(*program("plugin", *words[3:6], self.file, *words[7:]))

    @contextlib.contextmanager
    def driver(self, drives: str):
        """Run the driver and the node of the page; yields the driver."""
        rospy.set_param("/arm_controller/type", f"{drives}_controllers/JointGroup{drives.title()}Controller")
        with (
            started(sys.executable, str(ROOT / "test/ros/fake_arm.py")) as arm,
            started(sys.executable, str(ROOT / "examples/ros_control_arm.py")),
        ):
            yield arm

    def ask(self, line: str, **changes: object) -> dict[str, object]:
        """Send a request of the page until it is accepted; returns it as it was sent."""
        words = shlex.split(line)
        request = yaml.safe_load(words[3]) | changes
        words[3] = yaml.safe_dump(request, default_flow_style=True)
        rospy.wait_for_service(words[2], START)
        wait_for(lambda: shown(*words)["success"], START, line)
        return request

    def moves(self, goal: float, reached: Callable[[float], bool]) -> None:
        """Move the joint of the page until its position is `reached`; a motion that a pause ends is asked for again."""
        begin = len(self.logged)  # a pause may end the motion before the program that requests it has ended
        (joint,) = self.ask(self.requests[0], positions=[goal], speed=1.0)["joints"]

        def is_reached() -> bool:
            nonlocal begin
            if any("holds" in line for line in self.logged[begin:]):
                begin = len(self.logged)
                self.ask(self.requests[0], positions=[goal], speed=1.0)
            return reached(self.positions[joint])

        wait_for(is_reached, START, lambda: f"motion to {goal}; {self.positions}, {self.logged[begin:]}")

    def says(self, text: str, begin: int) -> None:
        """Wait until a node has logged a text since a line."""
        wait_for(lambda: any(text in line for line in self.logged[begin:]), START, lambda: f"{text} in {self.logged}")

    def tip(self) -> np.ndarray:
        """Return where the tip is, by the measured joints [m]."""
        self.kinematics.update(np.array([self.positions[joint] for joint in self.kinematics.dofs]))
        return self.kinematics.position("wrist_3_link").copy()

    def moves_and_holds(self, arm) -> None:
        """Check that a joint goes where the page asks; without joint states the plugin holds and says so."""
        (goal,) = yaml.safe_load(shlex.split(self.requests[0])[3])["positions"]
        self.moves(goal, lambda position: abs(position - goal) < NEAR)
        begin = len(self.logged)
        arm.send_signal(signal.SIGSTOP)
        self.says("joint_states holds and waits for feedback 'link_side_online'", begin)
        arm.send_signal(signal.SIGCONT)
        self.moves(0.0, lambda position: abs(position) < NEAR)

    def stops_without(self, plugin) -> None:
        """Check that a killed plugin leaves the arm at rest on its way."""
        self.moves(2.0, lambda position: position > 0.1)
        begin = len(self.logged)
        plugin.kill()
        self.says("/joint_states is silent: the arm holds", begin)
        rospy.sleep(1.0)
        rest = self.positions.copy()
        rospy.sleep(0.2)
        for joint, position in rest.items():
            self.assertLess(abs(self.positions[joint] - position), NEAR)
        self.assertLess(max(rest.values()), 1.0)

    def test_the_page(self):
        with contextlib.ExitStack() as plugins:
            plugin = plugins.enter_context(self.plugin(self.starts[0]))
            for drives in ("position", "velocity"):
                with self.driver(drives) as arm:
                    self.moves_and_holds(arm)
                    self.stops_without(plugin)
                    if drives == "position":
                        plugin = plugins.enter_context(self.plugin(self.starts[0]))
            with self.driver("velocity"):
                plugins.enter_context(self.plugin(self.starts[1]))
                rospy.wait_for_service(self.requests[1].split()[2], START)
                wait_for(lambda: bool(self.positions), START, "joint states")
                before = self.tip()
                goal = before + np.array(self.ask(self.requests[1])["values"])
                wait_for(lambda: np.abs(self.tip() - goal).max() < NEAR, START, lambda: f"{self.tip()}, {goal}")


if __name__ == "__main__":
    rostest.rosrun("solfer", "ros_control", RosControlTest)
