"""What a navigation can be doing."""

import abc
import math
from collections.abc import Sequence
from typing import Protocol

import numpy as np

from solfer.numerics.planar_move import turned
from solfer.transport import BodyMessage, Middleware, Reader, Writer
from solfer.transport.endpoints import MessageStatus
from solfer.transport.messages import FieldsMessage
from solfer.transport.topics import Topics

STALE_AGE = 0.5
"""Age from which on what is measured does not count [s]."""

CORRECTION_TIME = 5.0
"""Time constant with which corrections of a localisation are followed [s]."""


class Course(abc.ABC):
    """A motion that a navigation publishes, period by period.

    Attributes:
        writers: Where it is published; each needs a subscriber before it begins, see `unreceived`.
        count: How many steps or waypoints there are.
        ratio: Ratio of the robot's pace, and with it that of the motion's clock, to the published one.
        max_pace: Largest pace that it can go on at.
        has_dialogue: Whether others answer it before it begins.
    """

    has_dialogue = False

    writers: Sequence[Writer] = ()
    count: int = 0
    ratio: float = 1.0
    max_pace: float = 1.0

    def unreceived(self, topics: Topics) -> Sequence[Writer]:
        """Return writers of which one still needs a subscriber, so that it cannot begin; none: it can."""
        return [each for each in self.writers if topics.missing_subscriber(each.topic, each.carries)][:1]

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
        """Number of the present step or waypoint, from 1; 0 before the first."""

    @property
    @abc.abstractmethod
    def name(self) -> str:
        """What it is."""

    @property
    @abc.abstractmethod
    def left(self) -> float:
        """Time that is left [s]."""


class Localisation(Protocol):
    """Corrects the drift of an odometry: it knows where the frame of the odometry is in that of a map (REP 105)."""

    def locate(self, frame: str) -> tuple[float, float, float] | str:
        """Return place x, y [m] and heading [rad] of the odometry's `frame` in the map, or what is missing."""


class MeasuredPose:
    """Where the base is, as odometry measures it.

    In the frame of a map it is predicted by the odometry, and corrected by the localisation: by the mean at first, then
    with the time constant `CORRECTION_TIME`. What drives would otherwise run after each of its jumps.

    Args:
        middleware: Carries it.
        topic: Its topic.
        localisation: Gives the pose in the frame of a map; None: it is in the frame of the odometry.

    Attributes:
        x, y: [m].
        z: Height in the frame of the odometry [m].
        heading: [rad], continuous.
        still: Time for which the odometry has stayed within 5 mm and 5 mrad [s].
    """

    def __init__(self, middleware: Middleware, topic: str, localisation: Localisation | None = None):
        self._reader: Reader = middleware.reader(topic, "nav_msgs/Odometry")
        self._now = middleware.now
        self._localisation = localisation
        self.x = self.y = self.z = self.heading = self.still = 0.0
        self._stood = (math.inf, math.inf, math.inf)
        self._stood_since = 0.0
        self._before = 0.0, 0.0, 0.0
        self._located_at: float | None = None
        self._age = 0.0

    def awaits(self) -> str:
        """Read the newest message; returns what is missing."""
        self._reader.read()
        if self._reader.age() > STALE_AGE:
            return f"odometry on {self._reader.topic}"
        message: BodyMessage = self._reader.message
        heading = heading_of(message.orientation)
        x, y, z = message.position.tolist()
        if not math.isfinite(heading + x + y + z):
            return f"finite numbers on {self._reader.topic}"
        self.z = z
        self._measure_rest((x, y, heading))
        if self._localisation is None:
            self._move_to(x, y, heading)
            return ""
        located = self._localisation.locate(message.frame)
        if isinstance(located, str):
            return located
        self._predict(x, y, heading)
        self._correct(x, y, heading, located=located)
        return ""

    def _measure_rest(self, place: tuple[float, float, float]) -> None:
        now = self._now()
        if max(abs(new - old) for new, old in zip(place, self._stood, strict=True)) > 0.005:
            self._stood = place
            self._stood_since = now
        self.still = now - self._stood_since

    def _move_to(self, x: float, y: float, heading: float) -> None:
        self.x = x
        self.y = y
        self.heading += math.remainder(heading - self.heading, math.tau)

    def _predict(self, x: float, y: float, heading: float) -> None:
        """Move as the base has moved in the frame of the odometry since the message before."""
        x0, y0, heading0 = self._before
        self._before = x, y, heading
        yaw = self.heading - heading0
        dx, dy = turned(yaw, x - x0, y - y0)
        self._move_to(self.x + dx, self.y + dy, heading + yaw)

    def _correct(self, x: float, y: float, heading: float, located: tuple[float, float, float]) -> None:
        """Approach the pose in the map, or take it where it is too far away for noise."""
        x0, y0, yaw = located
        dx, dy = turned(yaw, x, y)
        dx += x0 - self.x
        dy += y0 - self.y
        left = math.remainder(heading + yaw - self.heading, math.tau)
        now = self._now()
        passed = 0.0 if self._located_at is None else min(max(now - self._located_at, 0.0), CORRECTION_TIME)
        self._located_at = now
        self._age = min(self._age + passed, CORRECTION_TIME)
        if math.hypot(dx, dy) > 0.5 or abs(left) > 0.5:  # [m, rad]: it is elsewhere, and not located more precisely
            self._age = 0.0
        ratio = passed / self._age if self._age else 1.0
        self._move_to(self.x + ratio * dx, self.y + ratio * dy, self.heading + ratio * left)


def heading_of(quaternion: np.ndarray) -> float:
    """Return the heading of a Hamilton quaternion (x, y, z, w) [rad]."""
    x, y, z, w = quaternion
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def twist(x: float, y: float, rate: float) -> FieldsMessage:
    """Make the message of velocities x and y [m/s] and a rate of the heading [rad/s]."""
    return FieldsMessage({"linear": {"x": x, "y": y, "z": 0.0}, "angular": {"x": 0.0, "y": 0.0, "z": rate}})


class FollowedPace:
    """The ratio of a module's pace to the velocities that it gets, as it publishes that.

    Args:
        middleware: Carries it.
        topic: Its topic.

    Attributes:
        value: From 0 to 1; 1 for a module that publishes none.
        topic: Its topic.
    """

    def __init__(self, middleware: Middleware, topic: str):
        self._reader: Reader = middleware.reader(topic, "std_msgs/Float64")
        self.value = 1.0
        self.topic = topic
        self._is_known = False

    def awaits(self) -> str:
        """Read the newest message; returns what is missing of a module that has published its pace before."""
        if self._reader.read() is MessageStatus.NEW:
            self._is_known = True
        if not self._is_known:
            return ""
        if self._reader.age() > 0.3:  # the lower level has brought the robot to rest by then
            return f"the pace on {self.topic}"
        message: FieldsMessage = self._reader.message
        pace = float(message.fields["data"])
        if not math.isfinite(pace):
            return f"finite numbers on {self.topic}"
        self.value = min(max(pace, 0.0), 1.0)
        return ""
