"""What an inverse dynamics commands: torques that pass smoothly, and positions and velocities beside them."""

import numpy as np

from solfer.dynamics import CarryingTorques
from solfer.robot import Robot

BLEND_TIME = 0.2
"""Time in which torques pass from the law to what holds the robot, and back [s]."""


class CommandedMotion:
    """Positions and velocities that accelerations lead to, and that return to the measured ones.

    Args:
        robot: The Robot.
        follow: Time in which they return [s].

    Attributes:
        position: Positions, shape (n,) [rad, m]; live.
        velocity: Velocities, shape (n,) [rad/s, m/s]; live.
        follow: See above; may be set.
    """

    def __init__(self, robot: Robot, follow: float):
        self._robot = robot
        self.position, self.velocity, self._step = np.zeros((3, robot.size))
        self.follow = follow

    def start(self, position: np.ndarray) -> None:
        """Begin at rest at a position, shape (n,) [rad, m]."""
        self.position[:] = position
        self.velocity[:] = 0.0

    def advance(self, acceleration: np.ndarray, step: float) -> None:
        """Go on by accelerations, shape (n,) [rad/s^2, m/s^2], for a time [s]."""
        state = self._robot.state
        coefficient = step / (self.follow + step)
        np.multiply(acceleration, step, out=self._step)
        self.velocity += self._step
        np.subtract(state.velocity, self.velocity, out=self._step)
        self._step *= coefficient
        self.velocity += self._step
        np.multiply(self.velocity, step, out=self._step)
        self.position += self._step
        np.subtract(state.position, self.position, out=self._step)
        self._step *= coefficient
        self.position += self._step
        np.maximum(self.position, self._robot.lower_limits.position, out=self.position)
        np.minimum(self.position, self._robot.upper_limits.position, out=self.position)


class CommandedTorques:
    """Torques that pass from one law to another without a jump.

    Args:
        carrying: Torques that carry the robot.
        speeds: DoFs whose drives take speeds alone, shape (m,).
        size: Number n of DoFs.

    Attributes:
        value: The torques, shape (n,) [Nm, N]; live.
    """

    def __init__(self, carrying: CarryingTorques, speeds: np.ndarray, size: int):
        self._carrying = carrying
        self._speeds = speeds
        self.value, self._before = np.zeros((2, size))
        self._left = 0.0

    def start(self) -> None:
        """Begin without a law before."""
        self._left = 0.0

    def hold(self, jacobian: np.ndarray) -> None:
        """Carry the robot where it is, on contacts with a Jacobian, shape (k, n)."""
        np.copyto(self.value, self._carrying.update(jacobian))
        self.value[self._speeds] = 0.0

    def change(self, before: np.ndarray) -> None:
        """Begin to pass from torques to those of another law, shape (n,) [Nm, N]."""
        self._before[:] = before
        self._left = BLEND_TIME

    def blend(self, step: float) -> None:
        """Blend the torques of the law in, a time [s] after the last call."""
        if self._left > 0.0:
            self._left = max(self._left - step, 0.0)
            u = 1.0 - self._left / BLEND_TIME
            self.value -= self._before
            self.value *= u * u * u * (10.0 - u * (15.0 - 6.0 * u))
            self.value += self._before
