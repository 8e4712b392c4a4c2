#!/usr/bin/env python3
"""Figs. 2 and 3 of the paper: a plugin on a part of the robot, and two of which one goes by what the other moves.

Simulator and plugins run in lock-step, so that commands are known to the last digits without
asking solfer.
"""

import contextlib
import difflib
import functools
import os
import signal
import subprocess
import tempfile
import unittest
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import rospy
import rostest
from recording import STEP, Recording
from system import START, end, program, started, wait_for

from solfer.srv import GetJointNames, ListControllers, MoveJoints

FILE = Path(os.path.realpath(__file__)).with_name("figures.yaml")
COMMANDS, DESIRED = "/position_controller/command", "/desired_state"
SPEED, PERIOD = 0.5, 0.005  # [rad/s], [s]
SOURCES, TARGETS, MOTION = ("j_arm1_1", "j_arm1_4"), ("j_arm2_1", "j_arm2_4"), (-0.2, 0.3)  # [rad]
TRACKING = 0.03
"""How far springs, and the delay of a command by a cycle, let a joint of the arms be off in motion [rad]."""

UPPER = ("urdf: /robot_description", "urdf: /robot_upper_body")
ARM = "dofs: {chain: all, type: actuated, mapping: LOWER_LEVEL}"
LEFT, RIGHT = ((ARM, ARM.replace("all", side)) for side in ("left_arm", "right_arm"))


def ramp(time: np.ndarray, distance: float, duration: float) -> np.ndarray:
    """Minimum-jerk motion from rest to rest (Flash and Hogan 1985), zero before it begins."""
    share = np.clip(time / duration, 0.0, 1.0)
    return distance * (10.0 * share**3 - 15.0 * share**4 + 6.0 * share**5)


def is_offered(service: str, node: subprocess.Popen) -> bool:
    """Whether a node offers a service; one that has ended never will."""
    if node.poll() is not None:
        raise AssertionError(f"ended with code {node.returncode}: {node.stdout.read()}")
    try:
        rospy.wait_for_service(service, 0.1)
    except rospy.ROSException:
        return False
    return True


def changed_lines(one: str, other: str) -> list[str]:
    """Lines that two texts do not share."""
    lines = difflib.ndiff(one.splitlines(), other.splitlines())
    return [line for line in lines if line[:1] in "+-"]


class Figures(unittest.TestCase):
    """Each test has a simulation of its own."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("figures_2_3_test")
        cls.folder = Path(cls.enterClassContext(tempfile.TemporaryDirectory()))

    def edited(self, *edits: tuple[str, str]) -> str:
        """Write the configuration file with edited tags; returns its path."""
        text = FILE.read_text()
        for before, after in edits:
            self.assertIn(before, text)
            text = text.replace(before, after, 1)
        with tempfile.NamedTemporaryFile("w", suffix=".yaml", dir=self.folder, delete=False) as file:
            file.write(text)
        return file.name

    @contextlib.contextmanager
    def scene(self, **files: str) -> Iterator[Recording]:
        """Run a simulated robot and plugins in lock-step, each with its own configuration file."""
        rospy.set_param("/lockstep", ", ".join(files))
        with contextlib.ExitStack() as stack:
            recording = Recording((COMMANDS, DESIRED))
            stack.callback(recording.close)
            nodes = [stack.enter_context(started(*program("simulator", "--factor", "0")))]
            wait_for(lambda: 0 in recording.joints and 0 in recording.base, START, "a simulated robot")
            for name, file in files.items():
                self.assertEqual(set(recording.joints), {0}, "steps before all are there")
                nodes.append(stack.enter_context(started(*program("plugin", "-p", name, "-c", file))))
                service = f"/{name}/lockstep/tick"
                wait_for(functools.partial(is_offered, service, nodes[-1]), START, f"{name} in lock-step")
            yield recording
            for node in reversed(nodes):
                end(node, signal.SIGTERM)

    def move(self, recording: Recording) -> int:
        """Move the left arm; the step at which the plugin has set out."""
        ask = rospy.ServiceProxy("/move/trajectory", MoveJoints)
        wait_for(lambda: recording.rests(DESIRED, "/move"), START, "a plugin that commands")
        start = recording.commanded(DESIRED, "/move")[0].position
        goals = [start[joint] + distance for joint, distance in zip(SOURCES, MOTION, strict=True)]
        reply = ask(joints=SOURCES, positions=goals, speed=SPEED)
        self.assertTrue(reply.success, reply.message)
        self.assertAlmostEqual(reply.duration, self.duration(), places=9)
        wait_for(lambda: recording.begins(DESIRED, "/move"), START, "motion")
        (begin,) = recording.begins(DESIRED, "/move")
        wait_for(lambda: max(recording.joints) > begin + (self.duration() + 0.5) / STEP, START, "the end of the motion")
        return begin

    @staticmethod
    def duration() -> float:
        """Of the motion: the fastest joint reaches 15/8 of its mean speed [s]."""
        return 15.0 / 8.0 * max(map(abs, MOTION)) / SPEED

    def way(self, steps: list[int], begin: int) -> np.ndarray:
        """How far the joints should have gone at each step, shape (k, 2) [rad]."""
        times = (np.array(steps) - begin) * STEP + PERIOD
        return np.stack([ramp(times, distance, self.duration()) for distance in MOTION], axis=-1)

    def assert_commands(
        self, recording: Recording, topic: str, sender: str, joints: tuple[str, ...], begin: int
    ) -> None:
        """Check that the references of a node are the predicted motion."""
        commands = recording.commanded(topic, sender)
        got = np.array([[each.position[joint] for joint in joints] for each in commands])
        self.assertLess(np.abs(got - got[0] - self.way([each.step for each in commands], begin)).max(), 1e-9)

    def goes(self, recording: Recording, joints: tuple[str, ...], begin: int) -> None:
        """Check that the simulated joints move as predicted, as far as springs can."""
        steps = sorted(recording.joints)
        got = np.array([[recording.position(joint, step) for joint in joints] for step in steps])
        self.assertLess(np.abs(got - got[0] - self.way(steps, begin)).max(), TRACKING)

    def test_figure_2_one_tag_chooses_a_part(self):
        """The plugin of the edited file works on the model of the upper body, a parameter of ROS, and commands that."""
        upper = self.edited(UPPER)
        self.assertEqual(len(changed_lines(FILE.read_text(), Path(upper).read_text())), 2)
        with self.scene(move=upper) as recording:
            begin = self.move(recording)
            self.assert_commands(recording, COMMANDS, "/move", SOURCES, begin)
            self.goes(recording, SOURCES, begin)
            commanded = set(recording.commanded(COMMANDS, "/move")[0].position)
            joints = rospy.ServiceProxy("/position_controller/get_joint_names", GetJointNames)().names
        legs = {joint for joint in joints if joint.startswith(("hip", "knee", "ankle"))}
        self.assertEqual(commanded, set(joints) - legs)

    def test_figure_3_two_nodes_command_a_part_each(self):
        """One moves an arm, and one moves the other arm as far as the first is measured to have moved."""
        with self.scene(move=self.edited(LEFT), follow=self.edited(RIGHT)) as recording:
            begin = self.move(recording)
            self.goes(recording, TARGETS, begin)
            self.follows_what_is_measured(recording)
            claimed = rospy.ServiceProxy("/lower_level/list_controllers", ListControllers)().claimed_by
            self.assertTrue(any("/move" in owners and "/follow" in owners for owners in claimed), claimed)

    def follows_what_is_measured(self, recording: Recording) -> None:
        """Each command is as far from the first as the newest measurement of the left arm is from that one's."""
        commands = recording.commanded(COMMANDS, "/follow")
        steps = np.array(sorted(recording.joints))
        newest = steps[np.searchsorted(steps, [each.step for each in commands], side="right") - 1]
        got = np.array([[each.position[joint] for joint in TARGETS] for each in commands])
        measured = np.array([[recording.position(joint, step) for joint in SOURCES] for step in newest])
        self.assertLess(np.abs((got - got[0]) - (measured - measured[0])).max(), 1e-9)
        self.assertGreater(np.abs(got - got[0]).max(), 0.2)


if __name__ == "__main__":
    rostest.rosrun("solfer", "figures_2_3", Figures)
