"""A robot with its lower level in shared memory, and what it does when the process that commands it fails.

Times are the robot's own, so that they do not depend on what else the machine does.
"""

import os
import signal

import pytest
from support.integration.xbot_system import HELD, V_MAX, WHEELS, XbotSystem, insist, until

from solfer.middleware.shared_memory.discovery import published_topics, services

SPEED = 2.0  # [rad/s]
SAFE = 0.15
"""Bound of the time from a fault to wheels at rest [s]: it is noticed after 20 cycles of 2 ms."""


def now(robot: XbotSystem) -> float:
    """Return the robot's time [s]."""
    robot.look()
    return robot.samples[-1][0]


def check_that_it_came_to_rest(robot: XbotSystem, moment: float) -> None:
    """Check that the wheels stopped in time and stay so, and no joint moved faster than it may."""
    robot.watch(0.5)
    assert robot.rest_after(moment) <= SAFE
    assert robot.largest_step(moment) <= HELD


def test_the_whole_lower_level_is_offered(robot):
    topics = {each.topic: each.message for each in published_topics(robot.namespace)}
    assert topics["joint_states"] == "sensor_msgs/JointState"
    assert topics["motor_states"] == "sensor_msgs/JointState"
    assert topics["imu"] == "sensor_msgs/Imu"
    assert topics["floating_base"] == "nav_msgs/Odometry"
    names = {each.name for each in services(robot.namespace)}
    assert {
        "lower_level/claim",
        "lower_level/emergency_stop",
        "velocity_controller/get_joint_names",
        "position_controller/load_gains",
        "simulator/reset",
    } <= names
    assert robot.middleware.controller_joints("velocity_controller", 30.0) == WHEELS


@pytest.mark.soak
def test_the_commanding_process_is_killed(robot):
    driver = robot.driver(SPEED)
    driver.kill()
    moment = now(robot)
    driver.wait()
    check_that_it_came_to_rest(robot, moment)
    robot.driver(-SPEED)  # a new one attaches, and is obeyed at once


@pytest.mark.soak
def test_the_commanding_process_stops_for_200_ms(robot):
    driver = robot.driver(SPEED)
    driver.send_signal(signal.SIGSTOP)
    moment = now(robot)
    robot.watch(0.2)
    driver.send_signal(signal.SIGCONT)
    check_that_it_came_to_rest(robot, moment)  # though the driver goes on: it would have to claim anew


def test_the_simulator_is_killed_and_comes_back(robot):
    driver = robot.driver(SPEED)

    def kill_and_start() -> None:
        robot.simulator.kill()
        robot.simulator.wait()
        stamp = now(robot)
        robot.simulate()
        until(lambda: robot.look() and robot.samples[-1][0] < stamp, "a robot that begins anew")

    insist(kill_and_start, lambda: abs(robot.speed() - SPEED) < 0.1, "wheels that turn again")
    assert driver.poll() is None


def test_no_joint_is_ever_thrown(robot):
    driver = robot.driver(SPEED)
    driver.send_signal(signal.SIGSTOP)
    robot.watch(0.1)
    os.kill(driver.pid, signal.SIGKILL)
    robot.watch(0.3)
    steps = [
        abs(after[1] - before[1]).max() / (after[0] - before[0])
        for before, after in zip(robot.samples, robot.samples[1:], strict=False)
        if after[0] > before[0]
    ]
    assert max(steps) <= V_MAX
