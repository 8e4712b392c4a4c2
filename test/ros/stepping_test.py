#!/usr/bin/env python3
"""A wheel steps by the launch file and the command of the page."""

import re
import shlex
import unittest

import rospy
import rostest
import yaml
from ros_tools import shown
from system import NODES, START, wait_for

from solfer.srv import GetReference, StepContact

PAGE = NODES.parent / "docs/reference/wheeled_motion.md"
REAR_LEFT = slice(6, 9)
"""Numbers of its vertex among those of all."""


class SteppingTest(unittest.TestCase):
    """What the page promises of the service."""

    def setUp(self):
        rospy.init_node("stepping_test")
        wait_for(lambda: rospy.get_time() > 1.0, START, "plugins, for which time stands still")
        rospy.wait_for_service("/stepping/step", START)
        self.reference = rospy.ServiceProxy("/stepping/get_reference", GetReference)

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
