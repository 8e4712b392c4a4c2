"""Stamps that cannot be true, in messages that arrive as they always do; and transports with which they can."""

import math

import numpy as np
import pytest

from solfer.transport.clocks.sender_clock import SenderClock

PERIOD, CLOCK = 0.002, 1.7e9
"""Period of the messages, and what the sender's clock is ahead of that of arrivals [s]."""

WRONG = (2.0, 5.0)
"""Begin and end of what is wrong [s]."""

draw = np.random.default_rng(7)

FAULTS = {
    "jitter": lambda time: time + draw.uniform(-0.07, 0.07),
    "a little jitter": lambda time: time + draw.uniform(-0.01, 0.01),
    "late": lambda time: time - draw.uniform(0.0, 0.02),
    "late by two periods": lambda time: time - draw.uniform(0.0, 2.0 * PERIOD),
    "early": lambda time: time + draw.uniform(0.0, 0.04),
    "set ahead": lambda time: time + 3600.0,
    "set back": lambda time: time - 0.2,
    "backwards": lambda time: 2.0 * WRONG[0] - time,
    "zero": lambda time: -CLOCK,
    "no number": lambda time: math.nan,
}


def times(stamped, arrives=lambda time: time, duration=8.0):
    """Return when messages are sent, and the times that a clock finds for them, both without the sender's clock [s]."""
    clock = SenderClock()
    sent = PERIOD * np.arange(1, round(duration / PERIOD))
    return clock, sent, np.array([clock.time(CLOCK + stamped(time), arrives(time)) - CLOCK for time in sent])


@pytest.mark.parametrize("fault", FAULTS.values(), ids=FAULTS)
def test_arrivals_count_where_stamps_cannot_be_true(fault):
    clock, sent, found = times(lambda time: fault(time) if WRONG[0] < time <= WRONG[1] else time)
    before = sent <= WRONG[0]
    during = (sent > WRONG[0]) & (sent <= WRONG[1])
    np.testing.assert_array_equal(found[before], CLOCK + sent[before] - CLOCK)
    assert np.abs(found - sent)[during].max() < 3.0 * PERIOD
    assert np.diff(found).min() > -1.5 * PERIOD and np.diff(found).max() < 4.0 * PERIOD
    assert np.abs(found - sent).max() < 3.0 * PERIOD and not clock.is_distrusted and clock.fault


@pytest.mark.parametrize("ahead", [-1e3, -0.3, 0.3, 1e3])
def test_after_a_pause_another_process_may_send_with_another_clock(ahead):
    """As a simulator that was killed and started again: its stamps count from the first message on."""
    clock = SenderClock()
    for step in range(1000):
        clock.time(CLOCK + step * PERIOD, step * PERIOD)
    for step in range(1000):
        stamp = CLOCK + ahead + 3.0 + step * PERIOD
        assert clock.time(stamp, 3.0 + step * PERIOD) == stamp
    assert not clock.is_distrusted and not clock.fault


@pytest.mark.parametrize("speed", [0.05, 0.3, 1.0])
def test_stamps_count_whatever_the_transport_and_the_speed_of_a_simulation(speed):
    """Messages are late by up to 20 ms, some are lost, all wait for half a second now and then and come together."""
    clock = SenderClock()
    random = np.random.default_rng(4)
    arrival = due = 0.0
    for step in range(1, 10000):
        due += PERIOD / speed + (0.5 if random.uniform() < 1e-3 else 0.0)
        arrival = max(arrival, due + (0.5 if random.uniform() < 1e-3 else 0.0) + random.uniform(0.0, 0.02))
        if random.uniform() < 0.1:
            continue
        stamp = CLOCK + step * PERIOD
        assert clock.time(stamp, arrival) == stamp
    assert not clock.fault


def test_a_sender_without_stamps_has_none_until_it_has():
    clock = SenderClock()
    assert [clock.time(0.0, 0.1 * step) for step in range(30)] == [0.0] * 30
    assert [clock.time(5.0 + 0.1 * step, 3.0 + 0.1 * step) for step in range(30)] == [
        5.0 + 0.1 * step for step in range(30)
    ]
    assert not clock.fault


@pytest.mark.parametrize("repeated", [2, 300])
@pytest.mark.parametrize("late", [0.0, PERIOD])
def test_a_repeated_message_is_no_fault(repeated, late):
    """A simulation that stands still at its start repeats each message; its clock may arrive behind its messages."""
    clock = SenderClock()
    for step in range(1, 500):
        stamp = CLOCK + PERIOD * step
        assert clock.time(stamp, PERIOD * step - (late if step > 1 else 0.0)) == stamp
        for _ in range(repeated if step == 1 else 1):
            assert clock.time(stamp, PERIOD * step) == stamp
    assert not clock.is_distrusted and not clock.fault


def test_a_clock_that_was_set_back_goes_on_from_where_it_was():
    """Its own stamps count again after a second, and times never jump."""
    clock, sent, found = times(lambda time: time - (3600.0 if time > WRONG[0] else 0.0), duration=20.0)
    np.testing.assert_allclose(found, sent, atol=PERIOD)
    assert not clock.is_distrusted and "back by 3.6e+03 s" in clock.fault
    late = sent > WRONG[0] + 2.0
    assert np.ptp((found - sent)[late]) < 1e-6
