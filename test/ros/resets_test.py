#!/usr/bin/env python3
"""A simulation begins anew while a plugin moves: its component is reset once, and its old references are forgotten."""

import contextlib
import os
import signal
import unittest
from pathlib import Path

import numpy as np
import rospy
import rostest
from geometry_msgs.msg import PointStamped
from system import (
    CENTAURO,
    LOADED,
    START,
    Robot,
    end,
    insist,
    numbers,
    program,
    soak,
    started,
    wait_for,
    wait_for_plugin,
)

from solfer.msg import JointCommand
from solfer.srv import ResetSimulation

FOLDER = Path(os.path.realpath(__file__)).parent
SIMULATOR = program("simulator")
PLUGIN = program("plugin", "-p", "joint_states", "-c", str(FOLDER / "resets.yaml"))
COMMANDS = "/position_controller/command"

RATE, SPEED = 200.0, 0.2  # [Hz], [rad/s]
SETTLE = 0.1
"""Shortest time in which nothing is commanded after a new beginning [s]."""

TICK = 0.004
"""Stamps are the time that a node has received last [s]."""

SAG = 0.05
"""How far springs have given way to the weight where the robot is measured [rad]."""


class ResetsTest(unittest.TestCase):
    """A simulator and a plugin that follows its time; the component counts its starts, resets and updates."""

    @classmethod
    def setUpClass(cls):
        rospy.set_param("/use_sim_time", True)
        cls.addClassCleanup(rospy.set_param, "/use_sim_time", False)
        stack = contextlib.ExitStack()
        cls.addClassCleanup(stack.close)
        rospy.init_node("tests")
        cls.simulator = stack.enter_context(started(*SIMULATOR))
        cls.started = stack.enter_context
        cls.events, cls.commands = [], []
        rospy.Subscriber(
            "/events",
            PointStamped,
            lambda message: cls.events.append((message.header.stamp.to_sec(), *numbers(message.point))),
            tcp_nodelay=True,
        )
        rospy.Subscriber(
            COMMANDS,
            JointCommand,
            lambda message: cls.commands.append((message.header.stamp.to_sec(), *message.position)),
            tcp_nodelay=True,
        )
        cls.robot = Robot()
        environment = {"PYTHONPATH": f"{FOLDER}:{os.environ['PYTHONPATH']}"}
        cls.plugin = stack.enter_context(started(*PLUGIN, **environment))
        wait_for_plugin(cls.plugin)
        wait_for(lambda: cls.events and cls.commands, START, "a plugin with subscribers")

    def begin(self) -> tuple[int, float]:
        """Let joints and wheels move; number of commands before, and how often the component has been reset."""
        sent = len(self.commands)
        wait_for(lambda: len(self.commands) > sent + 0.1 * RATE, START, "commands after all earlier requests")
        published, resets = len(self.commands), self.events[-1][2]
        begin = self.robot.positions()["torso_yaw"]
        insist(self.plugin, joints=["torso_yaw"], positions=[begin + 0.5], speed=SPEED)
        insist(self.plugin, joints=self.robot.wheels, velocities=[1.0] * len(self.robot.wheels))
        wait_for(lambda: abs(self.robot.positions()["torso_yaw"] - begin) > 0.1, START, "a robot that moves")
        return published, resets

    def listen(self, resets: int) -> tuple[np.ndarray, np.ndarray]:
        """Events before and after the component was reset so often."""
        wait_for(lambda: sum(each[2] == resets for each in list(self.events)) > RATE, START, "a plugin that is back")
        events = np.array(list(self.events))
        first = int(np.argmax(events[:, 2] == resets))
        return events[:first], events[first:]

    def check(self, before: np.ndarray, after: np.ndarray) -> None:
        """Check that there is one event, no cycle without messages, no burst."""
        self.assertTrue((after[:, 1] == before[-1, 1] + 1).all())
        self.assertTrue((after[:, 2] == before[-1, 2] + 1).all())
        self.assertTrue((np.diff(np.concatenate([before, after])[:, 3]) == 1.0).all())
        self.check_pace(after[:, 0])

    def check_pace(self, stamps: np.ndarray) -> None:
        """Check that time goes on, and late cycles are left out."""
        self.assertGreaterEqual(np.diff(stamps).min(), 0.0)
        for count in (10, 100):
            shortest = (stamps[count:] - stamps[:-count]).min()
            self.assertGreater(shortest, (count - 1) / RATE - TICK)

    def check_commands(self, before: np.ndarray, after: np.ndarray) -> None:
        """Check that the commands are the motion, then, with no step, the measured positions."""
        most = SPEED * (np.diff(before[:, :1], axis=0) + 1.1 / RATE)  # a late cycle covers the time that it is late
        self.assertTrue((np.abs(np.diff(before[:, 1:], axis=0)) < most).all())
        self.check_pace(after[:, 0])
        self.assertLess(np.abs(np.diff(after[:, 1:], axis=0)).max(), 1e-6)
        self.robot.settle()
        measured = self.robot.positions()
        names = rospy.wait_for_message(COMMANDS, JointCommand, START).name
        for name, expected in zip(names, after[0, 1:], strict=True):
            self.assertLess(abs(measured[name] - expected), SAG, name)
        self.assertLess(max(map(abs, self.robot.speeds())), 0.05)

    @soak
    def test_a_reset_reaches_components_as_one_event(self):
        published, resets = self.begin()
        reset = rospy.ServiceProxy("/simulator/reset", ResetSimulation)(state="mammal_wide_straight")
        self.assertTrue(reset.success, reset.message)
        before, after = self.listen(resets + 1)
        self.check(before, after)
        self.assertGreater(after[0, 0] - before[-1, 0], SETTLE - TICK)
        commands = np.array(self.commands[published:])
        anew = commands[:, 0] > (before[-1, 0] + after[0, 0]) / 2.0
        self.check_commands(commands[~anew], commands[anew])
        wait_for_plugin(self.plugin)

    def test_a_time_that_goes_back_is_one_event(self):
        """The simulator is killed and replaced: one component reset, one step back in time, no old references."""
        published, resets = self.begin()
        self.simulator.kill()
        self.simulator.wait(START)
        successor = self.started(started(*SIMULATOR))
        before, after = self.listen(resets + 1)
        self.check(before, after)
        self.assertLess(after[0, 0], before[-1, 0])
        self.assertGreater(after[0, 0], SETTLE - TICK)
        commands = np.array(self.commands[published:])
        back = np.flatnonzero(np.diff(commands[:, 0]) < 0.0)
        self.assertEqual(len(back), 1)
        self.check_commands(commands[: back[0] + 1], commands[back[0] + 1 :])
        self.robot.turn_wheels(1.0)
        joints = self.robot.positions()
        code, output = end(self.plugin, signal.SIGTERM)
        self.assertEqual(code, 0, output)
        self.assertNotIn("Traceback", output)
        wait_for(lambda: max(map(abs, self.robot.speeds())) < 0.02, START, "wheels at rest")
        self.assertEqual(set(self.robot.wheel_command.velocity), {0.0})
        self.assertLess(self.robot.moved(joints), LOADED)
        successor.kill()
        successor.wait(START)
        self.check_that_a_killed_simulators_parameters_are_not_taken()

    def check_that_a_killed_simulators_parameters_are_not_taken(self) -> None:
        """Start a plugin where they are left: it waits for a robot, and ends when it is asked to."""
        rospy.set_param("/use_sim_time", False)  # it would wait for the time first
        self.assertTrue(rospy.has_param("/robot_description"))
        with started(*program("plugin", "-p", "joint_states", "-c", str(CENTAURO))) as process:
            line = ""
            while "waits for the robot: no parameter '/robot_description'" not in line:
                line = process.stdout.readline()
                self.assertTrue(line, "the plugin has ended")
            code, output = end(process, signal.SIGINT)
        self.assertEqual(code, 0, output)


if __name__ == "__main__":
    rostest.rosrun("solfer", "resets", ResetsTest)
