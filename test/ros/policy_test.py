#!/usr/bin/env python3
"""A trained policy under ROS, in lock-step: it keeps the pelvis level on a slope."""

import math
import unittest

import rospy
import rostest
from nav_msgs.msg import Odometry
from system import START, wait_for

SLOPE = 5.0  # [degrees]


class PolicyTest(unittest.TestCase):
    """What the example does in memory, it does under ROS."""

    def setUp(self):
        rospy.init_node("policy_test")
        self.tilts = []
        rospy.Subscriber("/floating_base", Odometry, self._receive, queue_size=1000)

    def _receive(self, message):
        x, y = message.pose.pose.orientation.x, message.pose.pose.orientation.y
        self.tilts.append(math.degrees(math.acos(1.0 - 2.0 * (x * x + y * y))))

    def test_the_pelvis_becomes_level(self):
        wait_for(lambda: rospy.get_time() > 4.0 and self.tilts, START, "simulated time, which waits for the policy")
        self.assertLess(max(self.tilts[-50:]), 0.5 * SLOPE)


if __name__ == "__main__":
    rostest.rosrun("solfer", "policy", PolicyTest)
