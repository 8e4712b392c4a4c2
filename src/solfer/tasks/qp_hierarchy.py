"""Tasks of strict priority by QPs, within limits."""

import enum
import logging
from collections.abc import Iterator, Sequence

import numpy as np

from solfer.errors import SizeMismatch, TaskError, UnknownName
from solfer.numerics.bounds.velocity import VelocityBounds
from solfer.numerics.solvers.qp import QpStatus, Solution
from solfer.tasks.constraints import Constraint
from solfer.tasks.hierarchy import Descent
from solfer.tasks.kernel import count_kept
from solfer.tasks.qp_level import Inequalities, QpLevel
from solfer.tasks.stack import Levels, Stack
from solfer.throttle import Throttle

log = logging.getLogger(__name__)


class QpPolicy(enum.Enum):
    """Reaction to a level whose QP is infeasible or fails; what fails is logged where it begins."""

    HOLD = "hold"
    """The level and all after it add nothing: if it is the first one, velocities are zero and joints hold."""
    STOP = "stop"
    """`QpFailed` is raised: the plugin stops, and its joints hold."""
    RELAX = "relax"
    """The first level is solved again with slacks for constraints; where that fails, and for others, `HOLD`."""


class QpFailed(TaskError):
    """A level that was not solved.

    Attributes:
        solution: Outcome of the solver, with the problem.
    """

    def __init__(self, what: str, solution: Solution, where: str):
        super().__init__(what, where=where)
        self.solution = solution


class QpHierarchy:
    """Joint velocities of levels of tasks by one QP a level, each without changing the results of the levels before.

    A level whose step by null spaces is within all limits, as are those before it, is solved by that.
    Constraints are kept by all levels; a slack is chosen by the first one, and not enlarged by others. See `QpLevel`.

    Args:
        levels: Tasks, or groups of tasks that are weighed against each other; the most important first.
        bounds: Bounds of the velocities, such as `joint_bounds(robot, period)`; they are updated in each cycle.
        constraints: Further constraints.
        policy: Reaction to a failed QP: `hold`, `stop` or `relax`.
        position: Positions that the bounds are for, live, shape (n,) [rad, m]; default: the measured ones.
        relax: Names of the constraints that the policy `relax` gives slacks; default: all.

    Attributes:
        stack: The levels.
        policy: Reaction to a failed QP.
        velocity: Joint velocities as of the last `update`, shape (n,) [rad/s, m/s]; live.
        relaxed: Solution of the first level with these slacks, None where that was not needed.

    Raises:
        TaskError: See `Stack`; or an element is not a constraint.
        SizeMismatch: Bounds, constraints or positions are of another robot's size.
        UnknownName: There is no such policy, or no such constraint.
    """

    def __init__(
        self,
        levels: Levels,
        bounds: VelocityBounds | None = None,
        constraints: Sequence[Constraint] = (),
        policy: QpPolicy | str = QpPolicy.HOLD,
        position: np.ndarray | None = None,
        *,
        relax: Sequence[str] | None = None,
    ):
        self.stack, self.policy = Stack(levels), _policy(policy)
        size = self.stack.size
        self._position = self.stack.robot.state.position if position is None else position
        for what, array in (("positions", self._position), ("bounds", None if bounds is None else bounds.lower)):
            if array is not None and array.shape != (size,):
                raise SizeMismatch(f"{what} of shape {array.shape} for {size} DoFs")
        self._bounds, self._inequalities = bounds, Inequalities(constraints, size)
        weights = self._inequalities.weights
        forbidden = np.full_like(weights, np.inf)
        self._descent = Descent(self.stack, checks=True)
        basis = self._descent.basis
        none = np.zeros(0)
        self._velocity_bounds = (none, none) if bounds is None else (bounds.lower, bounds.upper)
        self._levels = [
            QpLevel(
                self.stack,
                index,
                bounds,
                inequalities=self._inequalities,
                weights=forbidden if index else weights,
                basis=basis,
            )
            for index in range(len(self.stack.levels))
        ]
        self._relaxed_level: QpLevel | None = None
        if self.policy is QpPolicy.RELAX and self._inequalities.rows:
            yields = np.isinf(weights) & _named(self._inequalities.names, relax)
            weights = np.where(yields, 1e4, weights)  # beside tasks of weight 1
            self._relaxed_level = QpLevel(
                self.stack, 0, bounds, inequalities=self._inequalities, weights=weights, basis=basis
            )
        self.velocity = np.zeros(size)
        self._solved: list[Solution | None] = [None] * len(self._levels)
        self._free = 0  # levels whose steps are those of the null spaces
        self.relaxed: Solution | None = None
        self._throttle, self._failing = Throttle(log), set[int]()
        # the first QP may come late: it shall take no longer than the others, and no memory
        self.stack.update()
        for level in self._levels:
            level.solve(self.velocity)

    def update(self) -> np.ndarray:
        """Compute and return the joint velocities at the state of the last update of the Robot.

        Raises:
            QpFailed: A level was not solved and the policy is `stop`; `velocity` is zero then.
        """
        self.stack.update()
        if self._bounds is not None:
            self._bounds.update(self._position)
        self._inequalities.update()
        self.velocity[:] = 0.0
        self.relaxed = None
        self._free = free = self._free_levels()
        if free == len(self._levels):
            return self.velocity
        self._solved[:] = [None] * len(self._levels)
        for index, level in enumerate(self._levels[free:], free):
            solution = self._solved[index] = level.solve(self.velocity)
            if not solution.is_solved:
                solution = self._after_failure(index, solution)
                if solution is None:
                    break
            else:
                self._failing.discard(index)
            self._store(solution.x)
        return self.velocity

    @property
    def solutions(self) -> list[Solution | None]:
        """Solution of each level in the last `update`; None for levels after one that failed; a new list."""
        slopes = self._descent.slopes.tolist()
        free = [
            Solution(QpStatus.SOLVED, x.copy(), 0, problem=None, residual=slope)
            for x, slope in zip(self._descent.steps[: self._free], slopes, strict=False)
        ]
        return [*free, *self._solved[self._free :]]

    @property
    def smallest_singular_values(self) -> np.ndarray:
        """See `Stack.smallest_singular_values`."""
        return self.stack.smallest_singular_values

    def _free_levels(self) -> int:
        """Take the null spaces' steps of the first levels, as far as they are within all limits; return how many.

        They are the least of the cost without limits: where they keep them, they solve the QP.
        """
        descent = self._descent
        inequalities = self._inequalities
        descent.update()
        count = count_kept(
            descent.steps,
            descent.slopes,
            *self._velocity_bounds,
            inequalities.matrix,
            inequalities.lower,
            inequalities.upper,
            1e-9,  # tolerance, as that of a `QpSolver`
        )
        if self._failing:
            self._failing.difference_update(range(count))
        if count:
            self._store(descent.steps[count - 1])
        return count

    def _store(self, x: np.ndarray) -> None:
        """Store the velocities of a solution, free of the solver's tolerance."""
        self.velocity[:] = x[: len(self.velocity)]
        if self._bounds is not None:
            np.maximum(self.velocity, self._bounds.lower, out=self.velocity)
            np.minimum(self.velocity, self._bounds.upper, out=self.velocity)

    def _after_failure(self, index: int, solution: Solution) -> Solution | None:
        """Apply the policy; return the relaxed solution, None if the level adds nothing."""
        where = f"level {index} ({' + '.join(task.name for task in self.stack.levels[index])})"
        what = f"the QP is {solution.status.value} after {solution.iterations} steps"
        if self.policy is QpPolicy.STOP:
            self.velocity[:] = 0.0
            raise QpFailed(what, solution, where)
        if index == 0 and self._relaxed_level is not None:
            self.relaxed = self._relaxed_level.solve(self.velocity)
            if self.relaxed.is_solved:
                self._report(index, f"{where}: {what}; constraints are relaxed", self.relaxed.x)
                return self.relaxed
        self._report(index, f"{where}: {what}; it and all after it add nothing", self.velocity)
        return None

    def _report(self, index: int, text: str, x: np.ndarray) -> None:
        """Log a failure where it begins, with what is left of what each task of the level requests."""
        if index not in self._failing:
            self._failing.add(index)
            left = ", ".join(f"{name} {value:.3g}" for name, value in self._residuals(index, x[: len(self.velocity)]))
            self._throttle.warning(text, "%s; left of their rates: %s", text, left)

    def _residuals(self, index: int, x: np.ndarray) -> Iterator[tuple[str, float]]:
        """Yield the tasks of a level with the length of K e + v - J dq."""
        stack = self.stack
        row = int(self.stack.ends[index])
        for task in stack.levels[index]:
            rows = slice(row, row + task.rows)
            left = (stack.velocity[rows] - stack.jacobian[rows] @ x) / np.sqrt(task.weight)
            row = rows.stop
            yield task.name, float(np.linalg.norm(left))


def _named(names: np.ndarray, selected: Sequence[str] | None) -> np.ndarray:
    """Return which rows are of the desired constraints, of all if there are none."""
    for name in selected or ():
        if name not in names:
            raise UnknownName("constraint", name, dict.fromkeys(names))
    return np.full(len(names), True) if selected is None else np.isin(names.astype(str), list(selected))


def _policy(policy: QpPolicy | str) -> QpPolicy:
    names = [one.value for one in QpPolicy]
    if not isinstance(policy, QpPolicy) and policy not in names:
        raise UnknownName("policy", str(policy), names)
    return QpPolicy(policy)
