"""Orientations that no robot can have: it tilts too fast, or its gyroscope contradicts it."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from solfer.errors import PipeError
from solfer.pipes.body.turn_check import TurnCheck

PERIOD = 0.002
"""Time between two messages of an IMU [s]."""


def values(rotation, rates=(0.0, 0.0, 0.0)):
    """Return what a reading has of an orientation and of turn rates [rad/s]."""
    numbers = np.zeros(13)
    numbers[:4], numbers[10:] = rotation.as_quat(), rates
    return numbers


def measured(seed, duration=3.0, own_axes=True, scale=1.0):
    """Yield times and values of a body that turns about drawn axes, with its rates times a scale."""
    draw, rotation = np.random.default_rng(seed), Rotation.random(random_state=seed)
    axis = draw.normal(size=3)
    for step in range(round(duration / PERIOD)):
        rates = axis * math.sin(2.0 * step * PERIOD + seed)
        world = rotation.apply(rates)
        yield step * PERIOD, values(rotation, scale * (rates if own_axes else world))
        rotation = rotation * Rotation.from_rotvec(rates * PERIOD)


@pytest.mark.parametrize("own_axes", [True, False])
@pytest.mark.parametrize("seed", range(5))
def test_a_body_that_turns_is_accepted(seed, own_axes):
    check = TurnCheck()
    for time, numbers in measured(seed, own_axes=own_axes):
        check.check(numbers, own_axes, time, time)


@pytest.mark.parametrize("own_axes", [True, False])
@pytest.mark.parametrize("seed", range(5))
def test_a_gyroscope_with_other_signs_is_found_soon(seed, own_axes):
    check, begin = TurnCheck(), None
    with pytest.raises(PipeError, match="otherwise by the turn rates"):
        for time, numbers in measured(seed, own_axes=own_axes, scale=-1.0):
            now = Rotation.from_quat(numbers[:4])
            begin = begin or now
            check.check(numbers, own_axes, time, time)
            assert (begin.inv() * now).magnitude() < 0.15


def test_a_gyroscope_that_contradicted_is_refused_also_at_rest():
    """It would be followed again as soon as the robot rests, and turn it again; a pause is a restart of the sensor."""
    check, refused = TurnCheck(), []
    for step in range(2500):
        time = step * PERIOD
        rate = 0.3 if time < 1.0 else 1e-6
        if 3.0 < time < 3.2:
            continue
        try:
            turn = Rotation.from_rotvec((0.0, 0.0, 0.3 * min(time, 1.0)))
            check.check(values(turn, (0.0, 0.0, -rate)), True, time, time)
        except PipeError:
            refused.append(time)
    assert refused[0] < 0.6 and refused == pytest.approx(np.arange(refused[0], 3.0 + 1e-9, PERIOD))


@pytest.mark.parametrize("axis", ["x", "y"])
def test_a_tilt_that_leaps_stays_refused_until_a_restart(axis):
    """Also when it comes after a while without messages, as long as a robot could have fallen."""
    check = TurnCheck()
    check.check(values(Rotation.identity()), True, 0.0, 0.0)
    over = values(Rotation.from_euler(axis, math.pi))
    for time in (PERIOD, 0.5, 5.0):
        with pytest.raises(PipeError, match=r"the tilt leaps by 3\.14 rad"):
            check.check(over, True, time, time)
    check.check(values(Rotation.from_euler(axis, 0.05)), True, 5.1, 5.1)
    check.forget()
    check.check(over, True, 5.2, 5.2)


def test_a_compass_may_correct_the_heading():
    """A jump about the vertical is no turn that contradicts the rates, whatever way the robot turns."""
    check = TurnCheck()
    for step in range(2000):
        time = step * PERIOD
        heading = 0.5 * time - (1.5 if step > 1000 else 0.0)
        check.check(values(Rotation.from_euler("z", heading), (0.0, 0.0, 0.5)), True, time, time)


def test_a_sender_without_turn_rates_is_not_contradicted():
    """A motion capture leaves them zero, and a pose has none."""
    check = TurnCheck()
    for step in range(2000):
        check.check(values(Rotation.from_euler("z", 2.0 * step * PERIOD)), True, step * PERIOD, step * PERIOD)


def test_a_gyroscope_in_degrees_is_found_at_rest():
    """It turns nothing, so only how far both turn to and fro shows it; a robot that sways by its noise would fall."""
    check, draw = TurnCheck(), np.random.default_rng(2)
    still = Rotation.random(random_state=2)
    with pytest.raises(PipeError, match="an orientation that turns as fast"):
        for step in range(50):
            noise = Rotation.from_rotvec(draw.normal(0.0, 1e-5, 3))
            rates = np.degrees(draw.normal(0.0, 5e-3, 3))
            check.check(values(still * noise, rates), True, step * PERIOD, step * PERIOD)


def test_noise_and_a_bias_contradict_nothing():
    check, draw = TurnCheck(), np.random.default_rng(1)
    for step in range(5000):
        noise = Rotation.from_rotvec(draw.normal(0.0, 2e-3, 3))
        check.check(values(noise, draw.normal(-0.05, 0.1, 3)), True, step * PERIOD, step * PERIOD)


def test_a_message_without_a_stamp_is_compared_by_its_arrival():
    check = TurnCheck()
    for step in range(100):
        check.check(values(Rotation.from_euler("x", 0.5 * step * PERIOD)), True, step * PERIOD, 0.0)
    with pytest.raises(PipeError, match="leaps"):
        check.check(values(Rotation.from_euler("x", 1.0)), True, 0.201, 0.0)


def feels(tilt, force=lambda time, up: 9.81 * up, rates=(0.0, 0.0, 0.0), duration=3.0, noise=0.0):
    """Check a link whose orientation tilts about x by `tilt(time)`, and that feels a force; return when it is refused.

    `force` is given the time and the direction in which the link really is upright, in its own axes.
    """
    check, draw = TurnCheck(), np.random.default_rng(3)
    for step in range(round(duration / PERIOD)):
        time = step * PERIOD
        felt = np.array(force(time, np.array((0.0, 0.0, 1.0))), float) + draw.normal(0.0, noise, 3)
        try:
            check.check(values(Rotation.from_euler("x", tilt(time)), rates), True, time, time, felt)
        except PipeError as error:
            assert "from the mean of the accelerometer" in error.what
            return time
    return None


@pytest.mark.parametrize("rate", [0.05, -0.3])
def test_a_tilt_that_drifts_from_gravity_is_found(rate):
    found = feels(lambda time: rate * time, duration=10.0, noise=0.3)
    assert found is not None and 0.1 < abs(rate) * found < 0.1 + 2.2 * abs(rate)


def test_an_accelerometer_that_is_not_measured_or_measures_no_gravity_contradicts_nothing():
    """It is zero, without gravity, in units of g, or not a number."""
    for force in ((0.0, 0.0, 0.0), (0.1, 0.0, 0.2), (0.0, 0.0, 1.0), (math.nan, 0.0, 9.81)):
        assert feels(lambda time: 0.5, lambda time, up, force=force: force) is None


def test_a_robot_that_accelerates_contradicts_nothing():
    """It brakes by 1.5 m/s^2 and starts again; is pushed; and falls, where nothing but its own axis is felt."""
    assert (
        feels(lambda time: 0.0, lambda time, up: (1.5 if time % 2.0 < 1.0 else -1.5, 0.0, 9.81), duration=8.0) is None
    )
    assert feels(lambda time: 0.0, lambda time, up: (0.0, 3.0 if time % 2.0 < 0.3 else 0.0, 9.81), duration=8.0) is None
    check, pace, tilt, rate = TurnCheck(), 3.1, 0.01, 0.03
    for step in range(2000):
        time, down = step * PERIOD, tilt >= 1.5
        rate = 0.0 if down else rate + PERIOD * pace**2 * math.sin(tilt)
        tilt += PERIOD * rate
        rotation = Rotation.from_euler("x", tilt)
        felt = rotation.inv().apply((0.0, 0.0, 9.81)) if down else (0.0, 0.0, 9.81 * math.cos(tilt) - rate**2 * 1.0)
        check.check(values(rotation, (rate, 0.0, 0.0)), True, time, time, np.array(felt))


@pytest.mark.parametrize("rate", [11.0, 50.0])
def test_spikes_of_the_turn_rates_are_refused_one_by_one(rate):
    """A link that really turns as fast, from one message to the next, is accepted."""
    check, rotation, draw = TurnCheck(), Rotation.identity(), np.random.default_rng(2)
    for step in range(1000):
        turning = rate if 500 < step < 520 else 0.0
        rotation = rotation * Rotation.from_rotvec((0.0, 0.0, turning * PERIOD))
        noise = Rotation.from_rotvec(draw.normal(0.0, 1e-3, 3))
        check.check(values(rotation * noise, (0.0, 0.0, turning or 0.01)), True, step * PERIOD, step * PERIOD)
        if step % 20 == 10 and not turning:
            with pytest.raises(PipeError, match="turn rates of"):
                later = (step + 0.5) * PERIOD
                check.check(values(rotation, (rate * (-1.0) ** step, 0.0, 0.0)), True, later, later)


@pytest.mark.parametrize("felt", ["gravity", "what leapt", "nothing"])
def test_a_tilt_that_leaps_counts_where_gravity_agrees(felt):
    """A sensor drifts and is right again, or a wrong one leaps: the accelerometer knows, time alone does not."""
    check, accepted = TurnCheck(), []
    for step in range(2000):
        time = step * PERIOD
        rotation = Rotation.from_euler("x", 0.4 if time > 1.0 else 0.0)
        up = {"gravity": rotation.inv().apply((0.0, 0.0, 9.81)), "what leapt": (0.0, 0.0, 9.81), "nothing": np.zeros(3)}
        try:
            check.check(values(rotation), True, time, time, np.array(up[felt]))
        except PipeError as error:
            assert "the tilt leaps by 0.4 rad" in error.what
        else:
            accepted.append(time)
    late = [time for time in accepted if time > 1.0]
    assert (late and late[0] == pytest.approx(1.5, abs=0.01)) if felt == "gravity" else not late


def test_a_spike_of_the_tilt_is_refused_alone():
    check, refused = TurnCheck(), 0
    for step in range(1000):
        is_spike = step % 100 == 50
        try:
            check.check(values(Rotation.from_euler("y", 1.0 if is_spike else 0.02)), True, step * PERIOD, step * PERIOD)
        except PipeError:
            assert is_spike
            refused += 1
    assert refused == 10


@pytest.mark.parametrize(
    ("force", "measured"), [((0.0, 0.0, 1.0), "1 "), ((0.05, 0.0, 0.02), "0.0"), ((0.0, 0.0, 9.81), "")]
)
def test_an_accelerometer_in_other_units_or_without_gravity_is_named(force, measured):
    check, named = TurnCheck(), []
    for step in range(10000):
        oddity = check.check(
            values(Rotation.identity(), (1e-3, 0.0, 0.0)), True, step * PERIOD, step * PERIOD, np.array(force)
        )
        named += [(step * PERIOD, oddity)] if oddity else []
    assert bool(named) == bool(measured)
    if named:
        assert named[0][0] < 2.0 and f"measures {measured}" in named[-1][1]


def test_what_others_distrust_is_refused_until_it_rests():
    check, refused = TurnCheck(), []
    for step in range(2000):
        time = step * PERIOD
        rate = 0.1 if 0.5 < time < 2.0 else 0.0
        tilt = 0.1 * min(max(time - 0.5, 0.0), 1.5)
        if step == 500:
            check.distrust("the ground turns")
        try:
            check.check(values(Rotation.from_euler("x", tilt), (rate, 0.0, 0.0)), True, time, time)
        except PipeError as error:
            assert "the ground turns" in error.what
            refused.append(time)
    assert refused[0] == pytest.approx(1.0) and refused[-1] == pytest.approx(2.5, abs=0.21)
