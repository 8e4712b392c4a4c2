"""How much time passes for the robot from one cycle of a plugin to the next."""

from collections.abc import Sequence

from solfer.pipes import FeedbackPipe

EARLIEST = 0.03
"""Time by which the newest stamp may be before the robot's time: messages come early [s]."""

LATEST = 0.06
"""Time by which it may be behind it: messages come late [s]."""

JUMP = 1.0
"""A stamp that jumps by this is of a clock that was set [s]."""


class RobotTime:
    """Time that passes for the robot: that of the clock, or of its measurements where these show that it is slower.

    A simulation that cannot hold real time falls behind the clock of those who command it: references that follow the
    clock would run away from the robot. The stamps of the first feedback that measures it show how far it has come.
    Messages that are only late or lost change nothing: within `EARLIEST` and `LATEST` the clock counts. Beyond that the
    stamps do, until the robot keeps up with the clock again.

    Args:
        feedbacks: Pipes in, in the order of the configuration.
        period: Time of a control cycle [s].

    Attributes:
        lost: Time that has passed by the clock and not for the robot in the newest cycle [s]; negative: the other way.
    """

    def __init__(self, feedbacks: Sequence[FeedbackPipe], period: float):
        self._period = period
        self._feedback = next((each for each in feedbacks if each.measures), None)
        self.restart(0.0)

    def restart(self, now: float) -> None:
        """Begin at a time of the clock [s]."""
        self._before = now
        self._owed = 0.0
        self._stamp = self._ahead = self._still = self._looked = self.lost = 0.0
        self._follows = False

    def advance(self, now: float) -> float:
        """Return how much time has passed for the robot since the last call [s], which is now by the clock [s]."""
        # whole periods: a cycle may begin anywhere in its own, so what is beyond one is owed until it is whole
        owed = max(0.0, self._owed + (now - self._before) / self._period - 1.0)
        rounding = 1e-6  # ratio of a period by which a clock's time is rounded
        left_out = int(owed + rounding)
        self._before = now
        self._owed = max(0.0, owed - left_out)
        by_clock = (1 + left_out) * self._period
        before = self._stamp
        stamp = before if self._feedback is None else self._feedback.stamp
        if -JUMP < stamp - before <= 0.0:  # nothing new, or what has been overtaken
            self._still += by_clock
            progress = 0.0
        else:
            self._stamp = stamp
            self._still = 0.0
            progress = stamp - before
            if not before or abs(progress) >= JUMP:  # a clock that was set has moved on as it should
                self._ahead = 0.0
                progress = by_clock
        self._ahead += by_clock - progress
        self.lost = 0.0
        if self._stamp == 0.0 or self._still > 0.5:  # a stamp that stays for so long [s] is of no clock
            self._ahead = 0.0
            self._follows = False
        if not self._follows:
            if not -EARLIEST <= self._ahead <= LATEST:
                self._follow(True)
            return by_clock
        self._looked += by_clock
        # the clock counts again where the robot was no more than 0.02 s slower or faster within a second
        if self._looked > 1.0:
            self._follow(abs(self._ahead) > 0.02)
        passed = max(progress, 0.01 * by_clock)  # never nothing, for many divide by it
        self.lost = by_clock - passed
        return passed

    def _follow(self, follows: bool) -> None:
        """Follow the stamps, or the clock; where this changes, and after each look, the robot is as far as it is."""
        if follows or self._follows:
            self._ahead = self._looked = 0.0
        self._follows = follows
