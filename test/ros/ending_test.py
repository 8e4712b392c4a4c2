#!/usr/bin/env python3
"""However a plugin ends, the robot comes to rest; claims_test.py and resets_test.py have `rosnode kill` and SIGTERM."""

import os
import signal
import subprocess
import tempfile
import unittest
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import rosnode
import rospy
import rostest
from system import LOADED, START, Robot, end, program, soak, started, wait_for, wait_for_plugin

CONFIGURATION = Path(os.path.realpath(__file__)).parents[2] / "config/centauro.yaml"
PLUGIN = program("plugin", "-p", "joint_states", "-c", str(CONFIGURATION))

SABOTEUR = """
from pathlib import Path

from solfer.components.joint_states import JointStates

class Saboteur(JointStates):
    def update(self):
        super().update()
        self._wheel_goal[:] = 1.0
        if Path(__file__).with_suffix(".now").exists():
            raise ValueError("sabotage")
"""
MODULE = """
    saboteur:
      class: saboteur:Saboteur
      layer: NRT
      robot: joint_space
      controller: direct
      mode: full
      kinematics: false
      dynamics: false
      model_change: false
"""


@contextmanager
def plugin(*arguments: str) -> Iterator[subprocess.Popen]:
    """Start a plugin, and wait until it accepts requests."""
    with started(*PLUGIN, *arguments) as process:
        wait_for_plugin(process)
        yield process


class EndingTest(unittest.TestCase):
    """Each test starts a plugin of its own on the same simulated robot."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("tests")
        cls.robot = Robot()

    def rests(self, before: dict[str, float]) -> None:
        """Check that the wheels stand still, the last command to them was zero, and the joints are held.

        A leg's springs gave way to the forces of driving, and come back.
        """
        wait_for(lambda: max(map(abs, self.robot.speeds())) < 0.02, START, "wheels at rest")
        wait_for(lambda: set(self.robot.wheel_command.velocity) == {0.0}, START, "zero as their last command")
        self.robot.passes(0.5)
        self.assertLess(max(map(abs, self.robot.speeds())), 0.02)
        self.assertLess(self.robot.moved(before), LOADED)

    def ends_at_rest(self, process: subprocess.Popen, number: signal.Signals) -> None:
        """Check that a signal ends a plugin that turns wheels."""
        self.robot.turn_wheels(1.0)
        before = self.robot.positions()
        code, output = end(process, number)
        self.assertEqual(code, 0, f"{number.name}: {output}")
        self.assertNotIn("Traceback", output)
        self.rests(before)

    @soak
    def test_a_component_that_fails_brings_rest(self):
        """A ValueError while wheels turn ends the node with its text, without a traceback, and the robot at rest."""
        folder = self.enterContext(tempfile.TemporaryDirectory())
        Path(folder, "saboteur.py").write_text(SABOTEUR)
        file = Path(folder, "centauro.yaml")
        file.write_text(CONFIGURATION.read_text().replace("{file: ", f"{{file: {CONFIGURATION.parent}/") + MODULE)
        path = os.pathsep.join((folder, os.environ["PYTHONPATH"]))
        arguments = ("-n", "saboteur", "-c", str(file), "__name:=saboteur")
        with started(*PLUGIN[:-2], *arguments, PYTHONPATH=path) as process:
            wait_for(lambda: min(map(abs, self.robot.speeds())) > 0.3, START, "wheels that turn")
            before = self.robot.positions()
            Path(folder, "saboteur.now").touch()
            output, _ = process.communicate(timeout=START)
        self.assertEqual(process.returncode, 1, output)
        self.assertIn("error: plugin 'saboteur' failed", output)
        self.assertIn("ValueError: sabotage", output)
        self.assertNotIn("Traceback", output)
        self.rests(before)

    @soak
    def test_a_terminal_that_is_closed_ends_it(self):
        with plugin() as process:
            self.ends_at_rest(process, signal.SIGHUP)

    @soak
    def test_a_plugin_of_another_name_finds_its_file(self):
        rospy.set_param("/mwoibn_config", str(CONFIGURATION))
        try:
            with started(*PLUGIN[:-2], "__name:=other") as process:
                wait_for_plugin(process)
                self.assertIn("/other", rosnode.get_node_names())
                self.ends_at_rest(process, signal.SIGINT)
        finally:
            rospy.delete_param("/mwoibn_config")

    def test_the_simulator_describes_the_robot_by_parameters(self):
        for name in ("robot_description", "robot_semantic_description", "robot_lower_body", "robot_upper_body"):
            self.assertIn("<robot", rospy.get_param(f"/{name}"))


if __name__ == "__main__":
    rostest.rosrun("solfer", "ending", EndingTest)
