"""Damped least squares for small stacks of tasks."""

import numpy as np
from numpy.typing import ArrayLike

from solfer.errors import NotFinite, SizeMismatch
from solfer.numerics.compilation import REORDERED, cached
from solfer.numerics.dense import DENSE, backward, cholesky, forward


class DampedInverse:
    """x = J^T (J J^T + D^2)^-1 e, the least of |J x - e|^2 + |D y|^2 with x = J^T y; J has m rows and n columns.

    Near a singularity the damping D bounds x. Source: S. Chiaverini, "Singularity-robust task-priority redundancy
    resolution for real-time kinematic control of robot manipulators", IEEE Transactions on Robotics and Automation
    13(3), 1997. `solve` allocates nothing.

    Args:
        rows: Rows m.
        cols: Columns n.
        damping: Diagonal of D, one positive number for all rows or one a row, shape (m,).

    Raises:
        SizeMismatch: `damping` has neither one number nor one a row.
        NotFinite: A number is not positive and finite.
    """

    def __init__(self, rows: int, cols: int, damping: ArrayLike):
        damping = np.asarray(damping, dtype=float)
        if damping.shape not in ((), (rows,)):
            raise SizeMismatch(f"damping of shape {damping.shape} for {rows} rows")
        if not (np.isfinite(damping) & (damping > 0.0)).all():
            raise NotFinite(f"damping {damping.tolist()}", expected="positive numbers")
        self._shapes = (rows, cols), (rows,), (cols,)
        # the matrix J J^T + D^2, then y, then the squares of the damping
        self._work = np.zeros((rows + 2, rows))
        self._work[rows + 1] = damping**2

    def solve(self, matrix: np.ndarray, vector: np.ndarray, out: np.ndarray) -> np.ndarray:
        """Write x into `out`, shape (n,).

        Args:
            matrix: J, shape (m, n), row by row in memory.
            vector: e, shape (m,).
            out: Result, shape (n,).

        Raises:
            SizeMismatch: An array has another shape, or is not contiguous float64.
        """
        if (matrix.shape, vector.shape, out.shape) != self._shapes:
            raise SizeMismatch(f"arrays of shapes {matrix.shape}, {vector.shape}, {out.shape}, expected {self._shapes}")
        try:
            _solve(matrix, vector, self._work, out)
        except TypeError as error:
            raise SizeMismatch(
                "an array is not contiguous float64", expected="arrays as np.ascontiguousarray makes them"
            ) from error
        return out


def _solve_into(matrix, vector, work, out):
    """Solve by Cholesky decomposition of the lower triangle, in place; see `DampedInverse`."""
    rows, cols = matrix.shape
    y = work[rows]
    for i in range(rows):
        for j in range(i + 1):
            entry = work[rows + 1, i] if i == j else 0.0
            for k in range(cols):
                entry += matrix[i, k] * matrix[j, k]
            work[i, j] = entry
    factor = work[:rows]
    cholesky(factor)
    y[:] = vector
    forward(factor, y)
    backward(factor, y)
    out[:] = 0.0
    for i in range(rows):
        for k in range(cols):
            out[k] += y[i] * matrix[i, k]


_solve = cached(
    "void(float64[:, ::1], float64[::1], float64[:, ::1], float64[::1])", _solve_into, REORDERED, sources=[DENSE]
)
