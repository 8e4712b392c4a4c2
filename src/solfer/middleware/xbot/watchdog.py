"""A look from outside: does the RT process still cycle?"""

import logging
import time
from collections.abc import Callable

from solfer.middleware.xbot.estop import EmergencyStop
from solfer.middleware.xbot.heartbeat import Pulse

logger = logging.getLogger(__name__)

LIMIT = 0.1
"""Age of the newest beat above which a process hangs [s]."""

LOOKS = 3
"""Looks without a new beat that it takes, so that a machine that stood still as a whole is no hang."""

PERIOD = 0.01
"""Time between two looks [s]."""


class Watchdog:
    """Trips the emergency stop when the RT process hangs: in an endless loop, a call that blocks, or stopped.

    A process that ends, in good order or not, is only named: its robot holds already, and whoever starts it again
    begins from the measured state.

    Args:
        pulse: The beats of the process.
        stop: The latch that is set.
        limit: Age of the newest beat above which the process hangs [s].

    Attributes:
        hangs: How often the process has begun to hang.
    """

    def __init__(self, pulse: Pulse, stop: EmergencyStop, limit: float = LIMIT):
        self._pulse, self._stop, self._limit = pulse, stop, limit
        self._newest: int | None = None
        self._looks, self._over, self.hangs = 0, True, 0

    def look(self) -> None:
        """Look once; to be repeated each PERIOD."""
        newest = self._pulse.beats()
        if newest != self._newest:
            self._newest, self._looks, self._over = newest, 0, newest is None
            return
        if self._over:
            return
        self._looks += 1
        if self._looks >= LOOKS and self._pulse.age() > self._limit:
            self._over = True
            self._judge()

    def run(self, running: Callable[[], bool]) -> None:
        """Look until somebody asks for the end."""
        due = time.monotonic()
        while running():
            self.look()
            due = max(due + PERIOD, time.monotonic())
            time.sleep(max(0.0, due - time.monotonic()))

    def _judge(self) -> None:
        """There are no beats any more: is there a process that hangs?"""
        pulse = self._pulse
        if pulse.alive():
            self.hangs += 1
            reason = f"process {pulse.pid} hangs: no cycle for {1e3 * pulse.age():.0f} ms"
            self._stop.trip(reason)
            logger.error("emergency stop: %s", reason)
        else:
            logger.error("process %d has ended without a word", pulse.pid)
