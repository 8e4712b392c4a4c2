"""Supervises the heartbeat of the RT process from outside."""

import logging
import time
from collections.abc import Callable

from solfer.realtime.emergency_stop import EmergencyStopLatch
from solfer.realtime.heartbeat import Heartbeat
from solfer.realtime.processor import ProcessorShare
from solfer.segments.presence import Presence

logger = logging.getLogger(__name__)

LIMIT = 0.1
"""Time in which a process could have cycled and did not, above which it hangs [s]."""

WATCHDOG_PATIENCE = 10.0
"""Multiple of the limit: age of the newest beat above which a process hangs even where the machine did not run it."""

WATCHDOG_POLLS = 3
"""Looks that it takes at least to find a hang, so that a stall of the whole machine, with the watchdog, is none."""

WATCHDOG_PERIOD = 0.01
"""Time between two looks [s]."""


class Watchdog:
    """Trips the emergency stop when the RT process hangs: in an endless loop, a call that blocks, or stopped.

    A process that waits for a processor, or is stopped, cannot cycle and does not hang: its robot holds already, for
    its commands are missing, and it goes on from the measured state. Where that takes PATIENCE times as long, it may no
    longer go on by itself. The end of the process is only logged: its successor begins from the measured state.

    Args:
        heartbeat: The heartbeat of the process.
        stop: The latch to trip.
        limit: Time without a beat, in which the process ran or waited for something else than a processor, above which
            it hangs [s].
        presence: Whether the namespace still exists; None: it is not checked.

    Attributes:
        hangs: How often the process has begun to hang.
    """

    def __init__(
        self, heartbeat: Heartbeat, stop: EmergencyStopLatch, limit: float = LIMIT, presence: Presence | None = None
    ):
        self._heartbeat = heartbeat
        self._stop = stop
        self._limit = limit
        self._presence = presence
        self._newest: int | None = None
        self._share: ProcessorShare | None = None
        self._age = self._idle = 0.0
        self._over = True
        self.hangs = 0

    def look(self) -> None:
        """Look once; to be repeated each PERIOD."""
        newest = self._heartbeat.beats()
        if newest != self._newest:
            self._newest = newest
            self._over = newest is None
            self._share = None
            self._age = self._idle = 0.0
        elif not self._over:
            self._measure(self._heartbeat.age())

    def run(self, running: Callable[[], bool]) -> None:
        """Look until the end is requested.

        Raises:
            MiddlewareError: The namespace was removed. The latch in its memory was tripped.
        """
        due = time.monotonic()
        presence = self._presence
        while running():
            self.look()
            if presence is not None and presence.lost():
                self._stop.trip(presence.loss)
                presence.require()
            due = max(due + WATCHDOG_PERIOD, time.monotonic())
            time.sleep(max(0.0, due - time.monotonic()))

    def _measure(self, age: float) -> None:
        """Add up how long the process could have gone on since its newest beat of this age [s]."""
        if self._share is None:
            self._share = ProcessorShare(self._heartbeat.pid)
            able = age
        else:
            able = self._share.since(age - self._age)
        self._age = age
        self._idle += min(able, self._limit / WATCHDOG_POLLS)
        if self._idle > self._limit or age > WATCHDOG_PATIENCE * self._limit:
            self._over = True
            self._judge()

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
