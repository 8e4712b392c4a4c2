"""One level of tasks as a QP."""

from collections.abc import Sequence

import numpy as np

from solfer.errors import SizeMismatch, TaskError
from solfer.numerics.bounds.velocity import VelocityBounds
from solfer.numerics.solvers.qp import QpSolver, Solution
from solfer.tasks.constraints import Constraint
from solfer.tasks.kernel import objective, span
from solfer.tasks.stack import Stack


class Inequalities:
    """All constraints one below the other.

    Args:
        constraints: The constraints.
        size: DoFs n.

    Attributes:
        matrix: Rows of all, shape (rows, n).
        lower: Lower bounds, shape (rows,).
        upper: Upper bounds, shape (rows,).
        weights: Weights of violations, inf where they are forbidden, shape (rows,).
        names: Name of each row's constraint, shape (rows,).

    Raises:
        TaskError: An element is not a constraint.
        SizeMismatch: A constraint does not have one column a DoF.
    """

    def __init__(self, constraints: Sequence[Constraint], size: int):
        for constraint in constraints:
            if not isinstance(constraint, Constraint):
                raise TaskError(f"a QP has constraints, got {type(constraint).__name__}", expected="a Constraint")
            if constraint.matrix.shape[1] != size:
                raise SizeMismatch(
                    f"a matrix of {constraint.matrix.shape[1]} columns for {size} DoFs", where=constraint.where
                )
        rows = sum(constraint.rows for constraint in constraints)
        self.matrix = np.zeros((rows, size))
        self.lower = np.zeros(rows)
        self.upper = np.zeros(rows)
        ends = np.cumsum([constraint.rows for constraint in constraints]).tolist()
        self._constraints = tuple(
            (one, self.matrix[end - one.rows : end], self.lower[end - one.rows : end], self.upper[end - one.rows : end])
            for one, end in zip(constraints, ends, strict=True)
        )
        self.weights = np.array(
            [np.inf if one.weight is None else one.weight for one in constraints for _ in range(one.rows)], dtype=float
        )

        self.names = np.array([one.name for one in constraints for _ in range(one.rows)], dtype=object)

    @property
    def rows(self) -> int:
        """Rows of all constraints."""
        return len(self.lower)

    def update(self) -> None:
        """Compute all constraints at the state of the last update of the Robot."""
        for constraint, matrix, lower, upper in self._constraints:
            constraint.update()
            matrix[:] = constraint.matrix
            lower[:] = constraint.lower
            upper[:] = constraint.upper


class QpLevel:
    """The joint velocities dq of one level, near those of the levels before it.

    The least of |r - J dq|^2 d^2 / D^2 + d^2 |dq - before|^2, where each row has its own damping D and d is the least
    of them, plus w s^2 for each slack, while J dq of the levels before stays the same, velocities stay in their
    bounds, and C dq + s within those of the constraints. The rows J of the levels before count as orthonormal rows that
    span them: rows that repeat each other, also almost, do no harm. Without bounds and constraints this is a
    `Hierarchy`'s step.

    Args:
        stack: The levels.
        index: Number of the level.
        bounds: Bounds of the velocities, or None.
        inequalities: Constraints.
        weights: Weights of their slacks, inf where there is none, shape (rows,).
        basis: Orthonormal rows that span those of the levels before, with zeros for dependent ones, shape (rows, n);
            the level appends those of the one before it. All levels share it, and are solved in their order.

    Attributes:
        solver: The QP.
    """

    def __init__(
        self,
        stack: Stack,
        index: int,
        bounds: VelocityBounds | None,
        inequalities: Inequalities,
        weights: np.ndarray,
        *,
        basis: np.ndarray,
    ):
        start = stack.ends[index]
        end = stack.ends[index + 1]
        self._stack = stack
        self._basis = basis
        self._spanned = (int(stack.ends[max(index - 1, 0)]), int(start))
        self._size = stack.size
        self._bounds = bounds
        self._inequalities = inequalities
        self._jacobian = stack.jacobian[start:end]
        self._velocity = stack.velocity[start:end]
        self._numbers = stack.numbers[start:end]
        self._is_first = index == 0
        soft = np.flatnonzero(np.isfinite(weights))
        self.solver = QpSolver(self._size + len(soft), start, inequalities.rows)
        self._problem = problem = self.solver.problem
        slacks = self._size + np.arange(len(soft))
        problem.hessian[slacks, slacks] = weights[soft]
        problem.inequality_matrix[soft, slacks] = 1.0
        if start:
            problem.equality_matrix = basis[:start]
        if not self._is_first:
            problem.inequality_matrix = inequalities.matrix
        self._reached = np.zeros(inequalities.rows)

    def solve(self, before: np.ndarray) -> Solution:
        """Solve the level at the last update of the stack; `before` is dq of the levels before, shape (n,)."""
        problem = self._problem
        size = self._size
        objective(self._jacobian, self._velocity, self._numbers, before, problem.hessian, problem.gradient)
        if self._bounds is not None:
            problem.x_min[:size], problem.x_max[:size] = self._bounds.lower, self._bounds.upper
        if self._inequalities.rows:
            problem.lower[:], problem.upper[:] = self._inequalities.lower, self._inequalities.upper
        if self._is_first:
            problem.inequality_matrix[:, :size] = self._inequalities.matrix
        else:
            self._admit(before)
        return self.solver.solve()

    def _admit(self, before: np.ndarray) -> None:
        """Keep what the levels before reached, and widen the bounds that they have violated, also by rounding."""
        problem = self._problem
        span(self._stack.jacobian, *self._spanned, self._basis)
        np.dot(problem.equality_matrix, before, out=problem.equality_vector)
        np.minimum(problem.x_min, before, out=problem.x_min)
        np.maximum(problem.x_max, before, out=problem.x_max)
        if self._inequalities.rows:
            np.dot(problem.inequality_matrix, before, out=self._reached)
            np.minimum(problem.lower, self._reached, out=problem.lower)
            np.maximum(problem.upper, self._reached, out=problem.upper)
