"""How far a motion is behind the clock, and how it makes up for that."""

ROLLING_TIMEOUT = 0.3
"""Longest time for which wheels roll on as they were commanded last [s]: then the lower level stops them."""


class ClockDelay:
    """How far the motion is behind the clock.

    Attributes:
        ratio: Ratio of the received velocities with which others go on while the motion makes up for it, from 0 to 1.
    """

    def __init__(self) -> None:
        self.start()

    def start(self) -> None:
        """Begin on time."""
        self._behind = 0.0
        self.ratio = 1.0

    def advance(self, step: float, passed: float, lost: float) -> float:
        """Take over the times of a cycle.

        Args:
            step: Time over which it integrates [s].
            passed: Time since the cycle before [s].
            lost: Time that has passed by the clock alone [s].

        Returns:
            For how much longer than `step` wheels have rolled on since the cycle before [s]. The pace makes up for the
            rest of a gap.
        """
        rolled = max(step, min(passed, ROLLING_TIMEOUT))
        self._behind += passed + lost - rolled
        # others slow down for what the motion is behind the clock: at 0.2 s they wait
        self.ratio = max(0.0, 1.0 - self._behind / 0.2)
        self._behind -= (1.0 - self.ratio) * (passed + lost)
        return rolled - step
