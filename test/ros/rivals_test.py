#!/usr/bin/env python3
"""Somebody else publishes the joint states of the simulator, all zero: nothing starts with them or goes by them."""

import contextlib
import os
import signal
import subprocess
import sys
import unittest
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticArray
from sensor_msgs.msg import JointState
from system import LATE, SOAKS, START, Robot, ask, end, insist, program, soak, started, wait_for, wait_for_plugin

from solfer.srv import ResetSimulation

CONFIGURATION = Path(os.path.realpath(__file__)).parents[2] / "config/centauro.yaml"
PLUGIN = program("plugin", "-p", "joint_states", "-c", str(CONFIGURATION))
ZEROS = """
import rospy
import sys
import time
from sensor_msgs.msg import JointState
rospy.init_node("zeros", disable_signals=True)
publisher = rospy.Publisher("/joint_states", JointState, queue_size=1, tcp_nodelay=True)
zeros = [0.0] * len(sys.argv[1:])
while True:
    publisher.publish(name=sys.argv[1:], position=zeros, velocity=zeros, effort=zeros)
    time.sleep(0.005)
"""
STARTS, THROWN = 2 if SOAKS else 1, 0.05
"""Starts that are tried, and how far a joint may be from where it should be [rad]."""

JOINT, GOAL, SPEED = "torso_yaw", 0.4, 0.4
"""A motion of some 2 s [rad, rad/s]."""


class Simulated(Robot):
    """The messages of the simulator alone.

    Attributes:
        track: Time [s] and position of JOINT [rad], oldest first.
        furthest: Largest distance of a joint from where it was at `mark` [rad].
    """

    def __init__(self) -> None:
        self.track: list[tuple[float, float]] = []
        self.furthest, self._marked, self.zeros = 0.0, {}, 0
        super().__init__()

    def mark(self) -> None:
        """From now on distances count from here."""
        self._marked, self.furthest = self.positions(), 0.0

    def receives_zeros(self) -> None:
        """Wait until another node publishes."""
        self.zeros = 0
        wait_for(lambda: self.zeros > 20, START, "zeros")

    def _receive_joints(self, message: JointState) -> None:
        if message._connection_header["callerid"] != "/simulator":
            self.zeros += 1
            return
        super()._receive_joints(message)
        published = dict(zip(message.name, message.position, strict=True))
        self.track.append((message.header.stamp.to_sec(), published[JOINT]))
        distances = [abs(published[name] - position) for name, position in self._marked.items()]
        self.furthest = max([self.furthest, *distances])


class RivalsTest(unittest.TestCase):
    """Both tests start a plugin of their own on the same simulated robot."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("tests")
        cls.robot = Simulated()
        cls.health = cls.published = ""
        cls.reset = rospy.ServiceProxy("/simulator/reset", ResetSimulation)
        rospy.Subscriber("/diagnostics", DiagnosticArray, cls.receive_health)

    @classmethod
    def receive_health(cls, message: DiagnosticArray):
        """Keep the health reports of the plugin."""
        for status in message.status:
            if status.name.startswith("joint_states:"):
                cls.health = f"{status.level} {status.message}"

    @contextlib.contextmanager
    def zeros(self) -> Iterator[subprocess.Popen]:
        """Somebody publishes zeros meanwhile; begins when they are received here."""
        with started(sys.executable, "-c", ZEROS, *self.robot.wheels, *self.robot.positions()) as process:
            self.robot.receives_zeros()
            yield process

    def reports_why(self) -> bool:
        """Return whether the plugin reports the topic and the senders of messages that it cannot distinguish."""
        try:
            reply = ask(state="reset")
        except rospy.ServiceException:
            return False
        self.published = reply.message or "it runs"
        return "'link_side_online' (/joint_states), where /simulator and /zeros publish the same DoFs" in self.published

    def test_nothing_starts_while_two_publish_the_same_joints(self):
        """Zeros taken for the posture would throw the robot, so the plugin waits until one publisher is left."""
        self.assertTrue(self.reset().success)
        self.robot.settle()
        self.robot.mark()
        with self.zeros() as zeros, started(*PLUGIN) as process:
            for _ in range(STARTS):
                wait_for(self.reports_why, START, lambda: f"a plugin that reports why it waits: {self.published}")
                self.robot.passes(0.3)
                self.assertTrue(self.reports_why(), self.published)
                self.assertLess(self.robot.furthest, THROWN)
                zeros.send_signal(signal.SIGSTOP)
                wait_for_plugin(process)  # it starts by itself
                self.robot.passes(0.2)
                self.assertLess(self.robot.furthest, THROWN)
                zeros.send_signal(signal.SIGCONT)
                self.robot.receives_zeros()
                self.assertTrue(self.reset().success)  # what runs begins anew
            code, output = end(process, signal.SIGTERM)
            self.assertEqual(code, 0, output)
            self.assertNotIn("Traceback", output)

    def path(self, process, meanwhile=contextlib.nullcontext) -> np.ndarray:
        """Compute a motion from 0 to GOAL: positions at each 10 ms since its beginning [rad]."""
        self.robot.reach({JOINT: 0.0}, SPEED, process)
        self.robot.settle()
        self.robot.track.clear()
        insist(process, joints=[JOINT], positions=[GOAL], speed=SPEED)
        wait_for(lambda: self.robot.positions()[JOINT] > GOAL / 4, START, "a motion")
        with meanwhile():
            self.robot.arrive({JOINT: GOAL}, LATE)
        times, positions = np.array(self.robot.track).T
        begin = np.flatnonzero(positions > 0.02)[0]
        return np.interp(np.arange(0.0, 1.5, 0.01), times[begin:] - times[begin], positions[begin:])

    def whole_path(self, *arguments) -> np.ndarray:
        """Move; once more where a plugin that was late on a busy machine gave the motion up."""
        for _ in range(2):
            with contextlib.suppress(AssertionError):
                return self.path(*arguments)
        return self.path(*arguments)

    @soak
    def test_a_motion_goes_on_beside_another_publisher(self):
        """The path is that of the undisturbed motion, and health and output name the publisher that is ignored."""
        with started(*PLUGIN) as process:
            wait_for_plugin(process)
            alone = self.whole_path(process)
            disturbed = self.whole_path(process, self.zeros)
            self.assertLess(np.abs(disturbed - alone).max(), THROWN)
            with self.zeros():
                wait_for(
                    lambda: "/simulator and /zeros publish the same DoFs" in self.health,
                    START,
                    lambda: f"health that names both: {self.health}",
                )
                self.assertEqual(self.health[0], "1")
            code, output = end(process, signal.SIGTERM)
            self.assertEqual(code, 0, output)
            self.assertIn("messages of /zeros were ignored", output)


if __name__ == "__main__":
    rostest.rosrun("solfer", "rivals", RivalsTest)
