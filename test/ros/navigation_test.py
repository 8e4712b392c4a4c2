#!/usr/bin/env python3
"""`rosrun solfer navigation`: scenarios and way-points with a stand-in of a robot, a pause, Ctrl-C."""

import math
import signal
import threading
import unittest

import rospy
import rostest
import tf2_ros
from geometry_msgs.msg import TransformStamped, Twist
from nav_msgs.msg import Odometry
from std_srvs.srv import SetBool
from system import NODES, START, end, program, soak, started, wait_for

from solfer.msg import NavigationProgress, WheelsState, WheelsSupport

SCENARIOS = NODES.parent / "config" / "scenarios"
NAVIGATION = program("navigation")
PERIOD, RATE = 0.01, 50.0  # [s], [Hz]


class StandIn:
    """A base that drives as `cmd_vel` says, publishes odometry, and adds up the velocities of scenarios."""

    def __init__(self):
        self.pose, self.way, self.wheels = [0.2, -0.1, 0.5], [0.0, 0.0, 0.0], [0.0] * 12
        self.camber, self.velocity, self.newest, self.progress = (), (0.0, 0.0, 0.0), WheelsState(), None
        self._odometry = rospy.Publisher("odometry/odom", Odometry, queue_size=1, tcp_nodelay=True)
        rospy.Subscriber("wheeled_motion/cmd_vel", Twist, self._drive, queue_size=1, tcp_nodelay=True)
        rospy.Subscriber("wheeled_motion/wheels_state", WheelsState, self._add, queue_size=100, tcp_nodelay=True)
        rospy.Subscriber("wheeled_motion/wheels_support", WheelsSupport, self._step, queue_size=100, tcp_nodelay=True)
        rospy.Subscriber("navigation/progress", NavigationProgress, self._hear, queue_size=10)
        threading.Thread(target=self._work, daemon=True).start()

    def _drive(self, message):
        self.velocity = message.linear.x, message.linear.y, message.angular.z

    def _add(self, message):
        self.newest, self.camber = message, message.cs
        self.way = [a + b / RATE for a, b in zip(self.way, (message.x, message.y, message.rz), strict=True)]

    def _step(self, message):
        self.wheels = [a + b / RATE for a, b in zip(self.wheels, message.velocity, strict=True)]

    def _hear(self, message):
        self.progress = message

    def _work(self):
        rate, last = rospy.Rate(1.0 / PERIOD), rospy.get_time()
        message = Odometry()
        while not rospy.is_shutdown():
            now = rospy.get_time()
            step, last = min(now - last, 0.1), now
            x, y, turn = self.velocity
            cos, sin = math.cos(self.pose[2]), math.sin(self.pose[2])
            self.pose[0] += (cos * x - sin * y) * step
            self.pose[1] += (sin * x + cos * y) * step
            self.pose[2] += turn * step
            message.header.stamp = rospy.Time.now()
            message.header.frame_id, message.child_frame_id = "odom", "base_link"
            message.pose.pose.position.x, message.pose.pose.position.y = self.pose[:2]
            message.pose.pose.orientation.z = math.sin(self.pose[2] / 2.0)
            message.pose.pose.orientation.w = math.cos(self.pose[2] / 2.0)
            self._odometry.publish(message)
            rate.sleep()


class NavigationTest(unittest.TestCase):
    """The node as users start it."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("tests")

    def setUp(self):
        self.base = StandIn()

    def test_a_scenario_is_played_to_its_end(self):
        with started(*NAVIGATION, "play", str(SCENARIOS / "shape_side.yaml"), "--rate", f"{RATE:g}") as process:
            output, _ = process.communicate(timeout=START)
        self.assertEqual(process.returncode, 0, output)
        along, across, turn = self.base.way
        self.assertAlmostEqual(along, 0.195 * math.cos(0.5), delta=0.01)
        self.assertAlmostEqual(across, 0.195 * math.sin(0.5), delta=0.01)
        self.assertEqual((turn, any(self.base.wheels), tuple(self.base.camber)), (0.0, False, (0.0,) * 4))
        self.assertEqual((self.base.newest.x, self.base.newest.y), (0.0, 0.0))
        wait_for(lambda: self.base.progress.done, START, "the end, published")
        self.assertEqual((self.base.progress.count, self.base.progress.left), (3, 0.0))

    @soak
    def test_it_goes_to_way_points_stops_and_goes_on(self):
        """A pause brings zero velocity and keeps the pose, and afterwards the last way-point is reached within 5 cm."""
        begin = list(self.base.pose)
        with started(*NAVIGATION, "go", "0.4,0.1", "-0.1,-0.1,0.0", "--speed", "0.2") as process:
            wait_for(lambda: math.dist(self.base.pose[:2], begin[:2]) > 0.05, START, "a base that drives")
            pause = rospy.ServiceProxy("navigation/pause", SetBool)
            self.assertTrue(pause(True).success)
            wait_for(lambda: self.base.velocity == (0.0, 0.0, 0.0), START, "a base at rest")
            wait_for(lambda: self.base.progress.paused, START, "the pause, published")
            here = self.base.pose[:2]
            rospy.sleep(0.5)
            self.assertEqual(self.base.pose[:2], here)
            self.assertTrue(pause(False).success)
            output, _ = process.communicate(timeout=START)
        self.assertEqual(process.returncode, 0, output)
        self.assertLess(math.dist(self.base.pose[:2], (-0.1, -0.1)), 0.05)
        self.assertAlmostEqual(self.base.pose[2], 0.0, delta=0.05)
        self.assertEqual(self.base.velocity, (0.0, 0.0, 0.0))

    def test_way_points_in_a_map_are_where_tf_has_them(self):
        """The map is turned by a quarter and shifted; until its transform is published the base waits."""
        with started(*NAVIGATION, "go", "0.9,0.8", "--frame", "map", "--speed", "0.5") as process:
            missing = "a transform from 'map' to 'odom' on /tf"
            wait_for(lambda: self.base.progress and self.base.progress.waits == missing, START, "what is missing")
            self.assertEqual(self.base.velocity, (0.0, 0.0, 0.0))
            transform = TransformStamped()
            transform.header.frame_id, transform.child_frame_id = "map", "odom"
            transform.transform.translation.x, transform.transform.translation.y = 0.9, 0.5
            transform.transform.rotation.z = transform.transform.rotation.w = math.sqrt(0.5)
            broadcaster = tf2_ros.StaticTransformBroadcaster()
            broadcaster.sendTransform(transform)
            output, _ = process.communicate(timeout=START)
        self.assertEqual(process.returncode, 0, output)
        self.assertLess(math.dist(self.base.pose[:2], (0.3, 0.0)), 0.03)  # in the frame of the odometry

    def test_ctrl_c_leaves_it_at_rest(self):
        with started(*NAVIGATION, "play", str(SCENARIOS / "support.yaml")) as process:
            wait_for(lambda: self.base.newest.x != 0.0, START, "a base that drives")
            code, output = end(process, signal.SIGINT)
        self.assertEqual(code, 1, output)
        wait_for(lambda: self.base.newest.x == self.base.newest.y == 0.0, START, "a base at rest")


if __name__ == "__main__":
    rostest.rosrun("solfer", "navigation_test", NavigationTest)
