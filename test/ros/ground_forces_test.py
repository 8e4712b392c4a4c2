#!/usr/bin/env python3
"""Ground forces by their launch file: the topic of each contact, as the page's commands show it, beside the truth."""

import re
import shlex
import subprocess
import unittest

import numpy as np
import rospy
import rostest
import yaml
from geometry_msgs.msg import WrenchStamped
from system import NODES, START, numbers, wait_for

PAGE = NODES.parent / "docs/reference/ground_forces.md"
LEGS = ("front_left_leg", "front_right_leg", "rear_left_leg", "rear_right_leg")
AGREES = 15.0
"""How far the truth and an estimate of a moment later may be from each other [N]."""


class GroundForcesTest(unittest.TestCase):
    """What the page promises of topics."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("forces_test")
        cls.estimated, cls.true = {}, {}
        for leg in LEGS:
            for kept, topic in ((cls.estimated, f"/ground_forces/{leg}"), (cls.true, f"/contacts/{leg}/link")):
                rospy.Subscriber(topic, WrenchStamped, cls.keep, (kept, leg), queue_size=10)
        wait_for(lambda: {*cls.estimated} == {*cls.true} == {*LEGS}, START, "the wrenches of all legs")
        begin = rospy.get_time()
        wait_for(lambda: rospy.get_time() > begin + 4.0, START, "4 s of simulated time")

    @staticmethod
    def keep(message, place):
        """Keep the newest message."""
        kept, leg = place
        kept[leg] = message

    def test_each_leg_has_the_wrench_of_a_sensor(self):
        def errors():
            return [
                abs(numbers(self.estimated[leg].wrench.force) - numbers(self.true[leg].wrench.force)).max()
                for leg in LEGS
            ]

        wait_for(lambda: max(errors()) < AGREES, START, lambda: f"forces that agree: {errors()}")
        for leg in LEGS:
            estimated, true = self.estimated[leg], self.true[leg]
            self.assertEqual(estimated.header.frame_id, true.header.frame_id)
            self.assertGreater(estimated.header.stamp.to_sec(), 0.0)
            self.assertGreater(np.linalg.norm(numbers(estimated.wrench.force)), 100.0)
            torque = numbers(estimated.wrench.torque) - numbers(true.wrench.torque)
            self.assertLess(abs(torque).max(), 0.1 * AGREES)

    def test_the_command_of_the_page_shows_a_force(self):
        (line,) = re.findall(r"^rostopic echo .*$", PAGE.read_text(), re.MULTILINE)
        output = subprocess.run(shlex.split(line), capture_output=True, text=True, timeout=START, check=True).stdout
        shown = yaml.safe_load(output.partition("\n---")[0])
        self.assertEqual(shown["header"]["frame_id"], "wheel_1")
        self.assertGreater(np.linalg.norm([shown["wrench"]["force"][axis] for axis in "xyz"]), 100.0)


if __name__ == "__main__":
    rostest.rosrun("solfer", "forces", GroundForcesTest)
