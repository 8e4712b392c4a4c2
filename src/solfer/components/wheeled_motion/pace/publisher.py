"""Publishes the pace of the motion."""

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class MotionPace:
    """A `std_msgs/Float64`: the ratio of the received velocities with which the motion goes on, from 0 to 1."""

    data: float = 1.0


class PacePublisher:
    """Publishes the pace, where it changes and now and then.

    Args:
        pace: Returns the present one.
    """

    def __init__(self, pace: Callable[[], float]):
        self._pace = pace
        self._cycles = 1
        self._left = 0
        self._published = 1.0

    def set_period(self, period: float) -> None:
        """Set the period of the control cycle [s]."""
        self._cycles = max(1, round(0.1 / period))  # [s] between two messages at most

    def start(self) -> None:
        """Publish the pace of the next cycle in any case."""
        self._left = 0

    def collect(self) -> MotionPace | None:
        """Return what is to be published after this cycle; None: nothing."""
        self._left -= 1
        pace = self._pace()
        if self._left > 0 and abs(pace - self._published) < 0.02:
            return None
        self._left = self._cycles
        self._published = pace
        return MotionPace(pace)
