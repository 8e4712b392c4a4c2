"""Keeps simulated time in step with real time."""

from collections.abc import Callable

CATCH_UP = 0.02  # [s]
WINDOW = 1.0  # [s]


class Pace:
    """Waits for the moment at which a simulated time is due.

    Deadlines are absolute. A lag of up to CATCH_UP is made up by steps without a pause; what goes beyond is counted as
    lost.

    Args:
        now: Monotonic clock [s].
        sleep_until: Returns at a time of that clock [s].
        factor: Simulated seconds for each second of the clock; 0: as fast as possible.

    Attributes:
        lost: Time that was not made up [s].
        measured: Simulated seconds for each second of the clock over the newest window; zero before the first is full.
    """

    def __init__(self, now: Callable[[], float], sleep_until: Callable[[float], None], factor: float = 1.0):
        self._now, self._sleep_until, self.factor = now, sleep_until, factor
        self.lost, self.measured = 0.0, 0.0
        self._start: tuple[float, float] | None = None
        self._window = (0.0, 0.0)
        self._newest = 0.0

    def wait(self, time: float) -> None:
        """Return when the simulated `time` [s] is due; the first call and a time that goes back start anew."""
        now = self._now()
        if self._start is None or time < self._newest:
            self._start = self._window = (now, time)
        self._newest = time
        self._measure(now, time)
        if not self.factor:
            return
        deadline = self._start[0] + (time - self._start[1]) / self.factor
        if now < deadline:
            self._sleep_until(deadline)
        elif now > deadline + CATCH_UP:
            late = now - deadline - CATCH_UP
            self.lost += late
            self._start = (self._start[0] + late, self._start[1])

    def restart(self) -> None:
        """Start anew with the next `wait`: the time in between does not count as lost."""
        self._start = None

    def _measure(self, now: float, time: float) -> None:
        begin, simulated = self._window
        if now - begin >= WINDOW:
            self.measured = (time - simulated) / (now - begin)
            self._window = (now, time)
