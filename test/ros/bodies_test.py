#!/usr/bin/env python3
"""A plugin that receives the floating base knows its Robot in the world: points of it against PyBullet."""

import io
import unittest

import numpy as np
import rospy
import rostest
from bodies_parts import Bullet
from geometry_msgs.msg import PointStamped, PoseStamped
from system import START, Robot, numbers, wait_for, wait_for_plugin

from solfer.errors import PipeError
from solfer.middleware.ros.codecs.table import codec
from solfer.msg import RobotPoints
from solfer.transport.messages import ROBOT_POINTS

HAND = "arm1_7"
NEAR = 3e-3
"""How far a robot that has just come to rest may move between two messages, on a machine that stalls [m]."""


class BodiesTest(unittest.TestCase):
    """A robot that has turned on the spot, and stands."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("tests")
        cls.robot, cls.published = Robot(), {}
        rospy.Subscriber("/center_of_mass", PointStamped, lambda message: cls.published.update(com=message))
        rospy.Subscriber("/wheels", RobotPoints, lambda message: cls.published.update(wheels=message))
        rospy.Subscriber("/hand", PoseStamped, lambda message: cls.published.update(hand=message))
        wait_for_plugin()
        cls.robot.turn_wheels(2.0)
        wait_for(cls.gone, START, "a robot that turns and moves")
        cls.robot.turn_wheels(0.0)
        cls.robot.settle()
        cls.published.clear()
        wait_for(lambda: {"com", "hand", "wheels"} <= set(cls.published), START, "the plugin's messages")
        cls.bullet = Bullet(rospy.get_param("/robot_description"))
        cls.base = cls.robot.odometry[-1].pose.pose
        cls.bullet.place(cls.base, cls.robot.positions())

    @classmethod
    def gone(cls):
        """Whether the base is neither where the URDF has it nor turned as there."""
        pose = cls.robot.odometry[-1].pose.pose if cls.robot.odometry else None
        return pose is not None and np.hypot(pose.position.x, pose.position.y) > 0.02 and abs(pose.orientation.z) > 0.02

    def test_the_center_of_mass_is_that_of_pybullet(self):
        message = self.published["com"]
        self.assertEqual(message.header.frame_id, "world")
        np.testing.assert_allclose(numbers(message.point), self.bullet.center_of_mass(), atol=NEAR)

    def test_the_hand_is_where_pybullet_has_it(self):
        message = self.published["hand"]
        self.assertEqual(message.header.frame_id, "world")
        np.testing.assert_allclose(numbers(message.pose.position), self.bullet.position(HAND), atol=NEAR)

    def test_the_wheels_are_published_by_name(self):
        message = self.published["wheels"]
        self.assertEqual((message.header.frame_id, message.count, len(message.value)), ("world", 4, 12))
        for name, position in zip(message.name, np.reshape(message.value, (4, 3)), strict=True):
            np.testing.assert_allclose(position, self.bullet.position(name), atol=NEAR, err_msg=name)

    def test_several_points_are_decoded(self):
        points = RobotPoints(name=["a", "b"], count=2, value=[1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
        points.header.frame_id = "pelvis"
        read = codec(ROBOT_POINTS).decode(self.packed(points), "/sender")
        self.assertEqual((read.frame, read.names, read.sender), ("pelvis", ("a", "b"), "/sender"))
        np.testing.assert_array_equal(read.values, [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
        for wrong in (RobotPoints(), RobotPoints(count=2, value=[1.0]), RobotPoints(name=["a"], count=2, value=[1, 2])):
            with self.assertRaises(PipeError):
                codec(ROBOT_POINTS).decode(self.packed(wrong), "")

    @staticmethod
    def packed(message):
        """Serialise a message."""
        buffer = io.BytesIO()
        message.serialize(buffer)
        return buffer.getvalue()


if __name__ == "__main__":
    rostest.rosrun("solfer", "bodies", BodiesTest)
