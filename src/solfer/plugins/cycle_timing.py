"""Durations of the stages of a control cycle."""

import time
from collections.abc import Callable

STAGES = ("calls", "read", "robot", "component", "gate", "write")
"""Calls from outside; feedback pipes and claim; kinematics and dynamics; the component; checks; controller pipes."""

_ZEROS = memoryview(bytes(8 * len(STAGES))).cast("q")


class CycleTiming:
    """Stopwatch of one cycle, in fixed memory.

    Attributes:
        names: Names of the stages.
        nanoseconds: The clock [ns].
        times: Time of each of `STAGES` in the newest cycle [ns], int64; zero for a stage that it did not reach. The
            executor replaces it by memory of its own, to collect the times of several plugins.
    """

    names = STAGES

    def __init__(self) -> None:
        self.nanoseconds: Callable[[], int] = time.monotonic_ns
        self.times = memoryview(bytearray(8 * len(STAGES))).cast("q")
        self._last = 0

    def begin(self) -> None:
        """Start a cycle."""
        self.times[:] = _ZEROS
        self._last = self.nanoseconds()

    def done(self, stage: int) -> None:
        """Record the end of the stage with this index in `STAGES`, and start the next."""
        now = self.nanoseconds()
        self.times[stage] = now - self._last
        self._last = now
