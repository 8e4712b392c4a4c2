#!/usr/bin/env python3
"""Gravity compensation by the commands of its page: joints move, and legs carry the robot by torques, as in memory."""

import functools
import re
import shlex
import signal
import subprocess
import tempfile
import unittest
from pathlib import Path

import numpy as np
import rospy
import rostest
import yaml
from recording import QUEUE, Recording, step_of
from replayed import replay
from ros_tools import shown
from support.paper.figure_3 import write_offline
from system import START, Robot, end, started, wait_for

from solfer.msg import JointCommand
from solfer.srv import MoveJoints

MOTION = 300
"""Steps of the simulation that are compared after the motion has begun."""

BLEND = 1000
"""Steps until a plugin that starts commands what it computes."""

PAGE = Path(__file__).resolve().parents[2] / "docs/reference/compensation.md"


class SentCommands:
    """What is commanded."""

    def __init__(self):
        self._by_step = {}
        rospy.Subscriber("/position_controller/command", JointCommand, self._receive, queue_size=QUEUE)

    @property
    def by_step(self):
        """Names, positions, velocities and efforts of the message of each step; a copy."""
        return dict(self._by_step)

    def effort(self, joint):
        """Newest effort of a joint [Nm]; zero before the first."""
        messages = self.by_step
        if not messages:
            return 0.0
        names, _, _, efforts = messages[max(messages)]
        return efforts[names.index(joint)]

    def _receive(self, message):
        values = message.position, message.velocity, message.effort
        self._by_step[step_of(message.header.stamp)] = (tuple(message.name), *values)


class CompensationTest(unittest.TestCase):
    """What the page promises."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("compensation_test")

    def test_the_commands_of_the_page_move_and_carry(self):
        """The page's own lines are run: the torso arrives, and a lifted leg's load moves onto the others and back.

        Each command sent equals that of the same plugin in memory.
        """
        robot, recording, sent = Robot(), Recording(("/desired_state",)), SentCommands()
        lines = re.findall(r"^rosservice call .*$", PAGE.read_text(), re.MULTILINE)
        self.assertEqual([line.split()[2].rpartition("/")[2] for line in lines], ["trajectory", "lift", "lift"])
        for line in lines:
            rospy.wait_for_service(line.split()[2], START)
        move, lift, put_down = lines
        commanding = "/desired_state", "/desired_joints"
        wait_for(lambda: recording.rests(*commanding), START, "a plugin at rest that commands joints")
        self.obey(move)
        wait_for(lambda: bool(recording.begins(*commanding)), START, "a motion")
        wait_for(lambda: abs(sent.effort("hip_pitch_1")) > 10.0, START, "legs that carry")
        wait_for(lambda: max(sent.by_step) > recording.begins(*commanding)[0] + MOTION, START, "a motion")
        compared = sent.by_step
        robot.arrive({"torso_yaw": 0.3}, START)
        before = sent.effort("hip_pitch_3")
        self.obey(lift)
        wait_for(lambda: abs(sent.effort("hip_pitch_3") - before) > 5.0, START, "more load on the others")
        self.obey(put_down)
        wait_for(lambda: abs(sent.effort("hip_pitch_3") - before) < 2.0, START, "the load as before")
        self.carry_the_desired_load(robot, sent)
        self.compare(compared, recording.begins(*commanding)[0], move)

    def carry_the_desired_load(self, robot, sent):
        """Let the plugin that carries start anew with one other tag, on the desired state."""
        subprocess.run(["rosnode", "kill", "/gravity_compensation"], check=True, capture_output=True)
        with tempfile.TemporaryDirectory() as folder:
            file = str(write_offline(Path(folder)))
            with started("rosrun", "plugins", "plugin", "-p", "gravity_compensation", "-c", file) as node:
                begin = max(sent.by_step)
                move = functools.partial(
                    rospy.ServiceProxy("/desired_joints/trajectory", MoveJoints), joints=["torso_yaw"], positions=[0.1]
                )
                wait_for(lambda: max(sent.by_step) > begin + BLEND, START, "commands of the one that is new")
                wait_for(lambda: move().success, START, "joints that move")
                robot.arrive({"torso_yaw": 0.1}, START)
                self.assertGreater(abs(sent.effort("hip_pitch_1")), 10.0)
                self.assertEqual(end(node, signal.SIGTERM)[0], 0)

    def compare(self, sent, begin, move):
        """Commands are those of the memory middleware where the motion begins at the same step."""
        fields = yaml.safe_load(shlex.split(move)[3])
        topic, last = "position_controller/command", begin + MOTION
        messages = replay(
            ("desired_joints", "gravity_compensation"),
            [(begin, "desired_joints/trajectory", fields)],
            last,
            {},
            {topic: "solfer/JointCommand"},
        )[topic]
        common = [step for step in sent if step < last]
        self.assertGreater(len(common), MOTION // 10)
        for step in common:
            names, *values = sent[step]
            expected = messages[step]
            self.assertEqual(names, tuple(expected.names))
            for mine, other in zip(values, (expected.position, expected.velocity, expected.effort), strict=True):
                self.assertLess(np.abs(np.subtract(mine, other)).max(initial=0.0), 1e-9)

    @staticmethod
    def obey(line: str) -> None:
        """Call a service until its owner has what it needs."""
        wait_for(lambda: shown(*shlex.split(line))["success"], START, line)


if __name__ == "__main__":
    rostest.rosrun("solfer", "compensation", CompensationTest)
