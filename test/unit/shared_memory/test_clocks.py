"""The clocks of a real-time layer: the machine's, and one that another process steps."""

import ctypes
import io
import signal
import time

import pytest

from solfer.errors import MiddlewareError
from solfer.middleware.shared_memory.clock import MonotonicClock, SteppedClock


@pytest.mark.parametrize("library", [None, ctypes.CDLL(None, use_errno=True)], ids=["python", "libc"])
def test_a_sleep_ends_at_its_deadline(library):
    clock = MonotonicClock()
    clock._libc = library
    assert abs(clock.now() - 1e-9 * clock.nanoseconds()) < 1.0
    deadline = clock.now() + 0.02
    clock.sleep_until(deadline)
    assert deadline <= clock.now() < deadline + 5.0
    before = clock.now()
    for past in (before - 10.0, 0.0):
        clock.sleep_until(past)
    assert clock.now() < before + 5.0


@pytest.mark.parametrize("library", [None, ctypes.CDLL(None, use_errno=True)], ids=["python", "libc"])
def test_a_signal_does_not_end_a_sleep(library):
    clock, rung = MonotonicClock(), []
    clock._libc = library
    before = signal.signal(signal.SIGALRM, lambda *_: rung.append(time.monotonic()))
    try:
        deadline = clock.now() + 0.05
        signal.setitimer(signal.ITIMER_REAL, 0.01)
        clock.sleep_until(deadline)
        assert clock.now() >= deadline and len(rung) == 1 and rung[0] < deadline + 5.0
    finally:
        signal.signal(signal.SIGALRM, before)


def test_a_stepped_clock_follows_its_lines():
    sent = []
    clock = SteppedClock(io.StringIO("0.1\n0.05\n0.3\n"), sent.append)
    assert (clock.now(), clock.nanoseconds(), clock.ended) == (0.0, 0, False)
    clock.sleep_until(0.1 + 0.5 * SteppedClock.RESOLUTION)
    assert clock.now() == 0.1 and sent == ["0.0"]
    clock.sleep_until(0.1)  # its time is there
    assert sent == ["0.0"]
    clock.sleep_until(0.2)  # it never goes back
    assert clock.now() == 0.3 and clock.nanoseconds() == 300_000_000 and sent == ["0.0", "0.1", "0.1"]
    clock.sleep_until(0.4)
    assert clock.ended and clock.now() == 0.4 and len(sent) == 4
    clock.sleep_until(5.0)
    assert clock.now() == 0.4 and len(sent) == 4


@pytest.mark.parametrize(("line", "shown"), [("soon\n", "'soon'"), ("nan\n", "'nan'"), ("\n", "''")])
def test_a_line_without_a_time_is_refused(line, shown):
    with pytest.raises(MiddlewareError) as error:
        SteppedClock(io.StringIO(line), lambda _: None).sleep_until(1.0)
    assert str(error.value) == f"standard input: invalid time {shown}\n  expected: the time in each line [s]"
