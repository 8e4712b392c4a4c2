"""Positions that others request of a Robot, kept apart from those that a component commands."""

from functools import partial

import numpy as np

from solfer.numerics.kernels import take_changes
from solfer.robot import Robot


class DesiredPositions:
    """Positions in the desired State as the pipes of a configuration write them there, in whole or in parts.

    A component that commands others than those that it received, and found its own numbers there in a cycle without a
    message, would add its change again in each cycle. Here each DoF keeps what was received last. DoFs that no message
    addresses stay where they are at a start.

    Args:
        robot: The Robot; its desired positions are no numbers until a pipe, or `start`, writes them.

    Attributes:
        values: Desired position of each DoF, shape (n,) [rad, m].
        read: read() takes what pipes have written since `send`.
    """

    def __init__(self, robot: Robot):
        self._robot = robot
        self._command = robot.command.position
        self.values, self._sent = np.full((2, robot.size), np.nan)
        self._own = np.zeros(robot.size, dtype=bool)
        self.read = partial(take_changes, self._command, self._sent, self.values, self._own)
        self._command[:] = np.nan

    def start(self) -> None:
        """Begin with DoFs that no pipe has written since the last start where they are measured, at rest."""
        self.read()
        self._own |= np.isnan(self.values)
        self.values[self._own] = self._robot.state.position[self._own]
        self._robot.command.velocity[self._own] = 0.0
        self.send(self.values)

    def send(self, positions: np.ndarray) -> None:
        """Command positions, shape (n,) [rad, m]."""
        self._command[:] = positions
        self._sent[:] = positions
