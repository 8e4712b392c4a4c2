"""Points that combine other points: constants, sums, differences, norms."""

from numbers import Integral

import numpy as np
from numpy.typing import ArrayLike

from solfer.errors import NotFinite, PointError, SizeMismatch
from solfer.points.compiled import layout
from solfer.points.dynamic import DynamicPoint
from solfer.points.offset import finite
from solfer.points.point import Arrangement, Operand, Point, common_robot
from solfer.points.program import CompiledPoint, Instruction
from solfer.points.space import Space, vector


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
        elif self._owner is None:
            self._jacobian = matrix.copy()
        else:
            raise SizeMismatch(f"the Handler of {self} has no columns, got shape {matrix.shape}")
        if len(self._set_columns) != cols:
            self._set_columns = np.arange(cols)
            Arrangement.version += 1


class _Pair(CompiledPoint):
    """Two points of one space and one Robot. Where one of them is dynamic, so is the result."""

    first: Point
    second: Point

    def __new__(cls, *operands: object, **named: object) -> "_Pair":
        if any(isinstance(operand, DynamicPoint) for operand in (*operands, *named.values())):
            from solfer.points.dynamic_algebra import DYNAMIC

            cls = DYNAMIC.get(cls, cls)
        return super().__new__(cls)

    def __init__(self, first: Operand, second: Operand):
        points = [operand for operand in (first, second) if isinstance(operand, Point)]
        if not points:
            raise PointError(f"{type(self).__name__} of numbers alone", expected="at least one point")
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
    """Sum of two vectors. `update` computes the sum only: its operands are updated before it.

    Args:
        first: A point, or numbers.
        second: A point, or numbers; one of the two is a point.

    Raises:
        SizeMismatch: Sizes differ.
        PointError: Robots differ, or an operand is not a vector.
    """

    def __init__(self, first: Operand, second: Operand):
        super().__init__(first, second)
        if not self.first.space.is_vector:
            raise PointError(f"{self.first} cannot be added", expected="vectors; a Minus of two orientations is one")

    def instructions(self) -> tuple[Instruction, ...]:
        """Return the kernel's instructions for this point alone."""
        return (Instruction(layout.PLUS, self, (self.first, self.second)),)


class Minus(_Pair):
    """First point minus the second one, a vector of `rows` numbers; for orientations and poses with the true Jacobian.

    The difference of two orientations is the rotation vector in world axes that turns the second into the first [rad].
    It is not smooth where its length reaches pi. `update` computes the difference only: its operands are updated
    before it.

    Args:
        first: A point, or numbers.
        second: A point, or numbers; one of the two is a point.

    Raises:
        SizeMismatch: Sizes differ.
        PointError: Robots differ.
    """

    def instructions(self) -> tuple[Instruction, ...]:
        """Return the kernel's instructions for this point alone."""
        return (Instruction(self.first.space.minus, self, (self.first, self.second)),)


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
        return (Instruction(layout.NORM, self, (self.point,)),)
