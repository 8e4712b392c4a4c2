"""The watchdog in a process of its own, and an RT process that hangs, is stopped for long, or ends."""

import re
import signal
import time

import pytest
from support.integration.xbot_system import system, until

from solfer.realtime.emergency_stop import EmergencyStopLatch
from solfer.telemetry.statistics import RuntimeStatistics


@pytest.fixture
def layer():
    """Make a namespace without a simulator."""
    with system() as made:
        yield made


BEATING = """
import os, time
from solfer.middleware.shared_memory import Namespace
from solfer.telemetry.statistics import RuntimeStatistics
statistics = RuntimeStatistics.create(Namespace({name!r}).folder, 500.0, ["plugin"], ["component"])
end = time.monotonic() + {duration}
while time.monotonic() < end:
    statistics.beat(time.monotonic_ns())
    time.sleep(0.002)
{afterwards}
"""
"""A process that beats for some time [s]."""


def beat(layer, duration: float = 3600.0, afterwards: str = ""):
    """Start a process with a heartbeat for `duration` [s]; returns when it has beaten: none hangs before that."""
    process = layer.start_code(BEATING.format(name=layer.name, duration=duration, afterwards=afterwards))
    until(lambda: (layer.namespace.folder / "statistics").exists() and last_beat(layer), "a process that beats")
    return process


def tripped(layer) -> EmergencyStopLatch:
    """Wait until the emergency stop is tripped, and return it."""
    stop = EmergencyStopLatch(layer.namespace.folder)
    until(lambda: bool(stop), "an emergency stop")
    return stop


def last_beat(layer) -> int:
    """Time of the newest beat [ns]."""
    return RuntimeStatistics.attach(layer.namespace.folder).segments[0].heartbeat


def test_an_endless_loop_trips_the_emergency_stop(layer):
    layer.watchdog()
    process = beat(layer, 0.5, "while True:\n    pass")
    stop = tripped(layer)
    [late] = re.findall(rf"process {process.pid} hangs: no cycle for (\d+) ms", stop.reason)
    assert int(late) >= 100


def test_a_stopped_process_trips_the_latched_stop(layer):
    layer.watchdog()
    process = beat(layer)
    time.sleep(0.3)
    process.send_signal(signal.SIGSTOP)
    stop = tripped(layer)
    before = last_beat(layer)
    process.send_signal(signal.SIGCONT)
    until(lambda: last_beat(layer) > before, "a process that goes on")
    assert stop
    assert stop.reason.startswith(f"process {process.pid} hangs")


@pytest.mark.daily(1)
@pytest.mark.parametrize(("afterwards", "code"), [("statistics.close()", 0), ("os.kill(os.getpid(), 9)", -9)])
def test_a_process_that_ends_trips_nothing(layer, afterwards, code):
    watchdog = layer.watchdog("--limit", "1.0")
    assert "watches the real-time layer" in watchdog.stdout.readline()
    process = layer.start_code(BEATING.format(name=layer.name, duration=0.5, afterwards=afterwards))
    assert process.wait(60.0) == code
    if code:
        assert f"process {process.pid} has ended unexpectedly" in watchdog.stdout.readline()
    else:
        time.sleep(1.5)  # longer than the limit
    assert watchdog.poll() is None
    assert not EmergencyStopLatch(layer.namespace.folder)


def test_a_watchdog_that_comes_back_sees_a_hang(layer):
    killed = layer.watchdog()
    process = beat(layer)
    killed.kill()
    killed.wait()
    process.send_signal(signal.SIGSTOP)
    layer.watchdog()
    assert tripped(layer).reason.startswith(f"process {process.pid} hangs")
