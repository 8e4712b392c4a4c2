#!/usr/bin/env python3
"""Fig. 4 of the paper: whichever of its plugins dies in motion, the robot stays up, and goes on when it is back."""

import contextlib
import subprocess
import unittest

import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticArray
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import JointState
from system import START, Robot, started, wait_for

from solfer.robot import Robot as Model
from solfer.srv import MoveJoints, ResetSimulation

PARTS = {"upper_body": ("torso_yaw", "j_arm1_4"), "lower_body": ("ankle_yaw_1", "ankle_yaw_2")}
MOTION, SPEED = 0.4, 0.2  # [rad], [rad/s]
UP = 0.05
"""How far the base may sink while a plugin is away [m]."""

CATCHING_UP = 1.15
"""Measured speeds against the speed limits of the joints when a plugin comes back: who merges catches up with what the
others want at the speed limits, which the targets keep to; the springs behind them swing by some 5 %."""


class Figure4Test(unittest.TestCase):
    """Each test starts the three plugins on the same robot."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("figure_4_test")
        cls.robot, cls.log, cls.health = Robot(), [], {}
        model = Model.load(rospy.get_param("/robot_description"), rospy.get_param("/robot_semantic_description"))
        cls.limits = dict(zip(model.dofs, model.upper_limits.velocity, strict=True))
        cls.fastest: dict[str, float] = {}
        rospy.Subscriber("/joint_states", JointState, cls.take_speeds, queue_size=1000, tcp_nodelay=True)
        rospy.Subscriber("/rosout", Log, lambda message: cls.log.append(message.msg), queue_size=1000)
        rospy.Subscriber("/diagnostics", DiagnosticArray, lambda message: cls.health.update(
            {status.name: f"{status.message} {status.values}" for status in message.status}), queue_size=100)

    @classmethod
    def take_speeds(cls, message: JointState) -> None:
        """Keep the largest share of its speed limit that any joint has used."""
        for name, speed in zip(message.name, message.velocity, strict=True):
            cls.fastest[name] = max(cls.fastest.get(name, 0.0), abs(speed) / cls.limits[name])

    def is_slower_than(self, share: float) -> None:
        """No joint has used more than a share of its speed limit."""
        worst = max(self.fastest, key=self.fastest.get)
        self.assertLess(self.fastest[worst], share, worst)

    def height(self) -> float:
        """Of the base [m]."""
        return self.robot.odometry[-1].pose.pose.position.z

    def ask(self, plugin: str, **fields: object) -> None:
        """Ask a plugin for a motion until it accepts."""
        answer = "no service"

        def accepts() -> bool:
            nonlocal answer
            try:
                reply = rospy.ServiceProxy(f"/{plugin}/trajectory", MoveJoints)(**fields)
            except rospy.ServiceException as error:
                answer = str(error)
                rospy.rostime.wallsleep(0.1)
                return False
            answer = reply.message
            return reply.success

        wait_for(accepts, START, lambda: f"{plugin} accepts a motion: {answer}")

    def swing(self, plugin: str, distance: float) -> dict[str, float]:
        """Move joints of a plugin's part; their goals [rad]."""
        now = self.robot.positions()
        goals = {joint: now[joint] + distance for joint in PARTS[plugin]}
        self.ask(plugin, joints=list(goals), positions=list(goals.values()), speed=SPEED)
        return goals

    def moves(self, joint: str, begin: float) -> bool:
        """Whether a joint has left its place."""
        return abs(self.robot.positions()[joint] - begin) > MOTION / 8.0

    def kill_in_motion(self, victim: str) -> None:
        """Kill a plugin while both parts move, see that the robot stays up, start it again, and move on."""
        self.assertTrue(rospy.ServiceProxy("/simulator/reset", ResetSimulation)(state="mammal_wide_straight").success)
        with contextlib.ExitStack() as stack:
            nodes: dict[str, subprocess.Popen] = {}
            for name in (*PARTS, "whole_body"):
                nodes[name] = stack.enter_context(started("rosrun", "plugins", "plugin", "-p", name))
            wait_for(lambda: "running" in self.health.get("whole_body: whole_body", ""), START, "all plugins")
            height, before = self.height(), self.robot.positions()
            self.fastest.clear()
            for part in PARTS:
                self.swing(part, MOTION)
            for joints in PARTS.values():
                wait_for(lambda joint=joints[0]: self.moves(joint, before[joint]), START, f"motion of {joints[0]}")
            self.log.clear()
            nodes[victim].kill()
            wait_for(lambda: any(victim in line for line in list(self.log)), START, f"a message that names {victim}")
            self.robot.settle()
            self.assertLess(abs(self.height() - height), UP)
            self.is_slower_than(1.0)
            self.fastest.clear()
            stack.enter_context(started("rosrun", "plugins", "plugin", "-p", victim))
            for part in PARTS:
                self.robot.arrive(self.swing(part, -MOTION / 2.0), START)
            self.assertLess(abs(self.height() - height), UP)
            self.is_slower_than(CATCHING_UP)
            self.health.clear()

    def test_the_plugin_on_the_upper_body(self):
        self.kill_in_motion("upper_body")

    def test_the_plugin_on_the_lower_body(self):
        self.kill_in_motion("lower_body")

    def test_the_plugin_that_merges(self):
        self.kill_in_motion("whole_body")


if __name__ == "__main__":
    rostest.rosrun("solfer", "figure_4", Figure4Test)
