#!/usr/bin/env python3
"""Three plugins of one launch file move a robot together, by the commands of their page."""

import re
import shlex
import unittest
from pathlib import Path

import rospy
import rostest
from system import START, Robot, wait_for
from tools import shown

PAGE = Path(__file__).resolve().parents[2] / "docs/shared_control.md"


class SharedControlTest(unittest.TestCase):
    """What the page promises."""

    def test_the_commands_of_the_page_move_both_parts(self):
        rospy.init_node("shared_control_test")
        robot, lines = Robot(), re.findall(r"^rosservice call .*$", PAGE.read_text(), re.MULTILINE)
        self.assertEqual([line.split()[2] for line in lines], ["/upper_body/trajectory", "/lower_body/trajectory"])
        before = robot.positions()["knee_pitch_1"]
        for line in lines:
            rospy.wait_for_service(line.split()[2], START)
            wait_for(lambda line=line: shown(*shlex.split(line))["success"], START, line)  # until it has its feedback
        robot.arrive({"torso_yaw": 0.3}, START)
        robot.settle()
        self.assertGreater(abs(robot.positions()["knee_pitch_1"] - before), 0.05)


if __name__ == "__main__":
    rostest.rosrun("solfer", "shared_control", SharedControlTest)
