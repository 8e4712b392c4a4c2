"""The clock of a sender: stamps that cannot be true are replaced by the arrivals of their messages."""

import math

AHEAD = 1.5
"""Periods by which a stamp may be ahead of all others at its arrival: transports are no faster than they have been."""

PAUSE = 0.5
"""Time without a new stamp after which stamps are compared with nothing: another process may send now [s]."""

AVERAGED = 100
"""Messages over which periods and delays are averaged."""


class SenderClock:
    """Finds the time at which the numbers of each message were true.

    That is its stamp, unless stamps go back by more than half a period, or ahead by more than 1.5, or are no numbers,
    or zero where others are not. After such a stamp arrivals count for 1 s, smoothed, with the mean delay of before.
    Where a clock was set, times go on from there. A stamp after 0.5 s without a new one counts as that of the first
    message.

    A stamp and the arrival of its message need not be of one clock, nor of clocks that go equally fast.

    Attributes:
        fault: What was wrong with the last stamp that did not count; empty: nothing.
        is_distrusted: Whether arrivals count at present.
    """

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """Forget all stamps."""
        self.fault = ""
        self.is_distrusted = False
        self._until = -math.inf
        self._stamp = self._arrival = self._difference = math.nan
        self._count = 0
        self._time = self._period = self._interval = self._delay = self._lowest = self._offset = 0.0

    def time(self, stamp: float, arrival: float) -> float:
        """Return the time of a message by its stamp and its arrival [s]."""
        passed = arrival - self._arrival
        step = stamp - self._stamp
        delay = arrival - stamp
        if not self.is_distrusted and 0.0 < step and delay >= self._lowest:
            count = self._count
            if count < AVERAGED:
                self._count = count = count + 1
            self._arrival = arrival
            self._stamp = stamp
            self._period += (step - self._period) / count
            self._interval += (passed - self._interval) / count
            self._delay += (delay - self._delay) / count
            # the lowest delay is forgotten in a second: a simulation that is slower than real time falls behind; of the
            # time between two messages at most 20 ms count: what comes late after a stall comes together
            self._lowest += (delay - self._lowest) * min(passed, 0.02)
            return stamp + self._offset
        return self._check(stamp, arrival)

    def _check(self, stamp: float, arrival: float) -> float:
        """Return the time of a message that is the first, repeated, earlier than all before, or after a wrong stamp."""
        if arrival - self._arrival > PAUSE:
            self.restart()
        if stamp == self._stamp and stamp and not self.is_distrusted:
            return stamp + self._offset  # a simulation that stands still has no period
        passed = arrival - self._arrival
        step = stamp - self._stamp
        delay = arrival - stamp
        self._arrival = arrival
        if math.isnan(passed) or (self._stamp == 0.0 and not self.is_distrusted):  # or the first one with a stamp
            self._stamp = stamp
            self._delay = self._lowest = delay
            return stamp
        # no stamp is checked by those of the first messages, of which some may have waited
        period = self._period if self._count >= 20 else math.inf
        # a stamp may be ahead by the mean delay beyond the lowest one besides
        tolerance = AHEAD * period + (self._delay - self._lowest)
        speed = self._period / self._interval if self._interval else 1.0
        is_ahead = step > speed * passed + tolerance and (self.is_distrusted or delay < self._lowest - tolerance)
        if not step >= -0.5 * period or is_ahead or not stamp:
            self._distrust(stamp, step, arrival - passed)
        if self.is_distrusted:
            return self._follow(stamp, arrival)
        self._count = count = min(self._count + 1, AVERAGED)
        self._lowest = min(self._lowest, delay)
        self._stamp = max(stamp, self._stamp)
        self._period += (step - self._period) / count
        self._interval += (passed - self._interval) / count
        self._delay += (delay - self._delay) / count
        return stamp + self._offset

    def _distrust(self, stamp: float, step: float, before: float) -> None:
        """Let arrivals count from now on, after the message that arrived `before` [s]."""
        if not stamp or not math.isfinite(stamp):
            self.fault = f"a stamp of {stamp:g}"
        else:
            self.fault = f"stamps that go {'back' if step < 0.0 else 'ahead'} by {abs(step):.3g} s"
        if not self.is_distrusted:
            self._time = before - self._delay + self._offset
        self.is_distrusted = True
        self._until = self._arrival + 1.0
        self._difference = math.nan

    def _follow(self, stamp: float, arrival: float) -> float:
        """Return the time of a message by its arrival, and in the end by its stamp, from where times are by then."""
        is_over = arrival > self._until
        if is_over and abs(self._difference - self._offset) > 0.1:  # [s]: the clock was set, this is no jitter
            self._offset = self._difference
        target = stamp if is_over else arrival - self._delay
        target += self._offset
        expected = self._time + self._period
        # a tenth of a difference is made up for in one period, and time goes on by a tenth of it at least
        self._time = max(expected + 0.1 * (target - expected), self._time + 0.1 * self._period)
        if math.isfinite(stamp) and stamp:
            self._stamp = stamp if abs(stamp - self._stamp) > AHEAD * self._period else max(stamp, self._stamp)
            difference = self._time - stamp
            known = difference if math.isnan(self._difference) else self._difference
            self._difference = known + (difference - known) / AVERAGED
        if is_over and self._time - target < 0.5 * self._period:
            self.is_distrusted = False
            self._delay = self._lowest = arrival - stamp
        return self._time
