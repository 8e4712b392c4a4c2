"""The implicit joint impedance law."""

from typing import Protocol

import numpy as np
from scipy.linalg.lapack import dposv

REGULARISATION = 1e-9
"""Ratio of the largest diagonal entry of M that is added to all, so that M is positive definite where the base's chart
is singular."""


class Dynamics(Protocol):
    """Dynamics of a robot that the law needs; `solfer.model.Kinematics` provides them.

    Attributes:
        size: Number of DoFs, those of a floating base included.
    """

    @property
    def size(self) -> int:
        """See above."""

    def inertia(self, q: np.ndarray, /) -> np.ndarray:
        """Return the joint space inertia M(q), shape (size, size), symmetric."""


class ImplicitImpedance:
    """Torques of joint springs and dampers, evaluated at the end of the time step.

    With the springs' target position q_d, target velocity v_d, diagonal stiffness K and damping D:

        r = K (q_d - q - dt v) + D (v_d - v) + tau_ff
        (M + dt D) a = r + f
        tau = r - dt D a

    It is stable for any stiffness and damping, where the explicit law with a robot's own gains diverges on light links.
    Rows without an actuator (a floating base) have K = D = tau_ff = 0.

    f is everything that acts beside the torque, as it was in the last step, M dv / dt - tau: weight, contacts, pushes,
    friction. Rigid contacts answer to tau by -P tau, where P is a projection, orthogonal in the norm of M^-1. In that
    norm f changes tau by dt D (M + dt D)^-1, which is below one: f converges for all D, and at rest tau is r.

    Source: J. Tan, K. Liu, G. Turk, "Stable Proportional-Derivative Controllers", IEEE Computer Graphics and
    Applications 31(4), 2011.

    A drive at or beyond its speed limit only brakes.

    Args:
        dynamics: Inertia of the robot.
        effort_limit: Largest torque of each DoF, zero where there is no actuator, shape (size,) [Nm, N].
        velocity_limit: Largest speed of each DoF's drive, shape (size,) [rad/s, m/s].

    Attributes:
        position, velocity, effort, stiffness, damping: q_d, v_d, tau_ff, and the diagonals of K and D; to be written
            by the caller, shape (size,).
        torque: The torques of the newest `update`, within the effort limits, shape (size,) [Nm, N].
    """

    def __init__(self, dynamics: Dynamics, effort_limit: np.ndarray, velocity_limit: np.ndarray):
        # imported here: its compiler takes a while to load
        from solfer.lower_level.laws import kernel

        size = dynamics.size
        self._kernel = kernel
        table = self._table = np.zeros((kernel.ROWS, size))
        table[kernel.UPPER] = effort_limit
        table[kernel.FASTEST] = velocity_limit
        self.position, self.velocity, self.effort = (
            table[row] for row in (kernel.POSITION, kernel.VELOCITY, kernel.EFFORT)
        )
        self.stiffness = table[kernel.STIFFNESS]
        self.damping = table[kernel.DAMPING]
        self.torque = table[kernel.TORQUE]
        self._dynamics = dynamics
        self._force, self._loss, self._right, self._outside = (
            table[row] for row in (kernel.FORCE, kernel.LOSS, kernel.RIGHT, kernel.OUTSIDE)
        )
        self._matrix = np.zeros((size, size), order="F")
        self._diagonal = self._matrix.reshape(-1, order="F")[:: size + 1]

    def place(self, q: np.ndarray) -> None:
        """Begin with a robot at rest that was put to q, shape (size,), and is held there."""
        self._table[[self._kernel.BEFORE, self._kernel.TORQUE]] = 0.0

    def limit(self, dof: int, torque: float) -> None:
        """Change the largest torque of a drive [Nm, N]; 0: it has no power."""
        self._table[self._kernel.UPPER, dof] = torque

    def update(self, q: np.ndarray, v: np.ndarray, dt: float) -> np.ndarray:
        """Compute `torque` for the step of `dt` [s] that begins at position q and velocity v, shape (size,)."""
        inertia = self._dynamics.inertia(q)
        self._kernel.feel(self._table, inertia, v, dt)
        self._kernel.pull(self._table, q, v, dt)
        self._kernel.damp(self._table, self._accelerations(inertia))
        self._kernel.limit(self._table, v)
        return self.torque

    def _accelerations(self, inertia: np.ndarray) -> np.ndarray:
        """Solve (M + W) a = r + f, with r, f and the diagonal W in the table, for a, shape (size,)."""
        diagonal = self._diagonal
        np.copyto(self._matrix, inertia)
        np.add(self._force, self._outside, out=self._right)
        np.add(diagonal, self._loss, out=diagonal)
        np.add(diagonal, REGULARISATION * diagonal.max(), out=diagonal)
        _, acceleration, failed = dposv(self._matrix, self._right, lower=1, overwrite_a=1, overwrite_b=1)
        if failed:  # M is not positive definite: leave this step to the explicit law
            acceleration[:] = 0.0
        return acceleration
