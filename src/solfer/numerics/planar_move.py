"""Rotations about z, and a shift: how references move with a base whose estimate has jumped."""

import math

import numpy as np

from solfer.numerics.rotations import quaternion_product


def turned(heading: float, x: float, y: float) -> tuple[float, float]:
    """Return a vector that is seen from a heading [rad] in the axes of the world."""
    cos = math.cos(heading)
    sin = math.sin(heading)
    return cos * x - sin * y, sin * x + cos * y


def seen_from(heading: float, x: float, y: float) -> tuple[float, float]:
    """Return a vector of the world as seen from a heading [rad]."""
    cos = math.cos(heading)
    sin = math.sin(heading)
    return cos * x + sin * y, cos * y - sin * x


def about_z(angle: float) -> tuple[float, float, float, float]:
    """Return the quaternion of a rotation about z [rad]."""
    return 0.0, 0.0, math.sin(angle / 2.0), math.cos(angle / 2.0)


class PlanarMove:
    """Moves what is given in the world along with a base, whose estimate has jumped while the robot has not.

    A place p goes to a + Rz (p - b), with the base's place before, b, and after, a. The tilt is a matter of gravity,
    which has not changed.

    Args:
        before: Place of the base before, shape (3,) [m].
        after: Place of the base after, shape (3,) [m].
        yaw: Angle of Rz, by which the heading has changed [rad].

    Attributes:
        before, after, yaw: See above.
        rise: How much higher the base is [m].
    """

    def __init__(self, before: np.ndarray, after: np.ndarray, yaw: float):
        self.yaw = yaw
        self.rise = float(after[2] - before[2])
        self.before = np.array(before, dtype=float)
        self.after = np.array(after, dtype=float)
        self._cos = math.cos(yaw)
        self._sin = math.sin(yaw)
        self._quaternion = about_z(yaw)

    @property
    def distance(self) -> float:
        """How far the base has moved [m]."""
        return float(np.linalg.norm(self.after - self.before))

    def move(self, place: np.ndarray) -> None:
        """Move a place, shape (3,) or its x and y, shape (2,) [m]."""
        size = len(place)
        place -= self.before[:size]
        self.rotate(place)
        place += self.after[:size]

    def rotate(self, vector: np.ndarray) -> None:
        """Rotate a vector in the world, of whose numbers the first two are x and y."""
        x = vector[0]
        y = vector[1]
        vector[0], vector[1] = self._cos * x - self._sin * y, self._sin * x + self._cos * y

    def rotate_orientation(self, quaternion: np.ndarray) -> None:
        """Rotate an orientation, quaternion (x, y, z, w)."""
        quaternion[:] = quaternion_product(self._quaternion, quaternion.tolist())

    def rotate_heading(self, heading: float) -> float:
        """Return a heading after the move, from -pi to pi [rad]."""
        return math.remainder(heading + self.yaw, 2.0 * math.pi)
