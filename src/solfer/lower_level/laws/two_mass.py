"""Drives with a spring between motor and joint: two masses on each such joint."""

import numpy as np

from solfer.lower_level.laws.impedance import Dynamics, ImplicitImpedance
from solfer.lower_level.laws.springs import Springs, mobility_of


class TwoMassImpedance(ImplicitImpedance):
    r"""Torques of springs between motors and joints; the impedance law acts on the motors.

    Behind its gear a motor has the position theta, the inertia B and the friction d. Between it and the joint at q is a
    spring of stiffness K with the damping D. With the drive's torque u and the spring's torque tau:

        B theta'' = u - tau - d theta'      M q'' + nle = tau      tau = K (theta - q) + D (theta' - q')

    u is what `ImplicitImpedance` says for the motor's position, with spring and damper of the law at the end of the
    step: stable for all gains, whatever hangs on the joint. Within a step x' changes first and x with the new x', for
    motors as for the simulator's links: speeds belong to the middle between two positions. For these the spring is

        tau = K (delta + beta dt^2 delta'') + D (delta' + gamma dt delta''),    delta = theta - q

    With gamma = 1/2 and beta = 1/12 that is Newmark's method of fourth order, which keeps the energy of an undamped
    oscillation. Its frequency w is right up to (w dt)^4 / 480, its damping up to (w dt)^2 / 12. gamma grows towards 1
    where D alone would stop the joint within a step. delta'' is found for all motors and links together, from one
    linear system of the size of M, with what else acted on the links in the last step. Link and motor feel opposite
    torques. For the law p - l alpha of force p and loss l, with the spring's gain c and m = B + dt d + l, a motor has
    alpha = (p - d theta' - tension + c a) / (m + c). What remains is (M + W) a = tension + c / (m + c)
    (p - d theta' - tension) + f with W = c m / (m + c). Without two masses W is m, and p - d q' acts on the link.
    Drives behind a spring that reach their limits are constant, and all is solved again.

    A spring that swings faster than a step resolves only yields, theta = q + tau / K: its rotor has no inertia, and
    the impedance acts on the joint, with spring, damper and torque of the law times 1 / (1 + stiffness / K),
    as of springs in series.

    Source: N. Newmark, "A Method of Computation for Structural Dynamics", Journal of the Engineering Mechanics Division
    85(3), 1959. Limits: T. Hughes, "The Finite Element Method", 1987, section 9.1.

    Args:
        dynamics: Inertia of the robot's links.
        limits: Largest torque u of each drive, zero where there is none, and its largest speed, shape (size,) each.
        springs: Springs and motors.
        posture: Positions for which gamma is chosen, shape (size,).
        dt: Duration of all steps [s].

    Attributes:
        springs: Springs and motors.
        motor_position, motor_velocity: theta and theta', shape (size,); those of the joint where it has no two masses.
        drive: Torques u of the newest `update`, shape (size,) [Nm]; `torque` has those of the springs.
    """

    def __init__(
        self,
        dynamics: Dynamics,
        limits: tuple[np.ndarray, np.ndarray],
        springs: Springs,
        posture: np.ndarray,
        dt: float,
    ):
        super().__init__(dynamics, *limits)
        self._dt = dt
        self.springs = springs
        table = self.table
        row = self._kernel
        self._elastic[:] = springs.two_mass
        self._sprung[:] = springs.stiffness > 0.0
        table[row.SPRING], table[row.DAMPER] = (
            np.where(self._elastic, values, 0.0) for values in (springs.stiffness, springs.damping)
        )
        table[row.FRICTION], table[row.COMPLIANCE] = springs.friction, springs.compliance
        table[row.COUPLING, self._elastic] = self._coupled(dynamics.inertia(posture))
        table[row.SLOW] = np.where(self._elastic, springs.rotor, 0.0) + dt * springs.friction
        self.motor_position = table[row.MOTOR_POSITION]
        self.motor_velocity = table[row.MOTOR_VELOCITY]
        self.drive = table[row.DRIVE]

    @property
    def motor_side(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Which DoFs have two masses, position and velocity of their motors, and the compliance of other springs."""
        return self._elastic, self.motor_position, self.motor_velocity, self.table[self._kernel.COMPLIANCE]

    def place(self, q: np.ndarray) -> None:
        """Put the motors where the joints are, at rest; q has the shape (size,)."""
        super().place(q)
        self.motor_position[:] = q
        self.motor_velocity[:] = 0.0

    def update(self, q: np.ndarray, v: np.ndarray, dt: float) -> np.ndarray:
        """Compute `torque`, and move the motors on, for the step that begins at position q and velocity v.

        Args:
            q: Position of the links, shape (size,).
            v: Velocity of the links, shape (size,).
            dt: Duration of the step, that of all steps [s].
        """
        self._kernel.update_two_mass(self._block.address, self._dynamics.inertia(q), q, v, dt)
        return self.torque

    def _coupled(self, inertia: np.ndarray) -> np.ndarray:
        """Choose gamma, and return what a spring gains for a unit of delta'', K beta dt^2 + D gamma dt."""
        elastic = self._elastic
        dt = self._dt
        row = self._kernel
        spring, damper = (self.table[each, elastic] for each in (row.SPRING, row.DAMPER))
        alone = mobility_of(inertia, self.springs.rotor, elastic).diagonal()
        damped = dt * damper * alone
        gamma = np.maximum(0.5, 1.0 - np.divide(1.0, damped, out=np.full(len(damped), np.inf), where=damped > 0.0))
        beta = 1.0 / 12.0  # periods are right to the fourth order of the step
        return beta * dt**2 * spring + gamma * dt * damper
