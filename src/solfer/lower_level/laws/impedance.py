"""The implicit joint impedance law."""

from typing import Protocol

import numpy as np
from scipy.linalg.lapack import dposv

REGULARISATION = 1e-9  # of the largest diagonal entry; keeps M positive definite where the base's chart is singular


class Dynamics(Protocol):
    """Dynamics of a robot that the law needs; `solfer.model.Kinematics` provides them.

    Attributes:
        size: Number of DoFs, those of a floating base included.
    """

    @property
    def size(self) -> int:
        """See above."""

    def inertia(self, q: np.ndarray, /) -> np.ndarray:
        """Return the joint space inertia M(q), shape (size, size)."""

    def bias(self, q: np.ndarray, v: np.ndarray, /) -> np.ndarray:
        """Return the Coriolis, centrifugal and gravity forces, shape (size,)."""


class ImplicitImpedance:
    """Torques of joint springs and dampers, evaluated at the end of the time step.

    With the springs' target position q_d, target velocity v_d, diagonal stiffness K and damping D:

        r = K (q_d - q - dt v) + D (v_d - v) + tau_ff
        (M + dt D) a = r - nle
        tau = r - dt D a

    It is stable for any stiffness and damping, where the explicit law with a robot's own gains diverges on light links.
    Rows without an actuator (a floating base) have K = D = tau_ff = 0. External forces are not in the prediction.

    Source: J. Tan, K. Liu, G. Turk, "Stable Proportional-Derivative Controllers", IEEE Computer Graphics and
    Applications 31(4), 2011.

    A drive at or beyond its speed limit only brakes.

    Args:
        dynamics: Inertia and bias forces of the robot.
        effort_limit: Largest torque of each DoF, zero where there is no actuator, shape (size,) [Nm, N].
        velocity_limit: Largest speed of each DoF's drive, shape (size,) [rad/s, m/s].

    Attributes:
        position, velocity, effort, stiffness, damping: q_d, v_d, tau_ff, and the diagonals of K and D; to be written
            by the caller, shape (size,).
        torque: The torques of the newest `update`, within the effort limits, shape (size,) [Nm, N].
    """

    def __init__(self, dynamics: Dynamics, effort_limit: np.ndarray, velocity_limit: np.ndarray):
        size = dynamics.size
        self._dynamics = dynamics
        self._upper = np.array(effort_limit, dtype=float)
        self._lower = -self._upper
        self._fastest = np.array(velocity_limit, dtype=float)
        self._slowest = -self._fastest
        self._too_fast = np.zeros(size, dtype=bool)
        self.position, self.velocity, self.effort = np.zeros(size), np.zeros(size), np.zeros(size)
        self.stiffness, self.damping, self.torque = np.zeros(size), np.zeros(size), np.zeros(size)
        self._matrix = np.zeros((size, size), order="F")
        self._diagonal = self._matrix.reshape(-1, order="F")[:: size + 1]
        self._force, self._work, self._right = np.zeros(size), np.zeros(size), np.zeros(size)

    def update(self, q: np.ndarray, v: np.ndarray, dt: float) -> np.ndarray:
        """Compute `torque` for the step of `dt` [s] that begins at position q and velocity v, shape (size,)."""
        self._pull(q, v, dt)
        np.multiply(self.damping, dt, out=self._work)
        np.multiply(self._work, self._accelerations(q, v), out=self._work)
        np.subtract(self._force, self._work, out=self._force)
        return self._limit(v)

    def _pull(self, position: np.ndarray, velocity: np.ndarray, dt: float) -> None:
        """Write the force r of springs and dampers at a position and a velocity."""
        force, work = self._force, self._work
        np.multiply(velocity, dt, out=work)
        np.add(work, position, out=work)
        np.subtract(self.position, work, out=work)
        np.multiply(self.stiffness, work, out=force)
        np.subtract(self.velocity, velocity, out=work)
        np.multiply(self.damping, work, out=work)
        np.add(force, work, out=force)
        np.add(force, self.effort, out=force)

    def _accelerations(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Solve (M + W) a = r - nle, with the force r and the diagonal W in the work array, for a, shape (size,)."""
        diagonal = self._diagonal
        np.copyto(self._matrix, self._dynamics.inertia(q))
        np.subtract(self._force, self._dynamics.bias(q, v), out=self._right)
        np.add(diagonal, self._work, out=diagonal)
        np.add(diagonal, REGULARISATION * diagonal.max(), out=diagonal)
        _, acceleration, failed = dposv(self._matrix, self._right, lower=1, overwrite_a=1, overwrite_b=1)
        if failed:  # M is not positive definite: leave this step to the explicit law
            acceleration[:] = 0.0
        return acceleration

    def _limit(self, velocity: np.ndarray) -> np.ndarray:
        """Write the force, within the limits of the drives at a velocity, to `torque`."""
        np.minimum(self._force, self._upper, out=self._force)
        np.maximum(self._force, self._lower, out=self.torque)
        np.minimum(
            self.torque, 0.0, out=self.torque, where=np.greater_equal(velocity, self._fastest, out=self._too_fast)
        )
        np.maximum(self.torque, 0.0, out=self.torque, where=np.less_equal(velocity, self._slowest, out=self._too_fast))
        return self.torque
