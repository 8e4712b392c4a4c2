"""The namespace is removed while the wheels turn, and an emergency stop is tripped where no process receives it.

Times are the robot's own, so that they do not depend on what else the machine does.
"""

import shutil
import subprocess
import sys

import pytest
from support.integration.xbot_system import HELD, REPOSITORY, WAIT, XbotSystem, until
from support.realtime.executor_faults import SPEED, begin, layer  # noqa: F401  (a fixture)

from solfer.plugins import PluginState
from solfer.realtime.emergency_stop import EmergencyStopLatch
from solfer.segments.namespace import Namespace

REST = 1.2
"""Bound of the time from the removal to wheels at rest [s]: it is noticed within 0.1 s."""


def replace(robot: XbotSystem) -> None:
    """Another one makes a namespace of the same name."""
    shutil.rmtree(robot.namespace.folder)
    Namespace(robot.name)


def solfer_rt(name: str, *arguments: str) -> subprocess.CompletedProcess:
    """`solfer rt`, as the operator calls it."""
    return subprocess.run(
        [sys.executable, str(REPOSITORY / "nodes" / "solfer"), "rt", *arguments, "--namespace", name],
        capture_output=True,
        text=True,
        timeout=WAIT,
    )


def check_that_it_came_to_rest(robot: XbotSystem, moment: float) -> None:
    """Check that the wheels stopped in time and stayed so, and no joint moved faster than it may."""
    assert robot.samples[-1][0] - moment >= 0.9  # the simulator ends 1 s after it holds
    assert robot.rest_after(moment) <= REST
    assert robot.largest_step(moment) <= HELD


def watch_to_the_end(robot: XbotSystem) -> None:
    """Look at the robot until the simulator has ended."""

    def ended() -> bool:
        over = robot.simulator.poll() is not None
        robot.look()
        return over

    until(ended, "a simulator that ends")


def output_at_the_end(process: subprocess.Popen) -> str:
    """Return the output of a process that gives up."""
    published, _ = process.communicate(timeout=WAIT)
    assert process.returncode == 2, published
    assert "Traceback" not in published
    return published


@pytest.mark.daily(1)
@pytest.mark.parametrize(
    ("remove", "watched"),
    [(lambda robot: shutil.rmtree(robot.namespace.folder), False), (replace, True)],
    ids=["removed", "replaced"],
)
def test_a_process_that_loses_the_namespace_ends(robot: XbotSystem, layer, remove, watched):  # noqa: F811
    process, _ = begin(robot, layer)
    others = [robot.watchdog()] if watched else []
    for each in others:
        assert "watches" in each.stdout.readline()
    robot.drive(SPEED)
    moment = robot.samples[-1][0]
    remove(robot)
    watch_to_the_end(robot)
    for each in (process, robot.simulator, *others):
        assert "no other process finds this one any more" in output_at_the_end(each)
    check_that_it_came_to_rest(robot, moment)


@pytest.mark.soak
def test_a_commander_without_checks_is_refused(robot: XbotSystem):
    robot.driver(SPEED)
    moment = robot.samples[-1][0]
    shutil.rmtree(robot.namespace.folder)
    watch_to_the_end(robot)
    assert "the robot holds; its joints were commanded by /driver" in output_at_the_end(robot.simulator)
    check_that_it_came_to_rest(robot, moment)


@pytest.mark.soak
def test_an_emergency_stop_reports_whether_obeyed(robot: XbotSystem, layer):  # noqa: F811
    begin(robot, layer)
    robot.drive(SPEED)
    wrong = f"{robot.name}0"
    missed = solfer_rt(wrong, "estop", "a dog")
    assert missed.returncode == 2 and f"did you mean: {robot.name}" in missed.stderr
    assert not (robot.namespace.folder.parent / f"solfer-{wrong}").exists()
    assert not EmergencyStopLatch(robot.namespace.folder) and robot.state() is not PluginState.ABORTED
    obeyed = solfer_rt(robot.name, "estop", "a dog")
    assert obeyed.returncode == 0 and "obeys" in obeyed.stdout
    assert robot.state() is PluginState.ABORTED
    robot.watch(0.5)
    assert robot.speed() < 0.2
