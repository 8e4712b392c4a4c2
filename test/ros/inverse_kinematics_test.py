#!/usr/bin/env python3
"""Inverse kinematics by the commands of pages: a hand goes where it is to be, and hands follow references of a file."""

import math
import re
import shlex
import unittest
from pathlib import Path

import rospy
import rostest
from ros_tools import shown
from system import START, Robot, program, started, wait_for

from solfer.srv import GetReference

PAGE = Path(__file__).resolve().parents[2] / "docs/reference/inverse_kinematics.md"
NAVIGATION = PAGE.with_name("navigation.md")


class InverseKinematicsTest(unittest.TestCase):
    """What the page promises."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("tests")

    def test_the_command_of_the_page_moves_an_arm(self):
        robot = Robot()
        (line,) = re.findall(r"^rosservice call .*$", PAGE.read_text(), re.MULTILINE)
        rospy.wait_for_service(line.split()[2], START)
        before = robot.positions()
        wait_for(lambda: shown(*shlex.split(line))["success"], START, line)
        arm = [joint for joint in before if joint.startswith("j_arm1_")]

        def farthest() -> float:
            now = robot.positions()
            return max(abs(now[joint] - before[joint]) for joint in arm)

        wait_for(lambda: farthest() > 0.2, START, lambda: f"a moved arm: {farthest():.3f} rad")

    def asked(self):
        """Return a function that says where a reference is; a plugin that is late on a busy machine is waited for."""
        rospy.wait_for_service("manipulation/get_reference", START)
        ask = rospy.ServiceProxy("manipulation/get_reference", GetReference)

        def values(task):
            replies = []
            wait_for(lambda: replies.append(ask(task)) or replies[-1].success, START, "a plugin that works")
            return replies[-1].values

        values("left")
        return values

    def test_the_references_of_a_file_are_followed_to_their_ends(self):
        """The command of the page of the navigation: both hands move, and their references end where they began."""
        (line,) = re.findall(r"^rosrun solfer navigation reference .*$", NAVIGATION.read_text(), re.MULTILINE)
        file, *options = shlex.split(line)[4:]
        ask = self.asked()
        begin = {task: ask(task) for task in ("left", "right")}
        farthest = dict.fromkeys(begin, 0.0)
        with started(*program("navigation"), "reference", str(PAGE.parents[2] / file), *options) as process:

            def has_ended():
                for task, first in begin.items():
                    farthest[task] = max(farthest[task], math.dist(first, ask(task)))
                return process.poll() is not None

            wait_for(has_ended, START, "the end of the references")
            output, _ = process.communicate(timeout=START)
        self.assertEqual(process.returncode, 0, output)
        self.assertGreater(farthest["left"], 0.07)  # the diameter is 0.08 m
        self.assertGreater(farthest["right"], 0.07)
        for task, first in begin.items():
            self.assertLess(math.dist(first, ask(task)), 1e-4)

    def test_a_killed_navigation_leaves_the_last_reference(self):
        ask = self.asked()
        begin = ask("left")
        file = str(PAGE.parents[2] / "config/references/hands.yaml")
        with started(*program("navigation"), "reference", file, "--target", "manipulation") as process:
            wait_for(lambda: math.dist(begin, ask("left")) > 0.02, START, "a reference that moves")
            process.kill()
            process.wait()
        rospy.sleep(0.5)
        rest = ask("left")
        rospy.sleep(1.0)
        self.assertEqual(ask("left"), rest)
        self.assertGreater(math.dist(begin, rest), 0.01)


if __name__ == "__main__":
    rostest.rosrun("solfer", "inverse_kinematics", InverseKinematicsTest)
