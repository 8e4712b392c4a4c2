"""Checks a trajectory whole, before any joint moves."""

from collections.abc import Sequence

import numpy as np

from solfer.errors import ComponentError, NotFinite, SizeMismatch, UnknownName
from solfer.interfaces.trajectories import JointTolerance, JointTrajectory, TrajectoryPoint
from solfer.numerics.rotations import whole_revolutions
from solfer.numerics.via_points import ViaPoints


class StaleTrajectory(ComponentError):
    """A trajectory whose last point has passed already, elsewhere than where the joints are."""


class TrajectoryCheck:
    """Makes motions of trajectories that are right in every part.

    Args:
        joints: Names of the joints that may be moved.
        lower: Their lower limits of position, shape (n,) [rad, m].
        upper: Their upper limits.
        speed: Their velocity limits [rad/s, m/s].
        turns: Revolution of those that are continuous, 0 of the others [rad].
    """

    _SLACK = 1e-6
    """Slack of limits, for numbers that were printed and read again."""

    def __init__(
        self, joints: Sequence[str], lower: np.ndarray, upper: np.ndarray, speed: np.ndarray, turns: np.ndarray
    ):
        self._joints = tuple(joints)
        self._place = {name: index for index, name in enumerate(joints)}
        self._lower = lower
        self._upper = upper
        self._speed = speed
        self._turns = turns

    def places(self, names: Sequence[str]) -> np.ndarray:
        """Find the joints of a trajectory, shape (m,).

        Raises:
            UnknownName: One is not among the joints that may be moved.
            ComponentError: None is given, or one twice.
        """
        for name in names:
            if name not in self._place:
                raise UnknownName("joint", name, self._place)
            if names.count(name) > 1:
                raise ComponentError(f"joint '{name}' is given twice", expected="each joint once")
        if not names:
            raise ComponentError("a trajectory names no joint", expected="the joints that its points move")
        return np.array([self._place[name] for name in names])

    def elapsed(self, trajectory: JointTrajectory, now: float) -> float:
        """Return the time `now` since the stamp of a trajectory [s]; below zero: it is in the future.

        Raises:
            ComponentError: It is too far in the future, or no number.
        """
        stamp = trajectory.header.stamp
        elapsed = now - stamp if stamp else 0.0
        longest_wait = 60.0  # [s]; a later one has a stamp of another clock
        if not elapsed >= -longest_wait:
            raise ComponentError(
                f"the trajectory is stamped {stamp:.3f} s, and now it is {now:.3f} s",
                expected=f"a stamp by this clock, at most {longest_wait:g} s ahead, or 0",
            )
        return elapsed

    def motion(
        self,
        trajectory: JointTrajectory,
        places: np.ndarray,
        start: np.ndarray,
        velocity: np.ndarray,
        measured: np.ndarray,
        *,
        elapsed: float,
    ) -> ViaPoints:
        """Make the motion of a trajectory from the state in which it begins; points that have passed are left out.

        The whole trajectory of a continuous joint is on the revolution on which its first point that is left is nearest
        to where the joint is desired, as in ros_control's joint_trajectory_controller. If all points have passed, and
        joints at rest are at the last one, they stay where they are desired.

        Args:
            trajectory: The trajectory, with points.
            places: Its joints, see `places`.
            start: Where they are desired then, shape (m,) [rad, m].
            velocity: How fast, shape (m,) [rad/s, m/s].
            measured: Where they are, shape (m,) [rad, m].
            elapsed: Time from its stamp until then [s].

        Raises:
            SizeMismatch: The numbers of joints and values differ.
            NotFinite: A number is NaN or infinite.
            StaleTrajectory: All points have passed, and the joints are not at the last one.
            ComponentError: The times do not increase, the joints do not come to rest, or a limit is exceeded.
        """
        times = self._times(trajectory.points)
        if any(any(point.effort) for point in trajectory.points):
            raise ComponentError("points with efforts", expected="positions, velocities and accelerations: no effort")
        rows = [self._row(trajectory, kind) for kind in ("positions", "velocities", "accelerations")]
        left = times > elapsed
        if rows[0] is not None:
            first = rows[0][int(left.argmax())] if left.any() else rows[0][-1]
            rows[0] += whole_revolutions(start - first, self._turns[places])
        if not left.any():
            last = rows[0]
            reached = last is not None and np.abs(last[-1] - measured).max() <= 1e-2  # [rad, m]
            if not reached or np.abs(velocity).max() > self._SLACK:
                raise StaleTrajectory(
                    f"the last point of the trajectory was to be reached {elapsed - times[-1]:.3g} s ago",
                    expected="a point in the future, or joints that are there already, at rest",
                )
            return ViaPoints(np.array([elapsed, elapsed + 1e-3]), np.vstack([start, start]))
        starts = (start, velocity, np.zeros_like(start))
        positions, velocities, accelerations = (
            None if row is None else np.vstack([first, row[left]]) for row, first in zip(rows, starts, strict=True)
        )
        if positions is None or (velocities is None and accelerations is not None):
            raise ComponentError(
                "points without positions, or with accelerations and without velocities",
                expected="positions; with velocities; with both and accelerations",
            )
        if velocities is not None and np.abs(velocities[-1]).max() > self._SLACK:
            index = int(np.abs(velocities[-1]).argmax())
            raise ComponentError(
                f"joint '{trajectory.joint_names[index]}' moves at {velocities[-1, index]:.6g} rad/s at the last point",
                expected="joints that come to rest: no velocity there",
            )
        motion = ViaPoints(np.append(elapsed, times[left]), positions, velocities, accelerations=accelerations)
        self._require_limits(motion, places, start)
        return motion

    def tolerances(self, given: Sequence[JointTolerance], names: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
        """Return tolerances of position and velocity of the joints of a trajectory, shape (m,) each; inf: none.

        Raises:
            UnknownName: One is for a joint that the trajectory does not move.
            NotFinite: One is no number.
            ComponentError: One is below zero, but not -1, or for an acceleration.
        """
        position = np.full(len(names), np.inf)
        velocity = np.full(len(names), np.inf)
        for each in given:
            if each.name not in names:
                raise UnknownName("joint", each.name, names)
            if each.acceleration not in (0.0, -1.0):
                raise ComponentError(
                    f"a tolerance for the acceleration of joint '{each.name}', which is not measured",
                    expected="0 or -1",
                )
            for target, value in ((position, each.position), (velocity, each.velocity)):
                if not np.isfinite(value):
                    raise NotFinite(f"tolerance of joint '{each.name}' is not a finite number")
                if value < 0.0 and value != -1.0:
                    raise ComponentError(f"tolerance {value:.6g} of joint '{each.name}'", expected="0, -1 or positive")
                if value > 0.0:
                    target[names.index(each.name)] = value
        return position, velocity

    @staticmethod
    def _times(points: Sequence[TrajectoryPoint]) -> np.ndarray:
        largest = 1000  # checking more would take too long between two cycles
        if len(points) > largest:
            raise ComponentError(f"a trajectory of {len(points)} points", expected=f"{largest} at most")
        times = np.array([point.time_from_start for point in points], dtype=float)
        if not np.isfinite(times).all():
            raise NotFinite("a time of the trajectory is not a finite number")
        wrong = np.flatnonzero(np.diff(times, prepend=-1.0) <= 0.0)
        if times[0] < 0.0 or wrong.size:
            index = int(wrong[0]) if wrong.size else 0
            raise ComponentError(
                f"point {index + 1} of the trajectory is at {times[index]:.6g} s",
                expected="times that increase, from 0 s",
            )
        return times

    @staticmethod
    def _row(trajectory: JointTrajectory, kind: str) -> np.ndarray | None:
        """Return one kind of numbers of all points, shape (points, joints); None: they are not given."""
        given = [getattr(point, kind) for point in trajectory.points]
        names = trajectory.joint_names
        if not any(given):
            return None
        for index, values in enumerate(given):
            if len(values) != len(names):
                raise SizeMismatch(
                    f"{len(values)} {kind} for {len(names)} joints at point {index + 1} of the trajectory",
                    expected="one for each joint, at all points or at none",
                )
        rows = np.array(given, dtype=float)
        if not np.isfinite(rows).all():
            index, joint = np.argwhere(~np.isfinite(rows))[0]
            raise NotFinite(f"{kind} of joint '{names[joint]}' at point {index + 1} is not a finite number")
        return rows

    def _require_limits(self, motion: ViaPoints, places: np.ndarray, start: np.ndarray) -> None:
        """Check positions and speeds of the whole motion; a joint that is beyond a limit already may come back."""
        lowest, highest, fastest = motion.extremes()
        lower = np.minimum(self._lower[places], start)
        upper = np.maximum(self._upper[places], start)
        slack = self._SLACK
        for what, values, within in (
            ("position {:.6g} rad", lowest, lowest >= lower - slack),
            ("position {:.6g} rad", highest, highest <= upper + slack),
            ("speed {:.6g} rad/s", fastest, fastest <= self._speed[places] * (1.0 + slack)),
        ):
            for index in np.flatnonzero(~within):
                place = places[index]
                raise ComponentError(
                    f"{what.format(values[index])} of a trajectory is beyond the limits of joint "
                    f"'{self._joints[place]}'",
                    expected=f"at most {self._speed[place]:.6g} rad/s"
                    if values is fastest
                    else f"{self._lower[place]:.6g} to {self._upper[place]:.6g} rad",
                )
