"""What goes to the lower level when a plugin starts and when it holds, without a step in between."""

from collections.abc import Sequence

import numpy as np

from solfer.model import State
from solfer.pipes import JointController


class Outputs:
    """Blends commands in at the start, remembers what was sent, and sends it again for a hold.

    With u = t / T, the share of what the component wants is s(u) = 10 u^3 - 15 u^4 + 6 u^5, the minimum-jerk profile
    (T. Flash and N. Hogan, Journal of Neuroscience 5(7), 1985); the rest is where the robot was measured at the start,
    without velocity and effort.

    Args:
        pipes: The pipes to the lower level.
        state: The measured State.
        period: Time of one cycle [s].
        duration: Time T of blending [s]; 0: there is none.
    """

    def __init__(self, pipes: Sequence[JointController], state: State, period: float, duration: float):
        self._pipes, self._state = tuple(pipes), state
        self._cycles = self._left = round(duration / period)
        self._sent = False
        # of each field: what the pipe is about to send, where blending starts, and what was sent last
        self._fields = [(field, pipe.dofs, values, np.zeros_like(values), np.zeros_like(values))
                        for pipe in pipes for field, values in pipe.fields]

    @property
    def blending(self) -> bool:
        """Whether the start is not over yet."""
        return self._left > 0

    def start(self) -> None:
        """Begin at the measured state."""
        self._left, self._sent = self._cycles, False
        for field, dofs, _, start, _ in self._fields:
            if field == "position":
                np.take(self._state.position, dofs, out=start, mode="clip")

    def blend(self) -> None:
        """Blend what was collected, in place, and remember it; to be called once a cycle, before it is sent."""
        if self._left > 0:
            u = 1.0 - self._left / self._cycles
            share = u * u * u * (10.0 - u * (15.0 - 6.0 * u))
            for _, _, values, start, _ in self._fields:
                values -= start
                values *= share
                values += start
            self._left -= 1
        for _, _, values, _, sent in self._fields:
            np.copyto(sent, values)
        self._sent = True

    def hold(self, stamp: float) -> None:
        """Send positions and efforts as they were sent last, and no velocity; nothing before the first command."""
        if not self._sent:
            return
        for field, _, values, _, sent in self._fields:
            if field == "velocity":
                sent.fill(0.0)
            np.copyto(values, sent)
        for pipe in self._pipes:
            pipe.reset()
            pipe.send(stamp)
