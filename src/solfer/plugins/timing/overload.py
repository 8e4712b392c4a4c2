"""Detects a loop that is too slow for its robot, and how much slower the robot has to move for it."""

import logging
from collections.abc import Sequence
from functools import partial

import numpy as np

from solfer.config.records.modules import OverloadRecord
from solfer.pipes import FeedbackPipe

logger = logging.getLogger(__name__)

WINDOW = 1.0
"""Time constant with which cycles, and the time that they had, are forgotten [s]."""

SLOWING_RATIO = 0.5
"""Ratio of periods left out beyond which motions slow down; up to it components bridge the gaps."""

REST_RATIO = 0.6
"""Ratio of periods left out beyond which they rest."""


class Overload:
    """Decides once a cycle, in the robot's own time, whether a loop is overloaded.

    A loop is overloaded when it has left out more than a ratio of the periods of a second, or works on a measurement
    that is too old. The pace falls from 1 to 0 between `SLOWING_RATIO` and `REST_RATIO`, with the age as well. From 0
    it rises when neither slows motions down any more.

    Args:
        plugin: Name of the plugin, for messages.
        feedbacks: Its pipes in; the first one that measures the robot counts.
        period: Time of a control cycle [s].
        limits: When the loop is overloaded.

    Attributes:
        reason: Why it is overloaded, with the figure of the beginning; empty while nothing is.
        figures: Ratio of the periods left out, age of the measurement [s], and pace; live, shape (3,).
        pace: Ratio of their speed with which motions may go on.
        is_near: Whether a limit is exceeded, shape (1,): then, and while motions are slowed down, `change` is due.
        address: What `RobotTime` counts a cycle in.
    """

    def __init__(self, plugin: str, feedbacks: Sequence[FeedbackPipe], period: float, limits: OverloadRecord):
        self._plugin = plugin
        # imported here: its compiler takes a while to load
        from solfer.numerics.blocks import MemoryBlock
        from solfer.plugins.timing.kernel import LOAD, add

        self._period = period
        self._limits = limits
        self._slowed = max(SLOWING_RATIO, limits.left_out)
        self._feedback = next((each for each in feedbacks if each.measures), None)
        self.figures = np.zeros(3)
        self.is_near = np.zeros(1, dtype=bool)
        self._block = MemoryBlock(
            LOAD,
            period=period,
            window=WINDOW,
            ratio_limit=limits.left_out,
            age_limit=limits.age,
            sums=np.zeros(2),
            accepted=np.zeros(1, dtype=np.int64),
            figures=self.figures,
            is_near=self.is_near,
        )
        self.address = self._block.address
        self._add = partial(add, self.address)
        self.restart()

    def restart(self) -> None:
        """Begin with a loop that keeps its rate."""
        self.reason = ""
        self.pace = 1.0
        self.figures[:] = 0.0, 0.0, 1.0
        self._calm = 0.0
        arrays = self._block.arrays
        arrays["sums"][:] = WINDOW, WINDOW / self._period
        arrays["accepted"][0] = -1
        self.is_near[0] = False

    def advance(self, passed: float) -> float:
        """Return the pace, in a cycle that begins `passed` [s] after the one before, in the robot's time."""
        self._add(passed, -1 if self._feedback is None else self._feedback.accepted)
        if self.is_near[0] or self.reason or self.pace < 1.0:
            self.change(passed)
        return self.pace

    def change(self, passed: float) -> None:
        """Begin or end the overload, and change the pace."""
        left_out, oldest_age, _ = self.figures.tolist()
        ratio = left_out / self._limits.left_out
        age = oldest_age / self._limits.age
        worst = max(ratio, age)
        if worst > 1.0 and not self.reason:
            self.reason = (
                f"overloaded: it leaves out {left_out:.0%} of its periods"
                if ratio > age
                else f"behind: its newest measurement is {1e3 * oldest_age:.0f} ms old"
            )
            logger.warning("%s is %s; motions slow down", self._plugin, self.reason)
        self._calm = self._calm + passed if worst < 0.5 else 0.0
        if self.reason and self._calm > 1.0:
            self.reason = ""
            logger.info("%s keeps up again", self._plugin)
        oldest = 4.0  # age of the measurement at which motions rest, in ages at which the overload begins
        slowed = max((left_out - self._slowed) / (REST_RATIO - SLOWING_RATIO), (age - 1.0) / (oldest - 1.0), 0.0)
        if slowed and not self.pace:  # what rests goes on when nothing slows it down any more, and does not creep
            slowed = 1.0
        change = max(1.0 - slowed, 0.0) - self.pace
        # for 0.02 s of a cycle at most: others have followed the pace before through all of a gap
        step = min(passed, 0.02)
        fall_rate = 4.0  # [1/s]
        rise_rate = 1.0
        self.pace += min(max(change, -fall_rate * step), rise_rate * step)
        self.figures[2] = self.pace
