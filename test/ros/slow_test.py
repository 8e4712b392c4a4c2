#!/usr/bin/env python3
"""A subscriber that hangs, and one that died: the simulator goes on, and all others receive everything."""

import os
import signal
import sys
import unittest
import xmlrpc.client
from collections.abc import Iterator

import rosgraph
import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticArray
from sensor_msgs.msg import JointState
from system import START, soak, started, wait_for

LISTENER = """
import rospy
from sensor_msgs.msg import JointState
rospy.init_node("listener")
rospy.Subscriber("/joint_states", JointState, lambda message: print(message.header.seq, flush=True))
rospy.spin()
"""
FULL = 60.0
"""Longest time until the buffers of a connection without a reader are full [s]."""


def sent() -> dict[int, int]:
    """Bytes that the simulator sent to each subscriber of the joint states, by connection."""
    uri = rosgraph.Master("/slow_test").lookupNode("/simulator")
    (publishers, *_) = xmlrpc.client.ServerProxy(uri).getBusStats("/slow_test")[2]
    connections = next(stats for topic, _, stats in publishers if topic == "/joint_states")
    return {connection: count for connection, count, *_ in connections}


def numbers(stream) -> Iterator[int]:
    """Numbers of the messages that the listener received."""
    return (int(line) for line in stream if line.strip().isdigit())


class SlowTest(unittest.TestCase):
    """A robot that publishes its joint states 1000 times in a simulated second."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("slow_test")
        cls.received, cls.states = [], []
        rospy.Subscriber("/joint_states", JointState, cls.received.append, queue_size=10_000, tcp_nodelay=True)
        rospy.Subscriber(
            "/diagnostics",
            DiagnosticArray,
            lambda message: cls.states.extend(
                status for status in message.status if status.name.startswith("manipulation:")
            ),
        )
        wait_for(cls.runs, START, "a plugin that runs")

    @classmethod
    def runs(cls, begin: int = 0) -> bool:
        """Return whether a plugin has reported that it runs, since so many reports, if too slowly for its robot."""
        # of what is too slow the health is `running; overloaded: ...`, or `running; behind: ...`
        return any(status.message.startswith("running") for status in cls.states[begin:])

    def receive(self, count: int) -> list[int]:
        """Numbers of the next `count` joint states."""
        begin = len(self.received)
        wait_for(lambda: len(self.received) >= begin + count, START, "joint states")
        return [message.header.seq for message in list(self.received)[begin : begin + count]]

    def test_a_hanging_subscriber_later_gets_the_newest(self):
        """While one connection is full the others miss no message; the hanging one then skips ahead, in order."""
        with started(sys.executable, "-c", LISTENER) as listener:
            first = next(numbers(listener.stdout))
            os.kill(listener.pid, signal.SIGSTOP)
            before, blocked = sent(), []

            def full() -> bool:
                """Return whether the system accepts nothing more for one connection while it does for others."""
                nonlocal before
                self.receive(1000)
                now = sent()
                blocked[:] = [connection for connection, count in now.items() if before.get(connection) == count]
                before = now
                return bool(blocked)

            try:
                wait_for(full, FULL, "a connection that accepts nothing more")
                self.assertEqual(len(blocked), 1)
                begin = len(self.states)
                received = self.receive(1500)
                self.assertEqual(received, list(range(received[0], received[0] + 1500)))
                # it may have been late for once, and reports that
                wait_for(lambda: self.runs(begin), START, "a plugin that runs")
            finally:
                os.kill(listener.pid, signal.SIGCONT)
            late = numbers(listener.stdout)
            last, skipped = first, False
            while last < received[-1]:
                number = next(late)
                self.assertGreater(number, last)
                skipped, last = skipped or number > last + 1, number
            self.assertTrue(skipped)

    @soak
    def test_a_dead_subscriber_is_forgotten(self):
        with started(sys.executable, "-c", LISTENER) as listener:
            next(numbers(listener.stdout))
            before = len(sent())
            listener.kill()
            wait_for(lambda: len(sent()) < before, START, "a connection that is given up")
        received = self.receive(1000)
        self.assertEqual(received, list(range(received[0], received[0] + 1000)))


if __name__ == "__main__":
    rostest.rosrun("solfer", "slow", SlowTest)
