#!/usr/bin/env python3
"""Fig. 5 by its launch file: navigation drives the robot, a message moves a hand, one plugin commands all joints."""

import math
import re
import shlex
import unittest

import rospy
import rostest
from geometry_msgs.msg import PointStamped
from sensor_msgs.msg import JointState
from system import NODES, START, Robot, program, started, wait_for

PAGE = NODES.parent / "docs" / "figures.md"


class FullControlTest(unittest.TestCase):
    """What the page promises."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("figure_5_test")
        cls.robot = Robot()
        wait_for(lambda: rospy.get_time() > 1.0 and cls.robot.odometry, START, "plugins, for which time stands still")

    def test_it_drives_by_the_command_of_the_page(self):
        (line,) = re.findall(r"^rosrun solfer (navigation .*)$", PAGE.read_text(), re.MULTILINE)
        name, *arguments = shlex.split(line)
        with started(*program(name, *arguments)) as process:
            output, _ = process.communicate(timeout=2.0 * START)
        self.assertEqual(process.returncode, 0, output)
        self.robot.passes(1.5)
        place = self.robot.odometry[-1].pose.pose.position
        self.assertLess(math.dist((place.x, place.y), (0.2, 0.0)), 0.015)

    def test_a_hand_moves(self):
        states = []
        rospy.Subscriber("/joint_states", JointState, states.append, queue_size=10)
        hand = rospy.Publisher("/hands/left/reference", PointStamped, queue_size=1)
        wait_for(lambda: states and hand.get_num_connections(), START, "joint states, and who moves the hand")
        begin = dict(zip(states[-1].name, states[-1].position, strict=True))
        message = PointStamped()
        message.header.frame_id = "pelvis"
        message.point.x, message.point.y, message.point.z = 0.49, 0.26, 0.53

        def moved():
            hand.publish(message)
            now = dict(zip(states[-1].name, states[-1].position, strict=True))
            return max(abs(now[name] - begin[name]) for name in begin if name.startswith("j_arm1")) > 0.2

        wait_for(moved, START, "an arm that moves")


if __name__ == "__main__":
    rostest.rosrun("solfer", "figure_5", FullControlTest)
