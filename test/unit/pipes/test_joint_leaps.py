"""Measurements of joints that cannot be true."""

import math

import numpy as np
import pytest
from support.unit.joint_pipes import make_robot

from solfer.errors import PipeError
from solfer.pipes.joint.leaps import JointLeaps

PERIOD = 0.005
ALL = np.array([0, 1])
"""Of the shoulder, 3 rad/s at most, and the wheel `roll` without ends, 10 rad/s at most."""


@pytest.fixture
def leaps():
    robot = make_robot()
    return JointLeaps(robot, np.array([robot.dofs.index("shoulder"), robot.dofs.index("roll")]))


def check(leaps, time, position, velocity=(0.0, 0.0), part=ALL, stamp=0.0):
    """Check a message; return what is wrong with it, empty if nothing is."""
    try:
        leaps.check(np.array(position, float), np.array(velocity, float), part, time, stamp)
    except PipeError as error:
        return error.what
    return ""


def test_honest_joints_are_accepted(leaps):
    """At their largest speeds, in bunches with stamps, after a silence, and modulo a turn without an end."""
    for cycle in range(1, 400):
        time = cycle * PERIOD
        arrival = math.ceil(time / 0.06) * 0.06
        roll = math.remainder(9.9 * time, 2.0 * math.pi)
        assert not check(leaps, arrival, (math.sin(2.9 * time), roll), (3.2, 10.5), stamp=time)
    assert not check(leaps, time + 0.5, (1.8, 3.0), stamp=0.0)


@pytest.mark.parametrize(("place", "name"), [((0.5, 0.0), "shoulder"), ((0.0, 1.0), "roll"), ((-0.5, 0.0), "shoulder")])
def test_a_leap_is_refused_until_it_can_be_true(leaps, place, name):
    assert not check(leaps, 1.0, (0.0, 0.0))
    assert f"'{name}' leaps by" in check(leaps, 1.0 + PERIOD, place)
    assert not check(leaps, 1.0 + 2 * PERIOD, (0.01, 0.02))
    refused = [check(leaps, 1.01 + cycle * PERIOD, place) != "" for cycle in range(1, 40)]
    assert all(refused[:5]) and refused == sorted(refused, reverse=True) and not refused[-1]


@pytest.mark.parametrize(("velocity", "name"), [((14.5, 0.0), "shoulder"), ((0.0, -35.5), "roll")])
def test_an_impossible_speed_is_refused(leaps, velocity, name):
    assert not check(leaps, 1.0, (0.0, 0.0), 0.95 * np.array(velocity))
    assert f"'{name}' at" in check(leaps, 1.0 + PERIOD, (0.0, 0.0), velocity)


def test_joints_are_compared_with_their_own_messages(leaps):
    """Of messages with one joint each, and none after a restart."""
    assert not check(leaps, 1.0, (1.0, 0.0), part=np.array([0]))
    assert not check(leaps, 1.1, (0.0, 2.0), part=np.array([1]))
    assert not check(leaps, 1.11, (1.02, 0.0), part=np.array([0]))
    assert check(leaps, 1.12, (0.0, 0.0), part=np.array([0]))
    leaps.forget()
    assert not check(leaps, 1.12, (0.0, 0.0))
