"""The Handler (section 1.4 of the paper): points that are updated as a group, in their order."""

from collections.abc import Callable, Iterable, Iterator
from typing import Generic, TypeVar

import numpy as np

from solfer.errors import PointError, SizeMismatch
from solfer.points.compiled import layout
from solfer.points.dynamic import DynamicPoint
from solfer.points.point import Arrangement, Point, common_robot
from solfer.points.program import CompiledPoint, Instruction, Program

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
        self._copies: dict[int, list[_Copy]] = {}
        self._value, self._jacobian, self._offset = np.zeros(0), np.zeros((0, 0)), np.zeros(0)
        self._steps: list[Callable[[bool], None]] = []
        self._version, self._is_laid_out, self._is_running = -1, True, False
        for point in points:
            self.add(point)

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
        self._is_laid_out = False
        Arrangement.version += 1
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
        if point._owner is self:
            for part in _parts(point):
                part._move(np.empty(part.size), np.zeros(part.jacobian.shape), None)
        self._is_laid_out = False
        Arrangement.version += 1
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
        self._lay_out()
        return self._value

    @property
    def jacobian(self) -> np.ndarray:
        """Jacobians of all points as of the last `update` with Jacobians, shape (rows, cols); live as `value`."""
        self._lay_out()
        return self._jacobian

    @property
    def offset(self) -> np.ndarray:
        """Offsets of DynamicPoints, zeros for all others, as of the last `update`, shape (rows,); live as `value`."""
        self._lay_out()
        return self._offset

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
        self._require_rest()
        if self._version != Arrangement.version:
            self._prepare()
        self._is_running = True
        try:
            for step in self._steps:
                step(jacobian)
        finally:
            self._is_running = False

    def _prepare(self) -> None:
        self._lay_out()
        self._steps = []
        instructions: list[Instruction] = []
        for index, point in enumerate(self._points):
            if isinstance(point, CompiledPoint) and point.is_plain:
                instructions += point.instructions()
            else:
                self._finish(instructions)
                self._steps.append(point.update)
            if index in self._copies:
                for one in self._copies[index]:
                    instructions += one.instructions()
        self._finish(instructions)
        self._version = Arrangement.version

    def _finish(self, instructions: list[Instruction]) -> None:
        """Make a step from the instructions so far."""
        if instructions:
            self._steps.append(Program(common_robot(*self._points), instructions, self.cols))
            instructions.clear()

    def _lay_out(self) -> None:
        """Move the arrays of the points to their places in the concatenated arrays."""
        if self._is_laid_out:
            return
        self._value, self._jacobian = np.empty(self.size), np.zeros((self.rows, self.cols))
        self._offset = np.zeros(self.rows)
        self._copies = {}
        place = row = 0
        for index, point in enumerate(self._points):
            end = row + point.rows
            values = self._value[place : place + point.size], self._offset[row:end]
            jacobians = self._jacobian[row:end], np.zeros((point.rows, 0))
            arrays = zip(_parts(point), values, jacobians, strict=False)
            if point._owner is None or point._owner is self:
                for part, value, jacobian in arrays:
                    part._move(value, jacobian, self)
            else:
                self._copies[index] = [_Copy(*one) for one in arrays]
            place, row = place + point.size, row + point.rows
        self._is_laid_out = True
        Arrangement.version += 1

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


def _parts(point: Point) -> tuple[Point, ...]:
    """Return the owners of arrays: the point, and the offset of a dynamic one."""
    return (point, point._offset) if isinstance(point, DynamicPoint) else (point,)


class _Copy(CompiledPoint):
    """Numbers of a point that another Handler owns."""

    def __init__(self, source: Point, value: np.ndarray, jacobian: np.ndarray):
        super().__init__(source.space, source.robot)
        self.source = source
        self._move(value, jacobian, None)
        value[:] = source.value
        if source.cols:
            jacobian[:] = source.jacobian

    def instructions(self) -> tuple[Instruction, ...]:
        """Return the kernel's instructions."""
        return (Instruction(layout.COPY, self, (self.source,)),)
