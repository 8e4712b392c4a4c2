#!/usr/bin/env python3
"""Frames of robot_state_publisher and tf's tools: where the Robot's kinematics see the links at the same stamp."""

import time
import unittest

import numpy as np
import rospy
import rostest
import tf2_ros
import yaml
from nav_msgs.msg import Odometry
from ros_tools import found
from sensor_msgs.msg import JointState
from system import START, numbers, soak, started, wait_for
from tf2_msgs.msg import TFMessage

from solfer import Robot
from solfer.msg import JointCommand
from solfer.numerics.rotations import quaternion_from_rotation

ENDS = ("wheel_1", "wheel_2", "wheel_3", "wheel_4", "arm1_8", "arm2_8")
"""Wheels and hands."""

TOLERANCE = 1e-6
"""Of frames on the base [m], and of the numbers of a quaternion."""

SHOWN = 1e-5
"""The same of what tf_echo shows of a robot that stands still."""

ECHO = r"At time ([\d.]+)\s+- Translation: \[(.*)\]\s+- Rotation: in Quaternion \[(.*)\]"


def nearest(messages: list, stamp: float) -> object:
    """Find the message with the nearest stamp [s]."""
    return min(list(messages), key=lambda message: abs(message.header.stamp.to_sec() - stamp))


class FramesTest(unittest.TestCase):
    """Arms that move, wheels that turn."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("tests")
        wait_for(lambda: rospy.has_param("/robot_description"), START, "a simulator that describes its robot")
        cls.enterClassContext(started("rosrun", "robot_state_publisher", "robot_state_publisher"))
        cls.model = Robot.load(rospy.get_param("/robot_description"))
        cls.joints, cls.bases, cls.transforms = [], [], []
        cls.buffer = tf2_ros.Buffer(rospy.Duration(60.0))
        cls.addClassCleanup(tf2_ros.TransformListener(cls.buffer).unregister)
        rospy.Subscriber("/joint_states", JointState, cls.joints.append, queue_size=100, tcp_nodelay=True)
        rospy.Subscriber("/floating_base", Odometry, cls.bases.append, queue_size=100, tcp_nodelay=True)
        rospy.Subscriber("/tf", TFMessage, lambda message: cls.transforms.extend(message.transforms), queue_size=100)
        wait_for(lambda: {"pelvis", "arm1_7"} <= cls.stamps().keys(), START, "frames of base and links")
        wait_for(
            lambda: all(cls.buffer.can_transform("world", link, rospy.Time()) for link in ENDS),
            START,
            "frames that do not move",
        )

    @classmethod
    def stamps(cls) -> dict[str, set[rospy.Time]]:
        """List the stamps of frames, by the frame's name."""
        published: dict[str, set[rospy.Time]] = {}
        for transform in list(cls.transforms):
            published.setdefault(transform.child_frame_id, set()).add(transform.header.stamp)
        return published

    def place(self, joints: JointState, base: Odometry) -> None:
        """Bring the model where a robot was measured."""
        position, pose = self.model.state.position, base.pose.pose
        self.model.kinematics.base.from_pose(numbers(pose.position), numbers(pose.orientation), position[:6])
        for name, value in zip(joints.name, joints.position, strict=True):
            position[self.model.dof(name)] = value
        self.model.update()

    def check(self, parent: str, link: str, translation: np.ndarray, quaternion: np.ndarray, tolerance: float) -> None:
        """Check that a transform from a link to its parent equals the model's."""
        kinematics = self.model.kinematics
        rotation = kinematics.rotation(parent).T
        expected = rotation @ (kinematics.position(link) - kinematics.position(parent))
        np.testing.assert_allclose(translation, expected, atol=tolerance, err_msg=link)
        expected = quaternion_from_rotation(rotation @ kinematics.rotation(link))
        np.testing.assert_allclose(quaternion * np.sign(quaternion @ expected), expected, atol=tolerance, err_msg=link)

    def move(self, duration: float) -> tuple[rospy.Time, rospy.Time]:
        """Move arms and wheels for a while [s]; when that began and ended."""
        arms = rospy.Publisher("/position_controller/command", JointCommand, queue_size=1, tcp_nodelay=True)
        wheels = rospy.Publisher("/velocity_controller/command", JointCommand, queue_size=1, tcp_nodelay=True)
        wait_for(lambda: arms.get_num_connections() and wheels.get_num_connections(), START, "a robot that subscribes")
        begin = rospy.get_rostime()
        end = begin + rospy.Duration(duration)
        while rospy.get_rostime() < end:
            arms.publish(name=["j_arm1_1", "j_arm2_1", "torso_yaw"], position=[0.8, 0.2, 0.3])
            wheels.publish(name=["j_wheel_1", "j_wheel_2", "j_wheel_3", "j_wheel_4"], velocity=[1.0, -1.0, 1.0, -1.0])
            time.sleep(0.01)
        return begin, end

    def test_frames_of_a_robot_that_moves(self):
        """Pinocchio's poses of the outermost links are the oracle, from pelvis and world, at each common stamp."""
        begin, end = self.move(2.0)
        wait_for(lambda: max(self.stamps()["pelvis"]) > end, START, "the base after the motion")
        joints = {message.header.stamp: message for message in list(self.joints)}
        bases = {message.header.stamp: message for message in list(self.bases)}
        stamps = self.stamps()
        common = stamps["arm1_7"] & stamps["pelvis"] & joints.keys() & bases.keys()
        common = [stamp for stamp in common if begin < stamp < end]
        self.assertGreater(len(common), 10)
        places = {link: [] for link in ENDS}
        for stamp in common:
            self.place(joints[stamp], bases[stamp])
            for link in ENDS:
                for parent in ("pelvis", "world"):
                    pose = self.buffer.lookup_transform(parent, link, stamp).transform
                    translation, quaternion = numbers(pose.translation), numbers(pose.rotation)
                    self.check(parent, link, translation, quaternion, TOLERANCE)
                places[link].append(np.append(translation, quaternion))
        for link, track in places.items():
            self.assertGreater(np.ptp(track, axis=0).max(), 0.01, link)

    @soak
    def test_tf_echo_shows_them(self):
        wait_for(lambda: max(map(abs, self.joints[-1].velocity)) < 0.001, START, "a robot that stands still")
        match = found(ECHO, "rosrun", "tf", "tf_echo", "world", "arm1_8", "_precision:=9")
        stamp, translation, quaternion = (np.array(text.split(","), dtype=float) for text in match.groups())
        self.place(nearest(self.joints, stamp[0]), nearest(self.bases, stamp[0]))
        self.check("world", "arm1_8", translation, quaternion, SHOWN)

    def test_every_link_has_its_parent(self):
        frames = yaml.safe_load(self.buffer.all_frames_as_yaml())  # what tf2_tools' view_frames.py draws
        parents = {joint.child: joint.parent for joint in self.model.description.joints.values()}
        self.assertEqual({name: frame["parent"] for name, frame in frames.items()}, parents)

    @soak
    def test_tf_monitor_follows_the_chain(self):
        chain = found(r"Chain is: (world -> pelvis -> .*)", "rosrun", "tf", "tf_monitor", "world", "wheel_1")
        self.assertEqual(chain[1].split(" -> ")[-1].strip(), "wheel_1")


if __name__ == "__main__":
    rostest.rosrun("solfer", "frames", FramesTest)
