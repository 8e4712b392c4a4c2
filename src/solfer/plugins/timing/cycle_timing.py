"""Durations of the stages of a control cycle."""

import enum
import time
from collections.abc import Callable


class Stage(enum.IntEnum):
    """Stage of a control cycle.

    CALLS: from outside. READ: feedback pipes and claim. ROBOT: kinematics and dynamics. COMPONENT. GATE: checks of the
    commands. WRITE: controller pipes.
    """

    CALLS = 0
    READ = 1
    ROBOT = 2
    COMPONENT = 3
    GATE = 4
    WRITE = 5


STAGES = tuple(stage.name.lower() for stage in Stage)
"""Names of the stages."""

NO_TIMES = memoryview(bytes(8 * len(Stage))).cast("q")
"""Times of a cycle that has reached no stage yet."""


class PassedPeriods:
    """Counts the periods from one cycle to the next by the clock: one, or more where a late loop left some out.

    A cycle may begin anywhere in its period. So what is beyond one period is owed, and counts as soon as it is whole.

    Args:
        period: Time of a control cycle [s].
    """

    def __init__(self, period: float):
        self._rate = 1.0 / period
        self._before = 0.0
        self._owed = 0.0

    def restart(self, now: float) -> None:
        """Begin `now` [s]."""
        self._before = now
        self._owed = 0.0

    def count(self, now: float) -> int:
        """Return how many periods have passed at the cycle that begins `now` [s]."""
        owed = max(0.0, self._owed + (now - self._before) * self._rate - 1.0)
        rounding = 1e-6  # share of a period by which a clock's time is rounded
        left_out = int(owed + rounding)
        self._before = now
        self._owed = max(0.0, owed - left_out)
        return 1 + left_out


class CycleTiming:
    """Times of the stages of a cycle, in fixed memory. The plugin writes them.

    Args:
        nanoseconds: The clock [ns].
        times: Where the times go, int64, a number for each `Stage`; None: memory of its own.

    Attributes:
        nanoseconds: See above.
        times: Time of each `Stage` in the newest cycle [ns]; zero for a stage that it did not reach.
    """

    def __init__(self, nanoseconds: Callable[[], int] = time.monotonic_ns, times: memoryview | None = None) -> None:
        self.nanoseconds = nanoseconds
        self.times = times if times is not None else memoryview(bytearray(8 * len(Stage))).cast("q")
