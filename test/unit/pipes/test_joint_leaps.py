"""Measurements of joints that cannot be true."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from support.unit.joint_pipes import make_robot

from solfer.errors import PipeError
from solfer.numerics.checks.joints import find_leap
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
    position = np.array(position, float)
    velocity = np.array(velocity, float)
    wrong = find_leap(leaps.address, position, velocity, part, time, stamp)
    if wrong < 0:
        return ""
    with pytest.raises(PipeError) as error:
        leaps.refuse(wrong, position, velocity, time)
    return error.value.what


def test_honest_joints_are_accepted(leaps):
    """At their largest speeds, in bunches with stamps, after a silence, and modulo a turn without an end."""
    for cycle in range(1, 400):
        time = cycle * PERIOD
        arrival = math.ceil(time / 0.06) * 0.06
        roll = math.remainder(9.9 * time, 2.0 * math.pi)
        assert not check(leaps, arrival, (math.sin(2.9 * time), roll), (2.9 * math.cos(2.9 * time), 10.5), stamp=time)
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


def moved(leaps, motion, rate=200.0, duration=3.0, seed=0):
    """Check messages of `motion(time, draw)`, positions and velocities; return the first error and its time [s]."""
    draw = np.random.default_rng(seed)
    for step in range(round(rate * duration)):
        time = step / rate
        wrong = check(leaps, time, *motion(time, draw), stamp=time)
        if wrong:
            return wrong, time
    return "", duration


def waves(time, draw=None):
    """Return places and speeds of a shoulder that waves and of a wheel that rolls."""
    return np.array((math.sin(2.0 * time), 8.0 * time)), np.array((2.0 * math.cos(2.0 * time), 8.0))


@pytest.mark.parametrize("seed", range(5))
def test_measured_velocities_contradict_no_honest_joint(leaps, seed):
    """With noise, steps of encoders, velocities that are filtered, and messages that are late, lost and bunched."""

    def motion(time, draw):
        place, _ = waves(time)
        _, speed = waves(time - 0.02)
        place = 1e-3 * np.round((place + draw.normal(0.0, 3e-4, 2)) / 1e-3)
        return place, speed + draw.normal(0.0, 0.05, 2)

    assert moved(leaps, motion, seed=seed)[0] == ""
    leaps.forget()
    draw = np.random.default_rng(seed)
    newest = -1.0
    for cycle in range(1, 1000):
        time = cycle * PERIOD
        stamp = PERIOD * math.floor((time - draw.uniform(0.0, 0.04)) / PERIOD)
        if draw.random() < 0.3 or stamp <= newest:
            continue
        newest = stamp
        assert check(leaps, time, *motion(stamp, draw), stamp=stamp + draw.uniform(-0.002, 0.002)) == ""


def test_a_joint_that_is_pushed_contradicts_nothing(leaps):
    """It vibrates faster than messages come."""

    def motion(time, draw):
        fade, phase = math.exp(-3.0 * time), 2.0 * math.pi * 31.0 * time
        return np.full(2, 3.0 / 195.0 * fade * math.sin(phase)), np.full(2, 3.0 * fade * math.cos(phase))

    for rate in (500.0, 200.0, 50.0):
        leaps.forget()
        assert moved(leaps, motion, rate)[0] == ""


@pytest.mark.parametrize(("part", "stands"), [(0, True), (0, False), (1, True)])
def test_a_drift_of_an_encoder_is_named_within_half_a_second(leaps, part, stands):
    def motion(time, draw):
        place, speed = (np.zeros(2), np.zeros(2)) if stands else waves(time + 0.4)
        place[part] += 1.0 * max(0.0, time - 0.5)
        return place, speed + draw.normal(0.0, 2e-3, 2)

    wrong, time = moved(leaps, motion)
    assert f"'{('shoulder', 'roll')[part]}' moved more than 0." in wrong and 0.5 < time < 1.0


@pytest.mark.parametrize("size", [0.05, 0.3, -0.4, 1.0])
def test_a_leap_against_measured_velocities_is_refused(leaps, size):
    """Until it agrees again, or messages pause: as an encoder does that starts again."""

    def leapt(begin, end, pause=0.0):
        refused = []
        leaps.forget()
        for step in range(1200):
            time = step * PERIOD
            if 2.0 < time < 2.0 + pause:
                continue
            place, speed = 0.05 * np.array(waves(time))
            place[0] += size if begin <= time < end else 0.0
            if check(leaps, time, place, speed, stamp=time):
                refused.append(time)
        return refused

    assert leapt(1.0, math.inf) == pytest.approx(np.arange(1.0, 6.0, PERIOD))
    assert leapt(1.0, 4.0) == pytest.approx(np.arange(1.0, 4.0, PERIOD))
    assert leapt(1.0, 1.0 + 0.9 * PERIOD) == pytest.approx([1.0])
    assert max(leapt(1.0, math.inf, pause=0.2)) == pytest.approx(2.0)


@pytest.mark.parametrize("gap", [PERIOD, 0.04, 0.0])
def test_neither_noise_nor_lost_messages_excuse_a_leap(leaps, gap):
    """A joint rests, leaps, and rests for a minute; messages come in time, late, or with the same stamp."""
    draw = np.random.default_rng(0)
    stamps = PERIOD * np.arange(200)
    for stamp in stamps:
        assert not check(leaps, stamp, draw.normal(0.0, 1e-4, 2), draw.normal(0.0, 2e-3, 2), stamp=stamp)
    later = stamps[-1] + PERIOD + gap * np.arange(60.0 / max(gap, PERIOD))
    for cycle, stamp in enumerate(later):
        place = (0.3, 0.0) + draw.normal(0.0, 1e-4, 2)
        arrival = later[0] + cycle * max(gap, PERIOD)
        assert check(leaps, arrival, place, draw.normal(0.0, 2e-3, 2), stamp=stamp)


@pytest.mark.parametrize("change", ["sign", "swapped"])
def test_velocities_of_another_joint_or_sign_are_named(leaps, change):
    def motion(time, draw):
        place, speed = waves(time)
        return place, -speed if change == "sign" else speed[::-1]

    wrong, time = moved(leaps, motion)
    assert "otherwise than by its velocities" in wrong and time < 0.2


@pytest.mark.parametrize("left_out", [0, 1, 2])
def test_velocities_that_are_not_measured_contradict_nothing(leaps, left_out):
    """A sender leaves them at zero, of one joint or of all, or has none."""

    def motion(time, draw):
        place, speed = waves(time)
        return place, (speed * (0.0, 1.0), np.zeros(2), np.zeros(0))[left_out]

    assert moved(leaps, motion)[0] == ""


@pytest.mark.parametrize(("struck", "is_refused"), [(6, False), (5, False), (4, True), (1, True)])
def test_where_the_robot_strikes_something_velocities_do_not_show_ways(struck, is_refused):
    """Joints that bounce between two messages: of a whole robot an impact, of a few joints wrong encoders."""
    limits = SimpleNamespace(position=np.ones(6), velocity=np.full(6, 10.0))
    robot = SimpleNamespace(dofs=tuple("abcdef"), upper_limits=limits, revolutions=np.zeros(6))
    leaps, part = JointLeaps(robot, np.arange(6)), np.arange(6)
    position, refused = np.zeros(6), []
    for cycle in range(200):
        velocity = np.full(6, 0.1)
        if cycle in (100, 101):
            velocity[:struck] = 3.0 if cycle == 100 else -3.0
            position[:struck] += 0.06
        position += PERIOD * velocity
        time = cycle * PERIOD
        refused.append(check(leaps, time, position.copy(), velocity, part, stamp=time) != "")
    assert not any(refused[:100])
    assert any(refused[100:]) is is_refused


def test_after_an_impact_joints_are_checked_again():
    limits = SimpleNamespace(position=np.ones(6), velocity=np.full(6, 10.0))
    robot = SimpleNamespace(dofs=tuple("abcdef"), upper_limits=limits, revolutions=np.zeros(6))
    leaps, part = JointLeaps(robot, np.arange(6)), np.arange(6)
    position, refused = np.zeros(6), []
    for cycle in range(400):
        velocity = np.full(6, 3.0 if cycle == 100 else 0.1)
        position += PERIOD * velocity
        measured = position.copy()
        measured[2] += 0.09 * (cycle >= 250)
        time = cycle * PERIOD
        refused.append(check(leaps, time, measured, velocity, part, stamp=time) != "")
    assert not any(refused[:250]) and all(refused[250:260])


@pytest.mark.parametrize("joint", [0, 1])
def test_an_encoder_that_is_right_again_counts_after_half_a_second(leaps, joint):
    """Its velocity was wrong while it rested; a joint without ends moved meanwhile, by numbers that were held."""
    wrong = []
    for cycle in range(1, 800):
        time = cycle * PERIOD
        is_wrong = 1.0 < time < 2.0
        numbers = np.zeros((2, 2))
        if joint == 0:
            numbers[:, 0] = 0.3, (0.5 + 0.01 * math.sin(30.0 * time)) * is_wrong
        else:
            numbers[:, 1] = 5.0 * (0.1 * math.floor(time / 0.1) if is_wrong else time), 5.0
        if check(leaps, time, *numbers, stamp=time):
            wrong.append(time)
    assert 1.0 < wrong[0] < 1.3 and 2.0 < wrong[-1] < 2.7


def test_an_encoder_that_stays_off_does_not_count_again(leaps):
    for cycle in range(1, 2000):
        time = cycle * PERIOD
        away = 0.06 if time > 1.0 else 0.0
        error = check(leaps, time, (away + 1e-3 * math.sin(time), 0.0), (1e-3 * math.cos(time), 0.0), stamp=time)
        assert bool(error) == (time > 1.0)
