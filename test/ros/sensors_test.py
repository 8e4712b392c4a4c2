#!/usr/bin/env python3
"""What the robot measures, on simulated time: types, frames, rates and stamps; and a plugin that goes by that time."""

import os
import signal
import time
import unittest
import xmlrpc.client

import numpy as np
import rosgraph
import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import WrenchStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu, JointState
from system import START, Robot, ask, wait_for, wait_for_plugin

from solfer.config.files import located
from solfer.simulation import read_bundle

WEIGHT = 94.96909 * 9.81
"""Weight of the robot [N]."""

WHEELS = {"front_left_leg": "wheel_1", "front_right_leg": "wheel_2", "rear_left_leg": "wheel_3",
          "rear_right_leg": "wheel_4"}
CONTACTS = WHEELS | {"left_arm": "arm1_7", "right_arm": "arm2_7"}

TOPICS = {"/joint_states": (JointState, ""), "/motor_states": (JointState, ""), "/imu": (Imu, "imu_link"),
          "/floating_base": (Odometry, "world")}
TOPICS |= {f"/contacts/{name}": (WrenchStamped, "world") for name in CONTACTS}
TOPICS |= {f"/contacts/{name}/link": (WrenchStamped, link) for name, link in CONTACTS.items()}
"""Types and frames of all that the robot tells."""


RATES = read_bundle(located("package://solfer/config/robots/centauro/robot.yaml", ".")).sensors.rates
NAMES = {"/joint_states": "joints", "/motor_states": "motors", "/imu": "imu", "/floating_base": "base"}
"""Rates of the robot's record, by topic; all others are contacts."""


def period(topic: str) -> float:
    """Simulated time between two messages of a topic [s]."""
    return 1.0 / getattr(RATES, NAMES.get(topic, "contacts"))


def pid(node: str) -> int:
    """Process of a node."""
    uri = rosgraph.Master("/sensors_test").lookupNode(node)
    return xmlrpc.client.ServerProxy(uri).getPid("/sensors_test")[2]


class SensorsTest(unittest.TestCase):
    """A robot that stands."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("sensors_test")
        cls.robot = Robot()
        wait_for_plugin()
        cls.heard = {topic: [] for topic in TOPICS}
        for topic, (message, _) in TOPICS.items():
            rospy.Subscriber(topic, message, cls.heard[topic].append, queue_size=100, tcp_nodelay=True)

    def test_every_topic_has_its_type_frame_rate_and_simulated_stamps(self):
        types = dict(rosgraph.Master("/sensors_test").getTopicTypes())
        for topic, (message, frame) in TOPICS.items():
            wait_for(lambda topic=topic: len(self.heard[topic]) > 100, START, f"messages on {topic}")
            wait_for(lambda topic=topic: self.age(topic) < 1.0, START, f"messages on {topic} that are stamped now")
            heard = list(self.heard[topic])  # rospy's thread goes on appending: look at one copy
            self.assertEqual(types[topic], message._type)
            stamps = np.array([item.header.stamp.to_sec() for item in heard])
            counts = np.array([item.header.seq for item in heard])
            self.assertEqual({item.header.frame_id for item in heard}, {frame}, topic)
            # exact multiples of the period: stamps are those of the simulation, not of the machine
            step = period(topic)
            np.testing.assert_allclose(stamps / step, np.round(stamps / step), atol=1e-6, err_msg=topic)
            np.testing.assert_allclose(np.diff(stamps), step * np.diff(counts), atol=1e-9, err_msg=topic)

    def age(self, topic: str) -> float:
        """Simulated time between the stamp of the newest message and now [s]."""
        return abs(self.heard[topic][-1].header.stamp.to_sec() - rospy.get_time())

    def test_the_wheels_carry_the_weight_and_the_imu_feels_it(self):
        self.robot.settle()
        before = len(self.heard["/imu"])
        wait_for(lambda: len(self.heard["/imu"]) > before, START, "an inertial measurement")
        total = sum(self.heard[f"/contacts/{name}"][-1].wrench.force.z for name in WHEELS)
        self.assertAlmostEqual(total / WEIGHT, 1.0, delta=1e-3)
        self.assertEqual(self.heard["/contacts/left_arm"][-1].wrench.force.z, 0.0)
        self.assertAlmostEqual(self.heard["/imu"][-1].linear_acceleration.z, 9.81, delta=0.01)

    def test_the_motor_side_is_behind_the_springs(self):
        wait_for(lambda: bool(self.heard["/motor_states"]), START, "motor states")
        motors = self.heard["/motor_states"][-1]
        same = [item for item in list(self.heard["/joint_states"]) if item.header.stamp == motors.header.stamp]
        for joints in same:
            knee = joints.name.index("knee_pitch_1")
            expected = joints.position[knee] + joints.effort[knee] / 80000.0
            self.assertAlmostEqual(motors.position[knee], expected, places=12)

    def test_a_plugin_on_simulated_time_moves_joints_and_outlives_a_pause(self):
        goal = {"torso_yaw": 0.3}
        reply = ask(joints=list(goal), positions=list(goal.values()), speed=0.5)
        self.assertTrue(reply.success, reply.message)
        self.robot.arrive(goal, START)
        states = []
        rospy.Subscriber("/diagnostics", DiagnosticArray, lambda message: states.extend(
            status for status in message.status if status.name.startswith("joint_states:")))
        process = pid("/simulator")
        os.kill(process, signal.SIGSTOP)
        try:
            time.sleep(1.0)
        finally:
            os.kill(process, signal.SIGCONT)
        # a plugin whose feedback had grown old would refuse: it waits for news, and starts anew
        goal = {"torso_yaw": 0.0}
        reply = ask(joints=list(goal), positions=list(goal.values()), speed=0.5)
        self.assertTrue(reply.success, reply.message)
        self.robot.arrive(goal, START)
        wait_for(lambda: bool(states), START, "health of the plugin")
        self.assertEqual({status.message for status in states}, {"running"})


if __name__ == "__main__":
    rostest.rosrun("solfer", "sensors", SensorsTest)
