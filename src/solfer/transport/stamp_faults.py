"""Faults of stamps that stay: they are of another clock, which counts from then on."""

import math

STAMP_PERSISTENT = 0.2
"""A clock was set, or is another, if its stamps jump or differ for so long [s]."""


class StampFault:
    """A fault of stamps: after a while it is their clock that has changed.

    Attributes:
        since: When it began [s]; NaN: the newest stamp is right.
    """

    def __init__(self) -> None:
        self.since = math.nan

    def persists(self, arrival: float) -> bool:
        """Note that a stamp which arrives at a time [s] has the fault; return whether it has lasted for long."""
        if math.isnan(self.since):
            self.since = arrival
        return arrival - self.since >= STAMP_PERSISTENT


class StreamClock:
    """Stamps of a stream, which do not go back; those that stay back are of another clock.

    Attributes:
        newest: Newest stamp that counts [s]; minus infinity before the first.
    """

    def __init__(self) -> None:
        self.newest = -math.inf
        self._fault = StampFault()

    def accepts(self, stamp: float, arrival: float) -> bool:
        """Return whether a message with a stamp counts, which arrives at a time [s]; without a stamp (0) it does."""
        if stamp == 0.0:
            return True
        if not math.isfinite(stamp) or (stamp < self.newest and not self._fault.persists(arrival)):
            return False
        self.newest = stamp
        self._fault.since = math.nan
        return True
