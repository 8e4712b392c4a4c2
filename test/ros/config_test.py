#!/usr/bin/env python3
"""A running plugin answers get_config, and its reply is a configuration that loads to the same values."""

import tempfile
import unittest
from pathlib import Path

import rospkg
import rospy
import rostest
from system import START, wait_for_plugin

from solfer.config import load
from solfer.srv import GetConfig, GetParameters, SetParameters


class ConfigTest(unittest.TestCase):
    """The service `~get_config` of the plugin."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("tests")
        wait_for_plugin()
        rospy.wait_for_service("/joint_states/get_config", START)
        cls.ask = staticmethod(rospy.ServiceProxy("/joint_states/get_config", GetConfig))

    def test_the_plugin_returns_each_values_place(self):
        reply = self.ask(origins=True)
        self.assertTrue(reply.success, reply.message)
        (rate,) = [line for line in reply.yaml.splitlines() if line.strip().startswith("rate:")]
        self.assertIn("support/NRT.yaml:4:11", rate)

    def test_what_it_returns_loads_again_equally(self):
        published = load(self.written(self.ask(origins=False).yaml), "joint_states")
        shipped = load(Path(rospkg.RosPack().get_path("solfer"), "config/centauro.yaml"), "joint_states")
        self.assertEqual(
            (published.feedbacks, published.controllers, published.rate),
            (shipped.feedbacks, shipped.controllers, shipped.rate),
        )

    def test_parameters_change_while_it_runs(self):
        """As the commands of live_parameters.md do."""
        described = rospy.ServiceProxy("/joint_states/get_parameters", GetParameters)
        change = rospy.ServiceProxy("/joint_states/set_parameters", SetParameters)
        before = described()
        self.assertEqual(before.names, ["speed", "wheel_acceleration"])
        self.assertEqual((before.units[0], before.minimums[0], before.maximums[0]), ("rad/s", "0.001", "100"))
        self.addCleanup(change, before.names, before.values)
        reply = change(["speed", "wheel_acceleration"], ["0.8", "2.5"])
        self.assertTrue(reply.success, reply.message)
        self.assertEqual(described(["speed"]).values, ["0.8"])
        refused = change(["sped"], ["0.5"])
        self.assertFalse(refused.success)
        self.assertIn("did you mean: speed", refused.message)

    def written(self, text: str) -> Path:
        """Write a file with a text, removed after the test."""
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        path = Path(folder.name, "reply.yaml")
        path.write_text(text)
        return path


if __name__ == "__main__":
    rostest.rosrun("solfer", "config", ConfigTest)
