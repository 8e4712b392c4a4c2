"""The node `xbot` in real time beside the simulator: killed, stopped for a while, started twice."""

import signal
import time

import pytest
from world import CONFIG
from xbot_system import REPOSITORY, WAIT, System, system, until

from solfer.middleware.xbot.board import Board
from solfer.middleware.xbot.estop import EmergencyStop
from solfer.middleware.xbot.lifecycle import Stage
from solfer.pipes.lower_level import Answer
from solfer.pipes.middleware import Flag, NoFields

SPEED = 2.0  # [rad/s]
REST = 0.5
"""Bound of the simulated time from a fault until the wheels rest [s]."""


@pytest.fixture
def layer(tmp_path):
    file = tmp_path / "layer.yaml"
    file.write_text(f"""
XBotRTPlugins: {{plugins: [joint_states]}}
mwoibn: {{config_file: {CONFIG / "centauro.yaml"}}}
executor: {{start: [joint_states], blend: 0.1, overruns: 1000000, schedule: {{lock_memory: false}}}}
""")
    return file


def begin(robot: System, file) -> tuple:
    """Start the node, and wait until its plugin runs; its process and its board."""
    process = robot.start(REPOSITORY / "nodes" / "xbot", str(file), "--namespace", robot.name)
    until(lambda: robot.stage() is Stage.RUNNING, "a plugin that runs")
    return process, Board.attach(robot.namespace.folder)


def ask(robot: System, service: str, interface: str, request: object) -> Answer:
    """Ask a service of the layer."""
    return robot.middleware.call(service, interface, request, Answer, WAIT)


def test_a_node_that_is_killed_leaves_a_robot_at_rest_and_the_next_one_takes_over(layer):
    with system() as robot:
        robot.simulate()
        process, board = begin(robot, layer)
        robot.drive(SPEED)
        process.kill()
        process.wait()
        robot.look()
        moment = robot.samples[-1][0]
        assert not board.alive
        robot.watch(1.5)
        assert robot.rest_after(moment) < REST
        EmergencyStop(robot.namespace.folder).trip("kept over a new start")
        robot.start(REPOSITORY / "nodes" / "xbot", str(layer), "--namespace", robot.name)
        until(lambda: robot.stage() is Stage.INITIALIZED, "a plugin that does not start by itself")
        refused = ask(robot, "joint_states/switch", "std_srvs/SetBool", Flag(True))
        assert not refused.success and "kept over a new start" in refused.message
        assert ask(robot, "xbotcore/estop_clear", "std_srvs/Trigger", NoFields()).success
        assert ask(robot, "joint_states/switch", "std_srvs/SetBool", Flag(True)).success
        until(lambda: robot.stage() is Stage.RUNNING, "a plugin that runs")
        robot.drive(SPEED)


def test_a_node_that_stands_still_for_200_ms_leaves_out_periods_and_goes_on(layer):
    with system() as robot:
        robot.simulate()
        process, board = begin(robot, layer)
        time.sleep(0.5)
        cycles, skipped = board.counts[:2]
        process.send_signal(signal.SIGSTOP)
        time.sleep(0.2)
        process.send_signal(signal.SIGCONT)
        until(lambda: board.counts[1] - skipped >= 90, "periods that are left out")
        until(lambda: board.counts[0] - cycles > 500 and robot.stage() is Stage.RUNNING, "a plugin that runs again")
        robot.drive(SPEED)


def test_a_second_node_in_the_namespace_is_refused_and_the_first_goes_on(layer):
    with system() as robot:
        robot.simulate()
        first, board = begin(robot, layer)
        second = robot.start(REPOSITORY / "nodes" / "xbot", str(layer), "--namespace", robot.name)
        assert second.wait(60.0) == 2
        told = second.stdout.read()
        assert f"process {first.pid}" in told and "Traceback" not in told
        robot.drive(SPEED)
        assert board.alive and board.stage(0) is Stage.RUNNING
