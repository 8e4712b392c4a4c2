"""Aligns the world of a sender, which starts anywhere, with the Robot's world."""

import math

import numpy as np


class Alignment:
    """A turn about the vertical and a shift, from the world of the sender to that of the Robot.

    Args:
        numbers: Memory of both, the turn row by row, then the shift, shape (12,).

    Attributes:
        turn: Rotation from the sender's world to the Robot's, shape (3, 3).
        shift: Origin of the sender's world in the Robot's, shape (3,) [m].
    """

    def __init__(self, numbers: np.ndarray):
        self.turn = numbers[:9].reshape(3, 3)
        self.shift = numbers[9:]

    def fit(self, published: tuple[np.ndarray, np.ndarray], known: tuple[np.ndarray, np.ndarray]) -> None:
        """Choose turn and shift so that the pose `published` gets the heading and position of `known`.

        Args:
            published: Position, shape (3,) [m], and rotation to the world, shape (3, 3), in the sender's world.
            known: The same in the Robot's world.
        """
        angle = _heading(known[1]) - _heading(published[1])
        cosine = math.cos(angle)
        sine = math.sin(angle)
        self.turn[:2, :2] = ((cosine, -sine), (sine, cosine))
        np.subtract(known[0], self.turn @ published[0], out=self.shift)


def _heading(rotation: np.ndarray) -> float:
    """Compute the angle of `rotation` about the vertical, its twist without the tilt [rad]."""
    return 2.0 * math.atan2(rotation[1, 0] - rotation[0, 1], 1.0 + np.trace(rotation))
