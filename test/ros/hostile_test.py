#!/usr/bin/env python3
"""Random messages, ten thousand in a soak, and the emergency stop, on a real master."""

import time
import unittest

import numpy as np
import rospy
import rostest
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger
from system import SOAKS, START, Robot, wait_for

from solfer.msg import JointCommand
from solfer.srv import ClaimJoints, ListControllers, ResetSimulation

MESSAGES = 10_000 if SOAKS else 600
BATCH, PAUSE = 20, 0.01  # [s]
HUGE = (np.nan, np.inf, -np.inf, 1e308, -1e308, 1e18)
FIELDS = ("position", "velocity", "effort", "stiffness", "damping")
EFFORT = 5000.0  # [Nm]; motors have at most 304, but springs of 80 kNm/rad take the blows of a robot that falls


def random_command(rng: np.random.Generator, joints: list[str]) -> JointCommand:
    """Known, unknown and duplicate names; arrays of any size with any numbers."""
    names = [str(name) for name in rng.choice(joints, size=rng.integers(0, 6))]
    names += ["no_such_joint"] if rng.random() < 0.1 else []
    message = JointCommand(name=names)
    for field in rng.choice(FIELDS, size=rng.integers(0, 4), replace=False):
        values = rng.normal(scale=rng.choice([0.1, 1.0, 100.0]), size=len(names) if rng.random() < 0.8 else 3)
        strange = rng.random(len(values)) < rng.choice([0.0, 0.2])
        values[strange] = rng.choice(HUGE, size=int(strange.sum()))
        setattr(message, field, values.tolist())
    return message


class HostileTest(unittest.TestCase):
    """The tests run in this order, on one robot."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("tests")
        cls.robot, cls.states = Robot(), []
        cls.list = rospy.ServiceProxy("/lower_level/list_controllers", ListControllers)
        cls.joints = {name: joints.split() for name, joints in zip(cls.list().names, cls.list().joints, strict=True)}
        cls.publishers = {
            name: rospy.Publisher(f"/{name}/command", JointCommand, queue_size=100, tcp_nodelay=True)
            for name in cls.joints
        }
        for publisher in cls.publishers.values():
            wait_for(lambda one=publisher: one.get_num_connections() > 0, START, "a simulator that receives commands")

    def test_a_hostile_publisher(self):
        """Random commands leave finite states and bounded efforts; the wheels stop when the flood does."""
        rng, names = np.random.default_rng(5), list(self.joints)
        subscriber = rospy.Subscriber("/joint_states", JointState, self.states.append, queue_size=100)
        for _ in range(MESSAGES // BATCH):
            for _ in range(BATCH):
                name = names[rng.integers(len(names))]
                self.publishers[name].publish(random_command(rng, self.joints[name]))
            time.sleep(PAUSE)
        self.robot.passes(0.5)
        subscriber.unregister()
        self.assertGreater(len(self.states), 100)
        for message in self.states:
            self.assertTrue(np.isfinite([*message.position, *message.velocity, *message.effort]).all())
            self.assertLess(np.abs(message.effort).max(), EFFORT)
        self.assertEqual(list(self.list().states), ["running"] * len(names))
        wait_for(lambda: max(map(abs, self.robot.speeds())) < 0.05, START, "wheels that stop without commands")
        wait_for(lambda: not any(self.list().claimed_by), START, "joints that are free")

    def test_an_emergency_stop_is_latched(self):
        """Commands that flow on cannot end the stop, and after its reset an earlier owner needs a claim of its own."""
        joint = self.joints["position_controller"][-1]
        command = JointCommand(name=[joint], position=[0.1])
        # it may lie on its side by now, and refuse all commands
        self.assertTrue(rospy.ServiceProxy("/simulator/reset", ResetSimulation)().success)
        self.assertTrue(rospy.ServiceProxy("/lower_level/emergency_stop", Trigger)().success)
        for _ in range(100):
            self.publishers["position_controller"].publish(command)
            time.sleep(0.02)
        self.robot.passes(0.2)  # nothing of that is on its way any more
        self.assertFalse(any(self.list().claimed_by))
        self.assertTrue(rospy.ServiceProxy("/lower_level/reset_emergency_stop", Trigger)().success)
        self.robot.settle()
        before = self.robot.positions()
        for _ in range(50):  # an earlier owner is not received any more, however long it waits
            self.publishers["position_controller"].publish(command)
            self.assertFalse(any(self.list().claimed_by))
            time.sleep(0.02)
        self.assertLess(self.robot.moved(before), 0.003)
        claim = rospy.ServiceProxy("/lower_level/claim", ClaimJoints)(
            owner=rospy.get_name(), controllers=["position_controller"], modes=["position"], joints=[joint]
        )
        self.assertTrue(claim.success, claim.message)
        self.publishers["position_controller"].publish(command)
        wait_for(lambda: abs(self.robot.positions()[joint] - 0.1) < 0.05, START, "a command that is carried out again")


if __name__ == "__main__":
    rostest.rosrun("solfer", "hostile", HostileTest)
