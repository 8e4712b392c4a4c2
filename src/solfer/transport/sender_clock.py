"""The clock of a sender: stamps that cannot be true are replaced by the arrivals of their messages."""

import math

DISTRUST = 1.0
"""Time after a wrong stamp for which arrivals count [s]."""

BACK, AHEAD = 0.5, 1.5
"""Periods by which a stamp may be behind the one before, or ahead of all others at its arrival: transports keep the
order of messages, and are no faster than they have been."""

SPREAD = 1.0
"""Share of the mean delay beyond the least one by which a stamp may be ahead besides."""

AVERAGED = 100
"""Messages over which periods and delays are averaged."""

LEARNED = 20
"""Messages from which on a stamp is judged by those before: at first some may come that have waited."""

FORGETTING_TIME = 1.0
"""Time in which a least delay is forgotten: a simulation that is slower than real time falls behind [s]."""

LONGEST_COUNTED = 0.02
"""Longest time that counts for that between two messages: what comes late after a stall comes together [s]."""

PULL = 0.1
"""Share of a period by which the time of a message goes on at least, and of a difference that is made up for in one."""

CLOCK_DIFFERENCE = 0.1
"""Mean difference of a message's time and its stamp from which on its clock was set, and is no jitter [s]."""


class SenderClock:
    """Finds the time at which the numbers of each message were true.

    That is its stamp, unless stamps go back by more than half a period, or ahead by more than 1.5, or are no numbers,
    or zero where others are not. After such a stamp arrivals count for 1 s, smoothed, with the mean delay of before.
    Where a clock was set, times go on from there.

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
        self._time = self._period = self._interval = self._delay = self._least = self._offset = 0.0

    def time(self, stamp: float, arrival: float) -> float:
        """Return the time of a message by its stamp and its arrival [s]."""
        passed = arrival - self._arrival
        step = stamp - self._stamp
        delay = arrival - stamp
        if not self.is_distrusted and 0.0 <= step and delay >= self._least:
            count = self._count
            if count < AVERAGED:
                self._count = count = count + 1
            self._arrival = arrival
            self._stamp = stamp
            self._period += (step - self._period) / count
            self._interval += (passed - self._interval) / count
            self._delay += (delay - self._delay) / count
            self._least += (delay - self._least) * min(passed, LONGEST_COUNTED) / FORGETTING_TIME
            return stamp + self._offset
        return self._judge(stamp, arrival)

    def _judge(self, stamp: float, arrival: float) -> float:
        """Return the time of a message that is the first, earlier than all before, or comes after a wrong stamp."""
        passed = arrival - self._arrival
        step = stamp - self._stamp
        delay = arrival - stamp
        self._arrival = arrival
        if math.isnan(passed) or (self._stamp == 0.0 and not self.is_distrusted):  # or the first one with a stamp
            self._stamp = stamp
            self._delay = self._least = delay
            return stamp
        period = self._period if self._count >= LEARNED else math.inf
        tolerance = AHEAD * period + SPREAD * (self._delay - self._least)
        speed = self._period / self._interval if self._interval else 1.0
        is_ahead = step > speed * passed + tolerance and (self.is_distrusted or delay < self._least - tolerance)
        if not step >= -BACK * period or is_ahead or not stamp:
            self._distrust(stamp, step, arrival - passed)
        if self.is_distrusted:
            return self._follow(stamp, arrival)
        self._count = count = min(self._count + 1, AVERAGED)
        self._least = min(self._least, delay)
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
        self._until = self._arrival + DISTRUST
        self._difference = math.nan

    def _follow(self, stamp: float, arrival: float) -> float:
        """Return the time of a message by its arrival, and in the end by its stamp, from where times are by then."""
        is_over = arrival > self._until
        if is_over and abs(self._difference - self._offset) > CLOCK_DIFFERENCE:
            self._offset = self._difference
        target = stamp if is_over else arrival - self._delay
        target += self._offset
        expected = self._time + self._period
        self._time = max(expected + PULL * (target - expected), self._time + PULL * self._period)
        if math.isfinite(stamp) and stamp:
            self._stamp = stamp if abs(stamp - self._stamp) > AHEAD * self._period else max(stamp, self._stamp)
            difference = self._time - stamp
            known = difference if math.isnan(self._difference) else self._difference
            self._difference = known + (difference - known) / AVERAGED
        if is_over and self._time - target < 0.5 * self._period:
            self.is_distrusted = False
            self._delay = self._least = arrival - stamp
        return self._time
