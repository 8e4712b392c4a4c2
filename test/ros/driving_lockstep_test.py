#!/usr/bin/env python3
"""`wheeled_motion` and its odometry under ROS, in lock-step with the simulator, command what they command in memory."""

import os
import signal
import sys
import tempfile
import unittest
from contextlib import closing
from pathlib import Path

import numpy as np
import rospy
import rostest
from recording import STEP, Recording
from sent import FIELDS, Sent
from system import START, end, started, wait_for

REPOSITORY = Path(os.path.realpath(__file__)).parents[2]
sys.path.append(str(REPOSITORY / "test"))
from support.shared.driving import LAST, DrivesInMemory, write_driving  # noqa: E402

TOPICS = {
    "/position_controller/command": ("driver", "position_controller"),
    "/velocity_controller/command": ("driver", "velocity_controller"),
    "/base_odometry": ("odometry", "odometry"),
}
"""What is published: the plugin and its pipe."""


def replay(file):
    """Numbers of all pipes by step, and the joints at the end."""
    with closing(DrivesInMemory(file)) as memory:
        memory.drive()
        period = round(1.0 / (memory.set.rate * STEP))
        names = [index for index, name in enumerate(memory.names) if name[2] in FIELDS]
        return {
            1 + period * cycle: {memory.names[index]: numbers[index] for index in names}
            for cycle, numbers in enumerate(memory.sent)
        }


class DrivingLockstepTest(unittest.TestCase):
    """A robot with time that stands still before the plugins are there."""

    def test_commands_are_those_of_memory(self):
        rospy.init_node("driving_lockstep_test")
        recording, sent = Recording(()), Sent(TOPICS)
        wait_for(lambda: 0 in recording.joints, START, "joint states")
        with tempfile.TemporaryDirectory() as folder:
            file = write_driving(Path(folder))
            path = os.pathsep.join([str(REPOSITORY / "test"), os.environ.get("PYTHONPATH", "")])
            with started("rosrun", "plugins", "shared", "-n", "shared", "-c", str(file), PYTHONPATH=path) as node:
                wait_for(lambda: max(sent.on("/velocity_controller/command"), default=0) > LAST, START, "a motion")
                code, output = end(node, signal.SIGTERM)
                self.assertEqual(code, 0, output)
            self.compare(replay(file), sent)

    def compare(self, expected, sent):
        """All that was sent is what was expected, and the robot drove."""
        for topic, pipe in TOPICS.items():
            found = {step: numbers for step, numbers in sent.on(topic).items() if step <= LAST}
            self.assertGreater(len(found), 0.99 * LAST / 5)
            for step, numbers in found.items():
                wanted = {name: x for name, x in expected[step].items() if name[:2] == pipe}
                self.assertLessEqual(numbers.keys(), wanted.keys())
                self.assertLess(max(abs(wanted[name] - x) for name, x in numbers.items()), 1e-9, f"{topic}, {step}")
        for joint in ("hip_pitch_1", "knee_pitch_3", "ankle_yaw_2"):
            name = (*TOPICS["/position_controller/command"], "position", joint)
            self.assertGreater(np.ptp([numbers[name] for numbers in expected.values()]), 0.01, joint)


if __name__ == "__main__":
    rostest.rosrun("solfer", "driving_lockstep", DrivingLockstepTest)
