"""The Point (section 1.3 and Listing 5 of the paper): a vector of numbers and the Jacobian that belongs to it."""

import abc
from collections.abc import Iterable
from operator import attrgetter
from typing import NoReturn, Protocol, Union
from weakref import WeakSet

import numpy as np

from solfer import points
from solfer.errors import PointError, SizeMismatch
from solfer.model.view import RobotView
from solfer.points.offset import finite
from solfer.points.space import Space, vector

__all__ = ["Point"]

Operand = Union["Point", np.ndarray, list, tuple, float]


class LayoutReader(Protocol):
    """What names arrays of points by their addresses."""

    def expire(self) -> None:
        """Take it that an array has moved, or that columns were added."""


class Layout:
    """Where arrays lie that programs name by their addresses: those of a Handler's points, or of one point alone.

    Programs that name them expire when it changes, and no others.

    Args:
        is_shared: Whether it is a Handler's.

    Attributes:
        is_shared: Whether it is a Handler's.
    """

    __slots__ = ("__weakref__", "_readers", "is_shared")

    def __init__(self, is_shared: bool = False):
        self.is_shared = is_shared
        self._readers: WeakSet[LayoutReader] | None = None

    def add_reader(self, reader: LayoutReader) -> None:
        """Let `reader` expire at the next change."""
        if self._readers is None:
            self._readers = WeakSet()
        self._readers.add(reader)

    def change(self) -> None:
        """Let all readers expire: an array was moved, or columns were added."""
        readers = self._readers
        self._readers = None
        for reader in readers or ():
            reader.expire()


class Point(abc.ABC):
    """A value and its Jacobian at the state of the last update of the Robot; base class of all points.

    A point of your own is a subclass that writes `self.value` in `compute` and `self.jacobian` in `compute_jacobian`.
    `update` computes this point alone: its operands have to be up to date, as they are if they stand before it in
    the same Handler.

    Args:
        space: Space of the value, or its size.
        robot: The Robot that the Jacobian belongs to; None if it has no columns.

    Attributes:
        space: Space of the value.
        robot: The Robot, or None.
        value: Value as of the last `update`, shape (size,); live.
        jacobian: Jacobian as of the last `update` with Jacobian, shape (rows, cols); live.
    """

    value: np.ndarray = property(attrgetter("_value"))  # type: ignore[assignment]  # read in each cycle
    jacobian: np.ndarray = property(attrgetter("_jacobian"))  # type: ignore[assignment]

    __array_ufunc__ = None  # an array minus a point is a Minus, too

    def __init__(self, space: Space | int, robot: RobotView | None = None):
        self.space = space if isinstance(space, Space) else vector(int(space))
        self.robot = robot
        cols = 0 if robot is None else robot.kinematics.size
        self._value = self.space.neutral()
        self._jacobian = np.zeros((self.space.rows, cols))
        self._flags = np.zeros(2, dtype=np.int64)
        self._is_overwritten = False
        self._layout = Layout()

    @property
    def size(self) -> int:
        """Numbers of the value."""
        return self.space.size

    @property
    def rows(self) -> int:
        """Rows of the Jacobian, numbers of a difference."""
        return self.space.rows

    @property
    def cols(self) -> int:
        """Columns of the Jacobian: the DoFs n of the Robot, 0 where there is none."""
        return self._jacobian.shape[1]

    @property
    def flags(self) -> np.ndarray:
        """Whether the next update clears the Jacobian, and whether it stays zero, shape (2,)."""
        return self._flags

    @property
    def columns(self) -> np.ndarray:
        """DoFs whose columns of the Jacobian may differ from zero, shape (m,)."""
        return np.arange(self.cols) if self._is_overwritten else self.written_columns()

    @property
    def parts(self) -> "tuple[Point, ...]":
        """Return the operands of this point, which are updated before it."""
        return ()

    @property
    def layout(self) -> Layout:
        """The layout of value and Jacobian: the point's own, or that of the Handler that has their memory."""
        return self._layout

    @property
    def layouts(self) -> Iterable[Layout]:
        """What the instructions of this point depend on besides its `parts`."""
        return (self._layout,)

    def written_columns(self) -> np.ndarray:
        """Return the DoFs whose columns an update writes, shape (m,)."""
        return np.arange(self.cols)

    @abc.abstractmethod
    def compute(self) -> None:
        """Write the value."""

    @abc.abstractmethod
    def compute_jacobian(self) -> None:
        """Write the Jacobian."""

    def update(self, jacobian: bool = True) -> None:
        """Compute the value, and the Jacobian if `jacobian`, at the state of the last update of the Robot."""
        self.compute()
        if jacobian:
            self._clear()
            self.compute_jacobian()

    def difference(self, other: Operand) -> np.ndarray:
        """Subtract the value of `other`, a point or a value, from this one's, shape (rows,); a new array.

        For orientations the result is the rotation vector in world axes that turns the other one into this [rad].

        Raises:
            SizeMismatch: The other one lies in another space.
        """
        if isinstance(other, Point):
            self._require_space(other, "difference")
            return self.space.subtract(self._value, other._value)
        value = np.asarray(other, dtype=float)
        if value.shape != self._value.shape:
            raise SizeMismatch(f"a difference from {self} needs {self.size} numbers, got shape {value.shape}")
        return self.space.subtract(self._value, value)

    def assign(self, other: "Point") -> "Point":
        """Copy value and Jacobian of a point, which hold until the next update of this one.

        Raises:
            SizeMismatch: The other one lies in another space.
            PointError: It belongs to another Robot.
        """
        self._require_space(other, "assignment")
        self._value[:] = other._value
        self._overwrite(other, 0.0, 1.0)
        return self

    def __iadd__(self, other: Operand) -> "Point":
        """Add value and Jacobian of a point, which hold until the next update of this one."""
        return self._accumulate(other, 1.0, "+=")

    def __isub__(self, other: Operand) -> "Point":
        """Subtract value and Jacobian of a point, which hold until the next update of this one."""
        return self._accumulate(other, -1.0, "-=")

    def __add__(self, other: Operand) -> "Point":
        """Make a point that stays the sum of both whenever it is updated; see `solfer.points.plus`."""
        return points.plus(self, other)

    def __sub__(self, other: Operand) -> "Point":
        """Make a point that stays the difference of both whenever it is updated; see `solfer.points.minus`."""
        return points.minus(self, other)

    def __radd__(self, other: Operand) -> "Point":
        """Make a point from numbers plus this point; see `__add__`."""
        return self + other

    def __rsub__(self, other: Operand) -> "Point":
        """Make a point from numbers minus this point; see `__sub__`."""
        return points.minus(other, self)

    def __reduce_ex__(self, protocol: object) -> NoReturn:
        """Refuse copies: programs name a point by the addresses of its arrays, which mean nothing in a copy."""
        raise PointError(f"{self} cannot be copied", expected="a new point, or Constant.like(point) for its value")

    def __str__(self) -> str:
        return f"{type(self).__name__}, {self.space}"

    def _accumulate(self, other: Operand, sign: float, sense: str) -> "Point":
        if not self.space.is_vector:
            raise PointError(
                f"'{sense}' has no meaning for {self}", expected="vectors; a Minus of two orientations is one"
            )
        if isinstance(other, Point):
            self._require_space(other, sense)
            self._value += sign * other._value
            self._overwrite(other, 1.0, sign)
        else:
            self._value += sign * finite(other, self.size, f"'{sense}' to {self}")
        return self

    def _overwrite(self, other: "Point", kept: float, factor: float) -> None:
        """Set the Jacobian to `kept` times itself plus `factor` times the other's; the next update clears it."""
        if other.cols and other.cols != self.cols:
            raise PointError(
                f"{other} has a Jacobian of {other.cols} columns, {self} one of {self.cols}",
                expected="points of one Robot",
            )
        self._jacobian *= kept
        if other.cols:
            self._jacobian += factor * other._jacobian
        if not self._is_overwritten:
            self._is_overwritten = True
            self._layout.change()
        self._flags[0] = 1

    def _clear(self) -> None:
        if self._flags[0]:
            self._jacobian[:] = 0.0
            self._flags[0] = 0

    def _require_space(self, other: "Point", sense: str) -> None:
        if self.space != other.space:
            raise SizeMismatch(f"{sense} of {self} and {other}")
        common_robot(self, other)

    def move(self, value: np.ndarray, jacobian: np.ndarray, layout: Layout) -> None:
        """Use other arrays for value and Jacobian, of a layout; their numbers are copied there.

        Args:
            value: Memory of the value, shape (size,).
            jacobian: Memory of the Jacobian, shape (rows, cols); it may have columns where the point had none.
            layout: Layout of both. Where it is the same as before, its owner lets its readers expire.
        """
        value[:] = self._value
        if self.cols:
            jacobian[:] = self._jacobian
        if layout is not self._layout:
            self._layout.change()
        self._value = value
        self._jacobian = jacobian
        self._layout = layout


def common_robot(*group: Point) -> RobotView | None:
    """Return the Robot of all points that have one.

    Raises:
        PointError: Two belong to different Robots.
    """
    owner: Point | None = None
    for point in group:
        if point.robot is None:
            continue
        if owner is not None and owner.robot.kinematics is not point.robot.kinematics:
            raise PointError(
                f"{point} belongs to another Robot ('{point.robot.name}') than {owner} ('{owner.robot.name}')",
                expected="points of one Robot object",
            )
        owner = owner or point
    return None if owner is None else owner.robot
