"""What a navigation can be doing."""

import abc
import math
from collections.abc import Sequence

from solfer.transport import BodyMessage, Middleware, Reader, Writer
from solfer.transport.endpoints import MessageStatus
from solfer.transport.messages import FieldsMessage

STALE = 0.5
"""Age from which on odometry does not count [s]."""

SILENT = 0.3
"""Age from which on the pace does not count [s]: the lower level has brought the robot to rest by then."""


class Course(abc.ABC):
    """A motion that a navigation publishes, period by period.

    Attributes:
        writers: Where it is published; each needs a subscriber before it begins.
        count: How many steps or way-points there are.
        share: Share of what is published with which the robot goes on, and with it the clock of the motion.
        most: Largest pace that it can go on at.
    """

    writers: Sequence[Writer] = ()
    count: int = 0
    share: float = 1.0
    most: float = 1.0

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


class FollowedPace:
    """With which share of the velocities that it gets a module goes on, as it publishes that.

    Args:
        middleware: Carries it.
        topic: Its topic.

    Attributes:
        value: From 0 to 1; 1 for a module that publishes none.
        topic: Its topic.
    """

    def __init__(self, middleware: Middleware, topic: str):
        self._reader: Reader = middleware.reader(topic, "std_msgs/Float64")
        self.value, self.topic, self._is_known = 1.0, topic, False

    def awaits(self) -> str:
        """Read the newest message; returns what is missing of a module that has published its pace before."""
        if self._reader.read() is MessageStatus.NEW:
            self._is_known = True
        if not self._is_known:
            return ""
        if self._reader.age() > SILENT:
            return f"the pace on {self.topic}"
        message: FieldsMessage = self._reader.message
        pace = float(message.fields["data"])
        if not math.isfinite(pace):
            return f"finite numbers on {self.topic}"
        self.value = min(max(pace, 0.0), 1.0)
        return ""
