"""The QP of an inverse dynamics: accelerations and forces of contacts within all limits."""

import numpy as np

from solfer.components.inverse_dynamics.ground import Ground
from solfer.components.inverse_dynamics.kernel import build, finish, touch
from solfer.numerics.acceleration_bounds import AccelerationBounds
from solfer.numerics.solvers.active_set import GAVE_UP, INACCURATE, INFEASIBLE, NOT_FINITE, SOLVED, ActiveSet
from solfer.numerics.solvers.qp import Problem
from solfer.robot import Robot

QP_TOLERANCE = 1e-9
"""Largest residual of a solution, see `numerics.solvers.qp.Solution`."""

TOUCHES = 1e-6
"""Share of a limit, or of 1, within which it counts as active."""

QP_ACCELERATION, QP_FORCE = 1e-8, 1e-5
"""Weights of the squares of each acceleration [s^4/rad^2, s^4/m^2], and of each force in units of a contact's share of
the weight, beside tasks of weight 1: what tasks leave open is small, and forces are shared out."""

CONTRADICTION = "what contacts hold"
"""What is violated where equalities have no solution."""

_WHY = {
    INFEASIBLE: "contradicts the others",
    GAVE_UP: "takes too many steps",
    INACCURATE: "depends on others almost",
    NOT_FINITE: "is not finite",
}


class WholeBodyProblem:
    """The accelerations a and contact forces f next to what tasks demand, and the torques that make them.

        least |W (J a - r)|^2  with  M a + h = S' tau + Jc' f,  Jc a + b = - D Jc v,
        G f <= 0,  0 <= N f <= most,  |tau| <= tau_max,  a_min <= a <= a_max

    Torques follow from a and f, and are no unknowns; nor is what the equalities fix, see `kernel`. The method starts
    from the cost alone: equal states have equal torques.

    Args:
        robot: The Robot; inertia and bias are used.
        ground: Its contacts.
        bounds: Bounds of the accelerations of all DoFs, updated by the caller.
        rows: Rows of all tasks.
        torque_limits: Largest torques of all DoFs, inf where there is none, shape (n,) [Nm, N].

    Attributes:
        acceleration: a of the last solution, shape (n,) [rad/s^2, m/s^2].
        force: f of the last solution, shape (k,) [N, Nm].
        torque: tau of the last solution, zero where there is no drive, shape (n,) [Nm, N].
        active: 1 for each constraint that is at a limit in the last solution, else 0, shape (c,); `names` are theirs.
        names: Names of the constraints: `torque of J`, `friction of C`, `normal force of C`, `acceleration of J`.
        steps: Steps of the solver in the last `solve`.
    """

    def __init__(self, robot: Robot, ground: Ground, bounds: AccelerationBounds, rows: int, torque_limits: np.ndarray):
        size = robot.size
        forces = ground.rows.rows
        self._robot = robot
        self._ground = ground
        self._bounds = bounds
        followers = robot.kinematics.followers.dofs
        moved = np.setdiff1d(np.arange(size), followers)
        self._driven = np.intersect1d(robot.actuated, moved).astype(np.int64)
        self._passive = np.setdiff1d(moved, robot.actuated).astype(np.int64)
        self._limits = torque_limits[self._driven]
        fixed = len(self._passive) + forces
        free = size - len(self._passive)
        self._smallest = np.concatenate((np.full(size, QP_ACCELERATION), np.full(forces, QP_FORCE)))
        self._rows = np.zeros((fixed, size + forces))
        self._sides = np.zeros(fixed)
        self._fixed = np.zeros(fixed, dtype=np.int64)
        self._free = np.zeros(free, dtype=np.int64)
        self._table = np.zeros((fixed, free))
        self._work = np.zeros((3, size + forces))
        contacts = len(ground.normals)
        first = len(self._driven) + len(ground.cones) + contacts
        self._problem = Problem.empty(free, 0, first + fixed)
        self._method = ActiveSet(free, first + fixed, QP_TOLERANCE)
        self._z = np.zeros(free)
        self.acceleration = np.zeros(size)
        self.torque = np.zeros(size)
        self.force = np.zeros(forces)
        self.names = (
            *(f"torque of {robot.dofs[dof]}" for dof in self._driven),
            *(f"friction of {ground.names[owner]}" for owner in ground.owners),
            *(f"normal force of {name}" for name in ground.names),
            *(f"acceleration of {dof}" for dof in robot.dofs),
        )
        self.active = np.zeros(len(self.names), dtype=np.int64)
        self._values, self._least, self._most = np.zeros((3, len(self.names)))
        self._least[: len(self._driven)], self._most[: len(self._driven)] = -self._limits, self._limits
        self._least[len(self._driven) : first - contacts] = -np.inf
        self._first = first
        self.steps = 0
        self._outcome = SOLVED

    def limit_torques(self, limits: np.ndarray) -> None:
        """Set the largest torques of all DoFs, shape (n,) [Nm, N]."""
        np.take(limits, self._driven, out=self._limits)
        np.negative(self._limits, out=self._least[: len(self._driven)])
        self._most[: len(self._driven)] = self._limits

    def solve(self, jacobian: np.ndarray, desired: np.ndarray, demanded: np.ndarray) -> bool:
        """Solve the problem at the last update of the Robot; `violated` has the reason where there is no solution.

        Args:
            jacobian: W J of all tasks, shape (rows, n).
            desired: W r, shape (rows,).
            demanded: Jc a of contacts, shape (k,).
        """
        dynamics = self._robot.dynamics
        ground = self._ground
        problem = self._problem
        inertia = dynamics.inertia
        bias = dynamics.bias
        held = ground.rows.jacobian
        is_sound = build(
            inertia,
            bias,
            held,
            demanded,
            ground.unit,
            self._passive,
            ground.holds,
            jacobian,
            desired,
            self._smallest,
            self._driven,
            self._limits,
            ground.cones,
            ground.normals,
            ground.most,
            self._bounds.lower,
            self._bounds.upper,
            self._rows,
            self._sides,
            self._fixed,
            self._free,
            self._table,
            self._work,
            problem.hessian,
            problem.gradient,
            problem.inequality_matrix,
            problem.lower,
            problem.upper,
            problem.least,
            problem.largest,
        )
        self._outcome = INFEASIBLE
        if not is_sound:
            self._values[:] = np.nan
            return False
        self._outcome, self.steps, _ = self._method.solve(problem, self._z)
        finish(
            self._z,
            inertia,
            bias,
            held,
            ground.unit,
            self._passive,
            self._fixed,
            self._sides,
            self._free,
            self._table,
            self.acceleration,
            self.force,
            self.torque,
        )
        self._compare()
        return bool(self._outcome == SOLVED)

    @property
    def violated(self) -> str:
        """The constraint that the last `solve` could not keep beside the others, and why."""
        beyond = np.maximum(self._least - self._values, self._values - self._most)
        if self._outcome == NOT_FINITE or not np.isfinite(self._values).all():
            return f"{CONTRADICTION} {_WHY[self._outcome]}"
        return f"{self.names[int(np.argmax(beyond))]} {_WHY[self._outcome]}"

    def _compare(self) -> None:
        """Write what is bounded, and which bounds it touches."""
        values = self._values
        drives = len(self._driven)
        ground = self._ground
        cones = drives + len(ground.cones)
        first = self._first
        np.take(self.torque, self._driven, out=values[:drives], mode="clip")
        np.dot(ground.cones, self.force, out=values[drives:cones])
        np.dot(ground.normals, self.force, out=values[cones:first])
        values[first:] = self.acceleration
        self._most[cones:first] = ground.most
        self._least[first:], self._most[first:] = self._bounds.lower, self._bounds.upper
        touch(values, self._least, self._most, TOUCHES, self.active)
