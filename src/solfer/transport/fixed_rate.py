"""A loop at a fixed rate."""

from collections.abc import Callable
from typing import Protocol


class Clock(Protocol):
    """A clock to sleep on, such as a Middleware."""

    def now(self) -> float:
        """Return the monotonic time [s]."""

    def sleep_until(self, deadline: float) -> None:
        """Return at `deadline` [s], or at once when it has passed."""


class FixedRateLoop:
    """Begins cycles at absolute deadlines, one period apart.

    A loop that is late, because of a long cycle or because it was woken late, leaves out whole periods and never makes
    up for them in a burst: each cycle begins in a period of its own.

    Args:
        clock: Its clock.
        rate: Cycles per second [Hz].
        catch_up: Lag below which no period is left out [s], if that is longer than a period: it is made up by cycles
            without a pause. For a loop whose cycles must not be left out, such as the steps of a simulation.

    Attributes:
        period: Time between two deadlines [s].
        deadline: Deadline of the newest cycle [s].
        skipped: Periods that were left out since the start.
    """

    def __init__(self, clock: Clock, rate: float, catch_up: float = 0.0):
        self._now = clock.now
        self._sleep_until = clock.sleep_until
        self.period = 1.0 / rate
        self._made_up = max(0.0, catch_up - self.period)
        self.skipped = 0
        self._periods = 0
        self._begin = self.deadline = clock.now()

    def restart(self) -> None:
        """Begin again: the next cycle is due now."""
        self._periods = 0
        self._begin = self._now()
        self.deadline = self._begin

    def begin(self) -> tuple[float, int]:
        """Begin a cycle.

        Returns:
            How late it is [s], and how many periods are left out because of that.
        """
        late = self._now() - self.deadline
        skip = int((late - self._made_up) / self.period)
        if skip <= 0:
            return late, 0
        self.skipped += skip
        self._advance(skip)
        return late, skip

    def wait(self, periods: int = 1) -> None:
        """End a cycle that stands for so many periods: return at the deadline of the next one."""
        self._advance(periods)
        self._sleep_until(self.deadline)

    def run(self, cycle: Callable[[float, int], None], running: Callable[[], bool]) -> None:
        """Call `cycle` with what `begin` returns, while `running` is true.

        The first cycle is due at once, or, in lock-step with a simulation, when that begins.
        """
        self._sleep_until(self._now())
        self.restart()
        while running():
            cycle(*self.begin())
            self.wait()

    def _advance(self, periods: int) -> None:
        self._periods += periods
        self.deadline = self._begin + self._periods * self.period
