"""Dynamics without the forces of constraints, by a QR decomposition of the constraints' Jacobian."""

from collections.abc import Callable, Hashable

import numpy as np
from scipy.linalg import lapack

from solfer.dynamics.dynamic_model import DynamicModel
from solfer.dynamics.elements import Elements
from solfer.errors import ModelError
from solfer.numerics.solvers.null_space import NullSpace


class ProjectedDynamics(Elements):
    """Dynamics of a constrained robot in the directions that its constraints leave free.

    With constraints J a = 0 and their forces J^T f, the n - r rows of A (A J^T = 0, A A^T = 1, r = rank J) take the
    forces out of M a + h = effort + J^T f: A M a + A h = A effort. See Aghili (2005), "A unified approach for inverse
    and direct dynamics of constrained multibody systems", and Mistry, Buchli, Schaal (2010), "Inverse dynamics control
    of floating base systems using orthogonal decomposition".

    Constraints may come and go: `constrain` accepts another number of rows each time, and rows of zeros do not
    count. Arrays hold until the state or the constraints change: the bias force A h, shape (n - r,), the inertia A M,
    shape (n - r, n), and as its inverse A^T (A M A^T)^-1, shape (n, n - r): what a force A (effort - h) accelerates
    while J a = 0 holds.

    Args:
        model: The full dynamics.

    Attributes:
        model: The full dynamics.
    """

    def __init__(self, model: DynamicModel):
        size = model.robot.kinematics.size
        self.model = model
        self._space = NullSpace(size)
        self._constrained = 0
        self._vector = np.zeros(size)
        self._rotated = np.zeros((size, size), order="F")
        self._square = np.zeros((size, size), order="F")
        # one block of memory each, that is cut again when the rank changes
        self._factors = np.zeros(size * size)
        self._solutions = np.zeros(size * size)
        self._fit()
        super().__init__(
            lambda name: self._with_constraints(model.stamp(name)),
            self._compute_bias,
            self._compute_inertia,
            self._compute_inverse,
        )

    @property
    def rank(self) -> int:
        """Number of independent constraints r."""
        return self._space.rank

    @property
    def projection(self) -> np.ndarray:
        """A, shape (n - r, n)."""
        return self._space.basis

    def constrain(self, jacobian: np.ndarray) -> None:
        """Set the Jacobian of the constraints, shape (k, n), k <= n; its rank is found from its numbers.

        Raises:
            SizeMismatch: `jacobian` has another shape.
        """
        rank = self.rank
        if self._space.update(jacobian) != rank:
            self._fit()
        self._constrained += 1

    def update(self) -> None:
        """Bring the full model up to date, and compute what is subscribed and stale."""
        self.model.update()
        self.manager.update()

    def decompose(self, vector: np.ndarray, out: np.ndarray) -> np.ndarray:
        """Write A `vector` into the first n - r numbers of `out`, and return these; both have n numbers."""
        return self._space.project(vector, out)

    def _fit(self) -> None:
        """Cut the work space to the number of free directions."""
        size = self._space.size
        free = self._space.size - self.rank
        self._factor = self._factors[: free * free].reshape((free, free), order="F")
        self._solution = self._solutions[: free * size].reshape((free, size), order="F")
        self._bias = self._vector[:free]
        self._inertia = self._rotated[self.rank :]
        self._inertia_inverse = self._solution.T

    def _with_constraints(self, stamp: Callable[[], Hashable]) -> Callable[[], Hashable]:
        return lambda: (self._constrained, stamp())

    def _compute_bias(self) -> None:
        self._space.project(self.model.bias, self._vector)

    def _compute_inertia(self) -> None:
        self._space.project_columns(self.model.inertia, self._rotated)

    def _compute_inverse(self) -> None:
        self._factor[:] = self._space.project_both(self.model.inertia, self._square)
        self._solution[:] = self._space.basis
        info = lapack.dposv(self._factor, self._solution, overwrite_a=1, overwrite_b=1)[2]
        if info:
            raise ModelError(
                f"the projected inertia of '{self.model.robot.name}' is not positive definite",
                expected="a robot whose links have mass",
            )
