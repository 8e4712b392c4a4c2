#!/usr/bin/env python3
"""A node in C++ (test/cpp/commander.cpp) receives, commands and calls the robot, and gets the reasons of refusals."""

import unittest

import rospkg
import rospy
import rostest
from system import CENTAURO, UNLOADED, Robot, program, run, soak, started, wait_for_plugin

JOINT = "torso_yaw"
COMMANDER = ("rosrun", "solfer", "commander")
PLUGIN = program("plugin", "-p", "joint_states", "-c", str(CENTAURO))


@unittest.skipUnless("roscpp" in rospkg.RosPack().list(), "no roscpp: CMakeLists.txt leaves the node out")
class RoscppTest(unittest.TestCase):
    """Our messages and services, from roscpp."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("tests")
        cls.robot = Robot()

    def test_a_command_moves_a_joint_that_is_free(self):
        goal = self.robot.positions()[JOINT] + 0.2
        code, message = run(*COMMANDER, "command", JOINT, "0.2")
        self.assertEqual((code, message), (0, ""))
        self.assertAlmostEqual(self.robot.positions()[JOINT], goal, delta=UNLOADED)

    @soak
    def test_a_plugin_moves_it_and_keeps_it(self):
        with started(*PLUGIN):
            wait_for_plugin()
            goal = self.robot.positions()[JOINT] - 0.3
            code, message = run(*COMMANDER, "request", JOINT, "-0.3")
            self.assertEqual((code, message), (0, ""))
            self.assertAlmostEqual(self.robot.positions()[JOINT], goal, delta=UNLOADED)
            code, message = run(*COMMANDER, "command", JOINT, "0.2")
            self.assertEqual(code, 1)
            self.assertIn(f"{JOINT} is not ours; position_controller is commanded by /joint_states: ", message)
            self.assertAlmostEqual(self.robot.positions()[JOINT], goal, delta=UNLOADED)

    @soak
    def test_a_wrong_name_is_reported(self):
        code, message = run(*COMMANDER, "command", "torso_jaw", "0.2")
        self.assertEqual((code, message), (1, "error: position_controller has no joint 'torso_jaw'\n"))


if __name__ == "__main__":
    rostest.rosrun("solfer", "roscpp", RoscppTest)
