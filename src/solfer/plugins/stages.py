"""How long the stages of a control cycle take."""

import time
from collections.abc import Callable

STAGES = ("calls", "read", "robot", "component", "gate", "write")
"""Calls from outside; feedback pipes and claim; kinematics and dynamics; the component; checks; controller pipes."""


class Stages:
    """Stopwatch of one cycle, in fixed memory.

    Args:
        nanoseconds: The clock [ns].

    Attributes:
        names: Names of the stages.
        times: Time of each of `STAGES` in the newest cycle [ns]; zero for a stage that it did not come to.
    """

    names = STAGES

    def __init__(self, nanoseconds: Callable[[], int] = time.monotonic_ns):
        self.nanoseconds, self.times = nanoseconds, [0] * len(STAGES)
        self._zeros, self._last = [0] * len(STAGES), 0

    def begin(self) -> None:
        """A cycle begins."""
        self.times[:] = self._zeros
        self._last = self.nanoseconds()

    def done(self, stage: int) -> None:
        """The stage with this index in `STAGES` has ended, and the next begins."""
        now = self.nanoseconds()
        self.times[stage] += now - self._last
        self._last = now
