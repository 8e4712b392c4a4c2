"""Real processes of an RT layer that are given a wrong configuration or no privileges, or lose a peer, or hang.

Times are the robot's own.
"""

import re
import signal

import pytest
from support.integration.world import CONFIG
from support.integration.xbot_system import HELD, REPOSITORY, WHEELS, system, until
from support.plugins.plugin import configuration

from solfer.plugins import PluginState
from solfer.realtime.emergency_stop import EmergencyStopLatch
from solfer.telemetry.statistics import LoopCount, RuntimeStatistics

NODE = REPOSITORY / "nodes" / "xbot"
SPEED = 1.0  # [rad/s]

SUPERVISED = 0.15
"""Bound of the time until the wheels rest when the RT process misses its cycles; it is noticed after 20 of 2 ms [s]."""

SILENT = 0.5
"""The same when a pipe times out, of which 0.2 s and 10 strikes are the pipe's own [s]."""


@pytest.fixture
def robot():
    with system() as made:
        yield made


def layer_file(folder, plugins="joint_states", main=CONFIG / "centauro.yaml", rules="{}"):
    """Write the file of a layer with plugins that start by themselves, in the ordinary scheduler without `rules`."""
    file = folder / "layer.yaml"
    file.write_text(f"""XBotRTPlugins: {{plugins: [{plugins}]}}
mwoibn: {{config_file: {main}}}
executor: {{start: [{plugins}], blend: 0.1, budget: 0.5, overruns: 1000000, schedule: {rules}}}
""")
    return file


def start(robot, file):
    """Start the node."""
    return robot.start(NODE, str(file), "--namespace", robot.name)


def reaches(robot, process, expected=PluginState.RUNNING):
    """Wait until the plugin of a node is in a stage of its life."""

    def there():
        assert process.poll() is None, process.stdout.read()
        return robot.state() is expected

    until(there, f"a plugin that is {expected.name}")


def turning(robot):
    """Whether the wheels turn."""
    return abs(robot.speed() - SPEED) < 0.1


@pytest.mark.daily(1)
@pytest.mark.parametrize(
    ("place", "behind", "right", "wrong"),
    [
        ("layer.yaml", "XBotRTPlugins:", "plugins:", "plugin:"),
        ("layer.yaml", "executor:", "budget:", "budgt:"),
        ("configuration.yaml", "joint_space:", "actuators:", "actuator:"),
    ],
)
def test_a_typing_error_starts_nothing(robot, tmp_path, place, behind, right, wrong):
    file, layer = tmp_path / place, layer_file(tmp_path, main=configuration(tmp_path))
    text = file.read_text()
    begin = text.index(right, text.index(behind))
    file.write_text(text[:begin] + text[begin:].replace(right, wrong, 1))
    process = start(robot, layer)
    assert process.wait(60.0) == 2
    published = process.stdout.read()
    assert re.search(rf"{re.escape(str(file))}:{text[:begin].count(chr(10)) + 1}:\d+: ", published), published
    assert f"did you mean: {right.rstrip(':')}" in published and "Traceback" not in published
    assert robot.state() is None


UNPRIVILEGED = """
import ctypes
import os
import resource
import sys

PR_CAPBSET_DROP, CAP_IPC_LOCK, CAP_SYS_NICE = 24, 14, 23
resource.setrlimit(resource.RLIMIT_RTPRIO, (0, 0))
resource.setrlimit(resource.RLIMIT_MEMLOCK, (0, 0))
if os.geteuid() == 0:
    for capability in (CAP_IPC_LOCK, CAP_SYS_NICE):
        assert ctypes.CDLL(None).prctl(PR_CAPBSET_DROP, capability, 0, 0, 0) == 0
os.execv(sys.executable, [sys.executable, *{arguments!r}])
"""
"""A process that may not do what an ordinary user may not: ask for another scheduler, and lock memory."""


@pytest.mark.soak
def test_without_privileges_the_node_works(robot, tmp_path):
    """No FIFO scheduling and no locked memory: it drives all the same, and one warning lists what is missing."""
    robot.simulate()
    arguments = (str(NODE), str(layer_file(tmp_path)), "--namespace", robot.name)
    process = robot.start_code(UNPRIVILEGED.format(arguments=arguments))
    reaches(robot, process)
    robot.drive(SPEED)
    moment = robot.samples[-1][0]
    scheduling = RuntimeStatistics.attach(robot.namespace.folder).text()
    assert "timer slack 1 ns" in scheduling
    assert re.search(r"; without .*memory locked \(.+\).*FIFO 60 \(Operation not permitted\)", scheduling)
    robot.watch(0.5)
    assert robot.largest_step(moment) <= HELD
    process.send_signal(signal.SIGINT)
    published, _ = process.communicate(timeout=60.0)
    assert process.returncode == 0
    assert [line for line in published.splitlines() if "scheduling" in line] == [
        f"[WARNING] [solfer.xbot]: scheduling: {scheduling}"
    ]


PEER = """
import time
from solfer.middleware.shared_memory import XbotMiddleware
from solfer.transport import JointMessage

node = XbotMiddleware({name!r}, "peer")
reader = node.reader("joint_states", "sensor_msgs/JointState")
while not reader.read():
    time.sleep(0.01)
published = reader.message
command = JointMessage.empty(published.names, ("position", "velocity"))
command.position[:] = published.position
for wheel in {wheels!r}:
    command.velocity[published.names.index(wheel)] = {speed}
writers = [node.writer(topic, "solfer/JointCommand") for topic in ("upper_body", "lower_body")]
while True:
    for writer in writers:
        writer.write(command)
    time.sleep(0.005)
"""
"""A process outside the layer that publishes references of the joints, and turns the wheels."""


@pytest.mark.soak
def test_a_peer_that_is_killed_may_come_back(robot, tmp_path):
    """The layer stops the wheels while `lower_body` is silent, keeps its cycles, and runs again with the new peer."""
    robot.simulate()
    code = PEER.format(name=robot.name, wheels=WHEELS, speed=SPEED)
    peer, layer = robot.start_code(code), start(robot, layer_file(tmp_path, "whole_body"))
    reaches(robot, layer)
    until(lambda: turning(robot), "wheels that turn")
    statistics = RuntimeStatistics.attach(robot.namespace.folder)
    peer.kill()
    robot.look()
    moment, cycles = robot.samples[-1][0], statistics.counts[LoopCount.CYCLES]
    reaches(robot, layer, PluginState.STARTING)
    assert "lower_body" in statistics.text(0)
    robot.watch(1.0)
    assert robot.rest_after(moment) <= SILENT
    assert robot.largest_step(moment) <= HELD
    assert statistics.counts[LoopCount.CYCLES] > cycles and layer.poll() is None
    robot.start_code(code)
    reaches(robot, layer)
    until(lambda: turning(robot), "wheels that turn")


HANGING = """
import os
import time

from solfer.components.joint_states import JointStates


class Hanging(JointStates):
    def update(self):
        super().update()
        if os.path.exists({signal!r}):
            {hang}
"""


@pytest.mark.daily(1)
@pytest.mark.parametrize("hang", ["while True: pass", "time.sleep(3600.0)"], ids=["loop", "blocked"])
def test_a_component_that_hangs_trips_the_stop(robot, tmp_path, monkeypatch, hang):
    """The watchdog stops the robot, whether the loop spins or blocks; test_executor_faults.py has what follows."""
    hangs = tmp_path / "hang"
    (tmp_path / "hanging_component.py").write_text(HANGING.format(signal=str(hangs), hang=hang))
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    main = configuration(tmp_path, **{"class": "hanging_component:Hanging"})
    file = layer_file(tmp_path, "test", main, "{priority: 0}")
    robot.simulate()
    robot.watchdog("--limit", "1.0")  # a machine that stalls for the usual 0.1 s is no hang of the component
    process = start(robot, file)
    reaches(robot, process)
    robot.drive(SPEED, "test")
    hangs.touch()
    robot.look()
    moment = robot.samples[-1][0]
    stop = EmergencyStopLatch(robot.namespace.folder)
    until(lambda: bool(stop), "an emergency stop")
    assert stop.reason.startswith(f"process {process.pid} hangs")
    robot.watch(0.5)
    assert robot.rest_after(moment) <= SUPERVISED
    assert robot.largest_step(moment) <= HELD


LEAVING = """
import os

from solfer.components.joint_states import JointStates


class Leaving(JointStates):
    def update(self):
        super().update()
        if os.path.exists({signal!r}):
            raise {fault}
"""


@pytest.mark.soak
@pytest.mark.parametrize("fault", ["SystemExit(0)", "KeyboardInterrupt"])
def test_a_component_that_wants_to_end_is_aborted(robot, tmp_path, monkeypatch, fault):
    """SystemExit and KeyboardInterrupt of a component leave the layer's loop alive, which ends cleanly by SIGINT."""
    leaves = tmp_path / "leave"
    (tmp_path / "leaving_component.py").write_text(LEAVING.format(signal=str(leaves), fault=fault))
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    main = configuration(tmp_path, **{"class": "leaving_component:Leaving"})
    robot.simulate()
    process = start(robot, layer_file(tmp_path, "test", main, "{priority: 0}"))
    reaches(robot, process)
    robot.drive(SPEED, "test")
    robot.look()
    moment = robot.samples[-1][0]
    leaves.touch()
    reaches(robot, process, PluginState.ABORTED)
    robot.watch(0.5)
    assert abs(robot.speed()) < 0.05 and robot.largest_step(moment) <= HELD
    statistics = RuntimeStatistics.attach(robot.namespace.folder)
    assert fault.partition("(")[0] in statistics.text(0)
    cycles = statistics.counts[LoopCount.CYCLES]
    until(lambda: statistics.counts[LoopCount.CYCLES] > cycles + 10, "cycles of the layer")
    process.send_signal(signal.SIGINT)
    assert process.wait(60.0) == 0
    assert "Traceback" not in process.stdout.read()


@pytest.mark.soak
def test_a_component_that_closes_descriptors_cannot_keep_the_layer_from_ending(robot, tmp_path, monkeypatch):
    """Pipes are mapped memory, and locks are lost with their descriptors: it ends by itself or by SIGTERM, at rest."""
    closes = tmp_path / "close"
    body = f"os.closerange(0, 1024)\n            os.unlink({str(closes)!r})"
    (tmp_path / "closing_component.py").write_text(HANGING.format(signal=str(closes), hang=body))
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    main = configuration(tmp_path, **{"class": "closing_component:Hanging"})
    robot.simulate()
    process = start(robot, layer_file(tmp_path, "test", main, "{priority: 0}"))
    reaches(robot, process)
    robot.drive(SPEED, "test")
    robot.look()
    moment = robot.samples[-1][0]
    closes.touch()
    until(lambda: not closes.exists(), "descriptors that are closed")
    process.terminate()
    process.wait(10.0)
    robot.watch(0.5)
    assert robot.rest_after(moment) < 5.0
    assert robot.largest_step(moment) <= HELD
