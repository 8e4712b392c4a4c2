"""The implicit joint impedance law."""

from typing import Protocol

import numpy as np


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
        table: All numbers of the law, see `kernel`.
        torque: The torques of the newest `update`, within the effort limits, shape (size,) [Nm, N].
    """

    def __init__(self, dynamics: Dynamics, effort_limit: np.ndarray, velocity_limit: np.ndarray):
        # imported here: its compiler takes a while to load
        from solfer.lower_level.laws import kernel
        from solfer.numerics.blocks import MemoryBlock
        from solfer.numerics.lapack import dposv_address

        size = dynamics.size
        self._kernel = kernel
        table = self.table = np.zeros((kernel.ROWS, size))
        table[kernel.UPPER] = effort_limit
        table[kernel.FASTEST] = velocity_limit
        self.position, self.velocity, self.effort = (
            table[row] for row in (kernel.POSITION, kernel.VELOCITY, kernel.EFFORT)
        )
        self.stiffness = table[kernel.STIFFNESS]
        self.damping = table[kernel.DAMPING]
        self.torque = table[kernel.TORQUE]
        self._dynamics = dynamics
        self._elastic, self._sprung = np.zeros((2, size), dtype=bool)
        self._block = MemoryBlock(
            kernel.LAW,
            size=size,
            dposv_address=dposv_address(),
            table=table,
            matrix=np.zeros((size, size)),
            elastic=self._elastic,
            sprung=self._sprung,
        )

    def place(self, q: np.ndarray) -> None:
        """Begin with a robot at rest that was put to q, shape (size,), and is held there."""
        self.table[[self._kernel.BEFORE, self._kernel.TORQUE]] = 0.0

    def limit(self, dof: int, torque: float) -> None:
        """Change the largest torque of a drive [Nm, N]; 0: it has no power."""
        self.table[self._kernel.UPPER, dof] = torque

    def update(self, q: np.ndarray, v: np.ndarray, dt: float) -> np.ndarray:
        """Compute `torque` for the step of `dt` [s] that begins at position q and velocity v, shape (size,)."""
        self._kernel.update_rigid(self._block.address, self._dynamics.inertia(q), q, v, dt)
        return self.torque
