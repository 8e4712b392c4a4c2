"""Moves joints along a trajectory, and supervises the goal of an action that requested it."""

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
from solfer.numerics.rotations import whole_turns
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
        turn: Turns after which they are where they were, shape (m,) [rad].
    """

    def __init__(self, robot: Robot, dofs: np.ndarray):
        # imported here: its compiler takes a while to load
        from solfer.numerics.kernels import shorten

        self._shorten = shorten
        self._state = robot.state
        self._dofs = dofs
        self.desired, self.speed, self.actual, self.turning = (np.zeros(len(dofs)) for _ in range(4))
        self.turn = robot.turns[dofs]
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
        self._shorten(self._displacements, self.turn)
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


class TrajectoryFollower:
    """One trajectory of some joints, with or without a goal.

    Args:
        robot: The Robot.
        joints: DoFs that may be moved, shape (n,).
        position: Where they are desired, shape (n,) [rad, m]; written.
        velocity: How fast, shape (n,) [rad/s, m/s]; written.

    Attributes:
        moving: Whether a trajectory is in progress.
        places: The joints that it moves, indices into `joints`.
    """

    def __init__(self, robot: Robot, joints: np.ndarray, position: np.ndarray, velocity: np.ndarray):
        self._robot = robot
        self._joints = joints
        self._position = position
        self._velocity = velocity
        self._check = TrajectoryCheck(
            [robot.dofs[dof] for dof in joints],
            robot.lower_limits.position[joints],
            robot.upper_limits.position[joints],
            speed=robot.upper_limits.velocity[joints],
            turns=robot.turns[joints],
        )
        self.moving = False
        self.places = np.zeros(0, dtype=int)
        self._motion: ViaPoints | None = None
        self._time = 0.0
        self._names: tuple[str, ...] = ()
        self._supervised: _Limits | None = None
        self._outcome: Outcome | None = None
        self._deviation = _Deviation(robot, joints[self.places])

    def begin(self, trajectory: JointTrajectory, now: float, goal: FollowGoal | None = None) -> np.ndarray:
        """Take over a trajectory; nothing changes if any part of it is wrong.

        Args:
            trajectory: The trajectory.
            now: The time in which trajectories are stamped [s].
            goal: The goal that it belongs to; None: a topic's.

        Returns:
            Where the joints of the trajectory end, shape (m,) [rad, m].

        Raises:
            SolferError: See `TrajectoryCheck`.
        """
        if not trajectory.points:
            raise ComponentError("a trajectory without points", expected="one point or more")
        names = trajectory.joint_names
        places = self._check.places(names)
        supervised = None if goal is None else self._limits(goal, names)
        start = self._position[places]
        velocity = self._velocity[places]
        measured = self._robot.state.position[self._joints[places]]
        motion, elapsed = self._check.motion(trajectory, places, start, velocity=velocity, measured=measured, now=now)
        self.leave("another trajectory has taken over")
        self._motion = motion
        self._time = elapsed
        self.moving = True
        self.places = places
        self._names = names
        self._supervised = supervised
        self._outcome = None
        self._deviation = _Deviation(self._robot, self._joints[places])
        return motion.last

    def advance(self, period: float) -> None:
        """Move the joints on by the time of a cycle [s], and supervise the goal."""
        if self._motion is None:
            return
        self._time += period
        if self.moving:
            deviation = self._deviation
            self._motion.at(self._time, deviation.desired, deviation.speed)
            self._position[self.places] = deviation.desired
            self._velocity[self.places] = deviation.speed
            self.moving = self._time < self._motion.end
        if self._supervised is not None and self._outcome is None:
            self._supervise(self._supervised, self._motion)

    def leave(self, why: str) -> None:
        """Leave the joints where they are, with their speed; a goal that is in progress ends with this reason."""
        self.moving = False
        self._motion = None
        if self._supervised is not None and self._outcome is None:
            self._outcome = Outcome(FollowResult(INVALID_GOAL, why), False, why)

    def forget(self) -> None:
        """Leave the trajectory, and the goal without an outcome."""
        self.moving = False
        self._motion = None
        self._supervised = None
        self._outcome = None

    def outcome(self) -> Outcome | None:
        """Return how the goal has ended; None: it is in progress."""
        return self._outcome

    @property
    def violated(self) -> bool:
        """Whether the joints have left the path of the goal while they move."""
        return self.moving and self._outcome is not None

    def report(self) -> FollowFeedback:
        """Return where the joints are desired and where they are."""
        deviation = self._deviation
        deviation.measure()
        time = max(self._time, 0.0)
        desired = self._position[self.places]
        speed = self._velocity[self.places]
        away = desired - deviation.actual
        away -= whole_turns(away, deviation.turn)
        return FollowFeedback(
            self._names,
            _point(desired, speed, time),
            _point(deviation.actual, deviation.turning, time),
            error=_point(away, speed - deviation.turning, time),
        )

    def _limits(self, goal: FollowGoal, names: tuple[str, ...]) -> _Limits:
        if not 0.0 <= goal.goal_time_tolerance < np.inf:
            raise ComponentError(
                f"goal_time_tolerance is {goal.goal_time_tolerance:.6g} s", expected="a number of 0 or more"
            )
        path, end = (self._check.tolerances(each, names) for each in (goal.path_tolerance, goal.goal_tolerance))
        supervises = [bool(np.isfinite(each).any()) for each in (path, end)]
        return _Limits(path if supervises[0] else None, end if supervises[1] else None, goal.goal_time_tolerance)

    def _supervise(self, limits: _Limits, motion: ViaPoints) -> None:
        if self.moving:
            if limits.path is not None and not self._deviation.is_within(limits.path):
                self._fail(PATH_TOLERANCE_VIOLATED, "on the way")
        elif limits.goal is None or self._deviation.is_within(limits.goal):
            self._outcome = Outcome(FollowResult(), True, "the joints are there")
        elif self._time >= motion.end + limits.time:
            self._fail(GOAL_TOLERANCE_VIOLATED, "at the end")

    def _fail(self, code: int, when: str) -> None:
        """End the goal: the first joint beyond its tolerance is named."""
        why = f"{self._deviation.worst(self._names)} {when}"
        self._outcome = Outcome(FollowResult(code, why), False, why)


def _point(position: np.ndarray, velocity: np.ndarray, time: float) -> TrajectoryPoint:
    """Make the message of positions [rad, m] and velocities [rad/s, m/s], shape (n,) each, at a time [s]."""
    return TrajectoryPoint(tuple(position.tolist()), tuple(velocity.tolist()), time_from_start=time)
