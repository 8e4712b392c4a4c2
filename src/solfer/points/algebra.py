"""Points that combine other points: constants, sums, differences, norms."""

from numbers import Integral
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from solfer.errors import NotFinite, PointError, SizeMismatch
from solfer.points.compiled import algebra as kernels
from solfer.points.compiled.registry import Kernel
from solfer.points.dynamic import CompiledDynamicPoint, DynamicPoint, offset_of, require_same_x
from solfer.points.offset import finite
from solfer.points.point import Operand, Point, common_robot
from solfer.points.program import CompiledPoint, Instruction
from solfer.points.space import Space, vector

__all__ = ["Constant", "Minus", "Norm", "Plus", "minus", "plus"]


class Constant(CompiledPoint):
    """A value that is set by hand, such as a reference, with a Jacobian of zeros.

    Args:
        value: The value, or its size: then it is zero, or no rotation.
        space: Space of the value; default: a vector.

    Raises:
        SizeMismatch, NotFinite: The value does not fit, or is not finite.
    """

    def __init__(self, value: ArrayLike, space: Space | None = None):
        has_size_only = isinstance(value, Integral)
        size = int(value) if isinstance(value, Integral) else np.size(value)
        super().__init__(space or vector(size))
        self._set_columns = np.arange(0)
        if not has_size_only:
            self.set(value)
        elif size != self.size:
            raise SizeMismatch(f"{self} of {size} numbers")

    @classmethod
    def like(cls, point: Point) -> "Constant":
        """Make a reference for a point: in its space, with its present value."""
        return cls(point.value, point.space)

    def set(self, values: ArrayLike) -> None:
        """Set the value, shape (size,), or with a matrix the Jacobian, shape (rows, cols).

        Raises:
            SizeMismatch: The shape fits neither.
            NotFinite: A value is NaN or infinite, or not a quaternion where one is needed; nothing is set.
        """
        if np.ndim(values) == 2:
            self._set_jacobian(np.asarray(values, dtype=float))
        else:
            self._value[:] = self._normalised(finite(values, self.size, str(self)))

    def instructions(self) -> tuple[Instruction, ...]:
        """Return no instructions: a constant is always up to date."""
        return ()

    def written_columns(self) -> np.ndarray:
        """Return the DoFs whose columns were set, shape (m,)."""
        return self._set_columns

    def _normalised(self, values: np.ndarray) -> np.ndarray:
        if self.space.is_vector:
            return values
        length = float(np.linalg.norm(values[-4:]))
        if length == 0.0:
            raise NotFinite(f"{self}: a quaternion of zeros is not an orientation", expected="a quaternion of length 1")
        return np.concatenate((values[:-4], values[-4:] / length))

    def _set_jacobian(self, matrix: np.ndarray) -> None:
        rows, cols = matrix.shape
        if rows != self.rows or self.cols not in (0, cols):
            expected = f"{self.rows} rows" + (f" and {self.cols} columns" if self.cols else "")
            raise SizeMismatch(f"{self} needs a Jacobian of {expected}, got shape {matrix.shape}")
        if not np.isfinite(matrix).all():
            raise NotFinite(f"the Jacobian of {self} is not finite")
        if self.cols:
            self._jacobian[:] = matrix
        elif not self._layout.is_shared:
            self._jacobian = matrix.copy()
        else:
            raise SizeMismatch(f"the Handler of {self} has no columns, got shape {matrix.shape}")
        if len(self._set_columns) != cols:
            self._set_columns = np.arange(cols)
            self._layout.change()


class _Pair(CompiledPoint):
    """Two points of one space and one Robot."""

    first: Point
    second: Point

    def __init__(self, first: Operand, second: Operand):
        points = [operand for operand in (first, second) if isinstance(operand, Point)]
        if not points:
            raise PointError(f"{type(self).__name__} of numbers alone", expected="at least one point")
        dynamic = next((point for point in points if isinstance(point, DynamicPoint)), None)
        if dynamic is not None and not isinstance(self, DynamicPoint):
            raise PointError(
                f"{type(self).__name__} of {dynamic} would have no offset",
                expected=f"{type(self).__name__.lower()}(first, second), which makes dynamic points of dynamic ones",
            )
        self.first, self.second = (
            operand if isinstance(operand, Point) else Constant(operand, points[0].space) for operand in (first, second)
        )
        if self.first.space != self.second.space:
            raise SizeMismatch(
                f"{type(self).__name__} of {self.first} and {self.second}",
                expected="two of one space; Constant.like(point) makes a reference for any point",
            )
        super().__init__(vector(self.first.rows), common_robot(self.first, self.second))
        self._jacobian = np.zeros((self.rows, max(self.first.cols, self.second.cols)))

    @property
    def parts(self) -> tuple[Point, ...]:
        """Return both points."""
        return self.first, self.second

    def written_columns(self) -> np.ndarray:
        """Return the DoFs that move one or the other, shape (m,)."""
        return np.union1d(self.first.columns, self.second.columns)


class Plus(_Pair):
    """Sum of two vectors; `plus` makes it. `update` computes the sum only: its operands are updated before it.

    Args:
        first: A point, or numbers.
        second: A point, or numbers; one of the two is a point.

    Raises:
        SizeMismatch: Sizes differ.
        PointError: Robots differ, an operand is not a vector, or is dynamic.
    """

    def __init__(self, first: Operand, second: Operand):
        super().__init__(first, second)
        if not self.first.space.is_vector:
            raise PointError(f"{self.first} cannot be added", expected="vectors; a Minus of two orientations is one")

    def instructions(self) -> tuple[Instruction, ...]:
        """Return the kernel's instructions for this point alone."""
        return (Instruction(kernels.plus, self, (self.first, self.second)),)


class Minus(_Pair):
    """First point minus the second one, a vector of `rows` numbers; for orientations and poses with the true Jacobian.

    The difference of two orientations is the rotation vector in world axes that turns the second into the first [rad].
    It is not smooth where its length reaches pi. `minus` makes it. `update` computes the difference only: its operands
    are updated before it.

    Args:
        first: A point, or numbers.
        second: A point, or numbers; one of the two is a point.

    Raises:
        SizeMismatch: Sizes differ.
        PointError: Robots differ, or an operand is dynamic.
    """

    def instructions(self) -> tuple[Instruction, ...]:
        """Return the kernel's instructions for this point alone."""
        return (Instruction(self.first.space.minus, self, (self.first, self.second)),)


class _DynamicPair(CompiledDynamicPoint):
    """Two DynamicPoints with the same x, or one and a constant."""

    kernel: ClassVar[Kernel]
    first: Point
    second: Point

    def __init__(self, first: Operand, second: Operand):
        super().__init__(first, second)  # type: ignore[arg-type]  # that of Plus or Minus, the next class
        self._dynamic = require_same_x(self.first, self.second)

    @property
    def x(self) -> np.ndarray:
        """The operands' x, shape (cols,); live."""
        return self._dynamic.x

    def instructions(self) -> tuple[Instruction, ...]:
        """Return the kernel's instructions for this point alone."""
        offsets = offset_of(self.first), offset_of(self.second)
        own = super().instructions()  # type: ignore[safe-super]  # that of Plus or Minus, the next class
        return (*own, Instruction(self.kernel, self._offset, offsets))


class DynamicPlus(_DynamicPair, Plus):
    """Sum of two DynamicPoints, or of one and a constant; x is theirs. Otherwise as `Plus`; `plus` makes it.

    Raises:
        SizeMismatch: Sizes differ.
        PointError: The operands differ in their Robot or their x.
    """

    kernel = kernels.plus


class DynamicMinus(_DynamicPair, Minus):
    """First DynamicPoint minus the second one; one of the two may be a constant, and x is theirs.

    Otherwise as `Minus`; `minus` makes it.

    Raises:
        SizeMismatch: Sizes differ.
        PointError: The operands differ in their Robot or their x.
    """

    kernel = kernels.minus


def plus(first: Operand, second: Operand) -> Plus:
    """Make the sum of two points, or of one and numbers: a `DynamicPlus` where one is dynamic, else a `Plus`.

    Raises:
        SizeMismatch: Sizes differ.
        PointError: There is no point, or the operands differ in their Robot or their x.
    """
    return DynamicPlus(first, second) if _is_dynamic(first, second) else Plus(first, second)


def minus(first: Operand, second: Operand) -> Minus:
    """Make the difference of two points, or of one and numbers: a `DynamicMinus` where one is dynamic, else a `Minus`.

    Raises:
        SizeMismatch: Sizes differ.
        PointError: There is no point, or the operands differ in their Robot or their x.
    """
    return DynamicMinus(first, second) if _is_dynamic(first, second) else Minus(first, second)


def _is_dynamic(*operands: Operand) -> bool:
    return any(isinstance(operand, DynamicPoint) for operand in operands)


class Norm(CompiledPoint):
    """Euclidean norm of a vector, one number. Where the vector is zero, its Jacobian is zero.

    Args:
        point: A point; `update` of the norm does not update it.

    Raises:
        PointError: It is not a vector.
    """

    def __init__(self, point: Point):
        if not point.space.is_vector:
            raise PointError(f"{point} has no norm", expected="a vector; a Minus of two orientations is one")
        super().__init__(1, point.robot)
        self.point = point
        self._jacobian = np.zeros((1, point.cols))

    @property
    def parts(self) -> tuple[Point, ...]:
        """Return the vector."""
        return (self.point,)

    def written_columns(self) -> np.ndarray:
        """Return the DoFs that move the vector, shape (m,)."""
        return self.point.columns

    def instructions(self) -> tuple[Instruction, ...]:
        """Return the kernel's instructions for this point alone."""
        return (Instruction(kernels.norm, self, (self.point,)),)
