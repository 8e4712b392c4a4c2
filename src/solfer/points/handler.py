"""The Handler (section 1.4 of the paper): points that are updated as a group, in their order."""

from collections.abc import Iterable, Iterator
from typing import Generic, TypeVar

import numpy as np

from solfer.errors import PointError, SizeMismatch
from solfer.model.view import RobotView
from solfer.points.compiled.algebra import copy
from solfer.points.dynamic import DynamicPoint
from solfer.points.point import Layout, Point, common_robot
from solfer.points.program import CompiledPoint, Instruction, Program

__all__ = ["Handler"]

PointT = TypeVar("PointT", bound=Point)


class Handler(Generic[PointT]):
    """A list of points with one concatenated value, one concatenated Jacobian, and one concatenated offset.

    `update` computes the points in their order, so that a point may depend on points before it, which are computed
    once. The arrays of the points become views of the Handler's own, unless another Handler has them already: then
    their numbers are copied at each update. Points that come with solfer are computed by one call of a compiled kernel;
    others by their own `update`.

    Args:
        points: The first points.

    Raises:
        PointError: An element is not a point, or belongs to another Robot.
    """

    def __init__(self, points: Iterable[PointT] = ()):
        self._points: list[PointT] = []
        self._memory, self._sequence, self._program = _Memory(), list[Point](), Program()
        self._contents = Layout()
        self._is_laid_out = False
        self._is_running = False
        for point in points:
            self.add(point)

    @property
    def contents(self) -> Layout:
        """What changes when points are added or removed."""
        return self._contents

    def add(self, point: PointT) -> PointT:
        """Append a point, and return it.

        Raises:
            PointError: It is not a point, belongs to another Robot, is here already, or the Handler is running.
            SizeMismatch: Its Jacobian has another number of columns.
        """
        self._require_rest()
        if not isinstance(point, Point):
            raise PointError(f"a Handler holds points, got {type(point).__name__}", expected="a Point")
        if any(point is other for other in self._points):
            raise PointError(f"{point} is in this Handler already", expected="each point once")
        other = next((other for other in self._points if other.cols), point)
        common_robot(other, point)
        if point.cols and other.cols != point.cols:
            raise SizeMismatch(f"{point} has a Jacobian of {point.cols} columns, {other} one of {other.cols}")
        self._points.append(point)
        self._program.reopen()
        self._is_laid_out = self._is_laid_out and self._memory.fits(point)
        if self._is_laid_out:
            self._sequence += self._memory.place(point)
        self._contents.change()
        return point

    def remove(self, which: int | PointT) -> PointT:
        """Remove a point, given by itself or its index (from the back if negative), and return it.

        Points that depend on it still do.

        Raises:
            PointError: There is no such point, or the Handler is running.
        """
        self._require_rest()
        index = which if isinstance(which, int) else self._index(which)
        point = self[index]
        del self._points[index]
        self._memory.release(point)
        self._program.expire()
        self._is_laid_out = False
        self._contents.change()
        return point

    def __getitem__(self, index: int) -> PointT:
        if not -len(self) <= index < len(self):
            raise PointError(
                f"there is no point {index} in a Handler of {len(self)}",
                expected=f"an index from {-len(self)} to {len(self) - 1}" if len(self) else "a Handler with points",
            )
        return self._points[index]

    def __setitem__(self, index: int, point: PointT) -> None:
        """Complete `handler[i] += b`; an assignment does not replace a point."""
        if self[index] is not point:
            raise PointError(
                f"{self[index]} is not replaced by {point}",
                expected="assign() to copy its numbers, or remove() and add()",
            )

    def end(self, index: int) -> PointT:
        """Return the point with this index counted from the back: `end(0)` is the last one."""
        return self[-1 - index]

    def __len__(self) -> int:
        return len(self._points)

    def __iter__(self) -> Iterator[PointT]:
        return iter(self._points)

    @property
    def value(self) -> np.ndarray:
        """Values of all points as of the last `update`, shape (size,); live until points are added or removed."""
        if not self._is_laid_out:
            self._lay_out()
        return self._memory.value

    @property
    def jacobian(self) -> np.ndarray:
        """Jacobians of all points as of the last `update` with Jacobians, shape (rows, cols); live as `value`."""
        if not self._is_laid_out:
            self._lay_out()
        return self._memory.jacobian

    @property
    def offset(self) -> np.ndarray:
        """Offsets of DynamicPoints, zeros for all others, as of the last `update`, shape (rows,); live as `value`."""
        if not self._is_laid_out:
            self._lay_out()
        return self._memory.offset

    @property
    def size(self) -> int:
        """Numbers of all values."""
        return sum(point.size for point in self._points)

    @property
    def rows(self) -> int:
        """Rows of all Jacobians."""
        return sum(point.rows for point in self._points)

    @property
    def cols(self) -> int:
        """Columns of the Jacobian: the DoFs n of the Robot, 0 where there is none."""
        return max((point.cols for point in self._points), default=0)

    def update(self, jacobian: bool = True) -> None:
        """Compute the values of all points in their order, and their Jacobians if `jacobian`.

        Raises:
            PointError: One of the points calls this itself, or changes the Handler.
        """
        if self._is_running:
            self._require_rest()
        if not self._program.is_current:
            if not self._is_laid_out:
                self._lay_out()
            self._program.complete(self._sequence, self._memory.robot, self._memory.jacobian.shape[1])
        self._is_running = True
        try:
            for step in self._program.steps:
                step(jacobian)
        finally:
            self._is_running = False

    def _lay_out(self) -> None:
        """Move the arrays of the points to their places in the concatenated arrays."""
        self._memory.provide(self.size, self.rows, self.cols, common_robot(*self._points))
        self._sequence = [part for point in self._points for part in self._memory.place(point)]
        self._program.expire()
        self._is_laid_out = True

    def _index(self, point: PointT) -> int:
        for index, other in enumerate(self._points):
            if other is point:
                return index
        raise PointError(f"{point} is not in this Handler", expected="a point that was added to it")

    def _require_rest(self) -> None:
        if self._is_running:
            raise PointError(
                "a Handler is updated or changed by one of its own points while it runs",
                expected="changes between two updates",
            )


class _Memory:
    """Concatenated arrays, with room for more points at their ends.

    Attributes:
        layout: Layout of the arrays of points in here.
        robot: Robot of the points, None if they have none.
        value: Values, shape (size,).
        jacobian: Jacobians, shape (rows, cols).
        offset: Offsets, shape (rows,).
    """

    def __init__(self) -> None:
        self.layout = Layout(is_shared=True)
        self.provide(0, 0, 0, robot=None)

    def provide(self, size: int, rows: int, cols: int, robot: RobotView | None) -> None:
        """Make other arrays for points of `size` numbers and `rows` rows together, and for as many later ones."""
        self.layout.change()
        self.robot = robot
        self._all = np.zeros(2 * size), np.zeros((2 * rows, cols)), np.zeros(2 * rows)
        self._use(0, 0)

    def fits(self, point: Point) -> bool:
        """Return whether there is room for a point."""
        values, jacobians, _ = self._all
        has_columns = point.cols in (0, jacobians.shape[1]) and (point.robot is None or self.robot is not None)
        has_rows = len(self.value) + point.size <= len(values) and len(self.jacobian) + point.rows <= len(jacobians)
        return has_rows and has_columns

    def place(self, point: Point) -> list[Point]:
        """Give a point the next place; return what has to be updated: it, and copies if it lies somewhere else."""
        first = len(self.value)
        row = len(self.offset)
        self._use(first + point.size, row + point.rows)
        values = self.value[first:], self.offset[row:]
        jacobians = self.jacobian[row:], np.zeros((point.rows, 0))
        arrays = zip(_parts(point), values, jacobians, strict=False)
        if point.layout.is_shared and point.layout is not self.layout:
            return [point, *(_Copy(*one, self.layout) for one in arrays)]
        for part, value, jacobian in arrays:
            part.move(value, jacobian, self.layout)
        return [point]

    def release(self, point: Point) -> None:
        """Give a point memory of its own, if it lies here."""
        if point.layout is self.layout:
            for part in _parts(point):
                part.move(np.empty(part.size), np.zeros(part.jacobian.shape), Layout())

    def _use(self, size: int, rows: int) -> None:
        values, jacobians, offsets = self._all
        self.value = values[:size]
        self.jacobian = jacobians[:rows]
        self.offset = offsets[:rows]


def _parts(point: Point) -> tuple[Point, ...]:
    """Return the owners of arrays: the point, and the offset of a dynamic one."""
    return (point, point._offset) if isinstance(point, DynamicPoint) else (point,)


class _Copy(CompiledPoint):
    """Numbers of a point that another Handler owns."""

    def __init__(self, source: Point, value: np.ndarray, jacobian: np.ndarray, layout: Layout):
        super().__init__(source.space, source.robot)
        self.source = source
        self.move(value, jacobian, layout)
        value[:] = source.value
        if source.cols:
            jacobian[:] = source.jacobian

    @property
    def parts(self) -> tuple[Point, ...]:
        """Return the other Handler's point."""
        return (self.source,)

    def instructions(self) -> tuple[Instruction, ...]:
        """Return the kernel's instructions."""
        return (Instruction(copy, self, (self.source,)),)
