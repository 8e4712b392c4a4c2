#!/usr/bin/env python3
"""Wheels step by the launch file and the commands of the pages."""

import re
import shlex
import subprocess
import unittest

import numpy as np
import rospy
import rostest
import yaml
from ros_tools import shown
from system import NODES, START, program, wait_for

from solfer.srv import GetReference, StepContact

PAGE = NODES.parent / "docs/reference/wheeled_motion.md"
CROSSING = NODES.parent / "docs/reference/navigation.md"
REAR_LEFT = slice(6, 9)
"""Numbers of its vertex among those of all."""


class SteppingTest(unittest.TestCase):
    """What the page promises of the service."""

    def setUp(self):
        rospy.init_node("stepping_test")
        wait_for(lambda: rospy.get_time() > 1.0, START, "plugins, for which time stands still")
        rospy.wait_for_service("/stepping/step", START)
        self.reference = rospy.ServiceProxy("/stepping/get_reference", GetReference)

    def test_a_crossing_of_the_page(self):
        """All wheels are 5 cm higher then; another world is refused before anything moves."""
        (line,) = re.findall(r"^rosrun solfer navigation (cross .*)$", CROSSING.read_text(), re.MULTILINE)
        command = [*program("navigation"), *shlex.split(line)]
        refused = subprocess.run([*command, "--world", "wall"], capture_output=True, text=True, timeout=60, check=False)
        self.assertEqual(refused.returncode, 2, refused.stderr)
        self.assertRegex(refused.stderr, r"error: '\w+_leg'")
        done = subprocess.run(command, capture_output=True, text=True, timeout=800, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        heights = np.reshape(self.reference(task="vertices").values, (-1, 3))[:, 2]
        self.assertLess(float(np.abs(heights - 0.05).max()), 0.01)

    def test_the_command_of_the_page(self):
        """The vertex is elsewhere then; a step that no leg reaches is refused, and moves nothing."""
        (line,) = re.findall(r"^rosservice call /stepping/step .*$", PAGE.read_text(), re.MULTILINE)
        words = shlex.split(line)
        request = yaml.safe_load(words[3])
        before = self.reference(task="vertices").values
        answer = shown(*words)
        self.assertTrue(answer["success"], answer["message"])
        after = self.reference(task="vertices").values
        x, y, z = (there - here for there, here in zip(after[REAR_LEFT], before[REAR_LEFT], strict=True))
        self.assertAlmostEqual(x, request["ahead"], delta=0.03)  # the base is elsewhere, too: its centre of mass stays
        self.assertLess(max(abs(y), abs(z)), 0.01)
        refused = rospy.ServiceProxy("/stepping/step", StepContact)(contact="rear_left_leg", up=0.6)
        self.assertFalse(refused.success)
        self.assertIn("does not reach the height of its path", refused.message)
        for there, here in zip(self.reference(task="vertices").values, after, strict=True):
            self.assertAlmostEqual(there, here, delta=0.002)


if __name__ == "__main__":
    rostest.rosrun("solfer", "steps", SteppingTest)
