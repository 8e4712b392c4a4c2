#!/usr/bin/env python3
"""rosbag records what the robot tells and what it is told, and plays a command again."""

import signal
import tempfile
import unittest
from pathlib import Path

import rosnode
import rospy
import rostest
from system import START, Robot, end, started, wait_for
from tools import output, shown

COMMAND = "/position_controller/command"


class BagsTest(unittest.TestCase):
    """A robot whose joints are free."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("bags_test")
        cls.robot = Robot()

    def test_a_recorded_command_is_played_again(self):
        with tempfile.TemporaryDirectory() as folder:
            bag = str(Path(folder, "command.bag"))
            with started("rosbag", "record", "-O", bag, COMMAND, "/joint_states", "/imu", "/tf") as process:
                wait_for(lambda: any(name.startswith("/record") for name in rosnode.get_node_names()), START, "rosbag")
                output("rostopic", "pub", "-1", COMMAND, "solfer/JointCommand", "{name: [torso_yaw], position: [0.3]}")
                self.robot.arrive({"torso_yaw": 0.3}, START)
                code, told = end(process, signal.SIGINT)
            self.assertEqual(code, 0, told)
            recorded = {topic["topic"]: topic for topic in shown("rosbag", "info", "--yaml", bag)["topics"]}
            self.assertEqual(recorded[COMMAND]["messages"], 1)
            self.assertEqual(recorded[COMMAND]["type"], "solfer/JointCommand")
            self.assertGreater(recorded["/joint_states"]["messages"], 200)
            self.assertGreater(recorded["/imu"]["messages"], 200)
            output("rosbag", "check", bag)
            self.assertTrue(shown("rosservice", "call", "/simulator/reset", "{}")["success"])
            self.robot.arrive({"torso_yaw": 0.0}, START)
            # A message that nobody listens to yet is lost, as is one that is still on its way when the player ends.
            play = ("rosbag", "play", "--wait-for-subscribers", "--keep-alive", bag, "--topics", COMMAND)
            with started(*play) as process:
                self.robot.arrive({"torso_yaw": 0.3}, START)
                code, told = end(process, signal.SIGINT)
            self.assertEqual(code, 0, told)


if __name__ == "__main__":
    rostest.rosrun("solfer", "bags", BagsTest)
