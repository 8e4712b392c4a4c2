"""Which contacts touch the ground, with hysteresis."""

from functools import partial

import numpy as np

from solfer.components.ground_forces import kernel


class Touch:
    """Contacts that touch the ground, by their normal forces.

    A contact begins to touch when its force has been larger than `above` for the time `delay`, and ends when it has
    been smaller than `below` for as long. Both forces rise with the contact's speed along the normal: the ground lets
    it have none, and what moves it makes errors.

    Args:
        count: Number of contacts k.
        above: Force above which a contact touches [N].
        below: Force below which it does not [N].
        delay: Time for which the force has to be so [s].
        speed: By how much both forces rise with the speed along the normal [N/(m/s)].

    Attributes:
        touching: Which contacts touch, shape (k,).
        lifted: Which have not touched for 0.1 s: they are in the air for sure, shape (k,).
        update: update(forces, speeds, period) finds out both by normal forces [N] and speeds along the normal [m/s],
            shape (k,) each, after `period` [s] more.
    """

    def __init__(self, count: int, above: float, below: float, delay: float, speed: float = 0.0):
        self._limits = np.zeros(4)
        self.set(above, below, delay, speed=speed)
        self.touching, self.lifted = np.zeros((2, count), dtype=bool)
        self._times = np.zeros((2, count))
        self.update = partial(kernel.touch, self._limits, self.touching, self.lifted, self._times)

    def set(self, above: float, below: float, delay: float, speed: float = 0.0) -> None:
        """Set when contacts touch, see above; those that touch do so until they end."""
        self._limits[:] = above, below, delay, speed

    def start(self, forces: np.ndarray) -> None:
        """Begin with the forces of now, shape (k,) [N], without a delay."""
        np.greater(forces, self._limits[0], out=self.touching)
        self._times[:] = 0.0
        self.lifted[:] = False
