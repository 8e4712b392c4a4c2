#!/usr/bin/env python3
"""What ROS's own tools find of the package in the workspace that was built and sourced."""

import unittest

import rostest
from ros_tools import output
from system import soak


class PackageTest(unittest.TestCase):
    """Package, messages, services and commands."""

    def test_both_packages_are_found(self):
        for package in ("solfer", "plugins"):
            self.assertTrue(output("rospack", "find", package).strip())

    def test_interfaces_are_generated(self):
        self.assertIn("float64[] stiffness", output("rosmsg", "show", "solfer/JointCommand"))
        self.assertIn("float64 duration", output("rossrv", "show", "solfer/MoveJoints"))

    @soak
    def test_the_plugin_runs_under_both_packages(self):
        for package in ("solfer", "plugins"):
            self.assertIn("usage", output("rosrun", package, "plugin", "--help"))

    def test_solfer_is_a_command(self):
        self.assertIn("usage", output("solfer", "--help"))


if __name__ == "__main__":
    rostest.rosrun("solfer", "package", PackageTest)
