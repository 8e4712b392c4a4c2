#!/usr/bin/env python3
"""`rosrun solfer simulator --robot FILE.urdf --srdf FILE --floating-base` with a quadruped that comes with PyBullet."""

import signal
import tempfile
import unittest
from pathlib import Path

import pybullet_data
import rospy
import rostest
from sensor_msgs.msg import JointState
from system import START, end, program, soak, started, wait_for

from solfer.srv import GetJointNames

SIMULATOR = program("simulator")
A1 = str(Path(pybullet_data.getDataPath(), "a1/a1.urdf"))
STANDING = {"hip": 0.0, "upper": 0.8, "lower": -1.6}
LEGS = ("FR", "FL", "RR", "RL")
GAVE_WAY = 0.03  # [rad]


def write_srdf(folder: str) -> str:
    """Write an SRDF with a state in which the quadruped stands; returns the file's name."""
    goal = {f"{leg}_{joint}_joint": value for leg in LEGS for joint, value in STANDING.items()}
    joints = "".join(f'<joint name="{name}" value="{value}"/>' for name, value in goal.items())
    file = Path(folder, "a1.srdf")
    file.write_text(
        f'<robot name="a1"><group name="legs"><link name="trunk"/></group>'
        f'<group_state name="crouched" group="legs">{joints}</group_state></robot>'
    )
    return str(file)


@soak
class BareRobotTest(unittest.TestCase):
    """The simulator's options for robots of others."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("tests")
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder, cls.srdf = folder.name, write_srdf(folder.name)

    def test_a_quadruped_stands_as_in_its_srdf(self):
        """Two files of a foreign robot suffice: after 2 s each joint is near the state in its SRDF."""
        published = {}
        rospy.Subscriber("/joint_states", JointState, lambda message: published.update(newest=message), queue_size=1)
        with started(*SIMULATOR, "--robot", A1, "--srdf", self.srdf, "--floating-base") as process:
            rospy.wait_for_service("/position_controller/get_joint_names", START)
            names = rospy.ServiceProxy("/position_controller/get_joint_names", GetJointNames)().names
            self.assertEqual(len(names), 12)
            wait_for(lambda: bool(published), START, "joint states")
            begin = published["newest"].header.stamp
            wait_for(
                lambda: (published["newest"].header.stamp - begin).to_sec() > 2.0, START, "two seconds of standing"
            )
            message = published["newest"]
            self.assertIn("/floating_base", [topic for topic, _ in rospy.get_published_topics()])
            for parameter, file in (("/robot_description", A1), ("/robot_semantic_description", self.srdf)):
                self.assertTrue(rospy.get_param(parameter) == Path(file).read_text(), parameter)
            code, output = end(process, signal.SIGINT)
        self.assertEqual(code, 0, output)
        self.assertEqual(set(message.name), set(names))
        for name, position in zip(message.name, message.position, strict=True):
            self.assertAlmostEqual(position, STANDING[name.split("_")[1]], delta=GAVE_WAY, msg=name)


if __name__ == "__main__":
    rostest.rosrun("solfer", "bare_robot", BareRobotTest)
