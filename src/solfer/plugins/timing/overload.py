"""Detects a loop that is too slow for its robot, and how much slower the robot has to move for it."""

import logging
from collections.abc import Sequence

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
    """

    def __init__(self, plugin: str, feedbacks: Sequence[FeedbackPipe], period: float, limits: OverloadRecord):
        self._plugin = plugin
        self._period = period
        self._ratio_limit = limits.left_out
        self._age_limit = limits.age
        self._slowed = max(SLOWING_RATIO, limits.left_out)
        self._feedback = next((each for each in feedbacks if each.measures), None)
        self.figures = np.zeros(3)
        self.restart()

    def restart(self) -> None:
        """Begin with a loop that keeps its rate."""
        self.reason = ""
        self.pace = 1.0
        self.figures[:] = 0.0, 0.0, 1.0
        self._left_out = self._age = self._calm = 0.0
        self._passed = WINDOW
        self._cycles = WINDOW / self._period
        self._accepted = -1

    def advance(self, passed: float) -> float:
        """Return the pace, in a cycle that begins `passed` [s] after the one before, in the robot's time."""
        # over time, not in each cycle: measurements that come in bunches let the robot's time pass in bunches
        kept = 1.0 / (1.0 + passed / WINDOW)
        self._passed = kept * self._passed + passed
        self._cycles = kept * self._cycles + 1.0
        self._left_out = max(1.0 - self._cycles * self._period / self._passed, 0.0)
        feedback = self._feedback
        if feedback is not None:
            self._age = self._age + passed if feedback.accepted == self._accepted else 0.0
            self._accepted = feedback.accepted
        ratio = self._left_out / self._ratio_limit
        age = self._age / self._age_limit
        if self.reason or ratio > 1.0 or age > 1.0 or self.pace < 1.0:
            self._change(ratio, age, passed)
        figures = self.figures
        figures[0] = self._left_out
        figures[1] = self._age
        figures[2] = self.pace
        return self.pace

    def _change(self, ratio: float, age: float, passed: float) -> None:
        """Begin or end the overload, and change the pace; `ratio` and `age` are multiples of their limits."""
        worst = max(ratio, age)
        if worst > 1.0 and not self.reason:
            self.reason = (
                f"overloaded: it leaves out {self._left_out:.0%} of its periods"
                if ratio > age
                else f"behind: its newest measurement is {1e3 * self._age:.0f} ms old"
            )
            logger.warning("%s is %s; motions slow down", self._plugin, self.reason)
        self._calm = self._calm + passed if worst < 0.5 else 0.0
        if self.reason and self._calm > 1.0:
            self.reason = ""
            logger.info("%s keeps up again", self._plugin)
        oldest = 4.0  # age of the measurement at which motions rest, in ages at which the overload begins
        slowed = max((self._left_out - self._slowed) / (REST_RATIO - SLOWING_RATIO), (age - 1.0) / (oldest - 1.0), 0.0)
        if slowed and not self.pace:  # what rests goes on when nothing slows it down any more, and does not creep
            slowed = 1.0
        change = max(1.0 - slowed, 0.0) - self.pace
        # for 0.02 s of a cycle at most: others have followed the pace before through all of a gap
        step = min(passed, 0.02)
        fall_rate = 4.0  # [1/s]
        rise_rate = 1.0
        self.pace += min(max(change, -fall_rate * step), rise_rate * step)
