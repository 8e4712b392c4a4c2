"""Keeps simulated time in step with real time."""

from solfer.simulation.physics import STEP
from solfer.transport.fixed_rate import Clock, FixedRateLoop


class Pace:
    """Waits for the moment at which a simulated time is due.

    A lag of up to 20 ms is made up by steps without a pause; what goes beyond is counted as lost.

    Args:
        clock: The clock of real time.
        factor: Simulated seconds for each second of the clock; 0: as fast as possible.

    Attributes:
        measured: Simulated seconds for each second of the clock over the newest second; zero before the first is over.
    """

    def __init__(self, clock: Clock, factor: float = 1.0):
        self._now = clock.now
        self.measured = 0.0
        self._loop = FixedRateLoop(clock, factor / STEP, 0.02) if factor else None
        self._newest: float | None = None
        self._window = (0.0, 0.0)

    @property
    def lost(self) -> float:
        """Time that was not made up [s]."""
        return self._loop.skipped * self._loop.period if self._loop is not None else 0.0

    def wait(self, time: float) -> None:
        """Return when the simulated `time` [s] is due; the first call and a time that goes back start again."""
        now = self._now()
        newest = self._newest
        self._newest = time
        if newest is None or time < newest:
            self._window = (now, time)
            if self._loop is not None:
                self._loop.restart()
            return
        self._measure(now, time)
        if self._loop is not None:
            self._loop.wait(round((time - newest) / STEP))
            self._loop.begin()

    def restart(self) -> None:
        """Start again with the next `wait`: the time in between does not count as lost."""
        self._newest = None

    def _measure(self, now: float, time: float) -> None:
        begin, simulated = self._window
        if now - begin >= 1.0:
            self.measured = (time - simulated) / (now - begin)
            self._window = (now, time)
