"""Positions that a robot measures, with the turns that its encoders do not count."""

import numpy as np


class MeasuredPosition:
    """The newest measured position, in which joints that turn without an end have counted their turns.

    Args:
        turns: Turn after which a joint is where it was, 0 without one, shape (n,) [rad].

    Attributes:
        value: The position, shape (n,) [rad, m]; live.
    """

    def __init__(self, turns: np.ndarray):
        # imported here: its compiler takes a while to load
        from solfer.numerics.kernels import keep_turns, unwrap

        self._unwrap = unwrap
        self._keep_turns = keep_turns
        self._turns = turns
        self._turning = np.flatnonzero(turns)
        self._added = np.zeros(len(turns))
        self._before = np.zeros((3, len(turns)))  # see the kernel
        self.value = np.zeros(len(turns))

    def start(self, q: np.ndarray) -> None:
        """Begin at a position."""
        self.value[:] = q
        self._before[:] = q
        self._added[:] = 0.0

    def measure(self, q: np.ndarray) -> np.ndarray:
        """Take over a measured position; return it with its turns: encoders may count within a turn."""
        value = self.value
        value[:] = q
        if not self._turning.size:
            return q
        self._unwrap(value, self._turning, self._before, self._turns, self._added)
        self._keep_turns(value, self._turning, self._before, self._added)
        return value
