#!/usr/bin/env python3
"""A running plugin answers get_config, and its reply is a configuration that loads to the same values."""

import subprocess
import tempfile
import time
import unittest
from pathlib import Path

import rospkg
import rospy
import rostest
import yaml
from dynamic_reconfigure import DynamicReconfigureParameterException, find_reconfigure_services
from dynamic_reconfigure.client import Client
from system import START, program, wait_for_plugin

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
        cls.described = staticmethod(rospy.ServiceProxy("/joint_states/get_parameters", GetParameters))
        cls.change = staticmethod(rospy.ServiceProxy("/joint_states/set_parameters", SetParameters))

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
        before = self.described()
        self.assertEqual(before.names, ["speed", "wheel_acceleration"])
        self.assertEqual((before.units[0], before.minimums[0], before.maximums[0]), ("rad/s", "0.001", "100"))
        self.addCleanup(self.change, before.names, before.values)
        reply = self.change(["speed", "wheel_acceleration"], ["0.8", "2.5"])
        self.assertTrue(reply.success, reply.message)
        self.assertEqual(self.described(["speed"]).values, ["0.8"])
        for names, value, part in (
            (["sped"], "0.5", "did you mean: speed"),
            (["speed"], "1000", "0.001 to 100 [rad/s]"),
        ):
            refused = self.change(names, [value])
            self.assertFalse(refused.success)
            self.assertIn(part, refused.message)

    def test_the_command_changes_and_saves_parameters(self):
        """As the commands of live_parameters.md do."""
        before = self.described()
        self.addCleanup(self.change, before.names, before.values)
        listed = self.params("list").stdout.splitlines()
        self.assertEqual([line.split()[0] for line in listed], ["joint_states", "name", "speed", "wheel_acceleration"])
        self.assertEqual(self.params("set", "speed=0.8", "wheel_acceleration=2.5").stdout, "")
        file = self.written("")
        self.params("save", str(file))
        self.assertEqual(
            yaml.safe_load(file.read_text()),
            {"mwoibn": {"modules": {"joint_states": {"speed": 0.8, "wheel_acceleration": 2.5}}}},
        )

    def test_the_command_refuses_in_one_error(self):
        done = self.params("list", plugin="joint_state", code=2)
        self.assertIn("did you mean: joint_states", done.stderr)
        self.assertEqual((done.stderr.count("error: "), done.stdout), (1, ""))

    def test_dynamic_reconfigure_changes_parameters(self):
        """As in live_parameters.md."""
        client = Client("/joint_states/parameters", timeout=START)
        self.addCleanup(client.close)
        before = client.get_configuration(timeout=START)
        self.addCleanup(client.update_configuration, {"speed": before["speed"]})
        self.assertEqual(client.update_configuration({"speed": 0.7})["speed"], 0.7)
        self.assertEqual(rospy.get_param("/joint_states/parameters/speed"), 0.7)
        self.assertEqual(self.described(["speed"]).values, ["0.7"])
        self.assertEqual(client.update_configuration({"speed": 1000.0})["speed"], 100.0)
        self.assertTrue(self.change(["speed"], ["0.6"]).success)
        end = time.monotonic() + START
        while client.get_configuration(timeout=START)["speed"] != 0.6 and time.monotonic() < end:
            time.sleep(0.05)
        self.assertEqual(client.get_configuration(timeout=START)["speed"], 0.6)
        with self.assertRaises(DynamicReconfigureParameterException):
            client.update_configuration({"sped": 1.0})

    def test_dynamic_reconfigure_lists_the_plugin(self):
        self.assertIn("/joint_states/parameters", find_reconfigure_services())

    def test_top_shows_plugins_pipes_and_processes(self):
        command = program("solfer", "top", "--once")
        done = subprocess.run(command, capture_output=True, text=True, timeout=START, check=True)
        for part in ("joint_states", "joint_states process", "joint_states feedback ", "joint_states controller "):
            self.assertIn(f"\n{part}", done.stdout)
        self.assertIn("lower_level", done.stdout)

    def params(self, action: str, *words: str, plugin: str = "joint_states", code: int = 0):
        """Run `solfer params`, and check its exit code."""
        command = program("solfer", "params", action, plugin, *words)
        done = subprocess.run(command, capture_output=True, text=True, timeout=START, check=False)
        self.assertEqual(done.returncode, code, done.stderr)
        return done

    def written(self, text: str) -> Path:
        """Write a file with a text, removed after the test."""
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        path = Path(folder.name, "reply.yaml")
        path.write_text(text)
        return path


if __name__ == "__main__":
    rostest.rosrun("solfer", "config", ConfigTest)
