"""Which contacts touch the ground, with hysteresis."""

import numpy as np


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
    """

    def __init__(self, count: int, above: float, below: float, delay: float, speed: float = 0.0):
        self.set(above, below, delay, speed=speed)
        self.touching, self._changing, self._above, self.lifted = np.zeros((4, count), dtype=bool)
        self._waited, self._away, self._reduced = np.zeros((3, count))

    def set(self, above: float, below: float, delay: float, speed: float = 0.0) -> None:
        """Set when contacts touch, see above; those that touch do so until they end."""
        self._begin = above
        self._end = below
        self._delay = delay
        self._rise = speed

    def start(self, forces: np.ndarray) -> None:
        """Begin with the forces of now, shape (k,) [N], without a delay."""
        np.greater(forces, self._begin, out=self.touching)
        self._waited[:] = self._away[:] = 0.0
        self.lifted[:] = False

    def update(self, forces: np.ndarray, speeds: np.ndarray, period: float) -> np.ndarray:
        """Return which contacts touch after `period` [s] more.

        Args:
            forces: Their normal forces, shape (k,) [N].
            speeds: Their speeds along the normal, shape (k,) [m/s].
            period: See above.
        """
        np.abs(speeds, out=self._reduced)
        self._reduced *= -self._rise
        self._reduced += forces
        # a contact that touches changes below `below`, another one above `above`
        np.greater(self._reduced, self._begin, out=self._changing)
        np.less(self._reduced, self._end, out=self._above)
        np.copyto(self._changing, self._above, where=self.touching)
        self._waited += period
        self._waited *= self._changing
        np.greater_equal(self._waited, self._delay - 1e-9, out=self._above)
        np.logical_and(self._above, self._changing, out=self._changing)
        np.logical_xor(self.touching, self._changing, out=self.touching)
        np.copyto(self._waited, 0.0, where=self._changing)
        self._away += period
        np.copyto(self._away, 0.0, where=self.touching)
        np.greater(self._away, 0.1, out=self.lifted)
        return self.touching
