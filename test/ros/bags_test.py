#!/usr/bin/env python3
"""rosbag records the robot's topics and commands, and plays a command again."""

import signal
import tempfile
import unittest
from pathlib import Path

import rospy
import rostest
from ros_tools import output, shown
from system import START, Robot, end, started, subscribers, wait_for

from solfer.msg import JointCommand

COMMAND = "/position_controller/command"
MEASURED = ("/joint_states", "/imu")


class BagsTest(unittest.TestCase):
    """A robot with free joints."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("tests")
        cls.robot = Robot()
        cls.publisher = rospy.Publisher(COMMAND, JointCommand, queue_size=1, tcp_nodelay=True)
        wait_for(lambda: cls.publisher.get_num_connections() == 1, START, "a simulator that receives commands")

    def is_recorded(self) -> bool:
        """Return whether rosbag receives measurements and commands."""
        receives = all(any(node.startswith("/record") for node in subscribers(topic)) for topic in MEASURED)
        return receives and self.publisher.get_num_connections() == 2

    def test_a_recorded_command_is_played_again(self):
        """After a reset, rosbag's player alone brings the torso back to 0.3 rad; the bag holds all topics."""
        with tempfile.TemporaryDirectory() as folder:
            bag = str(Path(folder, "command.bag"))
            with started("rosbag", "record", "-O", bag, COMMAND, *MEASURED, "/tf") as process:
                wait_for(self.is_recorded, START, "rosbag that receives all")
                self.publisher.publish(name=["torso_yaw"], position=[0.3])
                self.robot.arrive({"torso_yaw": 0.3}, START)
                self.robot.passes(1.0)
                code, published = end(process, signal.SIGINT)
            self.assertEqual(code, 0, published)
            recorded = {topic["topic"]: topic for topic in shown("rosbag", "info", "--yaml", bag)["topics"]}
            self.assertEqual(recorded[COMMAND]["messages"], 1)
            self.assertEqual(recorded[COMMAND]["type"], "solfer/JointCommand")
            for topic in MEASURED:
                self.assertGreater(recorded[topic]["messages"], 200)
            output("rosbag", "check", bag)
            self.assertTrue(shown("rosservice", "call", "/simulator/reset", "{}")["success"])
            self.robot.arrive({"torso_yaw": 0.0}, START)
            # A message without a subscriber yet is lost, as is one that is still on its way when the player ends.
            play = ("rosbag", "play", "--wait-for-subscribers", "--keep-alive", bag, "--topics", COMMAND)
            with started(*play) as process:
                self.robot.arrive({"torso_yaw": 0.3}, START)
                code, published = end(process, signal.SIGINT)
            self.assertEqual(code, 0, published)


if __name__ == "__main__":
    rostest.rosrun("solfer", "bags", BagsTest)
