"""Quadratic programs: problems, solutions that say how they ended, and a solver of bounded time (ProxQP)."""

import enum
import math
from dataclasses import dataclass, fields

import numpy as np
from proxsuite import proxqp

INFEASIBLE_ABOVE = 1e-6
"""Least violation of the constraints from which on they count as contradictory."""

_SMALLEST_CURVATURE = 1e-8
"""Cost of the unknowns themselves when the least violation is looked for."""


class Status(enum.Enum):
    """How the solution of a problem ended."""

    SOLVED = "solved"
    INFEASIBLE = "infeasible"
    """No x fulfils the constraints."""
    NOT_CONVERGED = "not converged"
    """The solver gave up; it may be that a solution exists."""
    NOT_FINITE = "not finite"
    """The problem holds a NaN, or an infinity in its cost or its equalities."""


@dataclass(eq=False)
class Problem:
    """The least of 1/2 x^T H x + g^T x with A x = b, l <= C x <= u and x_min <= x <= x_max.

    Attributes:
        hessian: H, symmetric, not indefinite, shape (n, n).
        gradient: g, shape (n,).
        equality_matrix: A, shape (e, n).
        equality_vector: b, shape (e,).
        inequality_matrix: C, shape (i, n).
        lower: l, shape (i,); -inf where there is none.
        upper: u, shape (i,); inf where there is none.
        least: x_min, shape (n,); -inf where there is none.
        largest: x_max, shape (n,); inf where there is none.
    """

    hessian: np.ndarray
    gradient: np.ndarray
    equality_matrix: np.ndarray
    equality_vector: np.ndarray
    inequality_matrix: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    least: np.ndarray
    largest: np.ndarray

    @classmethod
    def empty(cls, size: int, equalities: int = 0, inequalities: int = 0) -> "Problem":
        """No cost and no bounds; matrices of zeros."""
        return cls(
            np.zeros((size, size)), np.zeros(size), np.zeros((equalities, size)), np.zeros(equalities),
            np.zeros((inequalities, size)), np.full(inequalities, -np.inf), np.full(inequalities, np.inf),
            np.full(size, -np.inf), np.full(size, np.inf))

    def copy(self) -> "Problem":
        """The problem with arrays of its own."""
        return Problem(*(getattr(self, field.name).copy() for field in fields(self)))

    def is_finite(self) -> bool:
        """Whether cost and equalities are finite, and no limit is a NaN."""
        # a sum is finite only if all its terms are; where it overflows, the problem is no use either
        total = self.hessian.sum() + self.gradient.sum() + self.equality_matrix.sum() + self.equality_vector.sum()
        if not math.isfinite(total + self.inequality_matrix.sum()):
            return False
        return not any(np.isnan(limit).any() for limit in (self.lower, self.upper, self.least, self.largest))

    def is_contradictory(self) -> bool:
        """Whether a lower limit is above its upper one."""
        return bool((self.lower > self.upper).any() or (self.least > self.largest).any())


@dataclass(frozen=True, eq=False)
class Solution:
    """How a problem was solved.

    Attributes:
        status: Whether `x` is the solution, or why it is not.
        x: The solution, or where the solver gave up; shape (n,), a new array.
        iterations: Iterations of the solver.
        problem: The problem: the solver's own, or a copy of it if it was not solved.
    """

    status: Status
    x: np.ndarray
    iterations: int
    problem: Problem

    @property
    def is_solved(self) -> bool:
        """Whether `x` is the solution."""
        return self.status is Status.SOLVED


class QpSolver:
    """Solves problems of one size; those that fail end as well, after a bounded number of iterations.

    ProxQP is described in A. Bambade, S. El-Kazdadi, A. Taylor, J. Carpentier, "PROX-QP: Yet another Quadratic
    Programming Solver for Robotics and beyond", RSS 2022. Each solution starts from that of the equalities alone, so
    that equal problems have equal solutions, and one that failed spoils no later one.

    Args:
        size: Number of unknowns n.
        equalities: Number of equalities.
        inequalities: Number of inequalities besides the bounds of single unknowns.
        tolerance: Largest residual of the optimality conditions, of a cost whose largest entry of H is 1.
        has_point: Whether it is known that some x fulfils the constraints: a failure then is not taken for a
            contradiction, which is not looked for.

    Attributes:
        problem: The problem; its arrays are written, or replaced by others of the same shape, before `solve`.
    """

    def __init__(self, size: int, equalities: int = 0, inequalities: int = 0, tolerance: float = 1e-8,
                 has_point: bool = False):
        self.problem = Problem.empty(size, equalities, inequalities)
        self._engine = _Engine(self.problem, tolerance)
        is_open = equalities + inequalities > 0 and not has_point
        self._feasibility = _Feasibility(self.problem, tolerance) if is_open else None

    def solve(self) -> Solution:
        """Solve the problem; whatever happens is in the solution's status."""
        problem = self.problem
        if not problem.is_finite():
            return self._failure(Status.NOT_FINITE, np.zeros(len(problem.gradient)), 0)
        if problem.is_contradictory():
            return self._failure(Status.INFEASIBLE, np.zeros(len(problem.gradient)), 0)
        is_solved, x, iterations = self._engine.solve(problem)
        if is_solved:
            return Solution(Status.SOLVED, x, iterations, problem)
        is_infeasible = self._feasibility is not None and self._feasibility.is_excluded(problem)
        return self._failure(Status.INFEASIBLE if is_infeasible else Status.NOT_CONVERGED, x, iterations)

    def _failure(self, status: Status, x: np.ndarray, iterations: int) -> Solution:
        return Solution(status, x, iterations, self.problem.copy())


class _Engine:
    """ProxQP for one size of problems."""

    OUTER_ITERATIONS = INNER_ITERATIONS = 20

    def __init__(self, problem: Problem, tolerance: float, checks_gap: bool = True):
        size, equalities, inequalities = len(problem.gradient), len(problem.equality_vector), len(problem.lower)
        # with PrimalLDLT, or the preconditioner, single problems take seconds
        self._qp = proxqp.dense.QP(size, equalities, inequalities, True, proxqp.dense.HessianType.Dense,
                                   proxqp.dense.DenseBackend.PrimalDualLDLT)
        settings = self._qp.settings
        settings.eps_abs, settings.eps_rel, settings.compute_timings = tolerance, 0.0, False
        # without it an unknown may stay short of a bound by far more than the tolerance
        settings.check_duality_gap, settings.eps_duality_gap_abs = checks_gap, tolerance
        settings.max_iter, settings.max_iter_in = self.OUTER_ITERATIONS, self.INNER_ITERATIONS
        # what it takes for a contradiction need not be one: see `_Feasibility`
        settings.eps_primal_inf = settings.eps_dual_inf = 1e-14
        settings.initial_guess = proxqp.InitialGuess.EQUALITY_CONSTRAINED_INITIAL_GUESS
        self._has_equalities, self._has_inequalities = equalities > 0, inequalities > 0
        self._hessian, self._gradient = np.zeros((size, size)), np.zeros(size)
        self._hand_over = self._qp.init

    def solve(self, problem: Problem) -> tuple[bool, np.ndarray, int]:
        """Whether it is solved, x, and the number of iterations."""
        equalities = (problem.equality_matrix, problem.equality_vector) if self._has_equalities else (None, None)
        inequalities = (None, None, None)
        if self._has_inequalities:
            inequalities = problem.inequality_matrix, problem.lower, problem.upper
        # costs of very different sizes are its weak spot: the largest entry becomes 1
        scale = 1.0 / max(problem.hessian.max(), np.finfo(float).tiny)
        np.multiply(problem.hessian, scale, out=self._hessian)
        np.multiply(problem.gradient, scale, out=self._gradient)
        self._hand_over(self._hessian, self._gradient, *equalities, *inequalities, problem.least, problem.largest,
                        False)
        self._hand_over = self._qp.update
        self._qp.solve()
        results = self._qp.results
        return results.info.status == proxqp.QPSolverOutput.PROXQP_SOLVED, results.x.copy(), results.info.iter


class _Feasibility:
    """Looks for the least violation of a problem's constraints, within the bounds of its unknowns."""

    def __init__(self, problem: Problem, tolerance: float):
        self._size, self._equalities = len(problem.gradient), len(problem.equality_vector)
        slacks = self._equalities + len(problem.lower)
        self._elastic = Problem.empty(self._size + slacks, self._equalities, len(problem.lower))
        np.fill_diagonal(self._elastic.hessian, [_SMALLEST_CURVATURE] * self._size + [1.0] * slacks)
        np.fill_diagonal(self._elastic.equality_matrix[:, self._size:], 1.0)
        np.fill_diagonal(self._elastic.inequality_matrix[:, self._size + self._equalities:], 1.0)
        self._engine = _Engine(self._elastic, tolerance, checks_gap=False)

    def is_excluded(self, problem: Problem) -> bool:
        """Whether no x fulfils the constraints of the problem."""
        elastic, size = self._elastic, self._size
        elastic.equality_matrix[:, :size], elastic.inequality_matrix[:, :size] = (
            problem.equality_matrix, problem.inequality_matrix)
        elastic.equality_vector, elastic.lower, elastic.upper = problem.equality_vector, problem.lower, problem.upper
        elastic.least[:size], elastic.largest[:size] = problem.least, problem.largest
        is_solved, x, _ = self._engine.solve(elastic)
        return is_solved and float(np.abs(x[size:]).max()) > INFEASIBLE_ABOVE
