#!/usr/bin/env python3
"""Two figures in namespaces of one master, by the commands of their page: one under ROS, one in a real-time layer."""

import contextlib
import re
import shlex
import signal
import unittest

import rosgraph
import rospy
import rostest
from ros_tools import shown
from sensor_msgs.msg import JointState
from system import NODES, START, end, started, wait_for

PAGE = NODES.parent / "docs/tutorials/figures.md"
YAW = "torso_yaw"


class NamespacesTest(unittest.TestCase):
    """What the page promises."""

    def test_the_commands_of_the_page_move_one_of_two_robots(self):
        """Both robots measure; the request moves the one whose namespace it has, and all names are in a namespace."""
        rospy.init_node("namespaces_test")
        measured = {}
        others = self.published()  # of nodes that earlier tests have killed
        for name in ("left", "right"):
            rospy.Subscriber(f"/{name}/joint_states", JointState, self.keep, (measured, name))
        launches = re.findall(r"^roslaunch solfer .* namespace:=.*$", PAGE.read_text(), re.MULTILINE)
        request = re.search(r"^rosservice call /left/.*$", PAGE.read_text(), re.MULTILINE).group()
        self.assertEqual(len(launches), 2)
        with contextlib.ExitStack() as stack:
            processes = [stack.enter_context(started(*shlex.split(line))) for line in launches]
            wait_for(lambda: set(measured) == {"left", "right"}, 2.0 * START, "two robots that measure")
            before = dict(measured)
            rospy.wait_for_service(shlex.split(request)[2], START)
            wait_for(lambda: shown(*shlex.split(request))["success"], START, "a robot that moves")
            wait_for(lambda: abs(measured["left"] - 0.3) < 0.02, START, lambda: f"the left robot at 0.3: {measured}")
            self.assertLess(abs(measured["right"] - before["right"]), 0.005)
            inside = ("/left/", "/right/", "/rosout", "/clock")
            self.assertEqual([name for name in self.published() - others if not name.startswith(inside)], [])
            for process in processes:
                code, output = end(process, signal.SIGINT)
                self.assertEqual(code, 0, output)

    @staticmethod
    def published():
        """Return the names of all topics that have a publisher."""
        return {name for name, _ in rosgraph.Master("/namespaces_test").getPublishedTopics("/")}

    @staticmethod
    def keep(message, to):
        """Keep the last angle of the joint that moves."""
        measured, name = to
        measured[name] = message.position[message.name.index(YAW)]


if __name__ == "__main__":
    rostest.rosrun("solfer", "namespaces", NamespacesTest)
