"""A task: a point of the robot and its goal."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import ArrayLike

from solfer.errors import NotFinite, SizeMismatch, SolferError, TaskError
from solfer.points import Constant, Point, minus
from solfer.points.offset import chosen

GAIN, VELOCITY, WEIGHT, DAMPING, CORRECTION, COLUMNS = range(6)
"""Columns of the numbers of a row, as `solfer.tasks.kernel` reads them, and how many there are."""


def _numbers(
    column: int, what: str, least: float = -np.inf, above: float = -np.inf, largest: float = np.finfo(float).max
) -> property:
    """Return the property of a Task that is a column of its numbers, which are checked when assigned."""

    def read(task: "Task") -> np.ndarray:
        return task.numbers[:, column]

    def assign(task: "Task", values: ArrayLike) -> None:
        values = as_numbers(values, what, task.where)
        if values.shape not in ((), (task.rows,)):
            raise SizeMismatch(
                f"a {what} of shape {values.shape} for {task.rows} rows",
                where=task.where,
                expected="one number, or one a row",
            )
        if not (np.abs(values) <= largest).all():
            raise NotFinite(f"a {what} of {values.tolist()}", where=task.where)
        if (values < least).any() or (values <= above).any():
            expected = "positive numbers" if least < above else "numbers that are not negative"
            raise TaskError(f"a {what} of {values.tolist()}", where=task.where, expected=expected)
        task.numbers[:, column] = values

    return property(read, assign)


class Task:
    """A point that follows a reference: its desired rate is K e + v, with |K e| at most `correction` in each row.

    e is the reference minus the point, by `Point.difference`: for orientations the rotation vector in world axes that
    turns the point into the reference [rad], so that rates are angular velocities in world axes. `gain`, `velocity`,
    `weight`, `damping` and `correction` are live arrays of one number a row: writing into them in the cycle is not
    checked, assigning to them is.

    Args:
        name: Name of the task, for errors.
        point: The point; its operands are updated along with it.
        gain: Gain K [1/s], not negative: one number, or one a row.
        reference: A point that does not move with the robot, or numbers; default: a Constant at the present value.
        velocity: Feed-forward velocity v, in the units of the rows a second.
        weight: Weight within a level of several tasks, positive.
        damping: Damping of the inverse, positive, in the units of the Jacobian.
        correction: Largest rate by which an error is corrected, positive, in the units of the rows a second.
        rows: Rows of the point that count, such as (0, 1) for x and y; default: all.
        dofs: DoFs that move it, as names or numbers; the task does not use the others. Default: all.

    Attributes:
        name: Name of the task.
        point: The point.
        reference: The reference.
        error: The point `reference - point`.
        numbers: Gain, velocity, weight, damping and correction of each row, shape (rows, COLUMNS); live.
        selected: Rows of the point that count, shape (rows,).
        mask: 1 for each DoF that moves it, else 0, shape (n,).

    Raises:
        TaskError: The point moves with no robot, or the reference moves with one; a number has the wrong sign.
        SizeMismatch: There is neither one number nor one a row, or the reference is of another space.
        NotFinite: A value is NaN or infinite.
        UnknownName: The robot has no such DoF.
    """

    gain = _numbers(GAIN, "gain", least=0.0)
    """Gain K [1/s], shape (rows,)."""

    velocity = _numbers(VELOCITY, "velocity")
    """Feed-forward velocity v, shape (rows,)."""

    weight = _numbers(WEIGHT, "weight", above=0.0)
    """Weight, shape (rows,)."""

    damping = _numbers(DAMPING, "damping", above=0.0)
    """Damping, shape (rows,)."""

    correction = _numbers(CORRECTION, "correction", above=0.0, largest=np.inf)
    """Largest rate by which an error is corrected, shape (rows,)."""

    def __init__(  # noqa: PLR0913 for users: numbers of its rows, by their names
        self,
        name: str,
        point: Point,
        gain: ArrayLike = 1.0,
        *,
        reference: Point | ArrayLike | None = None,
        velocity: ArrayLike = 0.0,
        weight: ArrayLike = 1.0,
        damping: ArrayLike = 1e-3,
        correction: ArrayLike = np.inf,
        rows: Sequence[int] | None = None,
        dofs: Sequence[str | int] | None = None,
    ):
        self.name = name
        self.where = f"task '{name}'"
        if not isinstance(point, Point) or point.robot is None or not point.cols:
            raise TaskError(f"{point} moves with no robot", where=self.where, expected="a point of a Robot")
        self.point = point
        for part in updated_in_order(point):
            part.update()
        try:
            self.reference = _reference(point, reference)
            self.error = minus(self.reference, point)
        except SolferError as error:
            raise error.at(self.where) from error.__cause__
        self.selected = chosen("row", rows, point.rows, names=(), where=self.where, error=TaskError)
        self.mask = np.zeros(point.cols)
        names = point.robot.kinematics.dofs
        self.mask[chosen("DoF", dofs, point.cols, names=names, where=self.where, error=TaskError)] = 1.0
        self.numbers = np.zeros((self.rows, COLUMNS))
        self.gain = gain
        self.velocity = velocity
        self.weight = weight
        self.damping = damping
        self.correction = correction

    @property
    def rows(self) -> int:
        """Number of rows that count."""
        return len(self.selected)

    def hold(self) -> None:
        """Make the point's value as of its last update the reference.

        Raises:
            TaskError: The reference is a point of its own, not a Constant.
        """
        if not isinstance(self.reference, Constant):
            raise TaskError(f"its reference is {self.reference}", where=self.where, expected="a Constant")
        self.reference.set(self.point.value)

    def __repr__(self) -> str:
        return f"Task('{self.name}': {self.point}, {self.rows} rows)"


def as_numbers(values: object, what: str, where: str) -> np.ndarray:
    """Return `values` as an array of floats; a TaskError at `where` if they are not numbers."""
    try:
        return np.array(values, dtype=float)
    except (TypeError, ValueError) as error:
        raise TaskError(f"a {what} of {values!r}", where=where, expected="numbers") from error


def updated_in_order(*points: Point) -> Iterator[Point]:
    """Yield all operands of the points, then the points; each once, in the order in which they are to be updated."""
    seen: set[int] = set()

    def walk(point: Point) -> Iterator[Point]:
        if id(point) in seen:
            return
        seen.add(id(point))
        for part in point.parts:
            yield from walk(part)
        yield point

    for point in points:
        yield from walk(point)


def _reference(point: Point, reference: Point | ArrayLike | None) -> Point:
    if reference is None:
        return Constant.like(point)
    if not isinstance(reference, Point):
        return Constant(as_numbers(reference, "reference", ""), point.space)
    if len(reference.columns):
        raise TaskError(
            f"the reference {reference} moves with a robot",
            expected="a point that does not; a task of `point - other` keeps two points together",
        )
    return reference
