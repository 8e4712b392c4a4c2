"""Makes a robot hold when the commanding process is gone or hangs, sooner than a lease would end."""

import logging
from typing import Protocol

from solfer.lower_level.lower_level import LowerLevel

logger = logging.getLogger(__name__)


class HeartbeatSource(Protocol):
    """A process with a heartbeat in each of its cycles.

    Attributes:
        period: Time from one of its cycles to the next [s].
    """

    period: float

    def beats(self) -> int | None:
        """Return a number that changes with each cycle; None while there is no such process."""


class HeartbeatMonitor:
    """Supervises the heartbeat of a process; when it misses too many beats, all leases end.

    Wheels stop, positions hold. Owners have to claim again, also if the process goes on later, so that they begin from
    the measured state and not with earlier commands.

    Args:
        lower_level: The lower level that the process commands.
        process: The process.
        cycles: Heartbeats that the process may miss in a row, counted in the time of the lower level.

    Attributes:
        lost: Whether the heartbeat is missing at present.
        losses: How often it went missing.
    """

    MISSED_CYCLES = 20
    """Default of `cycles`."""

    def __init__(self, lower_level: LowerLevel, process: HeartbeatSource, cycles: int = MISSED_CYCLES):
        self._lower_level = lower_level
        self._process = process
        self._cycles = cycles
        self.lost = False
        self.losses = 0
        self._newest = process.beats()
        self._age = 0.0

    def advance(self, dt: float) -> None:
        """Let `dt` [s] pass."""
        newest = self._process.beats()
        if newest is not None and newest != self._newest:
            self._newest = newest
            self._age = 0.0
            if self.lost:
                self.lost = False
                logger.info("the commanding process is back")
            return
        self._age += dt
        if self._newest is not None and not self.lost and self._age > self._cycles * self._process.period:
            self.lost = True
            self.losses += 1
            reason = f"no heartbeat of the commanding process for {1e3 * self._age:.0f} ms"
            if owners := self._lower_level.release_all(reason):
                logger.error("%s: the robot holds; its joints were commanded by %s", reason, ", ".join(owners))
