"""How far a robot yields under its load."""

import numpy as np


class Deflection:
    """What joints stay away from their commands where they rest, as springs under a load, and where the base is.

    A low pass of the first order of measured minus commanded positions. Commands that are computed at the commanded
    positions plus this are an integral control of the points: weight, also a wrong or an unknown one, leaves no error.
    The time T_d has to be longer than the robot takes to follow: with |G - 1| <= T_d w of its response G at all
    frequencies w, the loop is stable by the small gain theorem. The base is commanded by the joints alone, so that what
    it stays away is no load: its command itself goes to what is measured within T_d.

    Args:
        size: Number of DoFs n.
        base: DoFs of the base among them.
        time: T_d [s].
        most: Largest deflection of a joint: what is held otherwise is not pushed farther [rad, m].

    Attributes:
        value: The deflections, shape (n,) [rad, m]; live.
        time: T_d [s]; may be set before each `update`.
        most: Largest deflection of a joint [rad, m], likewise.
    """

    def __init__(self, size: int, base: int, time: float, most: float):
        self.value, self._change = np.zeros((2, size))
        self._base = base
        self.time = time
        self.most = most

    def start(self, measured: np.ndarray, commanded: np.ndarray) -> None:
        """Begin with what joints stay away now; see `update`."""
        np.subtract(measured, commanded, out=self.value)
        self.value[: self._base] = 0.0
        np.clip(self.value, -self.most, self.most, out=self.value)

    def update(self, measured: np.ndarray, commanded: np.ndarray, passed: float) -> None:
        """Take over a share of what is measured, and bring the base's command nearer to it. Allocates nothing.

        Args:
            measured: Measured positions, shape (n,) [rad, m].
            commanded: Commanded ones; those of the base are written.
            passed: Time since the cycle before T [s]; the share is T / (T_d + T).
        """
        value = self.value
        change = self._change
        base = self._base
        np.subtract(measured, commanded, out=change)
        change -= value
        change *= passed / (self.time + passed)
        commanded[:base] += change[:base]
        change[:base] = 0.0
        value += change
        np.minimum(value, self.most, out=value)
        np.maximum(value, -self.most, out=value)
