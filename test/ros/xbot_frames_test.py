#!/usr/bin/env python3
"""A simulated robot in shared memory as tf and /clock show it through the bridge, against its own pose."""

import os
import shutil
import subprocess
import sys
import unittest
from pathlib import Path

import numpy as np
import rospy
import rostest
import tf2_ros
from nav_msgs.msg import Odometry
from system import START, numbers, started, wait_for

from solfer.middleware.shared_memory import Namespace

REPOSITORY = Path(__file__).resolve().parents[2]
LAYER = REPOSITORY / "config" / "xbot.yaml"
COMMON = 50
"""Moments at which both the frame and the pose of the base are compared."""

NEAR = 5e-3
"""How far the base, which comes to rest, moves between two messages that leave at one time [m]."""

ALIKE = 1.0 - 1e-5
"""Product of two quaternions that are that near."""


class XbotFramesTest(unittest.TestCase):
    """The simulator and the bridge; the layer itself is not needed."""

    @classmethod
    def setUpClass(cls):
        rospy.set_param("/use_sim_time", True)
        cls.addClassCleanup(rospy.set_param, "/use_sim_time", False)
        cls.enterClassContext(started("rosrun", "robot_state_publisher", "robot_state_publisher"))
        rospy.init_node("xbot_frames_test")
        cls.bases, cls.buffer = {}, tf2_ros.Buffer(rospy.Duration(120.0))
        cls.listener = tf2_ros.TransformListener(cls.buffer)
        rospy.Subscriber("/floating_base", Odometry, cls.receive, queue_size=100, tcp_nodelay=True)
        name = f"rostest-{os.getpid()}"
        cls.namespace, cls.processes = Namespace(name), []
        for node, *arguments in (("xbot_simulator", "--namespace", name), ("xbot_bridge", LAYER, "--namespace", name)):
            cls.processes.append(subprocess.Popen([sys.executable, REPOSITORY / "nodes" / node, *arguments]))
        wait_for(lambda: len(cls.bases) > COMMON, START, "a base that is published")

    @classmethod
    def tearDownClass(cls):
        for process in cls.processes:
            process.kill()
            process.wait()
        shutil.rmtree(cls.namespace.folder)

    @classmethod
    def receive(cls, message):
        """Take down where the base was."""
        cls.bases[message.header.stamp] = message.pose.pose

    def frame(self, stamp):
        """Return the base's frame at that time: position and orientation; None: it was not published then."""
        try:
            found = self.buffer.lookup_transform("world", "pelvis", stamp)
        except tf2_ros.TransformException:
            return None
        return np.append(numbers(found.transform.translation), numbers(found.transform.rotation))

    def compared(self):
        """List the published pose and the frame, at each moment at which there are both."""
        pairs = [
            (np.append(numbers(pose.position), numbers(pose.orientation)), self.frame(stamp))
            for stamp, pose in list(self.bases.items())
        ]
        return [(pose, frame) for pose, frame in pairs if frame is not None]

    def test_the_frame_of_the_base_follows_it(self):
        wait_for(lambda: len(self.compared()) > COMMON, START, "frames of the base")
        for pose, frame in self.compared():
            self.assertGreater(pose[2], 0.5)
            np.testing.assert_allclose(frame[:3], pose[:3], atol=NEAR)
            self.assertGreater(abs(frame[3:] @ pose[3:]), ALIKE)

    def test_links_are_found_in_the_world(self):
        wait_for(lambda: self.buffer.can_transform("world", "wheel_1", rospy.Time()), START, "a wheel in the world")
        wheel = self.buffer.lookup_transform("world", "wheel_1", rospy.Time()).transform.translation
        self.assertAlmostEqual(wheel.z, 0.078, delta=0.01)  # its radius above the ground

    def test_the_time_is_the_robot_s(self):
        before = rospy.get_time()
        wait_for(lambda: rospy.get_time() > before + 1.0, START, "simulated time that passes")
        newest = max(list(self.bases)).to_sec()
        self.assertLess(max(newest, rospy.get_time()), 1e6)  # since the robot's beginning, and not since 1970


if __name__ == "__main__":
    rostest.rosrun("solfer", "xbot_frames", XbotFramesTest)
