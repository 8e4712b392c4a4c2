"""Waypoints, as velocities of the base or as its positions."""

import abc
import math
from collections.abc import Sequence

import numpy as np

from solfer.errors import SizeMismatch
from solfer.interfaces.support import BASE_PORT, LEAD
from solfer.interfaces.task_references import REFERENCE_MESSAGES
from solfer.numerics.planar_move import seen_from, turned
from solfer.numerics.rotations import quaternion_product
from solfer.transport import Middleware, Writer
from solfer.transport.messages import VectorMessage
from solfer.transport.topics import Topics
from solfer_tools.navigation.course import (
    CORRECTION_TIME,
    Course,
    FollowedPace,
    Localisation,
    MeasuredPose,
    heading_of,
    twist,
)
from solfer_tools.navigation.reference_course import BegunReference
from solfer_tools.navigation.waypoints import WaypointFollower


class _Drive(abc.ABC):
    """How velocities of the base reach the target."""

    writer: Writer
    ratio = 1.0
    """Ratio of the velocities with which the target goes on."""

    @abc.abstractmethod
    def awaits(self) -> str:
        """Return what is missing; empty: nothing."""

    @abc.abstractmethod
    def publish(self, velocity: tuple[float, float, float], period: float) -> None:
        """Publish velocities of a period [s], seen from the heading of the base: x, y [m/s], heading [rad/s]."""


class _Velocities(_Drive):
    """Publishes the velocities themselves."""

    def __init__(self, middleware: Middleware, name: str):
        self.writer = middleware.writer(f"{name}cmd_vel", "geometry_msgs/Twist")

    def awaits(self) -> str:
        """See `_Drive.awaits`."""
        return ""

    def publish(self, velocity: tuple[float, float, float], period: float) -> None:
        """See `_Drive.publish`."""
        self.writer.write(twist(*velocity))


class _Positions(_Drive):
    """Publishes the pose that results from the velocities, from the target's own reference on.

    It is ahead by the way of `LEAD`, as that of `ScenarioPositions`, and goes on at the pace of the target: where
    wheels turn first it waits, and still shows the direction.
    """

    def __init__(self, middleware: Middleware, name: str, writer: Writer):
        self.writer = writer
        self._begun = BegunReference(middleware, f"{name}get_reference")
        self._followed = FollowedPace(middleware, f"{name}pace")
        self._place = np.zeros(3)
        self._begin: np.ndarray | None = None
        self._yaw = self._turn = 0.0

    def awaits(self) -> str:
        """See `_Drive.awaits`.

        Raises:
            SizeMismatch: The reference is no pose.
        """
        if self._begin is None:
            values = self._begun.values(BASE_PORT)
            if isinstance(values, str):
                return values
            if len(values) != 7:
                what = f"{len(values)} numbers for '{BASE_PORT}' from {self._begun.service}"
                raise SizeMismatch(what, expected="7: position and quaternion")
            self._place = values[:3].copy()
            self._begin = values[3:]
            self._yaw = heading_of(self._begin)
        missing = self._followed.awaits()
        self.ratio = 0.0 if missing else self._followed.value
        return missing

    def publish(self, velocity: tuple[float, float, float], period: float) -> None:
        """See `_Drive.publish`."""
        if self._begin is None:
            return
        x, y, rate = velocity
        passed = period * self.ratio
        velocity_there = np.array((*turned(self._yaw + self._turn + 0.5 * passed * rate, x, y), 0.0))
        self._place += passed * velocity_there
        self._turn += passed * rate
        half = 0.5 * (self._turn + LEAD * rate)
        turn = quaternion_product(np.array((0.0, 0.0, math.sin(half), math.cos(half))), self._begin)
        self.writer.write(VectorMessage("world", np.concatenate((self._place + LEAD * velocity_there, turn))))


class WaypointCourse(Course):
    """Follows waypoints with velocities seen from the heading of the base.

    They are published as the positions that result from them where the target receives these: on `base`, the pipe of a
    module that drives, or on `base/reference`, that of a task of `inverse_kinematics`; else on `cmd_vel`.

    It ends where the base has come to rest at the last one: a base that lags behind its velocities, as just after its
    start, rolls on and is sent back. In a map it stays until the corrections of the localisation have been followed.

    Args:
        middleware: Carries all of it.
        follower: The law.
        target: Namespace of the topics.
        odometry: Topic of the odometry.
        localisation: Where its frame is in that of the waypoints; None: they are the same.
        positions: Whether positions are published, or velocities; None: what the target receives, positions first.
    """

    def __init__(
        self,
        middleware: Middleware,
        follower: WaypointFollower,
        target: str,
        odometry: str,
        localisation: Localisation | None = None,
        *,
        positions: bool | None = None,
    ):
        self._follower = follower
        self._pose = MeasuredPose(middleware, odometry, localisation)
        self._settles = 0.0 if localisation is None else CORRECTION_TIME
        self._rested = 0.0
        name = f"{target}/" if target else ""
        self._drives: list[_Drive] = []
        if positions is not False:
            poses = (
                middleware.writer(f"{name}{BASE_PORT}", "geometry_msgs/PoseStamped"),
                middleware.declared_writer(f"{name}{BASE_PORT}/reference", REFERENCE_MESSAGES["pose"][0]),
            )
            self._drives.extend(_Positions(middleware, name, writer) for writer in poses)
        if not positions:
            self._drives.append(_Velocities(middleware, name))
        self._drive = self._drives[0]
        self.writers = tuple(each.writer for each in self._drives)
        self.count = len(follower.waypoints)

    def unreceived(self, topics: Topics) -> Sequence[Writer]:
        """See `Course.unreceived`; the first drive that is received is that of the course.

        A target's topics begin one after the other: this is asked again until all connections have settled.
        """
        for each in self._drives:
            if topics.missing_subscriber(each.writer.topic, each.writer.carries) is None:
                self._drive = each
                return ()
        return self.writers

    def awaits(self) -> str:
        """See `Course.awaits`; without odometry the base stops.

        Raises:
            SizeMismatch: The target's reference is no pose.
        """
        missing = self._pose.awaits() or self._drive.awaits()
        self.ratio = self._drive.ratio
        if missing:
            self._follower.stop()
        return missing

    def step(self, period: float, pace: float) -> bool:
        """See `Course.step`."""
        pose = self._pose
        follower = self._follower
        place = pose.x, pose.y, pose.heading
        moves = follower.step(place, period, pace)
        self._rested = 0.0 if moves else self._rested + period
        x, y, rate = follower.velocity
        self._drive.publish((*seen_from(pose.heading, x, y), rate), period)
        if moves:
            return True
        if self._rested >= self._settles and pose.still >= 0.3:
            return False
        follower.stay(place)
        return True

    def rest(self) -> None:
        """See `Course.rest`."""
        self._follower.stop()
        self._drive.publish((0.0, 0.0, 0.0), 0.0)

    @property
    def number(self) -> int:
        """See `Course.number`."""
        return min(self._follower.index + 1, self.count)

    @property
    def name(self) -> str:
        """See `Course.name`."""
        return f"way-point {self._follower.waypoints[self.number - 1]}"

    @property
    def left(self) -> float:
        """See `Course.left`."""
        return self._follower.left
