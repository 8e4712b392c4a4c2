"""Faults of stamps that stay: they are of another clock, which counts from then on."""

import math


class StampFault:
    """A fault of stamps: after a while it is their clock that has changed.

    Attributes:
        since: When it began [s]; NaN: the newest stamp is right.
    """

    def __init__(self) -> None:
        self.since = math.nan

    def persists(self, arrival: float) -> bool:
        """Note that a stamp which arrives at a time [s] has the fault; return whether it has for 0.2 s."""
        if math.isnan(self.since):
            self.since = arrival
        return arrival - self.since >= 0.2


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
