"""Positions and velocities of the joints that are commanded."""

from functools import partial

import numpy as np

from solfer.components.wheeled_motion.kernel import move, write_command
from solfer.components.wheeled_motion.original.resteering import Resteering
from solfer.model.state import State


class CommandedJoints:
    """Integrates joint velocities to positions, and writes both to the command.

    Args:
        moved: DoFs that move, shape (m,).
        size: Number of DoFs n.
        steering: DoFs that steer wheels, shape (m,).
        resteering: Turns these back as the original does; None: they stay in their ranges without it.

    Attributes:
        moved: As above.
        position: Commanded positions, shape (n,) [rad, m]; live.
        velocity: Commanded velocities, shape (n,) [rad/s, m/s]; live.
        is_first: Whether nothing has been commanded yet.
        send: send(position, velocity) writes both of the joints that move to a command.
    """

    def __init__(self, moved: np.ndarray, size: int, steering: np.ndarray, resteering: Resteering | None):
        self.moved = moved
        self._steering = steering
        self.position, self.velocity = np.zeros((2, size))
        self._resteering = resteering
        self.is_first = True
        self.send = partial(write_command, moved, self.position, self.velocity)

    def start(self, position: np.ndarray) -> None:
        """Begin at rest at a position, shape (n,) [rad, m]."""
        self.position[:] = position
        self.velocity[:] = 0.0
        self.is_first = True
        if self._resteering is not None:
            self._resteering.start()

    def integrate(self, rates: np.ndarray, step: float, measured: np.ndarray | None = None) -> None:
        """Take over joint velocities for a time, and turn wheels back where they are at their ends.

        Args:
            rates: Joint velocities, shape (n,) [rad/s, m/s].
            step: The time [s].
            measured: Measured positions, shape (n,) [rad, m]; None: no wheel turns back.
        """
        move(self.moved, rates, step, self.velocity, self.position)
        self.is_first = False
        if self._resteering is not None and measured is not None:
            commanded = self.position[self._steering]
            self._resteering.update(measured[self._steering], commanded)
            self.position[self._steering] = commanded

    def stop(self, command: State) -> None:
        """Write that all joints are still."""
        self.velocity[:] = 0.0
        command.velocity[self.moved] = 0.0
