"""How much time passes for the robot from one cycle of a plugin to the next."""

import math
from collections.abc import Callable, Sequence
from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np

from solfer.pipes import FeedbackPipe
from solfer.plugins.timing.limits import ROWS
from solfer.plugins.timing.overload import Overload

_NOTHING = SimpleNamespace(stamp=math.nan, accepted=-1)
"""In place of a feedback that measures."""


class RobotTime:
    """Time that passes for the robot: that of the clock, or of its measurements where these show that it is slower.

    A simulation that cannot hold real time falls behind the clock of those who command it: references that follow the
    clock would run away from the robot. The stamps of the first feedback that measures it show how far it has come.
    Messages that are only late or lost change nothing: within `limits.EARLIEST` and `limits.LATEST` the clock counts.
    Beyond that the stamps do, until the robot keeps up with the clock again.

    Args:
        feedbacks: Pipes in, in the order of the configuration.
        period: Time of a control cycle [s].
        load: What counts the load of the loop with it, if anything does.

    Attributes:
        feedback: The first one that measures; stands for none, too.
        state: What it remembers; at `limits.LOST` the time that has passed by the clock and not for the robot in the
            newest cycle [s]; negative: the other way.
        advance: Returns how much time has passed for the robot since the last call [s]; takes the time of the clock
            [s], and `stamp` and `accepted` of `feedback`.
    """

    def __init__(self, feedbacks: Sequence[FeedbackPipe], period: float, load: Overload | None = None):
        # imported here: its compiler takes a while to load
        from solfer.numerics.blocks import MemoryBlock
        from solfer.plugins.timing.kernel import TIME, advance

        self.feedback: Any = next((each for each in feedbacks if each.measures), _NOTHING)
        numbers = np.zeros(ROWS)
        self.state = memoryview(numbers)
        self._block = MemoryBlock(TIME, period=period, state=numbers, load=0 if load is None else load.address)
        self.advance: Callable[[float, float, int], float] = partial(advance, self._block.address)
        self.restart(0.0)

    def restart(self, now: float) -> None:
        """Begin at a time of the clock [s]."""
        self.state[:] = memoryview(np.array([0.0, now, *np.zeros(ROWS - 2)]))
