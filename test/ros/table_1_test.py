#!/usr/bin/env python3
"""Table 1 of the paper under ROS; the truth is what the simulator publishes, and PyBullet's geometry of it."""

import unittest
from functools import partial

import numpy as np
import pybullet
import rospy
import rostest
from bodies_parts import Bullet
from geometry_msgs.msg import WrenchStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState
from support.table_1 import FILE, GRAVITY, Table1, Table1System
from system import START, numbers, wait_for

from solfer.config import load
from solfer.middleware.ros import RosMiddleware, RosNode
from solfer.plugins import Registry, generate
from solfer.srv import MoveJoints

CONTACTS = {
    "front_left_leg": "wheel_1",
    "front_right_leg": "wheel_2",
    "rear_left_leg": "wheel_3",
    "rear_right_leg": "wheel_4",
    "left_arm": "arm1_7",
    "right_arm": "arm2_7",
}
PERIOD = 0.005
"""Simulated time between two joint states [s]."""


class RosTable1(Table1System):
    """Simulator and Speaker are nodes of their own, Listener runs here."""

    def __init__(self):
        self._middleware = RosMiddleware(RosNode("listener"))
        self._published = {}
        self._receive("/joint_states", JointState)
        self._receive("/floating_base", Odometry)
        for name in CONTACTS:
            self._receive(f"/contacts/{name}", WrenchStamped)
        self._ask = rospy.ServiceProxy("/speaker/trajectory", MoveJoints)
        wait_for(self._publishes, START, "a plugin 'speaker' that accepts requests")
        wait_for(lambda: len(self._published) == 2 + len(CONTACTS), START, "the simulator's messages")
        self._bullet = Bullet(rospy.get_param("/robot_description"))
        self.listener, self.spring = self._plugin("listener"), self._plugin("spring")
        bodies = range(-1, pybullet.getNumJoints(self._bullet.body, self._bullet.client))
        masses = [pybullet.getDynamicsInfo(self._bullet.body, each, self._bullet.client)[0] for each in bodies]
        self.weight = GRAVITY * sum(masses)
        self.run(2.0)

    def _plugin(self, name):
        configuration = load(FILE, name)
        return generate(configuration, self._middleware, Registry().find("", configuration.module.class_))

    def ask(self, **request):
        reply = self._ask(**request)
        assert reply.success, reply.message
        return reply.duration

    def run(self, duration):
        end = self._published["/joint_states"].header.seq + duration / PERIOD

        def cycled():
            self.listener.cycle()
            self.spring.cycle()
            return self._published["/joint_states"].header.seq >= end

        wait_for(cycled, START, f"{duration:g} s of the simulation")

    def joint(self, name):
        message = self._published["/joint_states"]
        index = message.name.index(name)
        return message.position[index], message.velocity[index]

    def pose(self, link):
        base, joints = self._published["/floating_base"].pose.pose, self._published["/joint_states"]
        if link == "pelvis":
            return numbers(base.position), numbers(base.orientation)
        bullet = self._bullet
        bullet.place(base, dict(zip(joints.name, joints.position, strict=True)))
        state = pybullet.getLinkState(bullet.body, bullet.links[link], True, True, bullet.client)
        return np.array(state[4]), np.array(state[5])

    def ground(self):
        force, moment = np.zeros(3), np.zeros(3)
        for name, link in CONTACTS.items():
            wrench = self._published[f"/contacts/{name}"].wrench
            force += numbers(wrench.force)
            moment += numbers(wrench.torque) + np.cross(self.pose(link)[0], numbers(wrench.force))
        return force, np.array([-moment[1], moment[0]]) / force[2]

    def _receive(self, topic, message):
        rospy.Subscriber(topic, message, partial(self._published.__setitem__, topic), queue_size=1, tcp_nodelay=True)

    def _publishes(self):
        try:
            return self._ask(state="reset").success
        except rospy.ServiceException:
            return False


class Table1Test(Table1, unittest.TestCase):
    """The rows under ROS."""

    @classmethod
    def setUpClass(cls):
        cls.system = RosTable1()


if __name__ == "__main__":
    rostest.rosrun("solfer", "table_1", Table1Test)
