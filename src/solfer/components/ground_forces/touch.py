"""Which contacts touch the ground, with hysteresis."""

import numpy as np

SURE = 0.1
"""Time after which a contact that does not touch is in the air for sure [s]."""


class Touch:
    """Contacts that touch the ground, by their normal forces.

    A contact begins to touch when its force has been larger than `above` for the time `delay`, and ends when it has
    been smaller than `below` for as long.

    Args:
        count: Number of contacts k.
        above: Force above which a contact touches [N].
        below: Force below which it does not [N].
        delay: Time for which the force has to be so [s].

    Attributes:
        touching: Which contacts touch, shape (k,).
        lifted: Which have not touched for `SURE`, shape (k,).
    """

    def __init__(self, count: int, above: float, below: float, delay: float):
        self._begin, self._end, self._delay = above, below, delay
        self.touching, self._waited = np.zeros(count, dtype=bool), np.zeros(count)
        self._changing, self._above, self.lifted = np.zeros((3, count), dtype=bool)
        self._away = np.zeros(count)

    def start(self, forces: np.ndarray) -> None:
        """Begin with the forces of now, shape (k,) [N], without a delay."""
        np.greater(forces, self._begin, out=self.touching)
        self._waited[:] = self._away[:] = 0.0
        self.lifted[:] = False

    def update(self, forces: np.ndarray, period: float) -> np.ndarray:
        """Return which contacts touch after `period` [s] more, by their normal forces, shape (k,) [N]."""
        # a contact that touches wants to change below `below`, another one above `above`
        np.greater(forces, self._begin, out=self._changing)
        np.less(forces, self._end, out=self._above)
        np.copyto(self._changing, self._above, where=self.touching)
        self._waited += period
        self._waited *= self._changing
        np.greater_equal(self._waited, self._delay - 1e-9, out=self._above)
        np.logical_and(self._above, self._changing, out=self._changing)
        np.logical_xor(self.touching, self._changing, out=self.touching)
        np.copyto(self._waited, 0.0, where=self._changing)
        self._away += period
        np.copyto(self._away, 0.0, where=self.touching)
        np.greater(self._away, SURE, out=self.lifted)
        return self.touching
