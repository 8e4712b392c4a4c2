"""The pace of a simulation or a recording in memory."""

import math
import time
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any


class PacedClock:
    """The clock, on which a simulation or a recording goes on while others sleep; a lag is not made up for.

    Args:
        step: Lets a time pass in memory [s].
        longest: Longest time that passes at once [s].
        call: Calls a service in memory.

    Attributes:
        call: See above.
        speed: Seconds that pass in memory for each second of the clock.
        measured: Those of about the newest second; NaN: it is not over.
    """

    def __init__(self, step: Callable[[float], None], longest: float, call: Callable[..., Future[Any]]):
        self._step = step
        self._longest = longest
        self.call = call
        self.speed = 1.0
        self.measured = math.nan
        self._newest = self._begin = self.now()
        self._passed = 0.0

    def now(self) -> float:
        """See `Clock.now`."""
        return time.monotonic()

    def sleep_until(self, deadline: float) -> None:
        """See `Clock.sleep_until`."""
        duration = self.speed * min(max(deadline - self._newest, 0.0), self._longest)
        self._newest = deadline
        self._step(duration)
        self._passed += duration
        now = self.now()
        if now - self._begin >= 1.0:  # [s]
            self.measured = self._passed / (now - self._begin)
            self._begin = now
            self._passed = 0.0
        time.sleep(max(deadline - now, 0.0))
