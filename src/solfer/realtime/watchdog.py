"""Supervises the heartbeat of the RT process from outside."""

import logging
import time
from collections.abc import Callable

from solfer.middleware.shared_memory.memory.presence import Presence
from solfer.realtime.emergency_stop import EmergencyStopLatch
from solfer.realtime.heartbeat import Heartbeat

logger = logging.getLogger(__name__)

LIMIT = 0.1
"""Age of the newest beat above which a process hangs [s]."""

LOOKS = 3
"""Looks without a new beat before a process counts as hanging, so that a stall of the whole machine does not."""

PERIOD = 0.01
"""Time between two looks [s]."""


class Watchdog:
    """Trips the emergency stop when the RT process hangs: in an endless loop, a call that blocks, or stopped.

    The end of the process, in good order or not, is only logged: its robot holds already, and its successor begins from
    the measured state.

    Args:
        heartbeat: The heartbeat of the process.
        stop: The latch to trip.
        limit: Age of the newest beat above which the process hangs [s].
        presence: Whether the namespace still exists; None: it is not checked.

    Attributes:
        hangs: How often the process has begun to hang.
    """

    def __init__(
        self, heartbeat: Heartbeat, stop: EmergencyStopLatch, limit: float = LIMIT, presence: Presence | None = None
    ):
        self._heartbeat, self._stop, self._limit, self._presence = heartbeat, stop, limit, presence
        self._newest: int | None = None
        self._looks, self._over, self.hangs = 0, True, 0

    def look(self) -> None:
        """Look once; to be repeated each PERIOD."""
        newest = self._heartbeat.beats()
        if newest != self._newest:
            self._newest, self._looks, self._over = newest, 0, newest is None
            return
        if self._over:
            return
        self._looks += 1
        if self._looks >= LOOKS and self._heartbeat.age() > self._limit:
            self._over = True
            self._judge()

    def run(self, running: Callable[[], bool]) -> None:
        """Look until the end is requested.

        Raises:
            MiddlewareError: The namespace was removed. The latch in its memory was tripped.
        """
        due, presence = time.monotonic(), self._presence
        while running():
            self.look()
            if presence is not None and presence.lost():
                self._stop.trip(presence.loss)
                presence.require()
            due = max(due + PERIOD, time.monotonic())
            time.sleep(max(0.0, due - time.monotonic()))

    def _judge(self) -> None:
        """Handle a missing heartbeat: the process hangs or has ended."""
        heartbeat = self._heartbeat
        if heartbeat.alive():
            self.hangs += 1
            reason = f"process {heartbeat.pid} hangs: no cycle for {1e3 * heartbeat.age():.0f} ms"
            self._stop.trip(reason)
            logger.error("emergency stop: %s", reason)
        else:
            logger.error("process %d has ended unexpectedly", heartbeat.pid)
