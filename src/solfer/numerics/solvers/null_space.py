"""The null space of a matrix from a QR decomposition with column pivoting, with the numerical rank."""

import numpy as np
from scipy.linalg import lapack

from solfer.errors import SizeMismatch

RANK_TOLERANCE = 1e-9
"""Diagonal entries of R below this ratio to the largest one count as zero."""


class NullSpace:
    """Null space of a matrix C with n columns: A with A C^T = 0 and A A^T = 1.

    C^T P = Q R; the first r = rank(C) columns of Q span the rows of C, the others are A^T. C may have any number of
    rows up to n, and another one at each `update`.

    Args:
        size: Number of columns n.

    Attributes:
        rank: Numerical rank r of C; 0 before the first `update`.
    """

    def __init__(self, size: int):
        self.size = size
        self.rank = 0
        self._packed = np.zeros((size, size), order="F")
        self._reflectors = self._packed[:, :0]
        self._scales = np.zeros(0)
        self._identity = np.eye(size)
        self._basis = np.eye(size, order="F")
        self._rows = self._basis.T
        self._column = np.zeros((size, 1), order="F")
        # the least work space of LAPACK, which is allocated at each call
        self._work = size
        self._work_of_pivoting = 3 * size + 1
        self._basis_is_current = False

    def update(self, matrix: np.ndarray) -> int:
        """Decompose `matrix`, shape (k, n) with k <= n, and return its rank. Rows of zeros do not count.

        Raises:
            SizeMismatch: `matrix` has another shape.
        """
        if matrix.ndim != 2 or matrix.shape[1] != self.size or matrix.shape[0] > self.size:
            raise SizeMismatch(f"a matrix of shape {matrix.shape}, expected (k, {self.size}), k <= {self.size}")
        self.rank = 0
        self._basis_is_current = False
        if matrix.shape[0] == 0:
            return 0
        packed = self._packed[:, : matrix.shape[0]]
        np.copyto(packed, matrix.T)
        packed, _, scales, _, _ = lapack.dgeqp3(packed, lwork=self._work_of_pivoting, overwrite_a=1)
        diagonal = np.abs(packed.diagonal())
        self.rank = int(np.count_nonzero(diagonal > RANK_TOLERANCE * diagonal[0]))
        self._reflectors = packed[:, : self.rank]
        self._scales = scales[: self.rank]
        return self.rank

    @property
    def basis(self) -> np.ndarray:
        """A, shape (n - r, n); live until the next `update`."""
        if not self._basis_is_current:
            np.copyto(self._basis, self._identity)
            self._multiply(self._basis, "N")
            self._basis_is_current = True
        return self._rows[self.rank :]

    def project(self, vector: np.ndarray, out: np.ndarray) -> np.ndarray:
        """Write A `vector` into the first n - r numbers of `out`, and return these; both have n numbers."""
        self._column[:, 0] = vector
        self._multiply(self._column, "T")
        result = out[: self.size - self.rank]
        result[:] = self._column[self.rank :, 0]
        return result

    def project_columns(self, matrix: np.ndarray, out: np.ndarray) -> np.ndarray:
        """Write A `matrix` into the last n - r rows of `out`, and return these; both are (n, n), `out` by columns."""
        np.copyto(out, matrix)
        self._multiply(out, "T")
        return out[self.rank :]

    def project_both(self, matrix: np.ndarray, out: np.ndarray) -> np.ndarray:
        """Write A `matrix` A^T into the last n - r rows and columns of `out`; both are (n, n), `out` by columns."""
        self.project_columns(matrix, out)
        self._multiply(out, "N", "R")
        return out[self.rank :, self.rank :]

    def _multiply(self, matrix: np.ndarray, transposed: str, side: str = "L") -> None:
        """Multiply `matrix` by Q or Q^T from one side, in place."""
        if self.rank:
            lapack.dormqr(side, transposed, self._reflectors, self._scales, matrix, self._work, overwrite_c=1)
