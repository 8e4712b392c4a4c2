#!/usr/bin/env python3
"""A node that cannot start reports the reason in one block, without a traceback, and exits with code 2."""

import os
import signal
import tempfile
import unittest
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import rosnode
import rospy
import rostest
from system import START, end, program, run, started, wait_for

CONFIG = Path(os.path.realpath(__file__)).parents[2] / "config"
CONFIGURATION, ROBOT = str(CONFIG / "centauro.yaml"), CONFIG / "robots/centauro"
PLUGIN = program("plugin", "-p", "joint_states")
SIMULATOR = program("simulator")
NOBODY = {"ROS_MASTER_URI": "http://localhost:9"}


class StartsTest(unittest.TestCase):
    """Bad starts, two at a time."""

    @classmethod
    def setUpClass(cls):
        for name in ("/robot_description", "/robot_semantic_description", "/mwoibn_config"):
            if rospy.has_param(name):  # another test on the same master has left it
                rospy.delete_param(name)

    def check(self, *cases: tuple[tuple[str, ...], tuple[str, ...]], **environment: str) -> None:
        """Each case is a command and what its stderr has to contain."""
        with ThreadPoolExecutor(2) as pool:
            done = list(pool.map(lambda case: run(*case[0], **environment), cases))
        for (command, parts), (code, output) in zip(cases, done, strict=True):
            text = f"{' '.join(command)}\n{output}"
            self.assertEqual(code, 2, text)
            self.assertTrue(output.startswith("error: "), text)
            self.assertNotIn("Traceback", output, text)
            for part in parts:
                self.assertIn(part, output, text)

    def test_mistakes_that_need_no_master(self):
        with tempfile.TemporaryDirectory() as folder:
            broken = Path(folder, "broken.yaml")
            broken.write_text("mwoibn:\n  system: [SM\n")
            self.check(
                ((*PLUGIN[:-1], "joint_stats", "-c", CONFIGURATION), ("joint_stats", "joint_states")),
                ((*PLUGIN, "-n", "joint_lowr", "-c", CONFIGURATION), ("joint_lowr", "joint_lower")),
                ((*PLUGIN, "-c", str(Path(folder, "brokn.yaml"))), ("brokn.yaml", "did you mean: broken.yaml")),
                ((*PLUGIN, "-c", str(broken)), (f"{broken}:",)),
                ((*SIMULATOR, "robot:=centaro"), ("centaro", "did you mean: centauro")),
                ((*SIMULATOR, "--world", "slop"), ("world 'slop'", "did you mean: slope")),
                **NOBODY,
            )

    def test_no_master(self):
        master = ("http://localhost:9", "start roscore or roslaunch")
        self.check(((*PLUGIN, "-c", CONFIGURATION), master), (SIMULATOR, master), **NOBODY)

    def test_no_configuration_file(self):
        self.check((PLUGIN, ("/mwoibn_config", "-c FILE")))

    def test_a_robot_without_a_description(self):
        self.check(((*PLUGIN, "-c", CONFIGURATION), ("/robot_description", "centauro.yaml:")))

    def test_a_plugin_that_waits_can_be_ended(self):
        for name, file in (("/robot_description", "centauro.urdf"), ("/robot_semantic_description", "centauro.srdf")):
            rospy.set_param(name, (ROBOT / file).read_text())
            self.addCleanup(rospy.delete_param, name)
        with started(*PLUGIN, "-c", CONFIGURATION) as process:
            wait_for(lambda: "/joint_states" in rosnode.get_node_names(), START, "a node that waits")
            code, output = end(process, signal.SIGINT)
        self.assertEqual(code, 0, output)
        self.assertNotIn("error", output)

    def test_a_simulator_of_nothing(self):
        self.check(
            ((*SIMULATOR, "--robot", "centaro"), ("centaro", "did you mean: centauro")),
            ((*SIMULATOR, "__name:=second", "state:=mammal_wid"), ("mammal_wid", "mammal_wide")),
        )
        self.check(((*SIMULATOR, "gui:=perhaps"), ("gui:=", "true or false")))


if __name__ == "__main__":
    rostest.rosrun("solfer", "starts", StartsTest)
