#!/usr/bin/env python3
"""Wheeled motion by its launch file: `cmd_vel`, way-points of the navigation, refused requests."""

import math
import re
import shlex
import unittest

import rospy
import rostest
from rosgraph_msgs.msg import Log
from system import NODES, START, Robot, program, soak, started, wait_for

from solfer.msg import WheelsSupport
from solfer.srv import LiftContacts, StepContact

PAGE = NODES.parent / "docs/reference/wheeled_motion.md"
SPEED, ACCELERATION, PATIENCE = 0.2, 0.3, 0.55  # [m/s], [m/s2], [s], as the page has them
REST = 0.002
"""Speed below which the base stands [m/s]."""


class WheeledMotionTest(unittest.TestCase):
    """What the page promises of topics."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("driving_test")
        cls.robot = Robot()
        wait_for(lambda: rospy.get_time() > 1.0, START, "plugins, for which time stands still")

    def setUp(self):
        self.stand()

    def base(self):
        """Return where the base is in truth, x and y [m]."""
        position = self.robot.odometry[-1].pose.pose.position
        return position.x, position.y

    def speed(self):
        """Return how fast it is in truth [m/s]."""
        velocity = self.robot.odometry[-1].twist.twist.linear
        return math.hypot(velocity.x, velocity.y)

    def stand(self):
        """Wait until the base stands."""

        def stands():
            before = self.base()
            self.robot.passes(0.2)
            return self.speed() < REST and math.dist(self.base(), before) < 0.2 * REST

        wait_for(lambda: bool(self.robot.odometry), START, "the state of the base")
        wait_for(stands, START, "a base at rest")

    def test_the_command_of_the_page_drives_until_it_ends(self):
        (line,) = re.findall(r"^rostopic pub .*$", PAGE.read_text(), re.MULTILINE)
        x, y = self.base()
        with started(*shlex.split(line)) as process:
            wait_for(lambda: self.base()[0] > x + 0.1, START, "a base that drives")
            process.kill()  # it says nothing when it ends
        last, _ = self.base()
        self.stand()
        way = SPEED * PATIENCE + SPEED**2 / (2.0 * ACCELERATION)
        self.assertLess(self.base()[0] - last, way + 0.03)
        self.assertLess(abs(self.base()[1] - y), 0.01)

    def test_the_navigation_arrives(self):
        x, y = self.base()  # the estimate begins at the origin, too
        with started(*program("navigation", "go", f"{x + 0.15:.4f},{y:.4f}")) as process:
            output, _ = process.communicate(timeout=2.0 * START)
        self.assertEqual(process.returncode, 0, output)
        self.assertIn("at its end after", output)
        self.stand()
        self.assertLess(math.dist(self.base(), (x + 0.15, y)), 0.015)

    def test_the_legs_alone_neither_lift_a_wheel_nor_step(self):
        lift = rospy.ServiceProxy("/wheeled_motion/lift", LiftContacts)
        rospy.wait_for_service("/wheeled_motion/lift", START)
        for contact, reason in (("front_left_leg", "where its weight is"), ("left_arm", "tracked contact")):
            answer = lift(contacts=[contact], lifted=True)
            self.assertFalse(answer.success)
            self.assertIn(reason, answer.message)
        self.assertTrue(lift(contacts=[], lifted=False).success)
        refused = rospy.ServiceProxy("/wheeled_motion/step", StepContact)(contact="rear_left_leg", ahead=0.1)
        self.assertFalse(refused.success)
        self.assertIn("where its weight is", refused.message)

    @soak
    def test_vertices_of_a_wrong_number_are_refused(self):
        texts = []
        rospy.Subscriber("/rosout", Log, lambda message: texts.append(message.msg), queue_size=100)
        before = self.base()
        support = rospy.Publisher("/wheeled_motion/wheels_support", WheelsSupport, queue_size=1)
        expected = "/wheeled_motion/wheels_support: a message of /driving"

        def refusal():
            support.publish(WheelsSupport(velocity=[0.1, 0.2]))
            return next((each for each in list(texts) if expected in each), "")

        wait_for(lambda: bool(refusal()), START, "a refusal")
        self.assertIn("velocity: 2 numbers; expected: 12", refusal())
        self.robot.passes(0.5)
        self.assertLess(math.dist(self.base(), before), 1e-3)


if __name__ == "__main__":
    rostest.rosrun("solfer", "driving", WheeledMotionTest)
