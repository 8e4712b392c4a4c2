"""What the watchdog makes of the beats that it sees."""

import pytest

from solfer.middleware.xbot.estop import EmergencyStop
from solfer.middleware.xbot.watchdog import Watchdog


class Beats:
    """A pulse that a test sets."""

    pid = 4711

    def __init__(self):
        self.newest, self.old, self.lives = None, 0.0, True

    def beats(self):
        return self.newest

    def age(self):
        return self.old

    def alive(self):
        return self.lives


@pytest.fixture
def pulse():
    return Beats()


@pytest.fixture
def stop(tmp_path):
    return EmergencyStop(tmp_path)


@pytest.fixture
def watchdog(pulse, stop):
    return Watchdog(pulse, stop, limit=0.1)


def look(watchdog, count=10):
    for _ in range(count):
        watchdog.look()


def test_without_a_process_nothing_happens(watchdog, pulse, stop):
    pulse.old = float("inf")
    look(watchdog)
    assert not stop


def test_an_old_beat_of_a_process_that_lives_trips(watchdog, pulse, stop):
    pulse.newest, pulse.old = 1, 0.11
    look(watchdog)
    assert stop
    assert stop.reason.startswith("process 4711 hangs: no cycle for 110 ms")


def test_a_young_beat_does_not_trip(watchdog, pulse, stop):
    pulse.newest, pulse.old = 1, 0.09
    look(watchdog, 50)
    assert not stop


def test_one_look_at_an_old_beat_does_not_trip(watchdog, pulse, stop):
    for number in range(1, 20):  # the machine stood still; beats and looks go on
        pulse.newest, pulse.old = number, 0.5
        look(watchdog, 2)
    assert not stop


def test_a_process_that_has_ended_does_not_trip(watchdog, pulse, stop, caplog):
    pulse.newest, pulse.old, pulse.lives = 1, 0.5, False
    look(watchdog, 50)
    assert not stop
    assert caplog.messages == ["process 4711 has ended without a word"]


def test_an_orderly_end_is_not_even_named(watchdog, pulse, stop, caplog):
    pulse.newest = 1
    look(watchdog, 2)
    pulse.newest, pulse.old = None, float("inf")
    look(watchdog, 50)
    assert not stop
    assert caplog.messages == []


def test_every_hang_trips_anew(watchdog, pulse, stop):
    for number in (1, 2):
        pulse.newest, pulse.old = 10 * number, 0.5
        look(watchdog, 50)
        assert stop
        assert watchdog.hangs == number
        stop.clear()
        pulse.newest, pulse.old = 10 * number + 1, 0.0
        look(watchdog)
        assert not stop
