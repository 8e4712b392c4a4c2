"""Stamps that no sample of a robot can have."""

import math

FUTURE = 0.05
"""A stamp is of the future that is this much earlier at its arrival than others [s]."""

FOREIGN = 0.1
"""Two sensors have different clocks whose stamps are this much apart at their arrival [s]."""

PERSISTENT = 0.2
"""A clock was set whose stamps jump for so long [s]."""

FORGET = 1.0
"""Time in which a smallest delay is forgotten: a simulation that is slower than real time falls behind [s]."""

STEP = 0.02
"""Longest time that counts for that between two messages: what comes late after a stall comes together [s]."""

KINDS = ("zero", "of the future", "of another clock", "older than the estimate")


class StampCheck:
    """Refuses stamps that no sample can have, and counts them by what is wrong with them.

    A stamp and the arrival of its message need not be of one clock. What counts is their difference: it is the delay of
    the transport and a constant, and so hardly ever smaller than it has been.

    Attributes:
        refused: How many stamps of each of the `KINDS` were refused.
        complaint: What was wrong last, and the publisher; empty: nothing since it was emptied.
    """

    def __init__(self) -> None:
        self.refused, self.complaint = dict.fromkeys(KINDS, 0), ""
        self._before = 0.0
        self.start()

    def start(self) -> None:
        """Forget the delay."""
        self._delay = self._jumped = math.nan
        self._is_foreign = False

    def accepts(self, stamp: float, arrival: float, after: float, sender: str) -> bool:
        """Judge a stamp.

        Args:
            stamp: The stamp [s].
            arrival: When its message arrived [s].
            after: It has to be after this time [s]; one that equals it is not counted, but does not pass either.
            sender: Name of its publisher.
        """
        if stamp == 0.0 or not math.isfinite(stamp):
            return self._refuse("zero", sender)
        if not self._is_plausible(arrival - stamp, arrival):
            return self._refuse("of the future", sender)
        if self._is_foreign:
            return self._refuse("of another clock", sender)
        if stamp < after:
            return self._refuse("older than the estimate", sender)
        return stamp > after

    def compare(self, other: "StampCheck", offset: float) -> None:
        """Find out whether these stamps, later by an offset [s], can be of the clock of others."""
        apart = self._delay - offset - other._delay
        self._is_foreign = math.isfinite(apart) and abs(apart) > FOREIGN

    def _is_plausible(self, delay: float, arrival: float) -> bool:
        """Return whether a delay is not much smaller than all before, or has been as small for long; note it."""
        if not delay < self._delay - FUTURE:
            passed = min(max(arrival - self._before, 0.0), STEP)
            known = delay if math.isnan(self._delay) else self._delay
            self._delay = min(delay, known + (delay - known) * -math.expm1(-passed / FORGET))
            self._before = arrival
            self._jumped = math.nan
            return True
        if math.isnan(self._jumped):
            self._jumped = arrival
        if arrival - self._jumped < PERSISTENT:
            return False
        self._delay = delay
        self._before = arrival
        self._jumped = math.nan
        return True

    def _refuse(self, kind: str, sender: str) -> bool:
        self.refused[kind] += 1
        self.complaint = f"a stamp of {sender or 'an unknown publisher'} is {kind}"
        return False
