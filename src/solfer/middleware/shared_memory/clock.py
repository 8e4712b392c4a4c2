"""The clock of the RT layer: the machine's monotonic one, or one that another process steps."""

import ctypes
import math
import sys
import time
from collections.abc import Callable
from typing import TextIO

from solfer.errors import MiddlewareError


class _Timespec(ctypes.Structure):
    _fields_ = (("seconds", ctypes.c_long), ("nanoseconds", ctypes.c_long))


class MonotonicClock:
    """CLOCK_MONOTONIC, which no change of the date moves.

    Python sleeps by `clock_nanosleep` from 3.11 on; before, it used `select`, which is coarser, so that the call is
    made directly there.
    """

    def __init__(self) -> None:
        self._libc = None if sys.version_info >= (3, 11) else ctypes.CDLL(None, use_errno=True)

    now = staticmethod(time.monotonic)
    """Time [s]."""

    nanoseconds = staticmethod(time.monotonic_ns)
    """Time [ns]."""

    def sleep_until(self, deadline: float) -> None:
        """Return at `deadline` [s], or at once when it has passed."""
        if self._libc is None:
            rest = deadline - time.monotonic()
            if rest > 0.0:
                time.sleep(rest)
            return
        seconds = int(deadline)
        until = _Timespec(seconds, int(1e9 * (deadline - seconds)))
        # 1, 1: CLOCK_MONOTONIC, TIMER_ABSTIME
        while self._libc.clock_nanosleep(1, 1, ctypes.byref(until), None):
            if time.monotonic() >= deadline:  # else a signal came: sleep on
                return


class SteppedClock:
    """Follows the times that another process sends, line by line [s]; `sleep_until` waits for these lines.

    Before each of them it sends its own time, so that the other process knows that all is done that was due.

    Args:
        lines: Where the times come from, such as the standard input.
        send: Sends the other process a line.

    Attributes:
        ended: Whether no more lines come; then `sleep_until` returns at once.
    """

    RESOLUTION = 1e-9
    """Times that differ by less are one: sums of periods are not exact [s]."""

    def __init__(self, lines: TextIO, send: Callable[[str], object]):
        self._lines = lines
        self._send = send
        self._now = 0.0
        self.ended = False

    def now(self) -> float:
        """Return the time [s]."""
        return self._now

    def nanoseconds(self) -> int:
        """Return the time [ns]."""
        return round(1e9 * self._now)

    def sleep_until(self, deadline: float) -> None:
        """Return when the time is `deadline` [s] or later; it never goes back.

        Raises:
            MiddlewareError: A line is not a time.
        """
        while self._now < deadline - self.RESOLUTION and not self.ended:
            self._send(repr(self._now))
            line = self._lines.readline()
            try:
                newest = float(line or "inf")
            except ValueError:
                newest = math.nan
            if math.isnan(newest):
                raise MiddlewareError(
                    f"invalid time {line.strip()!r}", where="standard input", expected="the time in each line [s]"
                )
            self._now = max(self._now, newest)
            if self._now == math.inf:
                self._now = deadline
                self.ended = True
