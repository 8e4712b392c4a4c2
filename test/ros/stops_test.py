#!/usr/bin/env python3
"""Nodes that stand still for a while in a motion: nothing moves without a command.

Joints move at 0.5 rad/s, wheels turn at 1 rad/s. `breaking.bounds` has the limits of what may follow.
"""

import contextlib
import sys
import tempfile
import unittest
from collections.abc import Callable
from pathlib import Path

import rospy
import rostest
from system import SOAKS, soak

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from breaking.figures import ros_alone, ros_figure_4  # noqa: E402
from breaking.systems import System  # noqa: E402
from breaking.trial import Fault, Plan, Trial  # noqa: E402

GAP, TIMEOUT, LONG = 0.08, 0.35, 3.0
"""For how long a process stands still: shorter than all timeouts, longer than the shortest, than all [s]."""


class StopsTest(unittest.TestCase):
    """Each test has a system of its own; a soak breaks more of it."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("stops_test")

    def check(self, make: Callable[[Path], System], **stops: tuple[float, ...]) -> None:
        """Stop processes of a system, one after the other."""
        with tempfile.TemporaryDirectory() as folder, contextlib.closing(make(Path(folder))) as system:
            system.start()
            for victim, durations in stops.items():
                for duration in durations:
                    verdict = Trial(system, Plan((Fault("stop", victim, duration),))).run()
                    self.assertEqual(verdict.complaints, [], f"{victim} stands still for {duration:g} s")

    def test_a_plugin_alone(self):
        self.check(ros_alone, joint_states=(GAP, TIMEOUT, LONG) if SOAKS else (LONG,))

    @soak
    def test_plugins_of_which_one_merges(self):
        often = {
            "upper_body": (TIMEOUT, LONG),
            "lower_body": (TIMEOUT,),
            "whole_body": (GAP, LONG),
            "simulator": (0.2, LONG),
        }
        self.check(ros_figure_4, **(often if SOAKS else {"upper_body": (TIMEOUT,), "whole_body": (LONG,)}))


if __name__ == "__main__":
    rostest.rosrun("solfer", "stops", StopsTest)
