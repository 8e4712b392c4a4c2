#!/usr/bin/env python3
"""The node of the page in the browser: it shows the simulated robot, and stops it."""

import re
import subprocess
import sys
import unittest

import rospy
import rostest
from system import NODES, START, program, wait_for

sys.path.insert(0, str(NODES.parent / "test"))  # rostest starts it
from support.page import opened_page  # noqa: E402


class ViewTest(unittest.TestCase):
    """A page without a browser; in the end the robot's emergency stop is latched."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("tests")

    def test_the_node_shows_and_stops_the_robot(self):
        command = program("view", "--port", "0", "__name:=view")
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            self.addCleanup(process.kill)
            address = process.stdout.readline().strip()
            self.assertTrue(re.fullmatch(r"http://localhost:\d+/[\w-]+/", address), address)
            with opened_page(address) as page:
                page.until(lambda: "/measured/pelvis" in page.positions, "the robot", START)
                page.until(lambda: {"simulation", "lower_level"} <= set(page.tabs), "tabs", START)
                page.click("EMERGENCY STOP")
                page.until(lambda: "stop the robot now" in page.labels, "the question", START)
                page.click("stop the robot now")
                page.until(lambda: "emergency stop" in page.content, "the stop in the report of the lower level", START)
            process.terminate()
            wait_for(lambda: process.poll() is not None, START, "the end of the node")


if __name__ == "__main__":
    rostest.rosrun("solfer", "view", ViewTest)
