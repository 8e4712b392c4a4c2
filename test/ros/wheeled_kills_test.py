#!/usr/bin/env python3
"""Who drives `wheeled_motion` is killed, and then its plugin: the robot comes to rest in the times of the page."""

import math
import os
import re
import shlex
import signal
import unittest
import xmlrpc.client

import rosgraph
import rospy
import rostest
from system import NODES, START, Robot, started, wait_for

PAGE = NODES.parent / "docs/reference/wheeled_motion.md"
REST, WHEEL_REST = 0.004, 0.05
"""Speeds of the base and of a wheel that stand [m/s], [rad/s]."""

UNSENT, LEASE = 1.5, 0.3
"""Times until the base rests after its sender is killed, and until a lease ends [s]."""


class WheeledKillsTest(unittest.TestCase):
    """Ends without notice, in the order of their names."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("killer")
        cls.robot = Robot()
        wait_for(lambda: rospy.has_param("/mwoibn_config"), START, "a configuration")

    def now(self):
        """Return the newest simulated time [s]."""
        return self.robot.odometry[-1].header.stamp.to_sec()

    def speed(self):
        """Return how fast the base is in truth [m/s]."""
        velocity = self.robot.odometry[-1].twist.twist.linear
        return math.hypot(velocity.x, velocity.y)

    def driving(self):
        """Start the command of the page."""
        (line,) = re.findall(r"^rostopic pub .*$", PAGE.read_text(), re.MULTILINE)
        return started(*shlex.split(line))

    def test_1_a_killed_sender_leaves_it_at_rest(self):
        with self.driving() as process:
            wait_for(lambda: self.speed() > 0.19, START, "a base that drives")
            begin = self.now()
            process.send_signal(signal.SIGKILL)
            wait_for(lambda: self.speed() < REST, START, "a base at rest")
            self.assertLess(self.now() - begin, UNSENT)

    def test_2_a_killed_plugin_leaves_wheels_at_rest(self):
        with self.driving():
            wait_for(lambda: self.speed() > 0.19, START, "a base that drives")
            uri = rosgraph.Master(rospy.get_name()).lookupNode("/wheeled_motion")
            _, _, pid = xmlrpc.client.ServerProxy(uri).getPid(rospy.get_name())
            before, begin = self.robot.positions(), self.now()
            os.kill(pid, signal.SIGKILL)
            wait_for(lambda: max(map(abs, self.robot.speeds())) < WHEEL_REST, START, "wheels at rest")
            self.assertLess(self.now() - begin, LEASE + 0.3)
        wait_for(lambda: self.speed() < REST, START, "a base at rest")
        self.assertLess(self.now() - begin, LEASE + UNSENT)  # it rocks on its springs for a second
        self.robot.passes(1.0)
        self.assertLess(self.speed(), REST)
        self.assertLess(self.robot.moved(before), 0.1)


if __name__ == "__main__":
    rostest.rosrun("solfer", "wheeled_kills", WheeledKillsTest)
