#!/usr/bin/env python3
"""Nodes that stand still for a while in a motion, or are killed: nothing moves without a command.

Joints move at 0.5 rad/s, wheels turn at 1 rad/s. `breaking.bounds` has the limits of what may follow.
"""

import contextlib
import sys
import tempfile
import unittest
from collections.abc import Callable, Iterable
from pathlib import Path

import rospy
import rostest
from system import SOAKS, soak

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from breaking.figures import ros_alone, ros_figure_4  # noqa: E402
from breaking.systems import System  # noqa: E402
from breaking.trial import Fault, Plan, Trial  # noqa: E402

GAP, TIMEOUT, LONG = 0.25, 0.35, 3.0
"""For how long a process stands still: shorter than all timeouts, longer than the shortest, than all [s]."""


class StopsTest(unittest.TestCase):
    """Each test has a system of its own; a soak breaks more of it."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("tests")

    def check(self, make: Callable[[Path], System], faults: Iterable[Fault]) -> None:
        """Break processes of a system, one after the other."""
        with tempfile.TemporaryDirectory() as folder, contextlib.closing(make(Path(folder))) as system:
            system.start()
            for fault in faults:
                self.assertEqual(Trial(system, Plan((fault,))).run().findings, [], fault)

    def test_a_plugin_alone(self):
        stops = [Fault("stop", "joint_states", duration) for duration in ((GAP, TIMEOUT, LONG) if SOAKS else (LONG,))]
        self.check(ros_alone, [*stops, Fault("kill", "joint_states")])

    @soak
    def test_plugins_of_which_one_merges(self):
        often = {
            "upper_body": (TIMEOUT, LONG),
            "lower_body": (TIMEOUT,),
            "whole_body": (GAP, LONG),
            "simulator": (0.2, LONG),
        }
        self.check(ros_figure_4, [Fault("stop", victim, each) for victim in often for each in often[victim]])


if __name__ == "__main__":
    rostest.rosrun("solfer", "stops", StopsTest)
