"""Moves joints along trajectories, one after the other, and supervises the goal of an action that requested one."""

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from solfer.components.trajectories.check import TrajectoryCheck
from solfer.errors import ComponentError
from solfer.interfaces.declaration import Outcome
from solfer.interfaces.trajectories import (
    GOAL_TOLERANCE_VIOLATED,
    INVALID_GOAL,
    PATH_TOLERANCE_VIOLATED,
    FollowFeedback,
    FollowGoal,
    FollowResult,
    JointTrajectory,
    TrajectoryPoint,
)
from solfer.numerics.rotations import whole_revolutions
from solfer.numerics.via_points import ViaPoints
from solfer.robot import Robot


@dataclass(frozen=True)
class _Limits:
    """Tolerances of a goal, shape (m,) each; None: nothing is supervised there."""

    path: tuple[np.ndarray, np.ndarray] | None = None
    goal: tuple[np.ndarray, np.ndarray] | None = None
    time: float = 0.0


class _Deviation:
    """How far joints are from where they are desired, and whether within tolerances; allocates nothing in a cycle.

    Args:
        robot: The Robot.
        dofs: The joints, shape (m,).

    Attributes:
        desired, speed: Where they are desired, and how fast, shape (m,) [rad, m] and [rad/s, m/s]; written.
        actual, turning: Where they were measured, and how fast.
        revolution: Angles after which they are where they were, shape (m,) [rad].
    """

    def __init__(self, robot: Robot, dofs: np.ndarray):
        # imported here: its compiler takes a while to load
        from solfer.numerics.kernels import shorten

        self._shorten = shorten
        self._state = robot.state
        self._dofs = dofs
        self.desired, self.speed, self.actual, self.turning = (np.zeros(len(dofs)) for _ in range(4))
        self.revolution = robot.revolutions[dofs]
        self._displacements = np.zeros((1, len(dofs)))
        self._away = self._error = self._displacements[0]
        self._slip = np.zeros(len(dofs))
        self._beyond = np.zeros(len(dofs), dtype=bool)

    def measure(self) -> None:
        """Measure the joints."""
        np.take(self._state.position, self._dofs, out=self.actual)
        np.take(self._state.velocity, self._dofs, out=self.turning)

    def is_within(self, tolerances: tuple[np.ndarray, np.ndarray]) -> bool:
        """Return whether all joints are where they are desired."""
        self.measure()
        np.subtract(self.desired, self.actual, out=self._away)
        np.subtract(self.speed, self.turning, out=self._slip)
        self._shorten(self._displacements, self.revolution)
        for error, tolerance in ((self._away, tolerances[0]), (self._slip, tolerances[1])):
            np.abs(error, out=error)
            np.greater(error, tolerance, out=self._beyond)
            if self._beyond.any():
                self._error = error
                return False
        return True

    def worst(self, names: tuple[str, ...]) -> str:
        """Name the first joint that is beyond its tolerance, and by how much."""
        index = int(self._beyond.argmax())
        unit = "rad" if self._error is self._away else "rad/s"
        return f"joint '{names[index]}' is {self._error[index]:.6g} {unit} from its trajectory"


@dataclass
class _Course:
    """A trajectory that is followed, or that waits.

    Attributes:
        motion: Its motion, by the time since its stamp.
        time: That time; while it waits, what it will be when it takes over [s].
        begins: When it takes over, by the clock of the follower [s].
        names: Its joints.
        places: The same, indices of those that may be moved, shape (m,).
        limits: Tolerances of its goal; None: it has no goal.
        deviation: How far its joints are from it.
    """

    motion: ViaPoints
    time: float
    begins: float
    names: tuple[str, ...]
    places: np.ndarray
    limits: _Limits | None
    deviation: _Deviation


class TrajectoryFollower:
    """One trajectory of some joints, with or without a goal, and those that wait for their stamps.

    Until the stamp of the next one everything goes on; it begins in the state in which the joints are then. It is
    checked, and its motion is made, when it comes.

    Args:
        robot: The Robot.
        joints: DoFs that may be moved, shape (n,).
        position: Where they are desired, shape (n,) [rad, m]; written.
        velocity: How fast, shape (n,) [rad/s, m/s]; written.
        coast: Writes where joints without a trajectory will be after a time [s], shape (n,), and how fast.

    Attributes:
        moving: Whether a trajectory is in progress.
        waiting: Trajectories that are to take over, in the order of their stamps.
    """

    def __init__(
        self,
        robot: Robot,
        joints: np.ndarray,
        position: np.ndarray,
        velocity: np.ndarray,
        coast: Callable[[float, np.ndarray, np.ndarray], None],
    ):
        self._robot = robot
        self._joints = joints
        self._position = position
        self._velocity = velocity
        self._coast = coast
        self._check = TrajectoryCheck(
            [robot.dofs[dof] for dof in joints],
            robot.lower_limits.position[joints],
            robot.upper_limits.position[joints],
            speed=robot.upper_limits.velocity[joints],
            turns=robot.revolutions[joints],
        )
        self.moving = False
        self.waiting: deque[_Course] = deque()
        self._clock = 0.0
        self._course: _Course | None = None
        self._goal: _Course | None = None
        self._outcome: Outcome | None = None

    def begin(self, trajectory: JointTrajectory, now: float, goal: FollowGoal | None = None) -> None:
        """Let a trajectory wait for its stamp, see `take_over`; nothing changes if any part of it is wrong.

        It replaces those that wait: from its stamp on those of the same joints, and all of others.

        Args:
            trajectory: The trajectory.
            now: The time in which trajectories are stamped [s].
            goal: The goal that it belongs to, in place of the one before; None: a topic's.

        Raises:
            SolferError: See `TrajectoryCheck`; or too many wait.
        """
        if not trajectory.points:
            raise ComponentError("a trajectory without points", expected="one point or more")
        names = trajectory.joint_names
        places = self._check.places(names)
        limits = None if goal is None else self._limits(goal, names)
        elapsed = self._check.elapsed(trajectory, now)
        # joints have to be at a point at the stamp by then
        start = elapsed if trajectory.points[-1].time_from_start == 0.0 else max(elapsed, 0.0)
        begins = self._clock + start - elapsed
        kept = [each for each in self.waiting if each.names == names and each.begins < begins]
        capacity = 1000
        if len(kept) == capacity:
            raise ComponentError(
                f"{capacity} trajectories wait for their stamps", expected="fewer, or stamps less far ahead"
            )
        position, velocity = self._after(start - elapsed, kept)
        motion = self._check.motion(
            trajectory,
            places,
            position[places],
            velocity=velocity[places],
            measured=self._robot.state.position[self._joints[places]],
            elapsed=start,
        )
        deviation = _Deviation(self._robot, self._joints[places])
        course = _Course(motion, start, begins, names=names, places=places, limits=limits, deviation=deviation)
        if goal is not None:
            self._goal = course
            self._outcome = None
        elif any(each is self._goal for each in self.waiting) and not any(each is self._goal for each in kept):
            self._abort("another trajectory has taken over")
        self.waiting = deque((*kept, course))

    def take_over(self, period: float) -> tuple[np.ndarray, np.ndarray] | None:
        """Let a trajectory take over that begins within some time [s].

        Returns:
            Its joints, and where they end, shape (m,) each [rad, m]; None: none begins.
        """
        course = None
        while self.waiting and self.waiting[0].begins <= self._clock + period:
            course = self.waiting.popleft()
            if self._goal is self._course:
                self._abort("another trajectory has taken over")
            self._course = course
        if course is None:
            return None
        course.time += self._clock - course.begins
        self.moving = True
        return course.places, course.motion.last

    def advance(self, period: float) -> None:
        """Move the joints on by the time of a cycle [s], and supervise the goal."""
        self._clock += period
        course = self._course
        if course is None:
            return
        course.time += period
        if self.moving:
            deviation = course.deviation
            course.motion.at(course.time, deviation.desired, deviation.speed)
            self._position[course.places] = deviation.desired
            self._velocity[course.places] = deviation.speed
            self.moving = course.time < course.motion.end
        if course.limits is not None and course is self._goal and self._outcome is None:
            self._supervise(course, course.limits)

    def leave(self, why: str) -> None:
        """Leave the joints where they are, with their speed; a goal that is in progress ends with this reason."""
        self._drop()
        self._abort(why)

    def forget(self) -> None:
        """Leave the trajectory, and the goal without an outcome."""
        self._drop()
        self._goal = None
        self._outcome = None

    def outcome(self) -> Outcome | None:
        """Return how the goal has ended; None: it is in progress."""
        return self._outcome

    @property
    def violated(self) -> bool:
        """Whether the joints have left the path of the goal while they move."""
        return self.moving and self._outcome is not None and self._course is self._goal

    def report(self) -> FollowFeedback:
        """Return where the joints of the goal are desired and where they are."""
        course = self._goal
        if course is None:
            raise ComponentError("there is no goal", expected="a goal in progress")
        deviation = course.deviation
        deviation.measure()
        time = max(course.time, 0.0)
        desired = self._position[course.places]
        speed = self._velocity[course.places]
        away = desired - deviation.actual
        away -= whole_revolutions(away, deviation.revolution)
        return FollowFeedback(
            course.names,
            _point(desired, speed, time),
            _point(deviation.actual, deviation.turning, time),
            error=_point(away, speed - deviation.turning, time),
        )

    def _after(self, lead: float, kept: Sequence[_Course]) -> tuple[np.ndarray, np.ndarray]:
        """Compute where all joints will be after a time [s], and how fast, with what waits until then."""
        position = self._position.copy()
        velocity = self._velocity.copy()
        if lead > 0.0:
            self._coast(lead, position, velocity)
            last = kept[-1] if kept else self._course
            if last is not None and (kept or self.moving):
                desired, speed = np.zeros((2, len(last.places)))
                waited = self._clock - last.begins if kept else 0.0
                last.motion.at(last.time + waited + lead, desired, speed)
                position[last.places] = desired
                velocity[last.places] = speed
        return position, velocity

    def _drop(self) -> None:
        self.moving = False
        self.waiting.clear()
        self._course = None

    def _abort(self, why: str) -> None:
        """End the goal with a reason, if it is in progress."""
        if self._goal is not None and self._outcome is None:
            self._outcome = Outcome(FollowResult(INVALID_GOAL, why), False, why)

    def _limits(self, goal: FollowGoal, names: tuple[str, ...]) -> _Limits:
        if not 0.0 <= goal.goal_time_tolerance < np.inf:
            raise ComponentError(
                f"goal_time_tolerance is {goal.goal_time_tolerance:.6g} s", expected="a number of 0 or more"
            )
        path, end = (self._check.tolerances(each, names) for each in (goal.path_tolerance, goal.goal_tolerance))
        supervises = [bool(np.isfinite(each).any()) for each in (path, end)]
        return _Limits(path if supervises[0] else None, end if supervises[1] else None, goal.goal_time_tolerance)

    def _supervise(self, course: _Course, limits: _Limits) -> None:
        if self.moving:
            if limits.path is not None and not course.deviation.is_within(limits.path):
                self._fail(PATH_TOLERANCE_VIOLATED, course, "on the way")
        elif limits.goal is None or course.deviation.is_within(limits.goal):
            self._outcome = Outcome(FollowResult(), True, "the joints are there")
        elif course.time >= course.motion.end + limits.time:
            self._fail(GOAL_TOLERANCE_VIOLATED, course, "at the end")

    def _fail(self, code: int, course: _Course, when: str) -> None:
        """End the goal: the first joint beyond its tolerance is named."""
        why = f"{course.deviation.worst(course.names)} {when}"
        self._outcome = Outcome(FollowResult(code, why), False, why)


def _point(position: np.ndarray, velocity: np.ndarray, time: float) -> TrajectoryPoint:
    """Make the message of positions [rad, m] and velocities [rad/s, m/s], shape (n,) each, at a time [s]."""
    return TrajectoryPoint(tuple(position.tolist()), tuple(velocity.tolist()), time_from_start=time)
