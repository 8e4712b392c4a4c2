"""The clock of a node in lock-step with a simulation: it stands still between two cycles."""

import threading
from collections.abc import Callable

from solfer.transport.waiting import ShutdownRequested

POLL_PERIOD = 0.1
"""Time between two checks for a requested end [s]."""

TIME_TOLERANCE = 1e-9
"""Times that differ by less are the same [s]."""


class StepClock:
    """Goes on when it is granted a cycle, and returns when the loop has made it and sleeps again.

    Like every clock it never goes back: when the simulation does, no time has passed.

    Two threads meet here: the loop in `sleep_until`, and the one that receives the simulation in `grant`.

    Args:
        running: False as soon as the end was requested.
        show: Shows the simulated time [s] of a cycle to all that asks for the time of ROS.

    Attributes:
        rewinds: How often the simulated time has gone back.
    """

    def __init__(self, running: Callable[[], bool], show: Callable[[float], None]):
        self.rewinds = 0
        self._running = running
        self._show = show
        self._time = 0.0
        self._granted = False
        self._published = 0.0
        """Newest simulated time [s]."""
        self._ahead = 0.0
        """By how much `now` is ahead of it since that went back [s]."""
        self._deadline: float | None = None
        self._moved = threading.Condition()

    def now(self) -> float:
        """See `Middleware.now`: the time of the cycle that was granted last."""
        return self._time

    def sleep_until(self, deadline: float) -> None:
        """See `Middleware.sleep_until`; returns as well when the end was requested."""
        with self._moved:
            self._deadline = deadline
            self._moved.notify_all()
            while not self._granted and self._running():
                self._moved.wait(POLL_PERIOD)
            self._granted = False
            self._deadline = None

    def publish(self, simulated: float) -> None:
        """See `Middleware.publish_time`; no effect here."""

    def grant(self, time: float, prepare: Callable[[], None]) -> float:
        """Let the loop make the cycle at `time` [s] if it is due; returns, after it, the time of the next one.

        Args:
            time: Simulated time.
            prepare: Called before the cycle, while the loop still sleeps.

        Raises:
            ShutdownRequested: The node has to end.
        """
        with self._moved:
            deadline = self._sleeping()
            if time < self._published - TIME_TOLERANCE:
                self.rewinds += 1
                self._ahead += self._published - time
            self._published = time
            if time + self._ahead >= deadline - TIME_TOLERANCE:
                self._show(time)
                self._time = time + self._ahead
                prepare()
                self._granted = True
                self._deadline = None
                self._moved.notify_all()
                deadline = self._sleeping()
            return deadline - self._ahead

    def _sleeping(self) -> float:
        """Wait until the loop sleeps; returns its deadline [s]."""
        while self._deadline is None:
            if not self._running():
                raise ShutdownRequested("ended in lock-step")
            self._moved.wait(POLL_PERIOD)
        return self._deadline
