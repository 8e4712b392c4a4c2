"""Holds a simulated robot when the process that commands it is gone or hangs."""

from collections.abc import Callable

from solfer.lower_level.supervision import Supervision
from solfer.simulation.engine import STEP
from solfer.simulation.followers import Followers


class Guard(Followers):
    """Nobody follows the simulation; after each step the beats of the one who commands are looked at.

    Args:
        supervision: What looks at them, and lets the robot hold.
    """

    def __init__(self, supervision: Supervision):
        self._supervision = supervision

    def follow(self, now: float, meanwhile: Callable[[], None]) -> None:
        """See `Followers.follow`."""
        self._supervision.advance(STEP)
