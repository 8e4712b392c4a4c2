"""The node `xbot` in real time beside the simulator: killed, stopped for a while, started twice."""

import signal
import time

import pytest
from support.integration.xbot_system import REPOSITORY, WAIT, XbotSystem, system, until
from support.realtime.executor_faults import SPEED, begin, layer  # noqa: F401 (a fixture)

from solfer.plugins import PluginState
from solfer.realtime.emergency_stop import EmergencyStopLatch
from solfer.telemetry.statistics import LoopCount
from solfer.transport.lower_level import Answer
from solfer.transport.middleware import Flag, NoFields

REST = 0.5
"""Bound of the simulated time from a fault until the wheels rest [s]."""


def ask(robot: XbotSystem, service: str, interface: str, request: object) -> Answer:
    """Ask a service of the layer."""
    return robot.middleware.call(service, interface, request, Answer, WAIT)


def test_a_node_that_is_killed_is_replaced(layer):
    """SIGKILL brings the wheels to rest within 0.5 s, and the next node respects a stop that was tripped meanwhile."""
    with system() as robot:
        robot.simulate()
        process, statistics = begin(robot, layer)
        robot.drive(SPEED)
        process.kill()
        process.wait()
        robot.look()
        moment = robot.samples[-1][0]
        assert not statistics.alive
        robot.watch(1.5)
        assert robot.rest_after(moment) < REST
        EmergencyStopLatch(robot.namespace.folder).trip("kept over a new start")
        robot.start(REPOSITORY / "nodes" / "xbot", str(layer), "--namespace", robot.name)
        until(lambda: robot.state() is PluginState.INITIALIZED, "a plugin that does not start by itself")
        refused = ask(robot, "joint_states/switch", "std_srvs/SetBool", Flag(True))
        assert not refused.success and "kept over a new start" in refused.message
        assert ask(robot, "xbotcore/estop_clear", "std_srvs/Trigger", NoFields()).success
        assert ask(robot, "joint_states/switch", "std_srvs/SetBool", Flag(True)).success
        until(lambda: robot.state() is PluginState.RUNNING, "a plugin that runs")
        robot.drive(SPEED)


def test_a_node_that_stands_still_goes_on(layer):
    with system() as robot:
        robot.simulate()
        process, statistics = begin(robot, layer)
        time.sleep(0.5)
        cycles, skipped = statistics.counts[:2]
        process.send_signal(signal.SIGSTOP)
        time.sleep(0.2)
        process.send_signal(signal.SIGCONT)
        until(lambda: statistics.counts[LoopCount.SKIPPED] - skipped >= 90, "periods that are left out")
        until(
            lambda: statistics.counts[LoopCount.CYCLES] - cycles > 500 and robot.state() is PluginState.RUNNING,
            "a plugin that runs again",
        )
        robot.drive(SPEED)


@pytest.mark.soak
def test_a_second_node_is_refused(layer):
    with system() as robot:
        robot.simulate()
        first, statistics = begin(robot, layer)
        second = robot.start(REPOSITORY / "nodes" / "xbot", str(layer), "--namespace", robot.name)
        assert second.wait(60.0) == 2
        published = second.stdout.read()
        assert f"process {first.pid}" in published and "Traceback" not in published
        robot.drive(SPEED)
        assert statistics.alive and statistics.state(0) is PluginState.RUNNING
