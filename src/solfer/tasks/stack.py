"""Levels of tasks in the order of their priority, as one matrix and one vector."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from solfer.errors import TaskError
from solfer.points import Handler
from solfer.tasks.kernel import ROW_TOLERANCE, gather, gather_jacobian
from solfer.tasks.task import COLUMNS, Task, updated_in_order

Levels = Sequence[Task | Sequence[Task]]
"""Levels, the most important first; a level of several tasks weighs them against each other."""


class Stack:
    """Tasks of one Robot in levels; computes the rows of all of them.

    Args:
        levels: The levels.

    Attributes:
        levels: The levels, each as a tuple of tasks.
        tasks: All tasks in their order.
        robot: Their Robot.
        ends: First row of each level, and the end of the last one, shape (levels + 1,).
        jacobian: sqrt(w) J of all rows, zero in columns of DoFs that do not count, shape (rows, n).
        velocity: sqrt(w) (K e + v) of all rows, shape (rows,).
        numbers: Numbers of all tasks as of the last update, see `Task`, shape (rows, COLUMNS).

    Raises:
        TaskError: There is no task, a task or a name is used twice, or tasks belong to different Robots.
    """

    def __init__(self, levels: Levels):
        self.levels = as_levels(levels)
        self.tasks = tuple(task for level in self.levels for task in level)
        _require_together(self.tasks)
        self.robot = self.tasks[0].point.robot
        self._points = Handler(updated_in_order(*(task.point for task in self.tasks)))
        self._errors = Handler(
            [*updated_in_order(*(task.reference for task in self.tasks)), *(task.error for task in self.tasks)]
        )
        sizes = [sum(task.rows for task in level) for level in self.levels]
        self.ends = np.cumsum([0, *sizes], dtype=np.int64)
        self._places = self._find_rows()
        self._masks = np.array([task.mask for task in self.tasks])
        # both Handlers are this stack's own: their arrays stay where they are
        self._point_jacobian = self._points.jacobian
        self._error_value = self._errors.value
        rows = int(self.ends[-1])
        self.jacobian = np.zeros((rows, self._masks.shape[1]))
        self.velocity = np.zeros(rows)
        self.numbers = np.zeros((rows, COLUMNS))
        starts = _starts([task.rows for task in self.tasks])
        self._copies = [
            (self.numbers[start : start + task.rows], task.numbers)
            for start, task in zip(starts, self.tasks, strict=True)
        ]

    @property
    def size(self) -> int:
        """DoFs n of the Robot."""
        return self.jacobian.shape[1]

    def update(self) -> None:
        """Compute the rows at the state of the last update of the Robot."""
        self._points.update()
        self._errors.update(jacobian=False)
        for place, numbers in self._copies:
            place[:] = numbers
        gather(
            self._point_jacobian,
            self._error_value,
            self._places,
            self._masks,
            self.numbers,
            self.jacobian,
            self.velocity,
        )

    def update_jacobian(self) -> None:
        """Compute the Jacobian of the rows alone; their weights are those of the last `update`."""
        self._points.update()
        gather_jacobian(self._point_jacobian, self._places, self._masks, self.numbers, self.jacobian)

    @property
    def smallest_singular_values(self) -> np.ndarray:
        """Smallest singular value of each level's rows in the null space of all before, shape (levels,).

        It is small near kinematic singularities, and where the level's tasks contradict each other or those before it.
        Computed at each call, for the rows of the last `update`.
        """
        values = []
        free = np.eye(self.size)
        for start, end in pairwise(self.ends):
            singular = np.linalg.svd(self.jacobian[start:end] @ free.T, compute_uv=False)
            values.append(singular[-1] if len(singular) == end - start else 0.0)
            _, singular, rows = np.linalg.svd(self.jacobian[:end])
            free = rows[np.count_nonzero(singular > ROW_TOLERANCE * singular[0]) :]
        return np.array(values)

    def __repr__(self) -> str:
        return f"Stack({' > '.join(' + '.join(task.name for task in level) for level in self.levels)})"

    def _find_rows(self) -> np.ndarray:
        """Find the row of the points' Jacobian, entry of the errors, and task of each row, shape (rows, 3)."""
        first_row = dict(zip(map(id, self._points), _starts([point.rows for point in self._points]), strict=True))
        entry = dict(zip(map(id, self._errors), _starts([point.size for point in self._errors]), strict=True))
        return np.vstack(
            [
                np.column_stack(
                    (
                        first_row[id(task.point)] + task.selected,
                        entry[id(task.error)] + task.selected,
                        np.full(task.rows, index),
                    )
                )
                for index, task in enumerate(self.tasks)
            ]
        ).astype(np.int64)


def _starts(sizes: list[int]) -> list[int]:
    return np.cumsum([0, *sizes])[:-1].tolist()


def as_levels(levels: Levels) -> tuple[tuple[Task, ...], ...]:
    """Convert levels to tuples of tasks.

    Raises:
        TaskError: An element is not a task, or a level is empty.
    """
    tuples = tuple((level,) if isinstance(level, Task) else tuple(level) for level in levels)
    for level in tuples:
        if not level:
            raise TaskError("a level without a task", expected="at least one task")
        for task in level:
            if not isinstance(task, Task):
                raise TaskError(f"a level consists of tasks, got {type(task).__name__}", expected="a Task")
    return tuples


def _require_together(tasks: tuple[Task, ...]) -> None:
    if not tasks:
        raise TaskError("a stack without a task", expected="at least one task")
    first = tasks[0]
    names = set()
    for task in tasks:
        if task.name in names:
            raise TaskError(
                "a stack has two tasks of this name", where=task.where, expected="a name of its own for each task"
            )
        names.add(task.name)
        if task.point.robot.kinematics is not first.point.robot.kinematics:
            raise TaskError(
                f"it belongs to another Robot ('{task.point.robot.name}') than task '{first.name}' "
                f"('{first.point.robot.name}')",
                where=task.where,
                expected="tasks of one Robot object",
            )
