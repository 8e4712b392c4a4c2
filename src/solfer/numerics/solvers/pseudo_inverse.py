"""Pseudo-inverse of symmetric matrices."""

import math

import numpy as np
from scipy.linalg import lapack

from solfer.errors import NotFinite


class SymmetricPseudoInverse:
    """Moore-Penrose inverse of a symmetric matrix without negative eigenvalues, by its eigenvectors.

    Args:
        size: Rows k of the matrix.

    Attributes:
        matrix: Input of `update`, written before each call, shape (k, k); its memory is used.
        value: The pseudo-inverse, shape (k, k); zero before the first `update`.
        rank: Number of eigenvalues that are not zero: above 1e-11 times the largest one.
    """

    def __init__(self, size: int):
        self.matrix, self.value, self._scaled = np.zeros((3, size, size))
        self._inverses = np.zeros(size)
        self._counts = np.zeros(size, dtype=bool)
        self.rank = 0

    def update(self) -> np.ndarray:
        """Compute `value` of `matrix`, and return it.

        Raises:
            NotFinite: The matrix has no finite eigenvalues.
        """
        # a symmetric matrix is its transpose, so LAPACK can work on its memory as it is
        values, vectors, failed = lapack.dsyev(self.matrix.T, overwrite_a=1)
        if failed or not math.isfinite(values[-1]):
            raise NotFinite("a symmetric matrix has no finite eigenvalues", expected="finite numbers")
        np.greater(values, 1e-11 * max(values[-1], 0.0), out=self._counts)
        self.rank = int(np.count_nonzero(self._counts))
        self._inverses[:] = 0.0
        np.divide(1.0, values, out=self._inverses, where=self._counts)
        np.multiply(vectors, self._inverses, out=self._scaled)
        return np.dot(self._scaled, vectors.T, out=self.value)
