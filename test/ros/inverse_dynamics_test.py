#!/usr/bin/env python3
"""CENTAURO squats on torques; its plugin is killed meanwhile, and the lower level holds the robot where it is."""

import os
import signal
import unittest
import xmlrpc.client

import rosgraph
import rospy
import rostest
from system import START, Robot, wait_for

LEASE = 0.3
"""Time until a lease ends [s]."""


class InverseDynamicsTest(unittest.TestCase):
    """The launch file of the page."""

    def test_a_killed_plugin_leaves_the_robot_standing(self):
        """The lower level holds the joints of a plugin that is killed in the middle of a squat."""
        rospy.init_node("killer")
        robot = Robot()

        def height():
            return robot.odometry[-1].pose.pose.position.z

        wait_for(lambda: robot.odometry, START, "a robot")
        top = height()
        wait_for(lambda: height() < top - 0.04, START, lambda: f"a squat: {top - height():.3f} m")
        wait_for(lambda: height() > top - 0.01, START, lambda: f"a robot that rises: {top - height():.3f} m")
        uri = rosgraph.Master(rospy.get_name()).lookupNode("/squat")
        _, _, pid = xmlrpc.client.ServerProxy(uri).getPid(rospy.get_name())
        os.kill(pid, signal.SIGKILL)
        robot.passes(LEASE + 1.0)
        before = robot.positions()
        robot.passes(1.0)
        self.assertLess(robot.moved(before), 0.01)
        self.assertGreater(height(), top - 0.06)


if __name__ == "__main__":
    rostest.rosrun("solfer", "inverse_dynamics", InverseDynamicsTest)
