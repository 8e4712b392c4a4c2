"""Changes between stacks of tasks without jumps of the joint velocities."""

from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np

from solfer.errors import TaskError
from solfer.model.view import RobotView
from solfer.tasks.hierarchy import Hierarchy
from solfer.tasks.stack import Levels, as_levels
from solfer.tasks.task import Task

DURATION = 0.5
"""Default duration of a change [s]."""

MAX_STACKS = 4
"""Largest number of stacks at one time."""


class Solver(Protocol):
    """Solver for joint velocities: a `Hierarchy` or a `QpHierarchy`."""

    @property
    def velocity(self) -> np.ndarray:
        """Joint velocities as of the last `update`, shape (n,)."""

    def update(self) -> np.ndarray:
        """Compute and return the joint velocities."""


class TaskController:
    """Joint velocities of a stack of tasks that changes while the robot moves.

    At a change, the old and the new stack run side by side, and the weight of the new one grows from 0 to 1 with
    u^3 (10 - 15 u + 6 u^2): velocities and accelerations stay continuous, and levels that both have in common are
    served all the time. It starts without tasks, at rest.

    Args:
        robot: The Robot.
        period: Period of the control cycle [s].
        make: Makes a solver of levels: `Hierarchy`, or a QpHierarchy with its limits by `functools.partial`.

    Attributes:
        levels: Levels, as they are at the end of all changes.
        velocity: Joint velocities as of the last `update`, shape (n,) [rad/s, m/s]; live.

    Raises:
        TaskError: The period is not positive.
    """

    def __init__(self, robot: RobotView, period: float, make: Callable[[Levels], Solver] = Hierarchy):
        if not 0.0 < period < np.inf:
            raise TaskError(f"a period of {period:g} s", expected="a positive number")
        self._robot = robot
        self._period = period
        self._make = make
        self.levels: tuple[tuple[Task, ...], ...] = ()
        self.velocity, self._difference = np.zeros((2, robot.kinematics.size))
        self._stages = [_Stage(_Rest(robot), 0.0)]

    @property
    def is_changing(self) -> bool:
        """Whether an earlier stack still takes part."""
        return len(self._stages) > 1

    @property
    def solver(self) -> Solver:
        """The solver at the end of all changes."""
        return self._stages[-1].solver

    def change(self, levels: Levels, duration: float = DURATION) -> None:
        """Change to other levels, none if they are empty, within `duration` [s].

        Changes between two updates are one change, with the duration of the last.

        Raises:
            TaskError: The levels cannot be a stack of this Robot, the duration is not positive, or too many changes
                are in progress. Nothing changes then.
        """
        levels = as_levels(levels)
        if not 0.0 < duration < np.inf:
            raise TaskError(f"a change within {duration:g} s", expected="a positive number")
        earlier = self._stages[:-1] if self.is_changing and self._stages[-1].is_new else self._stages
        if len(earlier) >= MAX_STACKS:
            raise TaskError(f"{MAX_STACKS - 1} changes are under way", expected="another one when the first has ended")
        for task in (task for level in levels for task in level):
            if task.point.robot.kinematics is not self._robot.kinematics:
                raise TaskError(
                    f"it belongs to another Robot ('{task.point.robot.name}')",
                    where=task.where,
                    expected="tasks of the controller's Robot object",
                )
        solver = self._make(levels) if levels else _Rest(self._robot)
        self._stages = [*earlier, _Stage(solver, self._period / duration)]
        self.levels = levels

    def insert(self, level: Task | Sequence[Task], at: int | None = None, duration: float = DURATION) -> None:
        """Insert a task, or a group of tasks, as level number `at`; default: after all others. See `change`."""
        added = as_levels([level])
        at = len(self.levels) if at is None else at
        if not 0 <= at <= len(self.levels):
            raise TaskError(f"level {at}", where=added[0][0].where, expected=f"0 to {len(self.levels)}")
        self.change((*self.levels[:at], *added, *self.levels[at:]), duration)

    def remove(self, task: Task, duration: float = DURATION) -> None:
        """Remove a task; a level without a task is removed, too. See `change`."""
        self._require(task)
        kept = (tuple(one for one in level if one is not task) for level in self.levels)
        self.change(tuple(level for level in kept if level), duration)

    def exchange(self, task: Task, other: Task, duration: float = DURATION) -> None:
        """Replace a task by another one. See `change`."""
        self._require(task)
        self.change(tuple(tuple(other if one is task else one for one in level) for level in self.levels), duration)

    def update(self) -> np.ndarray:
        """Compute and return the joint velocities at the state of the last update of the Robot."""
        for stage in self._stages:
            stage.advance()
        # stacks before one with the whole weight do not count any more
        while any(stage.has_come for stage in self._stages[1:]):
            del self._stages[0]
        self.velocity[:] = self._stages[0].solver.update()
        for stage in self._stages[1:]:
            np.subtract(stage.solver.update(), self.velocity, out=self._difference)
            self._difference *= stage.weight
            self.velocity += self._difference
        return self.velocity

    def _require(self, task: Task) -> None:
        if not any(task is one for level in self.levels for one in level):
            names = ", ".join(one.name for level in self.levels for one in level)
            raise TaskError(
                "it is not among the tasks",
                where=getattr(task, "where", ""),
                expected=f"one of {names}" if names else "there is no task",
            )


class _Stage:
    """A solver with its weight, which grows from 0 to 1."""

    def __init__(self, solver: Solver, step: float):
        self.solver = solver
        self._step = step
        self._progress = 0.0

    @property
    def is_new(self) -> bool:
        """Return whether it has no weight yet."""
        return self._progress == 0.0

    @property
    def has_come(self) -> bool:
        """Return whether it has the whole weight."""
        return self._progress >= 1.0

    @property
    def weight(self) -> float:
        """Compute its weight, from 0 to 1."""
        u = min(self._progress, 1.0)
        return u * u * u * (10.0 - u * (15.0 - 6.0 * u))

    def advance(self) -> None:
        """Advance by one period."""
        self._progress += self._step


class _Rest:
    """The solver without any task."""

    def __init__(self, robot: RobotView):
        self.velocity = np.zeros(robot.kinematics.size)

    def update(self) -> np.ndarray:
        """Return zero velocities."""
        return self.velocity
