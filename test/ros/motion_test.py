#!/usr/bin/env python3
"""The plugin joint_states moves the simulated robot on request, and nothing wrong gets through."""

import contextlib
import functools
import re
import shlex
import subprocess
import tempfile
import unittest
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit
from xml.etree import ElementTree

import rosgraph
import rospy
import rostest
from ros_tools import shown
from system import STANDS_STILL, START, Robot, ask, insist, move, soak, wait_for, wait_for_plugin

from solfer.msg import JointCommand
from solfer.recording.reader import read

README = Path(__file__).resolve().parents[2] / "README.md"
SOLFER = README.parent / "nodes" / "solfer"
NAN = float("nan")


class MotionTest(unittest.TestCase):
    """Requests to the service, and commands past it."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("tests")
        cls.robot = Robot()
        wait_for_plugin()

    @contextlib.contextmanager
    def no_motion(self) -> Iterator[None]:
        """Check that no joint moves because of what is asked for meanwhile."""
        self.robot.settle()
        before = self.robot.positions()
        yield
        self.robot.passes(0.2)
        self.assertLess(self.robot.moved(before), STANDS_STILL)  # of 0.1 rad that were asked for

    def refused(self, *parts: str, **request: object) -> None:
        """Check that a request is refused with a message that holds all `parts`."""
        replies = []

        def explained() -> bool:
            replies.append(ask(**request))
            return all(part in replies[-1].message for part in parts)

        # a plugin that the machine has just stalled refuses for another reason
        wait_for(explained, START, lambda: f"{parts} in '{replies[-1].message}'")
        self.assertEqual({(reply.success, reply.duration) for reply in replies}, {(False, 0.0)})

    def test_a_named_state_is_reached(self):
        semantics = ElementTree.fromstring(rospy.get_param("/robot_semantic_description"))
        for state in ("mammal_wide_high", "mammal_wide_straight"):
            joints = semantics.findall(f"group_state[@name='{state}']/joint")
            held = self.robot.positions()
            goal = {joint.get("name"): float(joint.get("value")) for joint in joints if joint.get("name") in held}
            self.assertGreater(len(goal), 30)
            speed = 1.0
            distance = max(abs(held[name] - value) for name, value in goal.items())
            reply = move(functools.partial(self.robot.arrive, goal), state=state, speed=speed)
            self.assertGreaterEqual(reply.duration, (distance - 0.02) / speed)

    def test_joints_are_moved_to_positions(self):
        goal = {"torso_yaw": 0.3, "neck_yaw": -0.2}
        arrive = functools.partial(self.robot.arrive, goal)
        reply = move(arrive, joints=list(goal), positions=list(goal.values()), speed=0.5)
        self.assertGreaterEqual(reply.duration, 0.3 / 0.5 - 0.05)

    def test_the_requests_of_the_readme_succeed(self):
        lines = re.findall(r"^rosservice call .*$", README.read_text(), re.MULTILINE)
        self.assertEqual(len(lines), 4)
        for command in map(shlex.split, lines):
            wait_for(lambda command=command: shown(*command)["success"], START, " ".join(command))
        self.robot.turn_wheels(0.0)
        insist(state="mammal_wide_straight", speed=1.0)
        self.robot.settle()

    @soak
    def test_what_happens_can_be_recorded_beside(self):
        port = urlsplit(rosgraph.get_master_uri()).port
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "motion.mcap"
            command = [SOLFER, "record", "-n", "joint_states", "--seconds", "2", f"ros.{port}", file]
            subprocess.run(list(map(str, command)), check=True, timeout=START)
            found = read(file)
        measured = found["joint_states/measured/position"]
        self.assertGreater(len(measured.times), 50)
        self.assertIn("torso_yaw", measured.columns)
        self.assertEqual(found.missing, ())

    def test_wrong_requests_are_refused(self):
        with self.no_motion():
            self.refused("mammal_wide_hihg", "mammal_wide_high", state="mammal_wide_hihg")
            self.refused("torso_jaw", "torso_yaw", joints=["torso_jaw"], positions=[0.1])
            self.refused("torso_yaw", "finite", joints=["neck_yaw", "torso_yaw"], positions=[0.1, NAN])
            self.refused("speed", joints=["torso_yaw"], positions=[0.1], speed=NAN)
            self.refused("1 positions for 2 joints", joints=["torso_yaw", "neck_yaw"], positions=[0.1])
            self.refused("neck_yaw", "limits", joints=["torso_yaw", "neck_yaw"], positions=[0.1, 3.0])
            self.refused("neither")

    def test_bad_commands_past_the_plugin_move_nothing(self):
        """The lower level is the last guard against NaN, unknown or doubled joints, and positions far away."""
        publisher = rospy.Publisher("/position_controller/command", JointCommand, queue_size=10)
        wait_for(lambda: publisher.get_num_connections() > 0, START, "a subscriber of the command")
        with self.no_motion():
            for names, position in (
                (["torso_yaw"], [NAN]),
                (["torso_jaw"], [0.5]),
                (["torso_yaw", "neck_yaw"], [0.5]),
                (["torso_yaw"], [0.5, 0.5]),
                (["torso_yaw", "torso_yaw"], [0.5, 0.5]),
                (["torso_yaw"], [50.0]),
            ):
                publisher.publish(JointCommand(name=names, position=position))
                self.robot.passes(0.05)
        publisher.unregister()


if __name__ == "__main__":
    rostest.rosrun("solfer", "motion", MotionTest)
