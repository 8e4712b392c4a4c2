"""Forces at contacts that explain what the world does to a robot best."""

from collections.abc import Sequence
from functools import partial

import numpy as np

from solfer.components.ground_forces import kernel
from solfer.points.contact.contacts import Contact

PRIOR_INFORMATION = 1e-10
"""What is known of a force before anything is measured, as the inverse of its variance [1/N^2]."""


def weighed(contacts: Sequence[Contact], weights: np.ndarray) -> np.ndarray:
    """Return the DoFs that contacts move and that weigh, in their order, shape (m,)."""
    moved = [contact.columns for contact in contacts]
    return np.flatnonzero(np.isin(np.arange(len(weights)), np.concatenate(moved)) & (weights > 0.0))


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
        update: update(jacobian, world) computes both by the Jacobian, shape (3k, n), and by what the world does, shape
            (n,).
    """

    def __init__(self, contacts: Sequence[Contact], deviations: np.ndarray):
        rows = 3 * len(contacts)
        size = len(deviations)
        weights = deviations**-2
        columns = weighed(contacts, weights)
        forces = np.zeros(rows)
        self.rest, self.value = np.zeros(size), forces.reshape(-1, 3)
        factor = np.zeros((rows, rows))
        self.update = partial(kernel.fit, weights, columns, PRIOR_INFORMATION, factor, forces, self.rest)
