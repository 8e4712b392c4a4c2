"""The Dynamic Point (section 1.4.1 of the paper): y = A x + b."""

import abc

import numpy as np

from solfer.errors import PointError
from solfer.model.view import RobotView
from solfer.points.point import Operand, Point
from solfer.points.program import CompiledPoint
from solfer.points.space import Space

__all__ = ["DynamicPoint"]


class _Offset(Point):
    """The offset of a dynamic point, which computes it."""

    def compute(self) -> None:
        """See `Point.compute`; the dynamic point has written it."""

    def compute_jacobian(self) -> None:
        """See `Point.compute_jacobian`; an offset has no columns."""


class DynamicPoint(Point, abc.ABC):
    """A value y = A x + b; base class of accelerations and forces.

    `jacobian` is A, `offset` is b. A subclass defines `x`, and writes `self.jacobian` in `compute_jacobian` and
    `self.offset` in `compute_offset`; `compute` comes last.

    Args:
        space: Space of the value, or its size.
        robot: The Robot.
    """

    def __init__(self, space: Space | int, robot: RobotView):
        super().__init__(space, robot)
        # a point of its own, so that Handlers and sums treat it like a value
        self._offset = _Offset(self.rows)

    @property
    @abc.abstractmethod
    def x(self) -> np.ndarray:
        """The factor of A, shape (cols,); live."""

    @property
    def offset(self) -> np.ndarray:
        """The offset b as of the last `update`, shape (rows,); live."""
        return self._offset.value

    @abc.abstractmethod
    def compute_offset(self) -> None:
        """Write the offset."""

    def compute(self) -> None:
        """Write the value A x + b, from the present Jacobian and offset."""
        np.dot(self._jacobian, self.x, out=self._value)
        self._value += self.offset

    def update(self, jacobian: bool = True) -> None:
        """Compute the Jacobian if `jacobian`, the offset and the value, at the last update of the Robot."""
        if jacobian:
            self._clear()
            self.compute_jacobian()
        self.compute_offset()
        self.compute()

    def assign(self, other: Point) -> Point:
        """Copy value, Jacobian and offset of a point with the same x, which hold until the next update of this one.

        Raises:
            SizeMismatch: The other one lies in another space.
            PointError: It belongs to another Robot, or its Jacobian to another x.
        """
        require_same_x(self, other)
        return super().assign(other)

    def _accumulate(self, other: Operand, sign: float, sense: str) -> Point:
        if isinstance(other, Point):
            require_same_x(self, other)
            return super()._accumulate(other, sign, sense)
        super()._accumulate(other, sign, sense)
        self._offset._accumulate(other, sign, sense)
        return self

    def _overwrite(self, other: Point, kept: float, factor: float) -> None:
        super()._overwrite(other, kept, factor)
        offset = self.offset
        offset *= kept
        offset += factor * offset_of(other).value


class CompiledDynamicPoint(CompiledPoint, DynamicPoint):
    """A DynamicPoint that the kernel computes, with its offset."""

    @property
    def written_offset(self) -> np.ndarray:
        """The offset that its instructions write, shape (rows,)."""
        return self.offset

    def compute_offset(self) -> None:
        """Write the offset and the value."""
        self.update(jacobian=False)


def offset_of(point: Point) -> Point:
    """Return the part of a value that does not depend on x: of a constant all of it."""
    return point._offset if isinstance(point, DynamicPoint) else point


def require_same_x(first: Point, second: Point) -> DynamicPoint | None:
    """Return the first of two points that is dynamic.

    Raises:
        PointError: Their Jacobians are multiplied with different x.
    """
    moving = [point for point in (first, second) if point.cols]
    dynamic = [point for point in moving if isinstance(point, DynamicPoint)]
    if len(dynamic) < len(moving) or any(point.x is not dynamic[0].x for point in dynamic):
        raise PointError(
            f"{first} and {second} do not depend on the same x",
            expected="two accelerations or two forces, or one of them and a constant",
        )
    return dynamic[0] if dynamic else None
