"""Quadratic programs, their solutions with outcomes, and the solver."""

import enum
import math
from dataclasses import dataclass, fields
from operator import attrgetter

import numpy as np

from solfer.errors import SizeMismatch
from solfer.numerics.solvers import active_set


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


class QpStatus(enum.Enum):
    """Outcome of a problem, in the order of `active_set`."""

    SOLVED = "solved"
    INFEASIBLE = "infeasible"
    """No x fulfils the constraints."""
    NOT_CONVERGED = "not converged"
    """The cost is flat in some direction, or there were not enough steps; a solution may exist."""
    INACCURATE = "inaccurate"
    """The conditions of an optimum are not met to within the tolerance: the cost is almost flat, or constraints depend
    on each other almost; a solution may exist."""
    NOT_FINITE = "not finite"
    """The problem contains a NaN, or an infinity in its cost or its equalities."""


_STATUS = tuple(QpStatus)


@dataclass(frozen=True, eq=False)
class Solution:
    """Result of a problem.

    Attributes:
        status: Whether `x` is the solution, or why not.
        x: The solution, or the point where the solver gave up; shape (n,), a new array.
        iterations: Steps of the solver.
        problem: The problem: the solver's own, or a copy of it if it was not solved; None where it is not written down.
        residual: The largest of what x leaves of the conditions of an optimum: violations of constraints, as ratios of
            their sides where these are larger than 1, and the slope H x + g beside the constraints' normals, as a
            ratio of its largest term; inf where the solver did not get there.
    """

    status: QpStatus
    x: np.ndarray
    iterations: int
    problem: Problem | None
    residual: float = math.inf

    @property
    def is_solved(self) -> bool:
        """Whether `x` is the solution."""
        return self.status is QpStatus.SOLVED


class QpSolver:
    """Solves problems of one size; those that fail end as well, after a bounded number of steps.

    The method is the dual one of `solfer.numerics.solvers.active_set`. It starts from the cost alone, so that equal
    problems have equal solutions, and a failed one affects no later one.

    Args:
        size: Number of unknowns n.
        equalities: Number of equalities.
        inequalities: Number of inequalities besides the bounds of single unknowns.
        tolerance: Largest residual of a solution, see `Solution.residual`.

    Attributes:
        problem: The problem; its arrays are written, or replaced by others of the same shape, before `solve`.
    """

    def __init__(self, size: int, equalities: int = 0, inequalities: int = 0, tolerance: float = 1e-9):
        self.problem = Problem.empty(size, equalities, inequalities)
        self._shapes = self.problem.shapes()
        self._tolerance = tolerance
        self._space = active_set.work_space(size, inequalities)

    def solve(self) -> Solution:
        """Solve the problem; failures are in the solution's status.

        Raises:
            SizeMismatch: An array has been replaced by one of another shape, or is not float64 row by row.
        """
        problem = self.problem
        if problem.shapes() != self._shapes:
            raise SizeMismatch(f"a problem of the shapes {problem.shapes()}, expected {self._shapes}")
        x = np.zeros(len(problem.gradient))
        status, steps, residual = self.write(x)
        return Solution(
            status, x, steps, problem=problem if status is QpStatus.SOLVED else problem.copy(), residual=residual
        )

    def write(self, out: np.ndarray) -> tuple[QpStatus, int, float]:
        """Solve the problem, whose arrays still have their shapes, without allocating arrays.

        Args:
            out: The x of `Solution`, written, shape (n,).

        Returns:
            Status, iterations and residual of `Solution`.

        Raises:
            SizeMismatch: An array is not float64 row by row.
        """
        try:
            outcome, steps, residual = active_set.solve(self.problem.arrays(), self._tolerance, self._space, out)
        except TypeError as error:
            raise SizeMismatch(
                "an array of a problem is not float64 row by row",
                expected="arrays as np.ascontiguousarray makes them",
            ) from error
        return _STATUS[outcome], steps, residual
