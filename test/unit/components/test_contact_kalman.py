"""The Kalman filter of odometry on wheels of which everything is known: its covariance is that of its errors."""

import math

import numpy as np
import pytest

from solfer.components.odometry.contact_kalman import PATCH, PLANE, UNEVEN, WANDERING, ContactKalman

PERIOD, SPEED, TURN = 0.01, 0.3, 0.1
ARMS = np.array(((0.55, 0.32, -0.6), (0.55, -0.32, -0.6), (-0.55, 0.32, -0.6), (-0.55, -0.32, -0.6)))
ACROSS = np.stack((-ARMS[:, 1], ARMS[:, 0], np.zeros(4)), axis=1)
NOISE, BIAS, RADIUS, SLIP = 1e-3, 3e-3, 0.003, 0.01
ALL = np.ones(4, dtype=bool)


def filtered():
    return ContactKalman(4, 1.0, NOISE, BIAS, 0.0, RADIUS)


def drive(kalman, random, cycles, rest=100, spun=None):
    """Drive on an arc after a rest; return the errors of position, heading and bias."""
    bias, shares = BIAS * random.standard_normal(), RADIUS * random.standard_normal(4)
    truth, estimate = np.zeros((2, 4))
    for k in range(cycles):
        going = min(max(k - rest, 0) / 50, 1.0)
        speed, turn = going * SPEED, going * TURN
        told = (np.array((speed, 0.0, 0.0)) + turn * ACROSS) / (1.0 + shares[:, None])
        told += SLIP * random.standard_normal((4, 3))
        if spun is not None:
            told[spun, 0] += 1.0
        rate = turn + bias + NOISE / math.sqrt(PERIOD) * random.standard_normal()
        kalman.accelerate((rate - kalman.bias) * PERIOD, PERIOD)
        kalman.correct(told, ARMS, rate, 1.0, np.full(4, SLIP), ALL.copy())
        turned = (rate - kalman.bias) * PERIOD
        kalman.advance(estimate[3] + 0.5 * turned, PERIOD, PERIOD, 0.0)
        go(estimate, kalman.velocity, turned)
        go(truth, np.array((speed, 0.0, 0.0)), turn * PERIOD)
    return np.append(truth - estimate, bias - kalman.bias)


def go(pose, velocity, turn):
    heading = pose[3] + 0.5 * turn
    cosine, sine = math.cos(heading), math.sin(heading)
    x, y, z = velocity * PERIOD
    pose += cosine * x - sine * y, sine * x + cosine * y, z, turn


@pytest.mark.slow
def test_errors_are_as_large_as_it_says():
    random, places = np.random.default_rng(3), [0, 1, 2, 3, 7]
    squares = []
    for _ in range(12):
        kalman = filtered()
        errors = drive(kalman, random, 500)
        squares.append(errors @ np.linalg.solve(kalman.covariance[np.ix_(places, places)], errors) / len(places))
    assert 0.5 < np.mean(squares) < 2.0


def test_it_learns_the_bias_at_rest():
    kalman = filtered()
    errors = drive(kalman, np.random.default_rng(1), 300, rest=300)
    assert math.sqrt(kalman.bias_variance) < 0.5 * BIAS and abs(errors[4]) < 4.0 * math.sqrt(kalman.bias_variance)


@pytest.mark.parametrize("wheel", range(4))
def test_a_wheel_that_spins_is_improbable(wheel):
    kalman = filtered()
    errors = drive(kalman, np.random.default_rng(1), 200, spun=wheel)
    assert kalman.rolling[wheel] < 1e-6 and np.delete(kalman.rolling, wheel).min() > 0.9
    assert np.abs(errors[:3]).max() < 0.01


def test_a_known_pose_has_no_covariance():
    kalman = filtered()
    drive(kalman, np.random.default_rng(1), 50)
    kalman.place()
    assert not kalman.covariance[:4].any() and np.linalg.eigvalsh(kalman.covariance).min() > -1e-12


def test_the_height_of_known_ground_is_known():
    kalman = filtered()
    drive(kalman, np.random.default_rng(1), 50)
    before = kalman.covariance[2, 2]
    kalman.settle(math.sqrt(before))
    assert kalman.covariance[2, 2] == pytest.approx(0.5 * before)


def wander(random, value, deviation, passed):
    """Change a Markov process of first order, by a share of its time."""
    keep = math.exp(-passed)
    return keep * value + deviation * math.sqrt(1.0 - keep * keep) * random.standard_normal(2)


@pytest.mark.slow
def test_the_tilt_is_as_uncertain_as_it_says():
    """Forty simulated runs: normalised squared errors average near 1, so the covariance is neither timid nor bold."""
    random, arm, squares = np.random.default_rng(5), np.array((0.0, 0.0, -0.6)), []
    deviation, places = math.radians(0.5), [0, 1, -4, -3]
    for _ in range(40):
        kalman = ContactKalman(4, 1.0, NOISE, BIAS, 0.0, RADIUS, deviation)
        tilt, slope = deviation * random.standard_normal(2), UNEVEN * random.standard_normal(2)
        base, bias = np.zeros(2), BIAS * random.standard_normal(2)
        for k in range(200):
            before, tilt = tilt, wander(random, tilt, deviation, PERIOD / WANDERING)
            slope, known = wander(random, slope, UNEVEN, 0.01 / PATCH), kalman.tilt.copy()
            # the base does not turn: the IMU tells how it rights itself, and the gyroscope its bias and its noise
            told = bias - kalman.biases[:2] + NOISE / math.sqrt(PERIOD) * random.standard_normal(2)
            kalman.lean(arm, 0.0, 0.0, tilt - before - told * PERIOD, PERIOD, 0.01, 0.0)
            (x, y), z = tilt - before - (kalman.tilt - known), arm[2]
            base += -y * z, x * z
            if k % 5 == 0:
                kalman.right(5 * PERIOD)
                kalman.level(*(tilt + slope + PLANE * random.standard_normal(2)))
            base += kalman.step[:2]
            kalman.step[:] = 0.0
        errors = np.concatenate((-base, tilt - kalman.tilt))
        squares.append(errors @ np.linalg.solve(kalman.covariance[np.ix_(places, places)], errors) / 4.0)
    assert 0.5 < np.mean(squares) < 2.0


def test_it_learns_biases_of_the_tilt_at_rest():
    kalman, random = ContactKalman(4, 1.0, NOISE, BIAS, 0.0, RADIUS, 0.01), np.random.default_rng(7)
    for _ in range(300):
        kalman.rest(np.array((BIAS, -BIAS, 0.0)) + NOISE / math.sqrt(PERIOD) * random.standard_normal(3), PERIOD)
    deviation = NOISE / math.sqrt(300 * PERIOD)
    np.testing.assert_allclose(kalman.biases[:2], (BIAS, -BIAS), atol=4.0 * deviation)
    assert kalman.covariance[-8, -8] == pytest.approx(1.0 / (deviation**-2 + BIAS**-2), rel=1e-6)


def test_a_slope_is_no_error_of_the_tilt():
    kalman = ContactKalman(4, 1.0, NOISE, BIAS, 0.0, RADIUS, 0.01)
    assert not kalman.level(0.2, 0.0) and not kalman.tilt[0] and kalman.level(0.005, 0.0) and kalman.tilt[0] > 0.0


def test_the_noise_of_the_gyroscope_limits_what_is_learned_at_rest():
    kalman, random = filtered(), np.random.default_rng(2)
    drive(kalman, random, 100, rest=100)
    assert kalman.bias_variance > 0.5 * NOISE**2 / (100 * PERIOD)
