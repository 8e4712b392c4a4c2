#!/usr/bin/env python3
"""Fig. 5 by its launch file: navigation drives the robot, a message moves a hand, one plugin commands all joints."""

import contextlib
import math
import re
import shlex
import sys
import threading
import unittest

import rospy
import rostest
from geometry_msgs.msg import PointStamped
from system import NODES, START, Robot, program, soak, started, wait_for

from solfer.middleware.ros import RosMiddleware, RosNode
from solfer.transport.fixed_rate import FixedRateLoop

PAGE = NODES.parent / "docs/tutorials/figures.md"


class Figure5Test(unittest.TestCase):
    """What the page promises; time waits for the test, too, which does nothing in its cycles."""

    @classmethod
    def setUpClass(cls):
        middleware = cls.enterClassContext(contextlib.closing(RosMiddleware(RosNode("driver", sys.argv))))
        ended = threading.Event()
        loop = FixedRateLoop(middleware, 100.0)
        thread = threading.Thread(target=loop.run, args=(lambda *_: None, lambda: not ended.is_set()))
        thread.start()
        cls.addClassCleanup(thread.join)
        cls.addClassCleanup(ended.set)
        cls.robot = Robot()
        wait_for(lambda: bool(cls.robot.odometry), START, "plugins, for which time stands still")

    @soak
    def test_it_drives_by_the_command_of_the_page(self):
        (line,) = re.findall(r"^rosrun solfer (navigation .*)$", PAGE.read_text(), re.MULTILINE)
        name, *arguments = shlex.split(line)
        with started(*program(name, *arguments)) as process:
            output, _ = process.communicate(timeout=2.0 * START)
        self.assertEqual(process.returncode, 0, output)
        self.robot.passes(1.5)
        place = self.robot.odometry[-1].pose.pose.position
        self.assertLess(math.dist((place.x, place.y), (0.2, 0.0)), 0.015)

    def test_a_hand_moves(self):
        hand = rospy.Publisher("/hands/left/reference", PointStamped, queue_size=1)
        wait_for(lambda: hand.get_num_connections() > 0, START, "who moves the hand")
        begin = self.robot.positions()
        message = PointStamped()
        message.header.frame_id = "pelvis"
        message.point.x, message.point.y, message.point.z = 0.49, 0.26, 0.53

        def moved():
            hand.publish(message)
            now = self.robot.positions()
            return max(abs(now[name] - begin[name]) for name in begin if name.startswith("j_arm1")) > 0.2

        wait_for(moved, START, "an arm that moves")


if __name__ == "__main__":
    rostest.rosrun("solfer", "figure_5", Figure5Test)
