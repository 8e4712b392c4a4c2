#!/usr/bin/env python3
"""Fig. 4 of the paper in lock-step with the simulator moves as on the memory middleware, to the last digits."""

import contextlib
import signal
import unittest

import numpy as np
import rospy
import rostest
from recording import STEP, Recording
from replayed import replay
from system import START, end, program, started, wait_for

from solfer.srv import MoveJoints

PLUGINS = ("upper_body", "lower_body", "shared_compensation")
WHEELS = ("j_wheel_1", "j_wheel_2", "j_wheel_3", "j_wheel_4")
REQUESTS = (
    ("upper_body", {"joints": ("torso_yaw", "j_arm1_4"), "positions": (0.3, -1.2)}),
    ("lower_body", {"state": "mammal_wide_high"}),
    ("lower_body", {"joints": WHEELS, "velocities": (1.0, -1.0, 1.0, -1.0)}),
)
ROLL = 1.0
"""Simulated time that the wheels turn [s]."""


COMMAND = "position_controller/command"
TOPICS = {"joint_states": "sensor_msgs/JointState", "floating_base": "nav_msgs/Odometry"}


class LockstepTest(unittest.TestCase):
    """A robot with time that stands still before all plugins are there, and after one has ended."""

    def test_the_motion_is_that_of_the_memory_middleware(self):
        rospy.init_node("figure_4_lockstep_test")
        recording = Recording(("/upper_body", "/lower_body", f"/{COMMAND}"))
        wait_for(lambda: 0 in recording.joints, START, "joint states")
        with contextlib.ExitStack() as stack:
            nodes = [stack.enter_context(started(*program("plugin", "-p", name))) for name in PLUGINS[:2]]
            rospy.wait_for_service("/lower_body/lockstep/tick", START)
            rospy.wait_for_service("/upper_body/lockstep/tick", START)
            self.assertEqual(set(recording.joints), {0})
            nodes.append(stack.enter_context(started(*program("plugin", "-p", PLUGINS[2]))))
            applied = self.carry_out(recording)
            wait_for(lambda: max(recording.joints) > applied[-1] + ROLL / STEP, START, "wheels that roll")
            for node in nodes:
                self.assertEqual(end(node, signal.SIGTERM)[0], 0)
        requests = [
            (step, f"{plugin}/trajectory", fields) for step, (plugin, fields) in zip(applied, REQUESTS, strict=True)
        ]
        last = applied[-1] + round(ROLL / STEP)
        joints, base, commands = replay(PLUGINS, requests, last, TOPICS, {COMMAND: "solfer/JointCommand"}).values()
        self.compare(
            {step: np.array([each.position, each.velocity]) for step, each in joints.items()}, recording.joints
        )
        self.compare(
            {step: np.concatenate([each.position, each.orientation]) for step, each in base.items()}, recording.base
        )
        sent = {one.step: one for one in recording.wanted(f"/{COMMAND}", f"/{PLUGINS[2]}") if one.step in commands}
        for step, one in sent.items():
            self.assertEqual(list(one.position), list(commands[step].names))
        self.compare(
            {
                step: np.concatenate([each.position, [] if each.velocity is None else each.velocity])
                for step, each in commands.items()
            },
            {step: np.array([*one.position.values(), *one.velocity.values()]) for step, one in sent.items()},
        )

    def carry_out(self, recording: Recording) -> list[int]:
        """Ask for the motions, each after the one before has begun; the steps at which they were carried out."""
        applied: dict[str, list[int]] = {name: [] for name, _ in REQUESTS}
        for plugin, fields in REQUESTS:
            ends = (f"/{plugin}",) * 2  # the topic has the name of the node
            wait_for(lambda ends=ends: recording.rests(*ends), START, f"{plugin} at rest")
            ask = rospy.ServiceProxy(f"/{plugin}/trajectory", MoveJoints)
            wait_for(lambda ask=ask, fields=fields: ask(**fields).success, START, f"{plugin} that moves")
            count = len(applied[plugin]) + 1
            wait_for(lambda ends=ends, count=count: len(recording.begins(*ends)) == count, START, f"motion of {plugin}")
            applied[plugin] = recording.begins(*ends)
        return sorted(applied["upper_body"] + applied["lower_body"])

    def compare(self, expected: dict[int, np.ndarray], measured: dict[int, np.ndarray]) -> None:
        """Both hold the same numbers at the same steps."""
        common = sorted((expected.keys() & measured.keys()) - {0})
        self.assertGreater(len(common), 300)
        self.assertEqual(common, sorted(step for step in measured if 0 < step <= max(expected)))
        for step in common:
            off = np.abs(expected[step] - measured[step])
            self.assertLess(off.max(), 1e-9, f"step {step}: {np.argwhere(off >= 1e-9).tolist()}")
        self.assertGreater(max(np.abs(measured[step] - measured[common[0]]).max() for step in common), 0.05)


if __name__ == "__main__":
    rostest.rosrun("solfer", "figure_4_lockstep", LockstepTest)
