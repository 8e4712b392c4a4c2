"""Calls after each step of a simulation: lock-step with nodes, and the hold when a commanding process is gone."""

from collections.abc import Callable

from solfer.lower_level.server.heartbeat_monitor import HeartbeatMonitor
from solfer.simulation.physics import STEP


class StepHook:
    """Null implementation: no node runs in lock-step; others let the simulation wait after each step for nodes."""

    def present(self) -> bool:
        """Return whether all followers are there; until then simulated time stands still."""
        return True

    def follow(self, now: float, meanwhile: Callable[[], None]) -> None:
        """Return when the followers have made the cycles that are due at simulated time `now` [s].

        Args:
            now: Simulated time [s].
            meanwhile: To be called repeatedly: answers requests that a follower may wait for.
        """


class HeartbeatHook(StepHook):
    """No node runs in lock-step; after each step the heartbeat of the commanding process is checked.

    Args:
        supervision: Checks it, and lets the robot hold when it stops.
    """

    def __init__(self, supervision: HeartbeatMonitor):
        self._supervision = supervision

    def follow(self, now: float, meanwhile: Callable[[], None]) -> None:
        """See `StepHook.follow`."""
        self._supervision.advance(STEP)
