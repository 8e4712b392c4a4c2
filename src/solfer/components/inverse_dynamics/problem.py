"""The QP of an inverse dynamics: accelerations and forces of contacts within all limits."""

import numpy as np

from solfer.components.inverse_dynamics.constraints import ProblemConstraints
from solfer.components.inverse_dynamics.demand import DemandedAccelerations
from solfer.components.inverse_dynamics.ground import Ground
from solfer.components.inverse_dynamics.kernel import WHOLE_BODY, build, finish
from solfer.dynamics import BIAS, INERTIA
from solfer.numerics.blocks import MemoryBlock
from solfer.numerics.bounds.acceleration import AccelerationBounds
from solfer.numerics.solvers.qp import QpSolver, QpStatus
from solfer.robot import Robot

ACCELERATION_WEIGHT = 1e-8
"""Weight of the square of each acceleration beside tasks of weight 1 [s^4/rad^2, s^4/m^2]: what tasks leave open is
small."""

FORCE_WEIGHT = 1e-5
"""Weight of the square of each force in units of a contact's part of the weight: forces are distributed."""


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
        demand: W J and W r of the tasks, and Jc a of the contacts; live.

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

    def __init__(
        self,
        robot: Robot,
        ground: Ground,
        bounds: AccelerationBounds,
        torque_limits: np.ndarray,
        demand: DemandedAccelerations,
    ):
        size = robot.size
        forces = ground.rows.rows
        self._dynamics = robot.dynamics
        self.bounds = bounds
        moved = np.setdiff1d(np.arange(size), robot.kinematics.followers.dofs)
        driven = np.intersect1d(robot.actuated, moved).astype(np.int64)
        passive = np.setdiff1d(moved, robot.actuated).astype(np.int64)
        fixed = len(passive) + forces
        free = size - len(passive)
        self._constraints = ProblemConstraints(robot, ground, bounds, driven, torque_limits)
        count = self._constraints.count + fixed
        self._solver = QpSolver(free, 0, count)
        problem = self._solver.problem
        self._z = np.zeros(free)
        self.acceleration = np.zeros(size)
        self.torque = np.zeros(size)
        self.force = np.zeros(forces)
        self.steps = 0
        self._status = QpStatus.SOLVED
        self._block = MemoryBlock(
            WHOLE_BODY,
            dofs=size,
            force_count=forces,
            inertia=self._dynamics.inertia,
            bias=self._dynamics.bias,
            passive_count=len(passive),
            passive=passive,
            driven_count=len(driven),
            driven=driven,
            torque_limits=self._constraints.limits,
            lower_acceleration=bounds.lower,
            upper_acceleration=bounds.upper,
            row_count=len(demand.tasks),
            task_rows=demand.stack.jacobian,
            desired=demand.tasks,
            smallest=np.concatenate((np.full(size, ACCELERATION_WEIGHT), np.full(forces, FORCE_WEIGHT))),
            contact_count=len(ground.normals),
            cone_count=len(ground.cones.matrix),
            jacobian=ground.jacobian,
            demanded=demand.contacts,
            holds=ground.holds,
            cones=ground.cones.matrix,
            normals=ground.normals,
            largest=ground.largest,
            unit=ground.unit,
            fixed_count=fixed,
            free_count=free,
            rows=np.zeros((fixed, size + forces)),
            sides=np.zeros(fixed),
            fixed=np.zeros(fixed, dtype=np.int64),
            free=np.zeros(free, dtype=np.int64),
            table=np.zeros((fixed, free)),
            work=np.zeros((3, size + forces)),
            origins=np.zeros((forces, forces)),
            limit_count=count,
            hessian=problem.hessian,
            gradient=problem.gradient,
            matrix=problem.inequality_matrix,
            lower=problem.lower,
            upper=problem.upper,
            z_min=problem.x_min,
            z_max=problem.x_max,
            z=self._z,
            acceleration=self.acceleration,
            force=self.force,
            torque=self.torque,
        )

    def solve(self) -> bool:
        """Solve the problem at the last update of the Robot, and of what is demanded.

        Returns:
            Whether there is a solution; `violated` has the reason where there is none.
        """
        for element in (INERTIA, BIAS):
            self._dynamics.manager.use(element)
        self._status = QpStatus.INFEASIBLE
        if not build(self._block.address):
            self._constraints.values[:] = np.nan
            return False
        self._status, self.steps, _ = self._solver.write(self._z)
        finish(self._block.address)
        self._constraints.compare(self.torque, self.force, self.acceleration)
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
