#!/usr/bin/env python3
"""ROS's own command line tools beside the simulated robot: they show its messages, and what they send moves it."""

import tempfile
import unittest
from pathlib import Path

import rospy
import rostest
import yaml
from ros_tools import found, output, shown
from system import START, Robot, soak, wait_for

COMMAND = "/position_controller/command"


class ToolsTest(unittest.TestCase):
    """A robot with free joints."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("tests")
        cls.robot = Robot()

    def swayed(self) -> float:
        """How far the base moved sideways since the robot's odometry begins [m]."""
        places = [message.pose.pose.position.y for message in list(self.robot.odometry)]
        return max(places, default=0.0) - min(places, default=0.0)

    @soak
    def test_rostopic_knows_the_topics(self):
        published = output("rostopic", "list", "-v")
        for topic, message in (
            ("/joint_states", "sensor_msgs/JointState"),
            ("/floating_base", "nav_msgs/Odometry"),
            ("/imu", "sensor_msgs/Imu"),
            ("/contacts/front_left_leg", "geometry_msgs/WrenchStamped"),
            (COMMAND, "solfer/JointCommand"),
        ):
            self.assertIn(f" * {topic} [{message}] 1 ", published)
        self.assertEqual(output("rostopic", "type", COMMAND), "solfer/JointCommand\n")
        self.assertIn("Subscribers: \n * /simulator", output("rostopic", "info", COMMAND))

    def test_rostopic_shows_messages_and_their_rate(self):
        self.robot.settle()
        joints = shown("rostopic", "echo", "-n", "1", "/joint_states")
        positions = dict(zip(joints["name"], joints["position"], strict=True))
        for name, position in self.robot.positions().items():
            self.assertAlmostEqual(positions[name], position, delta=0.001, msg=name)
        place = shown("rostopic", "echo", "-n", "1", "/floating_base/pose/pose/position")
        self.assertAlmostEqual(place["z"], self.robot.odometry[-1].pose.pose.position.z, delta=0.001)
        # 500 Hz of the simulated time, more or less, as soon as the tool receives in time
        found(r"average rate: (4\d\d|5[0-4]\d)\.", "rostopic", "hz", "/imu")

    def test_rostopic_moves_a_free_joint(self):
        output("rostopic", "pub", "-1", COMMAND, "solfer/JointCommand", "{name: [neck_yaw], position: [0.2]}")
        self.robot.arrive({"neck_yaw": 0.2}, START)

    def test_rosservice_calls_the_robot(self):
        self.assertEqual(output("rosservice", "type", "/simulator/push"), "solfer/PushLink\n")
        del self.robot.odometry[:]
        done = {"success": True, "message": ""}
        push = "{link: pelvis, force: [0, 150, 0], duration: 0.5}"
        self.assertEqual(shown("rosservice", "call", "/simulator/push", push), done)
        wait_for(lambda: self.swayed() > 0.001, START, "a pelvis that moved")
        refused = shown("rosservice", "call", "/simulator/push", "{link: pelvsi, duration: 0.3}")
        self.assertFalse(refused["success"])
        self.assertIn("pelvis", refused["message"])
        controllers = shown("rosservice", "call", "/lower_level/list_controllers")
        self.assertEqual(controllers["names"], ["position_controller", "velocity_controller"])

    @soak
    def test_rosnode_reaches_the_simulator(self):
        self.assertIn("xmlrpc reply", output("rosnode", "ping", "-c", "1", "/simulator"))
        published = output("rosnode", "info", "/simulator")
        for line in ("/joint_states [sensor_msgs/JointState]\n", COMMAND, "/simulator/push\n"):
            self.assertIn(f" * {line}", published)

    @soak
    def test_rosparam_reads_and_dumps_the_description(self):
        urdf = rospy.get_param("/robot_description")
        self.assertIn("/robot_semantic_description", output("rosparam", "list").splitlines())
        self.assertEqual(shown("rosparam", "get", "/robot_description").split(), urdf.split())
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "parameters.yaml")
            output("rosparam", "dump", str(path))
            self.assertEqual(yaml.safe_load(path.read_text())["robot_description"], urdf)


if __name__ == "__main__":
    rostest.rosrun("solfer", "tools", ToolsTest)
