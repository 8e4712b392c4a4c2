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
from system import CENTAURO, START, Robot, program, soak, started, wait_for, wait_for_plugin

from solfer.config.yaml.files import located
from solfer.simulation import read_bundle
from solfer.srv import ResetSimulation

WEIGHT = 94.96909 * 9.81
"""Weight of the robot [N]."""

WHEELS = {
    "front_left_leg": "wheel_1",
    "front_right_leg": "wheel_2",
    "rear_left_leg": "wheel_3",
    "rear_right_leg": "wheel_4",
}
CONTACTS = WHEELS | {"left_arm": "arm1_7", "right_arm": "arm2_7"}

TOPICS = {
    "/joint_states": (JointState, ""),
    "/motor_states": (JointState, ""),
    "/imu": (Imu, "imu_link"),
    "/floating_base": (Odometry, "world"),
}
TOPICS |= {f"/contacts/{name}": (WrenchStamped, "world") for name in CONTACTS}
TOPICS |= {f"/contacts/{name}/link": (WrenchStamped, link) for name, link in CONTACTS.items()}
"""Types and frames of all that the robot publishes."""


RATES = read_bundle(located("package://solfer/config/robots/centauro/robot.yaml", ".")).sensors.rates
NAMES = {"/joint_states": "joints", "/motor_states": "motors", "/imu": "imu", "/floating_base": "base"}
"""Rates of the robot's record, by topic; all others are contacts."""


def period(topic: str) -> float:
    """Return the simulated time between two messages of a topic [s]."""
    return 1.0 / getattr(RATES, NAMES.get(topic, "contacts"))


def pid(node: str) -> int:
    """Process of a node."""
    uri = rosgraph.Master("/tests").lookupNode(node)
    return xmlrpc.client.ServerProxy(uri).getPid("/tests")[2]


class SensorsTest(unittest.TestCase):
    """A robot that stands."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("tests")
        cls.robot = Robot()
        reset = rospy.ServiceProxy("/simulator/reset", ResetSimulation)()
        assert reset.success, reset.message
        cls.received = {topic: [] for topic in TOPICS}
        for topic, (message, _) in TOPICS.items():
            rospy.Subscriber(topic, message, cls.received[topic].append, queue_size=100, tcp_nodelay=True)

    def test_every_topic_has_type_frame_and_rate(self):
        types = dict(rosgraph.Master("/tests").getTopicTypes())
        for topic, (message, frame) in TOPICS.items():
            wait_for(lambda topic=topic: len(self.received[topic]) > 100, START, f"messages on {topic}")
            wait_for(lambda topic=topic: self.age(topic) < 1.0, START, f"messages on {topic} that are stamped now")
            received = list(self.received[topic])  # rospy's thread goes on appending: look at one copy
            self.assertEqual(types[topic], message._type)
            stamps = np.array([item.header.stamp.to_sec() for item in received])
            counts = np.array([item.header.seq for item in received])
            self.assertEqual({item.header.frame_id for item in received}, {frame}, topic)
            # exact multiples of the period: stamps are those of the simulation, not of the machine
            step = period(topic)
            np.testing.assert_allclose(stamps / step, np.round(stamps / step), atol=1e-6, err_msg=topic)
            np.testing.assert_allclose(np.diff(stamps), step * np.diff(counts), atol=1e-9, err_msg=topic)

    def age(self, topic: str) -> float:
        """Compute the simulated time between the stamp of the newest message and now [s]."""
        return abs(self.received[topic][-1].header.stamp.to_sec() - rospy.get_time())

    def test_the_wheels_carry_the_weight(self):
        self.robot.settle()
        before = len(self.received["/imu"])
        wait_for(lambda: len(self.received["/imu"]) > before + 200, START, "inertial measurements")
        # the mean of a second: a body that has stopped rocks on its legs for a while
        newest = (self.received[f"/contacts/{name}"][-200:] for name in WHEELS)
        total = sum(np.mean([item.wrench.force.z for item in messages]) for messages in newest)
        self.assertAlmostEqual(total / WEIGHT, 1.0, delta=1e-3)
        self.assertEqual(self.received["/contacts/left_arm"][-1].wrench.force.z, 0.0)
        felt = np.mean([item.linear_acceleration.z for item in self.received["/imu"][-200:]])
        self.assertAlmostEqual(felt, 9.81, delta=0.09)  # its bias has a deviation of 0.02

    def test_the_motor_side_is_behind_the_springs(self):
        wait_for(lambda: bool(self.received["/motor_states"]), START, "motor states")
        motors = self.received["/motor_states"][-1]
        same = [item for item in list(self.received["/joint_states"]) if item.header.stamp == motors.header.stamp]
        for joints in same:
            knee = joints.name.index("knee_pitch_1")
            expected = joints.position[knee] + joints.effort[knee] / 80000.0
            # half a step of the encoder, and 2 Nm of offset with 5 deviations of 0.5 Nm on the spring
            self.assertAlmostEqual(motors.position[knee], expected, delta=4.8e-5 + 4.5 / 80000.0)

    @soak
    def test_a_plugin_on_simulated_time_outlives_pauses(self):
        """SIGSTOP holds the simulator for 1 s: feedback of simulated age zero must not count as old."""
        wait_for_plugin(self.enterContext(started(*program("plugin", "-p", "joint_states", "-c", str(CENTAURO)))))
        self.robot.reach({"torso_yaw": 0.3})
        states = []
        rospy.Subscriber(
            "/diagnostics",
            DiagnosticArray,
            lambda message: states.extend(
                status for status in message.status if status.name.startswith("joint_states:")
            ),
        )
        process = pid("/simulator")
        os.kill(process, signal.SIGSTOP)
        try:
            time.sleep(1.0)
        finally:
            os.kill(process, signal.SIGCONT)
        # a plugin with old feedback would refuse: it waits for news, and starts anew
        self.robot.reach({"torso_yaw": 0.0})
        wait_for(lambda: bool(states), START, "health of the plugin")
        # its own loop may stand still on a busy machine, which is not what is tested
        self.assertLessEqual({status.message for status in states if "its own loop" not in status.message}, {"running"})


if __name__ == "__main__":
    rostest.rosrun("solfer", "sensors", SensorsTest)
