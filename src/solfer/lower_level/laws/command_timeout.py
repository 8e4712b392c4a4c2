"""Detects commands that are not renewed."""

import numpy as np


class CommandTimeout:
    """Ages of commands, one for each joint.

    Args:
        size: Number of joints.
        timeout: Age at which a command has expired [s].

    Attributes:
        expired: Whether the command of a joint has expired, shape (size,); true before the first one.
    """

    def __init__(self, size: int, timeout: float):
        self._timeout = timeout
        self._age = np.full(size, np.inf)
        self.expired = np.ones(size, dtype=bool)

    def renew(self, indices: np.ndarray) -> None:
        """Reset the ages of the joints at `indices`."""
        self._age[indices] = 0.0
        self.expired[indices] = False

    def advance(self, dt: float) -> np.ndarray:
        """Let `dt` [s] pass; returns `expired`."""
        np.add(self._age, dt, out=self._age)
        return np.greater(self._age, self._timeout, out=self.expired)
