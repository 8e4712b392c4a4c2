"""Forces at contacts that explain what the world does to a robot best."""

from collections.abc import Sequence

import numpy as np

from solfer.numerics.solvers.pseudo_inverse import SymmetricPseudoInverse
from solfer.points.contact.contacts import Contact


class WeightedForces:
    """Forces of the ground at contacts, by least squares.

    With the Jacobian J of the contacts, and what the world does along the DoFs, w, they minimise
    sum_i ((w - J^T f)_i / s_i)^2. The deviations s_i of joints are those of their torque sensors; those of the base are
    what may push it besides the ground, since nothing drives it. Where several forces do it, it is the smallest. The
    contacts count whether they are lifted or not: a lifted one gets a force of about zero.

    Args:
        contacts: The contacts, k of them.
        deviations: s, shape (n,) [N, Nm].

    Attributes:
        value: The forces, shape (k, 3), world axes [N]; live.
        rest: w - J^T f, shape (n,) [N, Nm]; live.
    """

    def __init__(self, contacts: Sequence[Contact], deviations: np.ndarray):
        rows, size = 3 * len(contacts), len(deviations)
        self._weights, self._inverse = deviations**-2, SymmetricPseudoInverse(rows)
        self._weighted, self._forces = np.zeros((rows, size)), np.zeros(rows)
        self._needed, self.rest, self.value = np.zeros(rows), np.zeros(size), self._forces.reshape(-1, 3)

    def update(self, jacobian: np.ndarray, world: np.ndarray) -> np.ndarray:
        """Return the forces by the Jacobian, shape (3k, n), and by what the world does, shape (n,); live."""
        np.multiply(jacobian, self._weights, out=self._weighted)
        np.dot(self._weighted, jacobian.T, out=self._inverse.matrix)
        np.dot(self._weighted, world, out=self._needed)
        np.dot(self._inverse.update(), self._needed, out=self._forces)
        np.dot(jacobian.T, self._forces, out=self.rest)
        np.subtract(world, self.rest, out=self.rest)
        return self.value
