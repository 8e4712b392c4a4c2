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
