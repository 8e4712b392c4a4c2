"""The references of wheels as the original program's `NwheelsZMPII` moves and sees them."""

import numpy as np

MOVING = 1e-4
"""Speed of a vertex from which its reference moves [m/s]."""


class WorldVertices:
    """References of the vertices in the world, and what the original knows of the vertices.

    It computes the errors in every second cycle, and looks where vertices are at every third of two times in a cycle:
    before the errors, and before the Jacobians.

    Args:
        count: Number of wheels.

    Attributes:
        references: Where vertices are to be, x and y in the world, shape (count, 2) [m].
        errors: Errors along the directions of rolling, shape (count,) [m].
        jacobian: Jacobian along them, shape (count, n).
    """

    def __init__(self, count: int, size: int):
        self.references, self._places, self._directions = np.zeros((3, count, 2))
        self.errors = np.zeros(count)
        self.jacobian = np.zeros((count, size))
        self._jacobians = np.zeros((count, 2, size))
        self._cycle = 0

    def start(self, places: np.ndarray) -> None:
        """Begin with references where the vertices are, shape (count, 3) [m]."""
        self.references[:] = places[:, :2]
        self._cycle = 0

    def move(self, velocities: np.ndarray, directions: np.ndarray, period: float) -> None:
        """Move references along the directions of rolling, shape (count, 2), by velocities of the vertices [m/s]."""
        along = (velocities * directions).sum(axis=1)
        for index in range(len(along)):
            if np.hypot(*velocities[index]) > MOVING:
                self.references[index] += period * along[index] * directions[index]

    def see(self, places: np.ndarray, directions: np.ndarray, jacobians: np.ndarray) -> None:
        """Take over what there is to know in this cycle, and compute errors and Jacobian.

        Args:
            places: Vertices in the world, shape (count, 3) [m].
            directions: Their directions of rolling, shape (count, 2).
            jacobians: Their Jacobians, x and y, shape (count, 2, n).
        """
        if self._cycle % 3 == 2 or self._cycle == 0:
            self._look(places, directions, jacobians)
        if self._cycle % 2 == 0:
            np.sum(self._directions * (self.references - self._places), axis=1, out=self.errors)
        if self._cycle % 3 == 0:
            self._look(places, directions, jacobians)
        for index, direction in enumerate(self._directions):
            np.dot(direction, self._jacobians[index], out=self.jacobian[index])
        self._cycle += 1

    def _look(self, places: np.ndarray, directions: np.ndarray, jacobians: np.ndarray) -> None:
        self._places[:] = places[:, :2]
        self._directions[:] = directions
        self._jacobians[:] = jacobians
