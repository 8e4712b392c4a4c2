"""Stamps that no sample of a robot can have."""

import math

from solfer.transport.clocks.stamp_faults import StampFault


class StampCheck:
    """Refuses stamps that no sample can have, and counts them by what is wrong with them.

    Whether they go on as the arrivals of their messages do is decided by the pipes, see `SenderClock`. A stamp and an
    arrival need not be of one clock: only stamps show whether two sensors share one.

    Args:
        reference: Check of the sensor whose clock this one shares; None: any clock counts.
        offset: Time by which the stamps are behind those of the reference [s].

    Attributes:
        refused: How many stamps were refused, by what was wrong with them.
        warning: What was wrong last, and the publisher; empty: nothing since it was emptied.
        first: The first stamp that was accepted [s].
        newest: Latest stamp that was accepted [s].
        before: The same when this cycle began [s]; written by who reads the messages of a cycle, which may be those of
            a long gap.
        arrival: When the message with that stamp arrived [s].
    """

    def __init__(self, reference: "StampCheck | None" = None, offset: float = 0.0) -> None:
        self._reference = reference
        self._offset = offset
        self.refused = dict.fromkeys(("zero", "of another clock", "older than the estimate"), 0)
        self.warning = ""
        self.start()

    def start(self) -> None:
        """Forget the clock."""
        self._apart = StampFault()
        self.first = self.newest = self.before = self.arrival = math.nan

    def accepts(self, stamp: float, arrival: float, after: float, sender: str) -> bool:
        """Check a stamp.

        Args:
            stamp: The stamp [s].
            arrival: When its message arrived [s].
            after: It has to be after this time [s]; one that equals it is not counted, but does not pass either.
            sender: Name of its publisher.
        """
        if stamp == 0.0 or not math.isfinite(stamp):
            return self._refuse("zero", sender)
        reference = self._reference
        if reference is not None and not self._shares_clock(reference, stamp + self._offset, arrival):
            return self._apart.persists(arrival) and self._refuse("of another clock", sender)
        if stamp < after:
            return self._refuse("older than the estimate", sender)
        if math.isnan(self.first):
            self.first = stamp
        if not stamp <= self.newest:
            self.newest = stamp
            self.arrival = arrival
        return stamp > after

    def _shares_clock(self, reference: "StampCheck", stamp: float, arrival: float) -> bool:
        """Return whether a stamp fits those of the reference, from before this cycle to now.

        A few stamps that do not fit are of messages that were held up: they are too old to be of use.
        """
        if math.isnan(reference.newest):  # nothing to compare with yet
            self._apart.since = math.nan
            return False
        # in the first cycle comes all that was sent while the plugin was made
        first = reference.first if math.isnan(reference.before) else reference.before
        passed = max(arrival - reference.arrival, 0.0)
        tolerance = 0.1  # [s] between the newest stamps of two sensors that both send
        if first - tolerance <= stamp <= reference.newest + passed + tolerance:
            self._apart.since = math.nan
            return True
        return False

    def _refuse(self, kind: str, sender: str) -> bool:
        self.refused[kind] += 1
        self.warning = f"a stamp of {sender or 'an unknown publisher'} is {kind}"
        return False
