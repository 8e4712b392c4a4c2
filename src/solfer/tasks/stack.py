"""Levels of tasks in the order of their priority, as one matrix and one vector."""

from collections.abc import Sequence

import numpy as np

from solfer.errors import TaskError
from solfer.points import Handler
from solfer.tasks.kernel import gather
from solfer.tasks.task import Task, updated_in_order

Levels = Sequence[Task | Sequence[Task]]
"""Levels, the most important first; a level of several tasks weighs them against each other."""


class Stack:
    """Tasks of one Robot in levels; computes the rows that all of them ask for.

    Args:
        levels: The levels.

    Attributes:
        levels: The levels, each as a tuple of tasks.
        tasks: All tasks in their order.
        robot: Their Robot.
        ends: Where the rows of each level begin, and where those of the last one end, shape (levels + 1,).
        jacobian: sqrt(w) J of all rows, zero in columns of DoFs that do not count, shape (rows, n).
        velocity: sqrt(w) (K e + v) of all rows, shape (rows,).
        numbers: Gain, feed-forward velocity, weight and damping as of the last update, shape (rows, 4).

    Raises:
        TaskError: There is no task, one is there twice, two have one name, or they belong to different Robots.
    """

    def __init__(self, levels: Levels):
        self.levels = tuple((level,) if isinstance(level, Task) else tuple(level) for level in levels)
        self.tasks = tuple(task for level in self.levels for task in level)
        _require_tasks(self.levels, self.tasks)
        self.robot = self.tasks[0].point.robot
        self._points = Handler(updated_in_order(*(task.point for task in self.tasks)))
        self._errors = Handler(
            [*updated_in_order(*(task.reference for task in self.tasks)), *(task.error for task in self.tasks)])
        sizes = [sum(task.rows for task in level) for level in self.levels]
        self.ends = np.cumsum([0, *sizes], dtype=np.int64)
        self._places = self._find_rows()
        self._masks = np.array([task.mask for task in self.tasks])
        # both Handlers are this stack's own: their arrays stay where they are
        self._point_jacobian, self._error_value = self._points.jacobian, self._errors.value
        rows = int(self.ends[-1])
        self.jacobian, self.velocity = np.zeros((rows, self._masks.shape[1])), np.zeros(rows)
        self.numbers = np.zeros((rows, 4))
        self._numbers_of_tasks = [task.numbers for task in self.tasks]

    @property
    def size(self) -> int:
        """DoFs n of the Robot."""
        return self.jacobian.shape[1]

    def update(self) -> None:
        """Compute the rows at the state of the last update of the Robot."""
        self._points.update()
        self._errors.update(jacobian=False)
        np.concatenate(self._numbers_of_tasks, out=self.numbers)
        gather(self._point_jacobian, self._error_value, self._places, self._masks, self.numbers, self.jacobian,
               self.velocity)

    def __str__(self) -> str:
        return " > ".join(" + ".join(f"'{task.name}'" for task in level) for level in self.levels)

    def _find_rows(self) -> np.ndarray:
        """Row of the points' Jacobian, entry of the errors, and task of each row, shape (rows, 3)."""
        first_row = dict(zip(map(id, self._points), _starts([point.rows for point in self._points]), strict=True))
        entry = dict(zip(map(id, self._errors), _starts([point.size for point in self._errors]), strict=True))
        return np.vstack([
            np.column_stack((first_row[id(task.point)] + task.selected, entry[id(task.error)] + task.selected,
                             np.full(task.rows, index)))
            for index, task in enumerate(self.tasks)
        ]).astype(np.int64)


def _starts(sizes: list[int]) -> list[int]:
    return np.cumsum([0, *sizes])[:-1].tolist()


def _require_tasks(levels: tuple[tuple[Task, ...], ...], tasks: tuple[Task, ...]) -> None:
    if not tasks or not all(levels):
        raise TaskError("a level without a task" if levels else "a stack without a task", expected="at least one task")
    for task in tasks:
        if not isinstance(task, Task):
            raise TaskError(f"a stack takes tasks, got {type(task).__name__}")
    first, names = tasks[0], set()
    for task in tasks:
        if task.name in names:
            raise TaskError("a stack has two tasks of this name", where=task.where)
        names.add(task.name)
        if task.point.robot.kinematics is not first.point.robot.kinematics:
            raise TaskError(f"it belongs to another Robot ('{task.point.robot.name}') than task '{first.name}' "
                            f"('{first.point.robot.name}')", where=task.where, expected="tasks of one Robot object")
