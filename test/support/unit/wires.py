"""Middlewares as the tests that hold for every middleware see them."""

import itertools
import tempfile
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
