"""The watchdog's reactions to a heartbeat."""

import os
import signal
import subprocess
import sys
import time

import pytest

from solfer.realtime.emergency_stop import EmergencyStopLatch
from solfer.realtime.processor import ProcessorTime
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


def look(watchdog, heartbeat, count=10):
    """Look repeatedly; the newest beat grows older meanwhile."""
    for _ in range(count):
        watchdog.look()
        heartbeat.old += Watchdog.PERIOD


def test_an_old_beat_of_a_live_process_trips(watchdog, heartbeat, stop):
    heartbeat.newest = 1
    look(watchdog, heartbeat, 11)
    assert not stop
    look(watchdog, heartbeat, 1)
    assert stop.reason.startswith("process 4711 hangs: no cycle for 110 ms")


@pytest.mark.parametrize(("age", "looks"), [(0.0, 9), (0.5, 2)], ids=["young", "the machine stood still"])
def test_beats_that_go_on_do_not_trip(watchdog, heartbeat, stop, age, looks):
    for number in range(1, 20):
        heartbeat.newest, heartbeat.old = number, age
        look(watchdog, heartbeat, looks)
    assert not stop


SPINS = "while True: pass"


@pytest.fixture
def process(request, heartbeat):
    """Run the code of the test's parameter as the process of the heartbeat."""
    with subprocess.Popen([sys.executable, "-S", "-c", request.param]) as made:
        heartbeat.pid = made.pid
        time.sleep(0.2)
        yield made
        made.kill()


def trips_within(watchdog, heartbeat, stop, most):
    """Look in real time at a process without a new beat, until the stop is tripped; return after how long [s]."""
    begin = time.monotonic()
    while not stop and time.monotonic() < begin + most:
        watchdog.look()
        time.sleep(Watchdog.PERIOD)
        heartbeat.old = time.monotonic() - begin
    return heartbeat.old


def test_a_process_that_gets_little_of_a_processor_does_not_hang(watchdog, heartbeat, stop, monkeypatch):
    """In a second it could go on for a tenth of it at most; after that it may not go on by itself."""
    monkeypatch.setattr(ProcessorTime, "since", lambda processor, elapsed: 0.08 * elapsed)
    heartbeat.newest = 1
    look(watchdog, heartbeat, 100)
    assert not stop
    look(watchdog, heartbeat, 3)
    assert stop


@pytest.mark.parametrize("process", [SPINS, "import time; time.sleep(60)"], indirect=True, ids=["spins", "blocks"])
def test_only_a_process_that_is_stopped_cannot_go_on(heartbeat, process):
    processor_time = ProcessorTime(process.pid)
    time.sleep(0.1)
    assert processor_time.since(0.1) > 0.0
    process.send_signal(signal.SIGSTOP)
    os.waitpid(process.pid, os.WUNTRACED)
    processor_time.since(0.0)
    time.sleep(0.05)
    assert processor_time.since(0.05) == 0.0
    process.kill()
    process.wait()
    assert processor_time.since(0.1) == 0.1


@pytest.mark.parametrize("process", [SPINS, "import time; time.sleep(60)"], indirect=True, ids=["spins", "blocks"])
def test_a_process_that_could_go_on_hangs_and_is_killed(watchdog, heartbeat, stop, process, monkeypatch):
    monkeypatch.setattr(Watchdog, "END", 0.5)
    heartbeat.newest = 1
    begin = time.monotonic() - trips_within(watchdog, heartbeat, stop, 30.0)
    assert stop and process.poll() is None
    while process.poll() is None and heartbeat.old < 30.0:
        watchdog.look()
        time.sleep(Watchdog.PERIOD)
        heartbeat.old = time.monotonic() - begin
    assert process.wait() == -signal.SIGKILL and heartbeat.old > 0.5


@pytest.mark.parametrize("process", [SPINS], indirect=True)
def test_a_process_that_stays_stopped_hangs_after_ten_times_the_limit(watchdog, heartbeat, stop, process):
    process.send_signal(signal.SIGSTOP)
    heartbeat.newest = 1
    assert trips_within(watchdog, heartbeat, stop, 30.0) > 1.0
    assert stop


def test_a_process_that_has_ended_does_not_trip(watchdog, heartbeat, stop, caplog):
    heartbeat.newest, heartbeat.old, heartbeat.lives = 1, 0.5, False
    look(watchdog, heartbeat, 50)
    assert not stop
    assert caplog.messages == ["process 4711 has ended unexpectedly"]


@pytest.mark.parametrize("newest", [1, None], ids=["ended", "none yet"])
def test_without_a_process_nothing_happens(watchdog, heartbeat, stop, caplog, newest):
    heartbeat.newest = newest
    look(watchdog, heartbeat, 2)
    heartbeat.newest, heartbeat.old = None, float("inf")
    look(watchdog, heartbeat, 50)
    assert not stop
    assert caplog.messages == []


def test_every_hang_trips_anew(watchdog, heartbeat, stop):
    for number in (1, 2):
        heartbeat.newest, heartbeat.old = 10 * number, 0.5
        look(watchdog, heartbeat, 50)
        assert stop
        assert watchdog.hangs == number
        stop.clear()
        heartbeat.newest, heartbeat.old = 10 * number + 1, 0.0
        look(watchdog, heartbeat)
        assert not stop
