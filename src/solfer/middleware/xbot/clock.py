"""The clock of the RT layer: the machine's monotonic one, or one that is stepped."""

import ctypes
import sys
import time
from collections.abc import Callable

CLOCK_MONOTONIC, TIMER_ABSTIME = 1, 1


class _Timespec(ctypes.Structure):
    _fields_ = (("seconds", ctypes.c_long), ("nanoseconds", ctypes.c_long))


class MonotonicClock:
    """CLOCK_MONOTONIC, which no change of the date moves.

    Python sleeps by `clock_nanosleep` from 3.11 on; before, it used `select`, which is coarser, so that the call is
    made directly there.
    """

    def __init__(self) -> None:
        self._libc = None if sys.version_info >= (3, 11) else ctypes.CDLL(None, use_errno=True)

    @property
    def now(self) -> float:
        """Time [s]."""
        return time.monotonic()

    @staticmethod
    def nanoseconds() -> int:
        """Time [ns]."""
        return time.monotonic_ns()

    def sleep_until(self, deadline: float) -> None:
        """Return at `deadline` [s], or at once when it has passed."""
        if self._libc is None:
            rest = deadline - time.monotonic()
            if rest > 0.0:
                time.sleep(rest)
            return
        seconds = int(deadline)
        until = _Timespec(seconds, int(1e9 * (deadline - seconds)))
        while self._libc.clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, ctypes.byref(until), None):
            if time.monotonic() >= deadline:  # else a signal came: sleep on
                return


class VirtualClock:
    """Stands still until somebody sleeps, steps it, or tells it that work took time. Nothing ever waits for it.

    Args:
        work: Called with the deadline before a sleep ends: what others do in the meantime.

    Attributes:
        now: Time [s].
    """

    def __init__(self, work: Callable[[float], None] | None = None):
        self.now, self._work = 0.0, work

    def nanoseconds(self) -> int:
        """Time [ns]."""
        return round(1e9 * self.now)

    def step(self, duration: float) -> None:
        """Let `duration` [s] pass."""
        self.now += duration

    def sleep_until(self, deadline: float) -> None:
        """Let time pass until `deadline` [s]; it never goes back."""
        if self._work is not None:
            self._work(deadline)
        self.now = max(self.now, deadline)
