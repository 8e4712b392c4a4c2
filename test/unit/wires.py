"""The memory middleware as the tests that hold for every middleware see it."""

import itertools

from solfer.middleware.memory import Bus, MemoryMiddleware

STEP = 0.005
"""Time between two looks whether something has arrived [s]."""

PATIENCE = 30.0
"""Longest time until it has [s]."""


class Wire:
    """A node that listens, and others that speak to it.

    Attributes:
        middleware: Of the node that listens.
    """

    _count = itertools.count()

    def topic(self) -> str:
        """Name of a topic that nobody has used."""
        return f"contract_{next(self._count)}"

    def until(self, condition) -> None:
        """Let time pass until `condition` holds."""
        end = self.middleware.now() + PATIENCE
        while not condition():
            assert self.middleware.now() < end, "it has not arrived"
            self.pass_time(STEP)


class MemoryWire(Wire):
    """All nodes are in this process, and time is virtual."""

    def __init__(self):
        self._bus = Bus()
        self.middleware = MemoryMiddleware(self._bus, "listener")

    def say(self, sender, topic, kind, *messages) -> None:
        """A node of the name `sender` sends messages on a topic, one after the other."""
        writer = MemoryMiddleware(self._bus, sender).writer(topic, kind)
        for message in messages:
            writer.write(message)

    def kill(self, sender) -> None:
        """A node ends without a goodbye."""

    def pass_time(self, duration) -> None:
        """Let time pass [s]."""
        self._bus.run_until(self._bus.time + duration)
