"""The QP of an inverse dynamics: accelerations and forces of contacts within all limits."""

from typing import NamedTuple

import numpy as np

from solfer.components.inverse_dynamics.constraints import ProblemConstraints
from solfer.components.inverse_dynamics.ground import Ground
from solfer.components.inverse_dynamics.kernel import build, finish
from solfer.numerics.bounds.acceleration import AccelerationBounds
from solfer.numerics.solvers.qp import QpSolver, QpStatus
from solfer.robot import Robot

ACCELERATION_WEIGHT = 1e-8
"""Weight of the square of each acceleration beside tasks of weight 1 [s^4/rad^2, s^4/m^2]: what tasks leave open is
small."""

FORCE_WEIGHT = 1e-5
"""Weight of the square of each force in units of a contact's part of the weight: forces are distributed."""


class Elimination(NamedTuple):
    """What the kernel writes when it eliminates what the e equalities fix, in its order; see `kernel`.

    Attributes:
        rows: A, shape (e, n + k).
        sides: b, then c, shape (e,).
        fixed: The fixed unknowns, shape (e,).
        free: The free ones, shape (m,).
        table: T, shape (e, m).
        work: Work space, shape (3, n + k).
        origins: Work space, shape (k, k).
    """

    rows: np.ndarray
    sides: np.ndarray
    fixed: np.ndarray
    free: np.ndarray
    table: np.ndarray
    work: np.ndarray
    origins: np.ndarray

    @classmethod
    def empty(cls, fixed: int, free: int, forces: int) -> "Elimination":
        """Make one of a number of fixed and of free unknowns, and of forces."""
        unknowns = fixed + free
        return cls(
            np.zeros((fixed, unknowns)),
            np.zeros(fixed),
            np.zeros(fixed, dtype=np.int64),
            free=np.zeros(free, dtype=np.int64),
            table=np.zeros((fixed, free)),
            work=np.zeros((3, unknowns)),
            origins=np.zeros((forces, forces)),
        )


class WholeBodyProblem:
    """The accelerations a and contact forces f next to what tasks demand, and the torques that make them.

        least |W (J a - r)|^2  with  M a + h = S' tau + Jc' f,  Jc a + b = - D Jc v,
        G f <= 0,  0 <= N f <= largest,  |tau| <= tau_max,  a_min <= a <= a_max

    Torques follow from a and f, and are no unknowns; nor is what the equalities fix, see `kernel`. The method starts
    from the cost alone: equal states have equal torques.

    Args:
        robot: The Robot; inertia and bias are used.
        ground: Its contacts.
        bounds: Bounds of the accelerations of all DoFs, updated by the caller.
        torque_limits: Largest torques of all DoFs, inf where there is none, shape (n,) [Nm, N].

    Attributes:
        acceleration: a of the last solution, shape (n,) [rad/s^2, m/s^2].
        force: f of the last solution, shape (k,) [N, Nm].
        torque: tau of the last solution, zero where there is no drive, shape (n,) [Nm, N].
        bounds: See above.
        steps: Steps of the solver in the last `solve`.
    """

    _REASONS = {
        QpStatus.INFEASIBLE: "contradicts the others",
        QpStatus.NOT_CONVERGED: "takes too many steps",
        QpStatus.INACCURATE: "depends on others almost",
        QpStatus.NOT_FINITE: "is not finite",
    }

    def __init__(self, robot: Robot, ground: Ground, bounds: AccelerationBounds, torque_limits: np.ndarray):
        size = robot.size
        forces = ground.rows.rows
        self._robot = robot
        self._ground = ground
        self.bounds = bounds
        moved = np.setdiff1d(np.arange(size), robot.kinematics.followers.dofs)
        driven = np.intersect1d(robot.actuated, moved).astype(np.int64)
        self._passive = np.setdiff1d(moved, robot.actuated).astype(np.int64)
        fixed = len(self._passive) + forces
        free = size - len(self._passive)
        self._smallest = np.concatenate((np.full(size, ACCELERATION_WEIGHT), np.full(forces, FORCE_WEIGHT)))
        self._elimination = Elimination.empty(fixed, free, forces)
        self._constraints = ProblemConstraints(robot, ground, bounds, driven, torque_limits)
        count = self._constraints.count + fixed
        self._solver = QpSolver(free, 0, count)
        self._z = np.zeros(free)
        self.acceleration = np.zeros(size)
        self.torque = np.zeros(size)
        self.force = np.zeros(forces)
        self.steps = 0
        self._status = QpStatus.SOLVED

    def solve(self, jacobian: np.ndarray, desired: np.ndarray, demanded: np.ndarray) -> bool:
        """Solve the problem at the last update of the Robot; `violated` has the reason where there is no solution.

        Args:
            jacobian: W J of all tasks, shape (rows, n).
            desired: W r, shape (rows,).
            demanded: Jc a of contacts, shape (k,).
        """
        dynamics = self._robot.dynamics
        ground = self._ground
        problem = self._solver.problem
        constraints = self._constraints
        solved = self._elimination
        inertia = dynamics.inertia
        bias = dynamics.bias
        held = ground.jacobian
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
            constraints.driven,
            constraints.limits,
            ground.cones,
            ground.normals,
            ground.largest,
            self.bounds.lower,
            self.bounds.upper,
            *solved,
            problem.hessian,
            problem.gradient,
            problem.inequality_matrix,
            problem.lower,
            problem.upper,
            problem.x_min,
            problem.x_max,
        )
        self._status = QpStatus.INFEASIBLE
        if not is_sound:
            constraints.values[:] = np.nan
            return False
        self._status, self.steps, _ = self._solver.write(self._z)
        finish(
            self._z,
            inertia,
            bias,
            held,
            ground.unit,
            self._passive,
            solved.fixed,
            solved.sides,
            solved.free,
            solved.table,
            self.acceleration,
            self.force,
            self.torque,
        )
        constraints.compare(self.torque, self.force, self.acceleration)
        return self._status is QpStatus.SOLVED

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the constraints: `torque of J`, `friction of C`, `normal force of C`, `acceleration of J`."""
        return self._constraints.names

    @property
    def active(self) -> np.ndarray:
        """1 for each constraint that is at a limit in the last solution, else 0, shape (c,); live."""
        return self._constraints.active

    def limit_torques(self, limits: np.ndarray) -> None:
        """Set the largest torques of all DoFs, shape (n,) [Nm, N]."""
        self._constraints.limit_torques(limits)

    @property
    def violated(self) -> str:
        """The constraint that the last `solve` could not keep beside the others, and why."""
        name = "" if self._status is QpStatus.NOT_FINITE else self._constraints.farthest()
        return f"{name or 'what contacts hold'} {self._REASONS[self._status]}"
