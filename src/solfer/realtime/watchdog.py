"""Supervises the heartbeat of the RT process from outside."""

import logging
import os
import signal
import time
from collections.abc import Callable
from contextlib import suppress

from solfer.realtime.emergency_stop import EmergencyStopLatch
from solfer.realtime.heartbeat import Heartbeat
from solfer.realtime.processor import ProcessorTime
from solfer.segments.presence import Presence

logger = logging.getLogger(__name__)


class Watchdog:
    """Trips the emergency stop when the RT process hangs: in an endless loop, a call that blocks, or stopped.

    A process that waits for a processor, or is stopped, cannot cycle and does not hang: its robot holds already, for
    its commands are missing, and it goes on from the measured state. Where that takes `AGE_RATIO` times as long, it may
    no longer go on by itself. A process that hangs on is killed: in a call of compiled code it obeys no other signal.
    The end of the process is only logged: its successor begins from the measured state.

    Args:
        heartbeat: The heartbeat of the process.
        stop: The latch to trip.
        limit: Time without a beat, in which the process ran or waited for something else than a processor, above which
            it hangs [s].
        presence: Checks whether the namespace still exists; None: it is not checked.

    Attributes:
        hangs: How often the process has begun to hang.
    """

    LIMIT = 0.1
    """Default of `limit` [s]."""

    END = 5.0
    """Time that a process may hang, counted as for the limit, until it is killed [s]."""

    PERIOD = 0.01
    """Time between two checks [s]."""

    AGE_RATIO = 10.0
    """Multiple of the limit: age of the newest beat above which a process hangs even if the machine did not run it."""

    def __init__(
        self, heartbeat: Heartbeat, stop: EmergencyStopLatch, limit: float = LIMIT, presence: Presence | None = None
    ):
        self._heartbeat = heartbeat
        self._stop = stop
        self._limit = limit
        self._presence = presence
        self._newest: int | None = None
        self._processor_time: ProcessorTime | None = None
        self._age = self._idle = 0.0
        self._over = True
        self._is_hanging = False
        self.hangs = 0

    def look(self) -> None:
        """Check once; to be repeated each `PERIOD`."""
        newest = self._heartbeat.beats()
        if newest != self._newest:
            self._newest = newest
            self._over = newest is None
            self._is_hanging = False
            self._processor_time = None
            self._age = self._idle = 0.0
        elif self._is_hanging or not self._over:
            self._measure(self._heartbeat.age())

    def run(self, running: Callable[[], bool]) -> None:
        """Check until the end is requested.

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
            due = max(due + self.PERIOD, time.monotonic())
            time.sleep(max(0.0, due - time.monotonic()))

    def _measure(self, age: float) -> None:
        """Add up how long the process could have gone on since its newest beat of this age [s]."""
        if self._processor_time is None:
            self._processor_time = ProcessorTime(self._heartbeat.pid)
            able = age
        else:
            able = self._processor_time.since(age - self._age)
        self._age = age
        # at least three checks: a stall of the whole machine, with the watchdog, is no hang
        self._idle += min(able, self._limit / 3)
        if self._is_hanging:
            if self._idle > self.END:
                self._is_hanging = False
                self._kill()
        elif self._idle > self._limit or age > self.AGE_RATIO * self._limit:
            self._over = True
            self._handle_loss()

    def _handle_loss(self) -> None:
        """Handle a missing heartbeat: the process hangs or has ended."""
        heartbeat = self._heartbeat
        if heartbeat.alive():
            self.hangs += 1
            self._is_hanging = True
            reason = f"process {heartbeat.pid} hangs: no cycle for {1e3 * heartbeat.age():.0f} ms"
            self._stop.trip(reason)
            logger.error("emergency stop: %s", reason)
        else:
            logger.error("process %d has ended unexpectedly", heartbeat.pid)

    def _kill(self) -> None:
        pid = self._heartbeat.pid
        with suppress(ProcessLookupError, PermissionError):
            os.kill(pid, signal.SIGKILL)
            logger.error("process %d hangs for %g s and is killed", pid, self.END)
