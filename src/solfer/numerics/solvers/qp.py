"""Solutions of quadratic programs with their outcomes, and the solver."""

import enum
import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from solfer.errors import SizeMismatch
from solfer.numerics.solvers.active_set import GAVE_UP, INACCURATE, INFEASIBLE, NOT_FINITE, SOLVED, ActiveSet
from solfer.numerics.solvers.problem import Problem


class QpStatus(enum.Enum):
    """Outcome of a problem."""

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

    _STATUS: ClassVar = {
        SOLVED: QpStatus.SOLVED,
        INFEASIBLE: QpStatus.INFEASIBLE,
        GAVE_UP: QpStatus.NOT_CONVERGED,
        INACCURATE: QpStatus.INACCURATE,
        NOT_FINITE: QpStatus.NOT_FINITE,
    }

    def __init__(self, size: int, equalities: int = 0, inequalities: int = 0, tolerance: float = 1e-9):
        self.problem = Problem.empty(size, equalities, inequalities)
        self._shapes = self.problem.shapes()
        self._method = ActiveSet(size, inequalities, tolerance)

    def solve(self) -> Solution:
        """Solve the problem; failures are in the solution's status.

        Raises:
            SizeMismatch: An array has been replaced by one of another shape, or is not float64 row by row.
        """
        problem = self.problem
        if problem.shapes() != self._shapes:
            raise SizeMismatch(f"a problem of the shapes {problem.shapes()}, expected {self._shapes}")
        x = np.zeros(len(problem.gradient))
        outcome, steps, residual = self._method.solve(problem, x)
        status = self._STATUS[outcome]
        return Solution(
            status, x, steps, problem=problem if status is QpStatus.SOLVED else problem.copy(), residual=residual
        )
