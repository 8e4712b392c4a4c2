"""A follower of waypoints: velocities from a pose, without any transport."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from solfer.errors import SolferError

APPROACH_RATE = 1.5
"""Rate at which what is left of a way decreases near its end [1/s]."""

BRAKING_RATIO = 0.8
"""Ratio of the deceleration with which it is planned to brake to the largest one."""


@dataclass(frozen=True)
class Waypoint:
    """A place to go to.

    Attributes:
        x, y: [m].
        heading: Heading there [rad]; None: that with which the base comes.
    """

    x: float
    y: float
    heading: float | None = None

    def __post_init__(self) -> None:
        numbers = (self.x, self.y, self.heading or 0.0)
        if not all(math.isfinite(each) and abs(each) <= 1e4 for each in numbers):
            raise SolferError(f"a way-point {numbers}", expected="finite coordinates up to 10 km")

    def __str__(self) -> str:
        turned = "" if self.heading is None else f", {math.degrees(self.heading):.0f} deg"
        return f"({self.x:g}, {self.y:g}{turned})"


@dataclass(frozen=True)
class DriveLimits:
    """How fast a base is driven.

    Attributes:
        speed: [m/s].
        acceleration: [m/s2].
        turn_speed: [rad/s].
        turn_acceleration: [rad/s2].
    """

    speed: float = 0.2
    acceleration: float = 0.2
    turn_speed: float = 0.3
    turn_acceleration: float = 0.3


class WaypointFollower:
    """Drives a base that can go in all directions along a polygon of waypoints, and turns it meanwhile.

    It passes a waypoint within `PASSING_DISTANCE`, slower the more the way bends there, and comes to rest at the last
    one. Its velocities never change faster than the limits say.

    Args:
        waypoints: At least one.
        limits: How fast.

    Attributes:
        velocity: x and y in the frame of the waypoints [m/s], and rate of the heading [rad/s].
        index: Waypoint that it goes to; the number of waypoints when it has arrived.
    """

    ARRIVAL_DISTANCE = 0.01
    """Distance from the last waypoint that is near enough [m]."""

    ARRIVAL_ANGLE = 0.01
    """Difference from its heading that is near enough [rad]."""

    PASSING_DISTANCE = 0.05
    """Distance at which a waypoint on the way counts as passed [m]."""

    def __init__(self, waypoints: Sequence[Waypoint], limits: DriveLimits):
        if not waypoints:
            raise SolferError("there is no way-point", expected="at least one")
        self.waypoints = tuple(waypoints)
        self.limits = limits
        self.velocity = (0.0, 0.0, 0.0)
        self.index = 0
        places = [(each.x, each.y) for each in waypoints]
        legs = [math.dist(*pair) for pair in zip(places, places[1:], strict=False)]
        self._after = [sum(legs[index:]) for index in range(len(places))]
        self._through = [*(self._bend(places, index) for index in range(len(places) - 1)), 0.0]
        self._pose = (0.0, 0.0, 0.0)

    def step(self, pose: tuple[float, float, float], period: float, pace: float = 1.0) -> bool:
        """Compute the velocity of the next period; False when it is at rest at the last waypoint.

        Args:
            pose: x, y [m] and heading [rad] of the base.
            period: [s].
            pace: Fraction of the planned speed.
        """
        self._pose = x, y, heading = pose
        while self.index < len(self.waypoints) - 1 and self._distance(x, y) <= self.PASSING_DISTANCE:
            self.index += 1
        if self.index >= len(self.waypoints) or (self._has_arrived(x, y, heading) and not any(self.velocity)):
            self.index = len(self.waypoints)
            self.velocity = (0.0, 0.0, 0.0)
            return False
        goal = self.waypoints[self.index]
        distance = self._distance(x, y)
        limits = self.limits
        arrived = self.index == len(self.waypoints) - 1 and distance <= self.ARRIVAL_DISTANCE
        speed = 0.0 if arrived else pace * self._speed(distance)
        yaw = self._heading_error(heading)
        rate = (
            0.0
            if abs(yaw) <= self.ARRIVAL_ANGLE
            else pace * _approach(yaw, limits.turn_speed, limits.turn_acceleration)
        )
        scale = speed / distance if distance > 0.0 else 0.0
        self._change((scale * (goal.x - x), scale * (goal.y - y)), math.copysign(rate, yaw), period)
        return True

    @property
    def left(self) -> float:
        """Time that is left [s], about: path by speed, or yaw by rate, and braking."""
        if self.index >= len(self.waypoints):
            return 0.0
        x, y, heading = self._pose
        limits = self.limits
        path = self._distance(x, y) + self._after[self.index]
        yaw = abs(self._heading_error(heading))
        return max(_duration(path, limits.speed, limits.acceleration),
                   _duration(yaw, limits.turn_speed, limits.turn_acceleration))  # fmt: skip

    def stay(self, pose: tuple[float, float, float]) -> None:
        """Go to the last waypoint once more if a base that has arrived is elsewhere; see `step`."""
        x, y, heading = pose
        self.index = len(self.waypoints) - 1
        if self._distance(x, y) <= 0.02 and abs(self._heading_error(heading)) <= 0.02:  # [m, rad]
            self.index = len(self.waypoints)

    def stop(self) -> None:
        """Be at rest at once."""
        self.velocity = (0.0, 0.0, 0.0)

    def _bend(self, places: Sequence[tuple[float, float]], index: int) -> float:
        """Return the speed at which a waypoint is passed [m/s]; the direction before the first is not known."""
        if index == 0:
            return 0.0
        (x0, y0), (x1, y1), (x2, y2) = places[index - 1 : index + 2]
        lengths = math.hypot(x1 - x0, y1 - y0) * math.hypot(x2 - x1, y2 - y1)
        if not lengths:
            return 0.0
        cosine = ((x1 - x0) * (x2 - x1) + (y1 - y0) * (y2 - y1)) / lengths
        return self.limits.speed * max(0.0, cosine) ** 2

    def _distance(self, x: float, y: float) -> float:
        goal = self.waypoints[self.index]
        return math.hypot(goal.x - x, goal.y - y)

    def _speed(self, distance: float) -> float:
        """Return the speed at a distance from the next waypoint [m/s]."""
        limits = self.limits
        through = self._through[self.index]
        if self.index == len(self.waypoints) - 1:
            return _approach(distance, limits.speed, limits.acceleration)
        left = max(0.0, distance - self.PASSING_DISTANCE)
        braking = math.sqrt(through**2 + 2.0 * BRAKING_RATIO * limits.acceleration * left)
        return min(limits.speed, max(braking, APPROACH_RATE * self.PASSING_DISTANCE))

    def _heading_error(self, heading: float) -> float:
        """Return what is left to the heading of the present waypoint, or of the next one that has one [rad]."""
        desired = next((each.heading for each in self.waypoints[self.index :] if each.heading is not None), heading)
        return math.remainder(desired - heading, math.tau)

    def _has_arrived(self, x: float, y: float, heading: float) -> bool:
        last = self.index == len(self.waypoints) - 1
        return (
            last
            and self._distance(x, y) <= self.ARRIVAL_DISTANCE
            and abs(self._heading_error(heading)) <= self.ARRIVAL_ANGLE
        )

    def _change(self, desired: tuple[float, float], rate: float, period: float) -> None:
        """Let the velocity go to the desired one within the acceleration."""
        vx, vy, before = self.velocity
        change = math.hypot(desired[0] - vx, desired[1] - vy)
        most = self.limits.acceleration * period
        ratio = 1.0 if change <= most else most / change
        step = self.limits.turn_acceleration * period
        self.velocity = (
            vx + ratio * (desired[0] - vx),
            vy + ratio * (desired[1] - vy),
            before + min(max(rate - before, -step), step),
        )


def _approach(left: float, speed: float, acceleration: float) -> float:
    """Return the speed with which the end of a path can still be met."""
    left = abs(left)
    return min(speed, math.sqrt(2.0 * BRAKING_RATIO * acceleration * left), APPROACH_RATE * left)


def _duration(path: float, speed: float, acceleration: float) -> float:
    """Return the time of a path from the present speed to rest, as if it was the largest."""
    braking = speed**2 / (2.0 * acceleration)
    return (path - braking) / speed + speed / acceleration if path > braking else math.sqrt(2.0 * path / acceleration)
