"""What a plugin has sent to joints last, and how far it has commanded them to move."""

from collections.abc import Callable, Sequence

import numpy as np

from solfer.pipes import JointCommandPipe


class SentJoints:
    """Commands in joint space: the numbers to send, and those sent last.

    Args:
        pipes: The pipes.
        moves: Returns whether joints move by what a pipe sends.
        period: Time of a control cycle [s].

    Attributes:
        pipes: The pipes, which keep what was sent last.
        is_sent: Whether anything was sent since the start.
        are_followed: Whether joints follow what was sent last.
        distance: Sum over all cycles of the largest commanded step of a joint [rad, m].
    """

    _LARGEST_DEFLECTION = 0.2
    """Largest distance of a joint from a command that it follows, as springs do under a load [rad, m]."""

    def __init__(self, pipes: Sequence[JointCommandPipe], moves: Callable[[JointCommandPipe], bool], period: float):
        self.pipes = tuple(pipes)
        for pipe in pipes:
            pipe.step.arrays["steps"][:] = _steps(pipe, period if moves(pipe) else None)
        self._positions = [
            (pipe.dofs, pipe.step.arrays["kept"][row])
            for pipe in pipes
            for row, (field, _) in enumerate(pipe.fields)
            if field == "position"
        ]
        self._reach = [np.full(dofs.shape, self._LARGEST_DEFLECTION) for dofs, _ in self._positions]
        self._velocities = [values for pipe in pipes for field, values in pipe.fields if field == "velocity"]
        self.are_followed = False
        self.is_sent = False
        self.distance = 0.0

    def restore(self) -> None:
        """Let what was sent last be sent again."""
        for pipe in self.pipes:
            pipe.block[...] = pipe.step.arrays["kept"]

    def stop(self, position: np.ndarray) -> None:
        """Let all velocities be zero, also those that a filter carries; joints are at `position`, (n,) [rad, m]."""
        for values in self._velocities:
            values.fill(0.0)
        for (dofs, sent), reach in zip(self._positions, self._reach, strict=True):
            # it may yield a little more while its plugin waits: beyond that another robot is there, or something
            # moved it
            np.minimum(np.abs(sent - position[dofs]) + 0.05, self._LARGEST_DEFLECTION, out=reach)

    def forget(self) -> None:
        """Forget what joints follow: others move them now, or the robot is in another state."""
        self.are_followed = False

    def follow(self, position: np.ndarray) -> None:
        """Write where joints are that follow what was sent last, beside where they are measured [rad, m]: there."""
        for (dofs, sent), reach in zip(self._positions, self._reach, strict=True) if self.are_followed else ():
            follow = np.abs(sent - position[dofs]) <= reach
            position[dofs[follow]] = sent[follow]


def _steps(pipe: JointCommandPipe, period: float | None) -> np.ndarray:
    """Return the time that each row of a pipe acts [s], see `solfer.numerics.kernels.keep`; 0: places, -1: neither."""
    steps = {} if period is None else {"position": 0.0, "velocity": period}
    return np.array([steps.get(field, -1.0) for field, _ in pipe.fields])
