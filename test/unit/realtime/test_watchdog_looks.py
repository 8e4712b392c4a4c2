"""The watchdog's reactions to a heartbeat."""

import pytest

from solfer.realtime.emergency_stop import EmergencyStopLatch
from solfer.realtime.watchdog import Watchdog


class Beats:
    """A heartbeat that a test sets."""

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
def heartbeat():
    return Beats()


@pytest.fixture
def stop(tmp_path):
    return EmergencyStopLatch(tmp_path)


@pytest.fixture
def watchdog(heartbeat, stop):
    return Watchdog(heartbeat, stop, limit=0.1)


def look(watchdog, count=10):
    for _ in range(count):
        watchdog.look()


def test_without_a_process_nothing_happens(watchdog, heartbeat, stop):
    heartbeat.old = float("inf")
    look(watchdog)
    assert not stop


def test_an_old_beat_of_a_live_process_trips(watchdog, heartbeat, stop):
    heartbeat.newest, heartbeat.old = 1, 0.11
    look(watchdog)
    assert stop
    assert stop.reason.startswith("process 4711 hangs: no cycle for 110 ms")


def test_a_young_beat_does_not_trip(watchdog, heartbeat, stop):
    heartbeat.newest, heartbeat.old = 1, 0.09
    look(watchdog, 50)
    assert not stop


def test_one_look_alone_does_not_trip(watchdog, heartbeat, stop):
    for number in range(1, 20):  # the machine stood still; beats and looks go on
        heartbeat.newest, heartbeat.old = number, 0.5
        look(watchdog, 2)
    assert not stop


def test_a_process_that_has_ended_does_not_trip(watchdog, heartbeat, stop, caplog):
    heartbeat.newest, heartbeat.old, heartbeat.lives = 1, 0.5, False
    look(watchdog, 50)
    assert not stop
    assert caplog.messages == ["process 4711 has ended unexpectedly"]


def test_an_orderly_end_is_not_logged(watchdog, heartbeat, stop, caplog):
    heartbeat.newest = 1
    look(watchdog, 2)
    heartbeat.newest, heartbeat.old = None, float("inf")
    look(watchdog, 50)
    assert not stop
    assert caplog.messages == []


def test_every_hang_trips_anew(watchdog, heartbeat, stop):
    for number in (1, 2):
        heartbeat.newest, heartbeat.old = 10 * number, 0.5
        look(watchdog, 50)
        assert stop
        assert watchdog.hangs == number
        stop.clear()
        heartbeat.newest, heartbeat.old = 10 * number + 1, 0.0
        look(watchdog)
        assert not stop
