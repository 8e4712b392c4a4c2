#!/usr/bin/env python3
"""rosbag records what the robot tells and what it is told, and plays a command again."""

import signal
import tempfile
import unittest
from pathlib import Path

import rospy
import rostest
from system import START, Robot, end, hearers, started, wait_for
from tools import output, shown

from solfer.msg import JointCommand

COMMAND = "/position_controller/command"
TOLD = ("/joint_states", "/imu")


class BagsTest(unittest.TestCase):
    """A robot whose joints are free."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("bags_test")
        cls.robot = Robot()
        cls.publisher = rospy.Publisher(COMMAND, JointCommand, queue_size=1, tcp_nodelay=True)
        wait_for(lambda: cls.publisher.get_num_connections() == 1, START, "a simulator that takes commands")

    def is_recorded(self) -> bool:
        """Whether rosbag hears what is said and told."""
        hears = all(any(node.startswith("/record") for node in hearers(topic)) for topic in TOLD)
        return hears and self.publisher.get_num_connections() == 2

    def test_a_recorded_command_is_played_again(self):
        with tempfile.TemporaryDirectory() as folder:
            bag = str(Path(folder, "command.bag"))
            with started("rosbag", "record", "-O", bag, COMMAND, *TOLD, "/tf") as process:
                wait_for(self.is_recorded, START, "rosbag that hears all")
                self.publisher.publish(name=["torso_yaw"], position=[0.3])
                self.robot.arrive({"torso_yaw": 0.3}, START)
                self.robot.passes(2.0)
                code, told = end(process, signal.SIGINT)
            self.assertEqual(code, 0, told)
            recorded = {topic["topic"]: topic for topic in shown("rosbag", "info", "--yaml", bag)["topics"]}
            self.assertEqual(recorded[COMMAND]["messages"], 1)
            self.assertEqual(recorded[COMMAND]["type"], "solfer/JointCommand")
            for topic in TOLD:
                self.assertGreater(recorded[topic]["messages"], 200)
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
