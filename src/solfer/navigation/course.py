"""What a navigation can be doing."""

import abc
import math
from collections.abc import Sequence

from solfer.transport import BodyMessage, Middleware, Reader, Writer

STALE = 0.5
"""Age from which on odometry does not count [s]."""


class Course(abc.ABC):
    """A motion that a navigation publishes, period by period.

    Attributes:
        writers: Where it is published; each needs a subscriber before it begins.
        count: How many steps or way-points there are.
    """

    writers: Sequence[Writer] = ()
    count: int = 0

    @abc.abstractmethod
    def awaits(self) -> str:
        """Return what is missing at present, so that the motion has to stand still; empty: nothing."""

    @abc.abstractmethod
    def step(self, period: float, pace: float) -> bool:
        """Publish the motion of the next period at a pace: 1 as planned, 0 at rest. False at its end.

        Raises:
            SolferError: It cannot go on.
        """

    @abc.abstractmethod
    def rest(self) -> None:
        """Publish that nothing is to move."""

    @property
    @abc.abstractmethod
    def number(self) -> int:
        """Number of the present step or way-point, from 1; 0 before the first."""

    @property
    @abc.abstractmethod
    def name(self) -> str:
        """What it is."""

    @property
    @abc.abstractmethod
    def left(self) -> float:
        """Time that is left [s]."""


class MeasuredPose:
    """Where the base is, as odometry says.

    Args:
        middleware: Carries it.
        topic: Its topic.

    Attributes:
        x, y: [m].
        heading: [rad], continuous.
    """

    def __init__(self, middleware: Middleware, topic: str):
        self._reader: Reader = middleware.reader(topic, "nav_msgs/Odometry")
        self.x = self.y = self.heading = 0.0

    def awaits(self) -> str:
        """Read the newest message; returns what is missing."""
        self._reader.read()
        if self._reader.age() > STALE:
            return f"odometry on {self._reader.topic}"
        message: BodyMessage = self._reader.message
        x, y, z, w = message.orientation
        heading = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
        if not math.isfinite(heading + message.position[0] + message.position[1]):
            return f"finite numbers on {self._reader.topic}"
        self.x, self.y = float(message.position[0]), float(message.position[1])
        self.heading += math.remainder(heading - self.heading, math.tau)
        return ""
