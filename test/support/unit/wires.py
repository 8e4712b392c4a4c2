"""Middlewares as the tests that hold for every middleware see them."""

import atexit
import functools
import itertools
import os
import tempfile
import time
from importlib.util import find_spec
from pathlib import Path

from support.bus_clock import BusClock

from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.middleware.shared_memory import Namespace, XbotMiddleware

STEP = 0.005
"""Time between two checks whether something has arrived [s]."""

PATIENCE = 60.0
"""Longest time until it has [s]."""


class Wire:
    """A node that receives, and others that publish to it.

    Attributes:
        middleware: Of the node that receives.
    """

    _count = itertools.count()

    def topic(self) -> str:
        """Return the name of a new topic."""
        return f"contract_{next(self._count)}"

    def until(self, condition) -> None:
        """Let time pass until `condition` holds."""
        end = self.middleware.now() + PATIENCE
        while not condition():
            assert self.middleware.now() < end, "it has not arrived"
            self.pass_time(STEP)

    def node(self, name):
        """Make another node."""

    def close(self) -> None:
        """Close the receiving node."""


class MemoryWire(Wire):
    """All nodes are in this process, and time is virtual."""

    def __init__(self):
        self._bus = Bus()
        self.middleware = MemoryMiddleware(self._bus, "listener")

    def say(self, sender, topic, kind, *messages) -> None:
        """Publish messages on a topic by a node of the name `sender`, one after the other."""
        writer = self.node(sender).writer(topic, kind)
        for message in messages:
            writer.write(message)

    def kill(self, sender) -> None:
        """Kill a node."""

    def node(self, name) -> MemoryMiddleware:
        """See `Wire.node`."""
        return MemoryMiddleware(self._bus, name)

    def pass_time(self, duration) -> None:
        """Let time pass [s]."""
        self._bus.run_until(self._bus.time + duration)


class XbotWire(Wire):
    """All nodes have a segment of shared memory each, and time is virtual."""

    def __init__(self):
        self._folder = tempfile.TemporaryDirectory(dir="/dev/shm")
        self.folder = Path(self._folder.name)
        self._bus, self._writers = Bus(), {}
        self.middleware = self.node("listener")

    def say(self, sender, topic, kind, *messages) -> None:
        """See `MemoryWire.say`."""
        writer = self._writers.get((sender, topic))
        if writer is None:
            writer = self._writers[sender, topic] = self.node(sender).writer(topic, kind)
        for message in messages:
            writer.write(message)

    def kill(self, sender) -> None:
        """Kill a node as by `kill -9`: the kernel releases its locks, what it had in memory stays."""
        for key in [key for key in self._writers if key[0] == sender]:
            self._writers.pop(key)._segment._lock.release()

    def pass_time(self, duration) -> None:
        """See `MemoryWire.pass_time`."""
        self._bus.run_until(self._bus.time + duration)

    def close(self) -> None:
        """See `Wire.close`."""
        self._folder.cleanup()

    def node(self, name) -> XbotMiddleware:
        """See `Wire.node`."""
        return XbotMiddleware(Namespace("contract", self.folder), name, clock=BusClock(self._bus))


@functools.cache
def ros2_middleware(name):
    """Make a node of ROS 2, once in this process: a test waits 0.1 s for each that it makes.

    Two participants of Fast DDS in one process, the second made while the first is found, miss each other's readers in
    one of some hundred pairs, for good; such a node is made anew.
    """
    from solfer.middleware.ros2 import Ros2Middleware, Ros2Node

    os.environ["ROS_DOMAIN_ID"] = str(1 + os.getpid() % 100)  # other tests on this machine stay outside
    while True:
        made = Ros2Middleware(Ros2Node(name, ["test"]))
        pairs = [pair for known in ROS2_NODES for pair in ((known, made), (made, known))]
        end = time.monotonic() + 5.0
        while time.monotonic() < end:
            if all(knows(*pair) for pair in pairs):
                ROS2_NODES.append(made)
                atexit.register(made.close)  # a thread that still spins in C++ as Python ends would abort the process
                return made
            time.sleep(STEP)
        made.close()


ROS2_NODES = []


def knows(one, other):
    """Return whether a node of ROS 2 has found another one, its publishers and its subscriptions."""
    names = (node for node, _ in one._ros.get_node_names_and_namespaces())
    return other.name.lstrip("/") in names and bool(
        one._ros.get_service_names_and_types_by_node(other.name.lstrip("/"), "/")
    )


class Ros2Wire(Wire):
    """All nodes are in this process, each with a DDS participant of its own; time is real."""

    def __init__(self):
        self.middleware = ros2_middleware("listener")
        self._senders = {}

    def say(self, sender, topic, kind, *messages) -> None:
        """See `MemoryWire.say`."""
        known = self._senders.setdefault(sender, {})
        writer = known.get(topic) or known.setdefault(topic, self.node(sender).writer(topic, kind))
        ends = [end.subscription for end in self.middleware._endpoints if end.topic == writer.topic]
        senders = self.middleware._ros.count_publishers
        self.until(lambda: writer._publisher.get_subscription_count() == len(ends))  # each end finds the other one
        self.until(lambda: all(end._subscription.handle.get_publisher_count() == senders(writer.topic) for end in ends))
        for message in messages:
            writer.write(message)

    def kill(self, sender) -> None:
        """Withdraw a node's publishers."""
        for writer in self._senders.pop(sender).values():
            writer.close()

    def node(self, name):
        """See `Wire.node`."""
        return ros2_middleware(name)

    def pass_time(self, duration) -> None:
        """See `MemoryWire.pass_time`."""
        time.sleep(duration)

    def close(self) -> None:
        """See `Wire.close`; the nodes stay for the next test."""
        for name in ("listener", "first", "second", "stranger"):
            ends = ros2_middleware(name)._endpoints
            for end in ends:
                end.close()
            ends.clear()


ROS2 = {"ros2": Ros2Wire} if find_spec("rclpy") else {}
"""Where ROS 2 is: in the environment of `./run ros2`."""
