#!/usr/bin/env python3
"""Three plugins of one launch file move a robot together, by the commands of their page."""

import os
import re
import shlex
import unittest
from pathlib import Path
from xml.etree import ElementTree

import rospy
import rostest
from system import START, Robot, wait_for
from tools import shown

from solfer.recording.reader import read

PAGE = Path(__file__).resolve().parents[2] / "docs/shared_control.md"


class SharedControlTest(unittest.TestCase):
    """What the page promises."""

    def test_the_commands_of_the_page_move_both_parts(self):
        rospy.init_node("shared_control_test")
        robot, lines = Robot(), re.findall(r"^rosservice call .*$", PAGE.read_text(), re.MULTILINE)
        self.assertEqual([line.split()[2] for line in lines], ["/upper_body/trajectory", "/lower_body/trajectory"])
        before = robot.positions()
        for line in lines:
            rospy.wait_for_service(line.split()[2], START)
            wait_for(lambda line=line: shown(*shlex.split(line))["success"], START, line)  # until it has its feedback
        joints = ElementTree.fromstring(rospy.get_param("/robot_semantic_description")).findall(
            "group_state[@name='mammal_wide_high']/joint"
        )
        legs = {each.get("name"): float(each.get("value")) for each in joints if "pitch" in each.get("name")}
        moved = {name: goal for name, goal in legs.items() if name in before and abs(goal - before[name]) > 0.1}
        self.assertGreater(len(moved), 3)
        robot.arrive({"torso_yaw": 0.3, **moved}, START)
        self.check_recording(Path(os.environ["ROS_HOME"], "shared_control.mcap"))

    def check_recording(self, file):
        """Look into what `record:=FILE` has made of the three plugins so far; rows are written a moment later."""
        plugins, commanded = (
            ("upper_body", "lower_body", "whole_body"),
            "whole_body/command/position_controller/position",
        )

        def is_complete():
            recording = read(file)
            if not set(plugins) <= set(recording.plugins):
                return False
            requests = [event for event in recording.events if (event.plugin, event.kind) == ("upper_body", "request")]
            yaw = recording[commanded].column("torso_yaw")
            return requests and len(yaw) and abs(yaw[-1] - 0.3) < 0.005

        wait_for(is_complete, START, f"{commanded} of torso_yaw at 0.3, and the request, in {file}")


if __name__ == "__main__":
    rostest.rosrun("solfer", "shared_control", SharedControlTest)
