#!/usr/bin/env python3
"""The plugin joint_states moves hardware that names and counts its joints otherwise; judged by its raw encoders."""

import functools
import unittest
from xml.etree import ElementTree

import rospy
import rostest
from sensor_msgs.msg import JointState
from system import START, move, wait_for, wait_for_plugin

from solfer.config import read
from solfer.simulation.mock_hardware.records import HardwareRecord
from solfer.srv import GetJointNames

UNLOADED, LOADED = 0.05, 0.12
"""How far the hardware's soft springs give way to gravity [rad]."""


class HardwareTest(unittest.TestCase):
    """Requests to the service, and what the encoders of the mock read afterwards."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("hardware_test")
        cls.encoders = read(rospy.get_param("/hardware/file"), HardwareRecord).joints
        cls.published = JointState()
        rospy.Subscriber("/joint_states", JointState, lambda message: setattr(cls, "published", message), queue_size=1)
        wait_for(lambda: bool(cls.published.name), START, "joint states")
        wait_for_plugin()

    def posture(self):
        """Compute the physical posture, from the readings and the way in which the mock mounts its encoders [rad]."""
        readings = dict(zip(self.published.name, self.published.position, strict=True))
        return {joint: each.direction * readings[each.name] + each.zero for joint, each in self.encoders.items()}

    def reach(self, goal, timeout):
        """Wait until all joints of `goal` are physically there."""

        def away():
            posture = self.posture()
            return {
                joint: posture[joint] - value
                for joint, value in goal.items()
                if abs(posture[joint] - value) > (LOADED if joint.startswith(("hip", "knee", "ankle")) else UNLOADED)
            }

        wait_for(lambda: not away(), timeout, lambda: f"joints at their goals: {away()}")

    def test_the_hardware_has_names_of_its_own(self):
        self.assertEqual(list(self.published.name), [each.name for each in self.encoders.values()])
        names = rospy.ServiceProxy("/velocity_controller/get_joint_names", GetJointNames)().names
        self.assertEqual(list(names), ["J46", "J56", "J66", "J76"])

    def test_a_named_state_is_reached(self):
        semantics = ElementTree.fromstring(rospy.get_param("/robot_semantic_description"))
        joints = semantics.findall("group_state[@name='mammal_wide_high']/joint")
        goal = {joint.get("name"): float(joint.get("value")) for joint in joints}
        goal = {joint: value for joint, value in goal.items() if not joint.startswith("j_wheel")}
        self.assertGreater(len(goal), 30)
        move(lambda timeout: self.reach(goal, timeout), state="mammal_wide_high", speed=1.0)

    def test_joints_are_moved_to_positions(self):
        goal = {"torso_yaw": 0.4, "neck_yaw": -0.3}
        move(lambda timeout: self.reach(goal, timeout), joints=list(goal), positions=list(goal.values()), speed=0.5)

    def test_wheels_turn_their_own_way(self):
        """Each encoder has a direction of its own: the raw readings times that must reach all four desired speeds."""
        goal = {"j_wheel_1": 1.0, "j_wheel_2": -1.0, "j_wheel_3": 0.5, "j_wheel_4": -0.5}

        def speeds():
            readings = dict(zip(self.published.name, self.published.velocity, strict=True))
            return {wheel: self.encoders[wheel].direction * readings[self.encoders[wheel].name] for wheel in goal}

        def turn(desired, timeout):
            wait_for(
                lambda: all(abs(speeds()[wheel] - speed) < 0.05 for wheel, speed in desired.items()),
                timeout,
                lambda: f"wheels at their speeds, not at {speeds()}",
            )

        for factor in (1.0, 0.0):
            desired = {wheel: factor * speed for wheel, speed in goal.items()}
            move(functools.partial(turn, desired), joints=list(desired), velocities=list(desired.values()))


if __name__ == "__main__":
    rostest.rosrun("solfer", "calibration", HardwareTest)
