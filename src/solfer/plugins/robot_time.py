"""How much time passes for the robot from one cycle of a plugin to the next."""

from collections.abc import Sequence

from solfer.pipes import FeedbackPipe
from solfer.plugins.cycle_timing import PassedPeriods

EARLY, LATE = 0.03, 0.06
"""Times by which the newest stamp may be before the robot's time, or behind it: messages come early or late [s]."""

RANGE = 0.06
"""The robot's time hardly goes on where the newest stamp is further behind it by this [s]."""

SLOWEST, FASTEST = 0.01, 2.0
"""How fast the robot's time goes at least and at most: never not at all, for many divide by what has passed."""

SET, FROZEN = 1.0, 0.5
"""A stamp that jumps by this is of a clock that was set, and one that stays for so long is of none [s]."""


class RobotTime:
    """Time that passes for the robot: that of the clock, or less where its own measurements show that it is slower.

    A simulation that cannot hold real time falls behind the clock of those who command it: references that follow the
    clock would run away from the robot. The stamps of the first feedback that measures it show how far it has come.
    Messages that are merely late or lost change nothing: within `EARLY` and `LATE` the clock counts.

    Args:
        feedbacks: Pipes in, in the order of the configuration.
        period: Time of a control cycle [s].

    Attributes:
        lost: Time that has passed by the clock and not for the robot in the newest cycle [s].
    """

    def __init__(self, feedbacks: Sequence[FeedbackPipe], period: float):
        self._period, self._periods = period, PassedPeriods(period)
        self._feedback = next((each for each in feedbacks if each.measures), None)
        self._stamp = self._ahead = self._still = self.lost = 0.0

    def restart(self, now: float) -> None:
        """Begin at a time of the clock [s]."""
        self._periods.restart(now)
        self._stamp = self._ahead = self._still = self.lost = 0.0

    def advance(self, now: float) -> float:
        """Return how much time has passed for the robot since the last call [s], which is now by the clock [s]."""
        by_clock = self._periods.count(now) * self._period
        ahead = self._ahead + by_clock - self._progress(by_clock)
        if self._stamp == 0.0 or self._still > FROZEN:
            ahead = 0.0
        if -EARLY <= ahead <= LATE:
            self._ahead, self.lost = ahead, 0.0
            return by_clock
        over = ahead - LATE if ahead > LATE else ahead + EARLY
        passed = by_clock * min(max(1.0 - over / RANGE, SLOWEST), FASTEST)
        self.lost = by_clock - passed
        self._ahead = ahead - self.lost
        return passed

    def _progress(self, by_clock: float) -> float:
        """Return by how much the newest stamp has moved on [s]; a clock that was set has moved on as it should."""
        before = self._stamp
        stamp = before if self._feedback is None else self._feedback.stamp
        if -SET < stamp - before <= 0.0:  # nothing new, or what has been overtaken
            self._still += by_clock
            return 0.0
        self._stamp, self._still = stamp, 0.0
        if before and abs(stamp - before) < SET:
            return stamp - before
        self._ahead = 0.0
        return by_clock
