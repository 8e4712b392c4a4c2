"""Quadratic programs: their matrices and vectors."""

from dataclasses import dataclass, fields
from operator import attrgetter

import numpy as np


@dataclass(eq=False)
class Problem:
    """The least of 1/2 x^T H x + g^T x with A x = b, l <= C x <= u and x_min <= x <= x_max.

    Attributes:
        hessian: H, symmetric and positive definite, shape (n, n).
        gradient: g, shape (n,).
        equality_matrix: A, shape (e, n).
        equality_vector: b, shape (e,).
        inequality_matrix: C, shape (i, n).
        lower: l, shape (i,); -inf where there is none.
        upper: u, shape (i,); inf where there is none.
        x_min: Lower bounds of x, shape (n,); -inf where there is none.
        x_max: Upper bounds of x, shape (n,); inf where there is none.
    """

    hessian: np.ndarray
    gradient: np.ndarray
    equality_matrix: np.ndarray
    equality_vector: np.ndarray
    inequality_matrix: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    x_min: np.ndarray
    x_max: np.ndarray

    @classmethod
    def empty(cls, size: int, equalities: int = 0, inequalities: int = 0) -> "Problem":
        """Return a problem without cost and bounds; matrices of zeros."""
        return cls(
            np.zeros((size, size)),
            np.zeros(size),
            np.zeros((equalities, size)),
            equality_vector=np.zeros(equalities),
            inequality_matrix=np.zeros((inequalities, size)),
            lower=np.full(inequalities, -np.inf),
            upper=np.full(inequalities, np.inf),
            x_min=np.full(size, -np.inf),
            x_max=np.full(size, np.inf),
        )

    def copy(self) -> "Problem":
        """Return the problem with arrays of its own."""
        return Problem(*(array.copy() for array in self.arrays()))

    def arrays(self) -> tuple[np.ndarray, ...]:
        """Return all arrays in their order."""
        return _ARRAYS(self)

    def shapes(self) -> tuple[tuple[int, ...], ...]:
        """Return the shapes of all arrays in their order."""
        return _SHAPES(self)


_ARRAYS = attrgetter(*(field.name for field in fields(Problem)))
_SHAPES = attrgetter(*(f"{field.name}.shape" for field in fields(Problem)))
