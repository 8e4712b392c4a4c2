#!/usr/bin/env python3
"""The floating base: its twist is the derivative of its pose, and tf has the same pose."""

import unittest

import numpy as np
import rospy
import rostest
from nav_msgs.msg import Odometry
from system import PERIOD, START, Robot, numbers, wait_for, wait_for_plugin
from tf2_msgs.msg import TFMessage

from solfer.numerics.rotations import rotation_from_quaternion


def position(message: Odometry) -> np.ndarray:
    """Where the base is, shape (3,) [m]."""
    return numbers(message.pose.pose.position)


def orientation(message: Odometry) -> np.ndarray:
    """Rotation from the base to the world, shape (3, 3)."""
    return rotation_from_quaternion(numbers(message.pose.pose.orientation))


class BaseTest(unittest.TestCase):
    """The base of a robot that turns on the spot and sways: all wheels turn equally, on both sides."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("tests")
        cls.robot, cls.transforms = Robot(), []
        rospy.Subscriber("/tf", TFMessage, lambda message: cls.transforms.extend(message.transforms), queue_size=100)
        wait_for_plugin()
        wait_for(lambda: cls.transforms and cls.robot.odometry, START, "a base that is published")
        cls.robot.turn_wheels(2.0)
        cls.robot.passes(1.5)
        cls.robot.turn_wheels(0.0)
        cls.odometry = list(cls.robot.odometry)

    def test_the_twist_is_the_derivative_of_the_pose(self):
        moved, turned, before = np.zeros(3), np.zeros(3), self.odometry[0]
        for message in self.odometry[1:]:
            rotation = orientation(message)
            time_passed = PERIOD * (message.header.seq - before.header.seq)
            moved += time_passed * rotation @ numbers(message.twist.twist.linear)
            turned += time_passed * rotation @ numbers(message.twist.twist.angular)
            before = message
        expected = position(self.odometry[-1]) - position(self.odometry[0])
        self.assertGreater(np.linalg.norm(expected), 0.02)
        np.testing.assert_allclose(moved, expected, atol=0.003)
        change = orientation(self.odometry[-1]) @ orientation(self.odometry[0]).T
        yaw = np.arctan2(change[1, 0], change[0, 0])
        self.assertGreater(abs(yaw), 0.02)
        self.assertAlmostEqual(turned[2], yaw, delta=0.005)

    def test_tf_shows_the_pose(self):
        """Odometry and tf are two ways to the same pose: 5 mm and 0.01 rad apart at most, at equal stamps."""
        stamps = np.array([message.header.stamp.to_sec() for message in self.odometry])
        compared = 0
        for transform in self.transforms:
            if transform.child_frame_id != "pelvis":
                continue
            self.assertEqual(transform.header.frame_id, "world")
            nearest = int(np.argmin(np.abs(stamps - transform.header.stamp.to_sec())))
            if abs(stamps[nearest] - transform.header.stamp.to_sec()) < PERIOD:
                pose = self.odometry[nearest].pose.pose
                translation = numbers(transform.transform.translation)
                np.testing.assert_allclose(translation, numbers(pose.position), atol=0.005)
                rotation = numbers(transform.transform.rotation)
                self.assertGreater(abs(rotation @ numbers(pose.orientation)), np.cos(0.01))
                compared += 1
        self.assertGreater(compared, 100)


if __name__ == "__main__":
    rostest.rosrun("solfer", "base", BaseTest)
