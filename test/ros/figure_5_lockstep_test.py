#!/usr/bin/env python3
"""Fig. 5 on the course of the demonstration: nodes in lock-step send what the same plugins send in memory."""

import os
import sys
import unittest
from contextlib import closing
from pathlib import Path

import numpy as np
import rospy
import rostest
from recording import QUEUE, STEP, step_of
from system import START, wait_for

from solfer.middleware.ros import RosMiddleware, RosNode
from solfer.msg import JointCommand
from solfer.transport.fixed_rate import FixedRateLoop

REPOSITORY = Path(os.path.realpath(__file__)).parents[2]
sys.path.append(str(REPOSITORY / "test"))
from support.paper.one_schedule import (  # noqa: E402
    COURSE_RATE,
    FIELDS,
    PLUGINS_RATE,
    Outside,
    ScheduledNodes,
    check_equal,
)

DURATION = float(os.environ.get("SOLFER_FIGURE_5_SECONDS", "4"))
"""Simulated time that is compared [s]."""

CONTROLLERS = ("position_controller", "velocity_controller")


class SentToLowerLevel:
    """What was sent to the lower level: by step, its numbers by controller, field and joint."""

    def __init__(self):
        self._numbers = {name: {} for name in CONTROLLERS}
        for name in CONTROLLERS:
            rospy.Subscriber(f"/{name}/command", JointCommand, self._receive, name, QUEUE, tcp_nodelay=True)

    def _receive(self, message, controller):
        self._numbers[controller][step_of(message.header.stamp)] = {
            (controller, field, name): value
            for field in FIELDS
            for name, value in zip(message.name, getattr(message, field), strict=False)
        }

    def at(self, step):
        """Return the numbers of a step; None: not all have come."""
        found = [numbers.get(step) for numbers in self._numbers.values()]
        return {key: value for each in found for key, value in each.items()} if all(found) else None


class Figure5LockstepTest(unittest.TestCase):
    """The test is one of the nodes that time waits for."""

    def test_nodes_send_what_memory_sends(self):
        """The transport must not change the control: every command of the course is compared, step by step."""
        with closing(RosMiddleware(RosNode("driver", sys.argv))) as middleware:
            sent, outside = SentToLowerLevel(), Outside(middleware)
            FixedRateLoop(middleware, COURSE_RATE).run(
                outside.cycle, lambda: middleware.running() and middleware.now() < DURATION
            )
            cycles = round(DURATION * PLUGINS_RATE)
            steps = [1 + round(cycle / PLUGINS_RATE / STEP) for cycle in range(cycles)]
            wait_for(lambda: sent.at(steps[-1]) is not None, START, "the last commands")
            rows = [sent.at(step) for step in steps]
        with closing(ScheduledNodes().play(DURATION)) as memory:
            self.assertGreater(outside.navigation.elapsed, 0.5 * DURATION)
            self.assertEqual(rows[-1].keys(), set(memory.names))
            begin = next(index for index, row in enumerate(rows) if row is not None)
            self.assertLess(begin, 5)  # its joints are asked for before it sends anything
            found = np.array([[row[name] for name in memory.names] for row in rows[begin:]])
            check_equal(found, np.array(memory.sent[begin:cycles]))
            self.assertGreater(np.ptp(found, axis=0).max(), 1.0)


if __name__ == "__main__":
    rostest.rosrun("solfer", "figure_5_lockstep", Figure5LockstepTest)
