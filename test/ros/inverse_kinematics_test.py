#!/usr/bin/env python3
"""Inverse kinematics by the command of its page: a hand goes where it is wanted."""

import re
import shlex
import unittest
from pathlib import Path

import rospy
import rostest
from system import START, Robot, wait_for
from tools import shown

PAGE = Path(__file__).resolve().parents[2] / "docs/inverse_kinematics.md"


class InverseKinematicsTest(unittest.TestCase):
    """What the page promises."""

    def test_the_command_of_the_page_moves_an_arm(self):
        rospy.init_node("inverse_kinematics_test")
        robot = Robot()
        (line,) = re.findall(r"^rosservice call .*$", PAGE.read_text(), re.MULTILINE)
        rospy.wait_for_service(line.split()[2], START)
        before = robot.positions()
        wait_for(lambda: shown(*shlex.split(line))["success"], START, line)
        arm = [joint for joint in before if joint.startswith("j_arm1_")]

        def has_moved():
            now = robot.positions()
            return max(abs(now[joint] - before[joint]) for joint in arm) > 0.2

        wait_for(has_moved, START, "a moved arm")


if __name__ == "__main__":
    rostest.rosrun("solfer", "inverse_kinematics", InverseKinematicsTest)
