#!/usr/bin/env python3
"""A node that cannot start reports the reason in one block, without a traceback, and exits with code 2.

Nodes start as forks of this process, which has their modules and no threads: a start anew takes seconds for imports.
"""

import multiprocessing
import os
import runpy
import signal
import sys
import tempfile
import unittest
from pathlib import Path
from typing import TextIO

import rosnode
import rospy
import rostest
from bare_robot_test import A1, write_srdf
from system import CENTAURO, NODES, START, end, program, started, wait_for

for node in ("plugin", "simulator", "navigation"):
    runpy.run_path(str(NODES / node))  # imports what a fork need not import again

CONFIG = CENTAURO.parent
ROBOT, SCENARIOS = CONFIG / "robots/centauro", CONFIG / "scenarios"
PLUGIN = ("plugin", "-p", "joint_states")
CONFIGURED = (*PLUGIN, "-c", str(CENTAURO))
SIMULATOR = ("simulator",)
NAVIGATION = ("navigation",)
NOBODY = {"ROS_MASTER_URI": "http://localhost:9"}


def run_node(command: tuple[str, ...], errors: TextIO, environment: dict[str, str]) -> None:
    """Be one of our nodes, in a process of its own."""
    os.environ.update(environment)
    os.dup2(errors.fileno(), 2)
    sys.stderr = errors
    sys.argv = [str(NODES / command[0]), *command[1:]]
    runpy.run_path(sys.argv[0], run_name="__main__")


def forked(command: tuple[str, ...], environment: dict[str, str]) -> tuple[int | None, str]:
    """Exit code and stderr of a node that ends by itself; the code of one that does not is None."""
    with tempfile.TemporaryFile("w+") as errors:
        process = multiprocessing.get_context("fork").Process(target=run_node, args=(command, errors, environment))
        process.start()
        process.join(START)
        code = process.exitcode
        process.kill()
        errors.seek(0)
        return code, errors.read()


class StartsTest(unittest.TestCase):
    """Bad starts."""

    @classmethod
    def setUpClass(cls):
        for name in ("/robot_description", "/robot_semantic_description", "/mwoibn_config"):
            if rospy.has_param(name):  # another test on the same master has left it
                rospy.delete_param(name)

    def setUp(self):
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))

    def check(self, *cases: tuple[tuple[str, ...], tuple[str, ...]], **environment: str) -> None:
        """Each case is a command and what its stderr has to contain."""
        for command, parts in cases:
            code, output = forked(command, environment)
            text = f"{' '.join(command)}\n{output}"
            self.assertEqual(code, 2, text)
            self.assertTrue(output.startswith("error: "), text)
            self.assertNotIn("Traceback", output, text)
            for part in parts:
                self.assertIn(part, output, text)

    def test_mistakes_that_need_no_master(self):
        broken = self.folder / "broken.yaml"
        broken.write_text("mwoibn:\n  system: [SM\n")
        self.check(
            (("plugin", "-p", "joint_stats", "-c", str(CENTAURO)), ("joint_stats", "joint_states")),
            ((*PLUGIN, "-n", "joint_lowr", "-c", str(CENTAURO)), ("joint_lowr", "joint_lower")),
            ((*PLUGIN, "-c", str(self.folder / "brokn.yaml")), ("brokn.yaml", "did you mean: broken.yaml")),
            ((*PLUGIN, "-c", str(broken)), (f"{broken}:",)),
            ((*SIMULATOR, "robot:=centaro"), ("centaro", "did you mean: centauro")),
            ((*SIMULATOR, "--world", "slop"), ("world 'slop'", "did you mean: slope")),
            **NOBODY,
        )

    def test_no_master(self):
        master = ("http://localhost:9", "start roscore or roslaunch")
        self.check((CONFIGURED, master), (SIMULATOR, master), **NOBODY)

    def test_no_configuration_file(self):
        self.check((PLUGIN, ("/mwoibn_config", "-c FILE")))

    def test_a_misspelt_description_is_not_waited_for(self):
        rospy.set_param("/robot_descripton", "<robot/>")
        self.addCleanup(rospy.delete_param, "/robot_descripton")
        self.check((CONFIGURED, ("/robot_description", "centauro.yaml:", "did you mean: /robot_descripton")))

    def test_a_plugin_that_waits_can_be_ended(self):
        for name, file in (("/robot_description", "centauro.urdf"), ("/robot_semantic_description", "centauro.srdf")):
            rospy.set_param(name, (ROBOT / file).read_text())
            self.addCleanup(rospy.delete_param, name)
        with started(*program(*CONFIGURED)) as process:
            wait_for(lambda: "/joint_states" in rosnode.get_node_names(), START, "a node that waits")
            code, output = end(process, signal.SIGINT)
        self.assertEqual(code, 0, output)
        self.assertNotIn("error", output)

    def test_a_simulator_of_nothing(self):
        self.check(
            ((*SIMULATOR, "--robot", "centaro"), ("centaro", "did you mean: centauro")),
            ((*SIMULATOR, "__name:=second", "state:=mammal_wid"), ("mammal_wid", "mammal_wide")),
            ((*SIMULATOR, "gui:=perhaps"), ("gui:=", "true or false")),
        )

    def test_a_simulator_of_a_robot_of_others(self):
        robot, srdf = (*SIMULATOR, "--robot", A1), write_srdf(str(self.folder))
        broken = self.folder / "broken.srdf"
        broken.write_text('<robot name="a1"><group name="legs"><link name="trunc"/></group></robot>')
        self.check(
            ((*SIMULATOR, "--robot", f"{self.folder}/a2.urdf"), ("a2.urdf", "the URDF cannot be read")),
            ((*robot, "--srdf", f"{self.folder}/a2.srdf"), ("a2.srdf",)),
            ((*robot, "--srdf", str(broken)), ("unknown link 'trunc'", "did you mean: trunk")),
            ((*robot, "--floating-base", "--srdf", srdf, "--state", "croched"), ("croched", "crouched")),
            ((*robot, "floating_base:=perhaps"), ("floating_base", "true or false")),
        )

    def test_a_navigation_to_nowhere(self):
        """Wrong files, way-points and options; what argparse reports begins with the usage."""
        broken = NODES.parent / "test/data/scenarios/hw.yaml"
        cases = (
            (("play", str(broken)), ("hw.yaml:9:2", "not YAML")),
            (("play", str(SCENARIOS / "circulr.yaml")), ("circulr.yaml", "did you mean: circular.yaml")),
            (("play", str(SCENARIOS / "events.yaml")), ("events.yaml:101:3", "names of the contacts")),
            (("go", "1,x"), ("'1,x', expected X,Y",)),
            (("go", "1,2", "--speed", "9"), ("a number from 0.001 to 5 [m/s]",)),
            (("go",), ("X,Y[,HEADING]",)),
            (("go", "1,2", "--positions", "--velocities"), ("--velocities", "not allowed with", "--positions")),
        )
        for arguments, parts in cases:
            code, output = forked((*NAVIGATION, *arguments), {})
            self.assertEqual(code, 2, output)
            self.assertNotIn("Traceback", output)
            for part in parts:
                self.assertIn(part, output)


if __name__ == "__main__":
    rostest.rosrun("solfer", "starts", StartsTest)
