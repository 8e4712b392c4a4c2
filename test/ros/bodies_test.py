#!/usr/bin/env python3
"""A plugin that hears the floating base knows its Robot in the world: points of it against PyBullet."""

import io
import tempfile
import unittest

import numpy as np
import pybullet
import rospy
import rostest
from geometry_msgs.msg import PointStamped, PoseStamped
from system import START, Robot, numbers, wait_for, wait_for_plugin

from solfer.errors import PipeError
from solfer.middleware.ros.codecs import codec
from solfer.model import Description
from solfer.msg import RobotPoints
from solfer.pipes.messages import POINTS
from solfer.simulation.body_urdf import body_urdf

HAND = "arm1_7"
NEAR = 1e-3
"""How far a robot that stands still may move between two messages [m]."""


class Bullet:
    """PyBullet's own copy of the robot, put where the robot says that it is."""

    def __init__(self, description: str):
        self.urdf = body_urdf(Description.from_text(description), True)
        self.client = pybullet.connect(pybullet.DIRECT)
        with tempfile.NamedTemporaryFile("w", suffix=".urdf") as file:
            file.write(self.urdf.text)
            file.flush()
            self.body = pybullet.loadURDF(file.name, physicsClientId=self.client)
        infos = [pybullet.getJointInfo(self.body, index, self.client)
                 for index in range(pybullet.getNumJoints(self.body, self.client))]
        self.joints = {info[1].decode(): info[0] for info in infos}
        self.links = {info[12].decode(): info[0] for info in infos}

    def place(self, pose, joints):
        """Put base and joints."""
        offset = pybullet.getDynamicsInfo(self.body, -1, self.client)[3:5]
        base = pybullet.multiplyTransforms(numbers(pose.position).tolist(), numbers(pose.orientation).tolist(), *offset)
        pybullet.resetBasePositionAndOrientation(self.body, *base, self.client)
        for name, position in joints.items():
            pybullet.resetJointState(self.body, self.joints[name], position, physicsClientId=self.client)

    def center_of_mass(self):
        """Centre of mass of all links [m]."""
        masses = [pybullet.getDynamicsInfo(self.body, index, self.client)[0] for index in (-1, *self.joints.values())]
        places = [pybullet.getBasePositionAndOrientation(self.body, self.client)[0]]
        states = pybullet.getLinkStates(self.body, list(self.joints.values()), True, True, self.client)
        return np.average(places + [state[0] for state in states], axis=0, weights=masses)

    def position(self, link):
        """Origin of a link [m]."""
        return np.array(pybullet.getLinkState(self.body, self.links[link], True, True, self.client)[4])


class BodiesTest(unittest.TestCase):
    """A robot that has turned on the spot, and stands."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("bodies_test")
        cls.robot, cls.told = Robot(), {}
        rospy.Subscriber("/center_of_mass", PointStamped, lambda message: cls.told.update(com=message))
        rospy.Subscriber("/wheels", RobotPoints, lambda message: cls.told.update(wheels=message))
        rospy.Subscriber("/hand", PoseStamped, lambda message: cls.told.update(hand=message))
        wait_for_plugin()
        cls.robot.turn_wheels(2.0)
        wait_for(cls.gone, START, "a robot that turns and moves")
        cls.robot.turn_wheels(0.0)
        cls.robot.settle()
        cls.told.clear()
        wait_for(lambda: {"com", "hand", "wheels"} <= set(cls.told), START, "what the plugin tells")
        cls.bullet = Bullet(rospy.get_param("/robot_description"))
        cls.base = cls.robot.odometry[-1].pose.pose
        cls.bullet.place(cls.base, cls.robot.positions())

    @classmethod
    def gone(cls):
        """Whether the base is neither where the URDF has it nor turned as there."""
        pose = cls.robot.odometry[-1].pose.pose if cls.robot.odometry else None
        return pose is not None and np.hypot(pose.position.x, pose.position.y) > 0.02 and abs(pose.orientation.z) > 0.02

    def test_the_center_of_mass_is_that_of_pybullet(self):
        message = self.told["com"]
        self.assertEqual(message.header.frame_id, "world")
        np.testing.assert_allclose(numbers(message.point), self.bullet.center_of_mass(), atol=NEAR)

    def test_the_hand_is_where_pybullet_has_it(self):
        message = self.told["hand"]
        self.assertEqual(message.header.frame_id, "world")
        np.testing.assert_allclose(numbers(message.pose.position), self.bullet.position(HAND), atol=NEAR)

    def test_the_wheels_are_told_by_name(self):
        message = self.told["wheels"]
        self.assertEqual((message.header.frame_id, message.count, len(message.value)), ("world", 4, 12))
        for name, position in zip(message.name, np.reshape(message.value, (4, 3)), strict=True):
            np.testing.assert_allclose(position, self.bullet.position(name), atol=NEAR, err_msg=name)

    def test_several_points_are_decoded(self):
        points = RobotPoints(name=["a", "b"], count=2, value=[1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
        points.header.frame_id = "pelvis"
        read = codec(POINTS).decode(self.packed(points), "/somebody")
        self.assertEqual((read.frame, read.names, read.sender), ("pelvis", ("a", "b"), "/somebody"))
        np.testing.assert_array_equal(read.values, [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
        for wrong in (RobotPoints(), RobotPoints(count=2, value=[1.0]), RobotPoints(name=["a"], count=2, value=[1, 2])):
            with self.assertRaises(PipeError):
                codec(POINTS).decode(self.packed(wrong), "")

    @staticmethod
    def packed(message):
        """The bytes of a message."""
        buffer = io.BytesIO()
        message.serialize(buffer)
        return buffer.getvalue()


if __name__ == "__main__":
    rostest.rosrun("solfer", "bodies", BodiesTest)
