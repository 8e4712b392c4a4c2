"""Lets a robot hold when the process that commands it is gone or hangs, sooner than a lease would end."""

import logging
from typing import Protocol

from solfer.lower_level.lower_level import LowerLevel

logger = logging.getLogger(__name__)


CYCLES = 20
"""Cycles that a process may miss in a row."""


class Beating(Protocol):
    """A process that beats once in each of its cycles.

    Attributes:
        period: Time from one of its cycles to the next [s].
    """

    period: float

    def beats(self) -> int | None:
        """A number that changes with each cycle; None while there is no such process."""


class Supervision:
    """Watches the beats of a process; when it misses too many, all leases end.

    Wheels stop, positions hold. Whoever commanded has to claim anew, also if the process goes on later, so that it
    begins from the measured state and not with what it wanted before.

    Args:
        lower_level: What is commanded.
        process: Who commands it.
        cycles: Cycles that the process may miss, counted in the time of the lower level.

    Attributes:
        lost: Whether the beats are missing at present.
        losses: How often they went missing.
    """

    def __init__(self, lower_level: LowerLevel, process: Beating, cycles: int = CYCLES):
        self._lower_level, self._process, self._cycles = lower_level, process, cycles
        self.lost, self.losses = False, 0
        self._newest, self._age = process.beats(), 0.0

    def advance(self, dt: float) -> None:
        """Let `dt` [s] pass."""
        newest = self._process.beats()
        if newest is not None and newest != self._newest:
            self._newest, self._age = newest, 0.0
            if self.lost:
                self.lost = False
                logger.info("the process that commands is back")
            return
        self._age += dt
        if self._newest is not None and not self.lost and self._age > self._cycles * self._process.period:
            self.lost, self.losses = True, self.losses + 1
            self._hold()

    def _hold(self) -> None:
        lower_level = self._lower_level
        reason = f"no beat of the process that commands for {1e3 * self._age:.0f} ms"
        owners = lower_level.claims.owners()
        for owner in owners:
            lower_level.release(owner)
            lower_level.claims.bar(owner, reason)
        if owners:
            logger.error("%s: the robot holds; its joints were commanded by %s", reason, ", ".join(owners))
