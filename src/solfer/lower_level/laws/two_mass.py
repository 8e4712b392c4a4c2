"""Drives with a spring between motor and joint: two masses on each such joint."""

import numpy as np

from solfer.lower_level.laws.impedance import Dynamics, ImplicitImpedance
from solfer.lower_level.laws.springs import Springs, mobility_of

ACCURATE = 1.0 / 12.0
"""Share beta of the springs' acceleration with which periods are right to the fourth order of the step."""

LEARNING = 0.001
"""Share of an acceleration that was not expected by which the next is expected.

After a second most is learned. Faster would shake wheels on the ground: it takes damping from their springs.
"""

HOLDING = 1e7
"""Damping with which a motor holds its speed; beside it nothing counts [Nms/rad]."""


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
    linear system of the size of M. It knows contacts only by what they did in the last second: while they change, the
    spring of a link that they hold is softer than K by up to (w dt)^2 / 12. Link and motor feel opposite torques.

    A spring that swings faster than a step resolves only gives way, theta = q + tau / K: its rotor has no inertia, and
    the impedance acts on the joint, with spring, damper and torque of the law times 1 / (1 + stiffness / K),
    as of springs in series.

    Source: N. Newmark, "A Method of Computation for Structural Dynamics", Journal of the Engineering Mechanics Division
    85(3), 1959. Limits: T. Hughes, "The Finite Element Method", 1987, section 9.1.

    Args:
        dynamics: Inertia and bias forces of the robot's links.
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
        size, self._dt, self.springs = dynamics.size, dt, springs
        self._elastic, self._rigid = springs.two_mass, ~springs.two_mass
        self._sprung, self._compliance = springs.stiffness > 0.0, springs.compliance
        self._spring, self._damper = (
            np.where(self._elastic, values, 0.0) for values in (springs.stiffness, springs.damping)
        )
        self._friction = springs.friction
        self._coupling = np.zeros(size)
        self._coupling[self._elastic] = self._coupled(dynamics.inertia(posture))
        self._slow = np.where(self._elastic, springs.rotor, 0.0) + dt * springs.friction
        self.motor_position, self.motor_velocity, self.drive = np.zeros(size), np.zeros(size), np.zeros(size)
        self._tension, self._pulled, self._loss = np.zeros(size), np.zeros(size), np.zeros(size)
        self._links, self._motors = np.zeros(size), np.zeros(size)
        self._free, self._inert, self._share = np.zeros(size), np.zeros(size), np.zeros(size)
        self._before, self._expected, self._surprise = np.zeros(size), np.zeros(size), np.zeros(size)
        self._clipped = np.zeros(size, dtype=bool)

    @property
    def motor_side(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Which DoFs have two masses, position and velocity of their motors, and the compliance of other springs."""
        return self._elastic, self.motor_position, self.motor_velocity, self._compliance

    def place(self, q: np.ndarray) -> None:
        """Put the motors where the joints are, at rest; q has the shape (size,)."""
        self.motor_position[:] = q
        for rest in (self.motor_velocity, self._before, self._expected, self._surprise):
            rest[:] = 0.0

    def update(self, q: np.ndarray, v: np.ndarray, dt: float) -> np.ndarray:
        """Compute `torque`, and move the motors on, for the step that begins at position q and velocity v.

        Args:
            q: Position of the links, shape (size,).
            v: Velocity of the links, shape (size,).
            dt: Duration of the step, that of all steps [s].
        """
        np.copyto(self.motor_position, q, where=self._rigid)
        np.copyto(self.motor_velocity, v, where=self._rigid)
        self._learn(v)
        self._stretch(q, v)
        self._pull(self.motor_position, self.motor_velocity, dt)
        self._soften(dt)
        self._solve(q, v)
        if self._saturate():  # then some drives do not follow their law, and all is different
            self._solve(q, v)
            self._saturate()
        self._release()
        return self.torque

    def _coupled(self, inertia: np.ndarray) -> np.ndarray:
        """Choose gamma, and return what a spring gains for a unit of delta'', K beta dt^2 + D gamma dt."""
        elastic, dt = self._elastic, self._dt
        alone = mobility_of(inertia, self.springs.rotor, elastic).diagonal()
        damped = dt * self._damper[elastic] * alone
        gamma = np.maximum(0.5, 1.0 - np.divide(1.0, damped, out=np.full(len(damped), np.inf), where=damped > 0.0))
        return ACCURATE * dt**2 * self._spring[elastic] + gamma * dt * self._damper[elastic]

    def _learn(self, v: np.ndarray) -> None:
        """Learn from the last step which acceleration of the links contacts and pushes cause."""
        work = self._work
        np.subtract(v, self._before, out=work)
        np.divide(work, self._dt, out=work)
        np.subtract(work, self._expected, out=work)
        np.multiply(work, LEARNING, out=work)
        np.add(self._surprise, work, out=self._surprise)
        np.copyto(self._before, v)

    def _stretch(self, q: np.ndarray, v: np.ndarray) -> None:
        """Write the torques of the springs as they are at the beginning of the step."""
        tension, work = self._tension, self._work
        np.subtract(self.motor_position, q, out=tension)
        np.multiply(self._spring, tension, out=tension)
        np.subtract(self.motor_velocity, v, out=work)
        np.multiply(self._damper, work, out=work)
        np.add(tension, work, out=tension)

    def _soften(self, dt: float) -> None:
        """Write the law's force, and what it loses for a unit of acceleration: dt D, with two masses dt (D + dt K)."""
        loss, share = self._loss, self._share
        np.multiply(self.stiffness, self._elastic, out=loss)
        np.multiply(loss, dt, out=loss)
        np.add(loss, self.damping, out=loss)
        np.multiply(loss, dt, out=loss)
        np.multiply(self._compliance, self.stiffness, out=share)
        np.add(share, 1.0, out=share)
        np.divide(loss, share, out=loss)
        np.divide(self._force, share, out=self._pulled)

    def _solve(self, q: np.ndarray, v: np.ndarray) -> None:
        """Write the accelerations of links and motors, for the law p - l alpha of force p and loss l.

        With the spring's gain c and m = B + dt d + l a motor has alpha = (p - d theta' - tension + c a) / (m + c). What
        remains is (M + W) a = tension + c / (m + c) (p - d theta' - tension) - nle with W = c m / (m + c). Without two
        masses W is m, and p - d q' acts on the link.
        """
        free, inert, share, links = self._free, self._inert, self._share, self._links
        np.multiply(self._friction, self.motor_velocity, out=free)
        np.subtract(self._pulled, free, out=free)
        np.subtract(free, self._tension, out=free)
        np.add(self._slow, self._loss, out=inert)
        np.add(inert, self._coupling, out=share)
        np.copyto(share, 1.0, where=self._rigid)
        np.divide(self._coupling, share, out=share, where=self._elastic)
        np.multiply(share, free, out=self._force)
        np.add(self._force, self._tension, out=self._force)
        np.multiply(share, inert, out=self._work)
        np.copyto(self._motors, self._accelerations(q, v))
        np.add(self._motors, self._surprise, out=links)
        np.copyto(self._expected, links)
        self._move(free, inert)

    def _move(self, free: np.ndarray, inert: np.ndarray) -> None:
        """Write the motors' accelerations: `free` is the torque on each while nothing accelerates, `inert` its mass."""
        moved, elastic = self._motors, self._elastic
        np.multiply(self._coupling, self._links, out=self._work)
        np.add(free, self._work, out=moved, where=elastic)
        np.add(inert, self._coupling, out=inert)
        np.divide(moved, inert, out=moved, where=elastic)

    def _saturate(self) -> bool:
        """Write the torques of the drives within their limits; drives behind a spring that reach one become constant.

        Returns:
            Whether there are any.
        """
        force, clipped, drive = self._force, self._clipped, self.drive
        np.multiply(self._loss, self._motors, out=force)
        np.subtract(self._pulled, force, out=force)
        np.copyto(drive, force)
        np.not_equal(self._limit(self.motor_velocity), drive, out=clipped)
        np.copyto(drive, self.torque)
        np.logical_and(clipped, self._sprung, out=clipped)
        np.copyto(self._pulled, drive, where=clipped)
        np.copyto(self._loss, 0.0, where=clipped)
        return bool(clipped.any())

    def _release(self) -> None:
        """Write the springs' torques with what the drives have left, and move the motors on."""
        free, torque = self._free, self.torque
        np.multiply(self._friction, self.motor_velocity, out=free)
        np.subtract(self.drive, free, out=free)
        np.subtract(free, self._tension, out=free)
        np.copyto(self._inert, self._slow)
        self._move(free, self._inert)
        np.subtract(self._motors, self._links, out=torque)
        np.multiply(self._coupling, torque, out=torque)
        np.add(torque, self._tension, out=torque)
        np.multiply(self._slow, self._motors, out=self._work)  # without two masses, what friction takes
        np.subtract(free, self._work, out=torque, where=self._rigid)
        np.multiply(self._motors, self._dt, out=self._work)
        np.add(self.motor_velocity, self._work, out=self.motor_velocity)
        np.multiply(self.motor_velocity, self._dt, out=self._work)
        np.add(self.motor_position, self._work, out=self.motor_position)
