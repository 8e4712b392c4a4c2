"""The Kalman filter of odometry on wheels of which everything is known: its covariance is that of its errors."""

import math

import numpy as np
import pytest

from solfer.components.odometry import filter_kernel
from solfer.components.odometry import kalman_kernel as kernel
from solfer.components.odometry.kalman import (
    FLOOR_DEVIATION,
    FLOOR_LENGTH,
    PLANE_DEVIATION,
    TILT_TIME_CONSTANT,
    ImuSample,
    WheelInertialFilter,
)
from solfer.components.odometry.kalman_kernel import GYRO_BIAS, HEADING, TILT

PERIOD, SPEED, TURN = 0.01, 0.3, 0.1
ARMS = np.array(((0.55, 0.32, -0.6), (0.55, -0.32, -0.6), (-0.55, 0.32, -0.6), (-0.55, -0.32, -0.6)))
ACROSS = np.stack((-ARMS[:, 1], ARMS[:, 0], np.zeros(4)), axis=1)
NOISE, BIAS, RADIUS, SLIP = 1e-3, 3e-3, 0.003, 0.01
ALL = np.ones(4, dtype=bool)


def filtered():
    return WheelInertialFilter(4, 1.0, NOISE, BIAS, 0.0, radius=RADIUS)


def drive(kalman, random, cycles, rest=100, spun=None):
    """Drive on an arc after a rest; return the errors of position, heading and bias."""
    bias, shares = BIAS * random.standard_normal(), RADIUS * random.standard_normal(4)
    truth, estimate = np.zeros((2, 4))
    for k in range(cycles):
        going = min(max(k - rest, 0) / 50, 1.0)
        speed, turn = going * SPEED, going * TURN
        measured = (np.array((speed, 0.0, 0.0)) + turn * ACROSS) / (1.0 + shares[:, None])
        measured += SLIP * random.standard_normal((4, 3))
        if spun is not None:
            measured[spun, 0] += 1.0
        rate = turn + bias + NOISE / math.sqrt(PERIOD) * random.standard_normal()
        kalman.predict((rate - kalman.bias) * PERIOD, PERIOD)
        kalman.correct(measured, ARMS, rate, 1.0, variances=np.full(4, SLIP**2), inliers=ALL.copy())
        turned = (rate - kalman.bias) * PERIOD
        kalman.integrate(estimate[3] + 0.5 * turned, PERIOD, PERIOD, 0.0)
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
    random, places = np.random.default_rng(3), [0, 1, 2, HEADING, GYRO_BIAS + 2]
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
    kalman.settle_height(math.sqrt(before))
    assert kalman.covariance[2, 2] == pytest.approx(0.5 * before)


def wander(random, value, deviation, passed):
    """Change a Markov process of first order, by a share of its time."""
    keep = math.exp(-passed)
    return keep * value + deviation * math.sqrt(1.0 - keep * keep) * random.standard_normal(2)


@pytest.mark.slow
def test_the_tilt_is_as_uncertain_as_it_says():
    """Forty simulated runs: normalised squared errors average near 1, so the covariance is neither timid nor bold."""
    random, arm, squares = np.random.default_rng(5), np.array((0.0, 0.0, -0.6)), []
    deviation, places = math.radians(0.5), [0, 1, TILT, TILT + 1]
    for _ in range(40):
        kalman = WheelInertialFilter(4, 1.0, NOISE, BIAS, 0.0, radius=RADIUS, tilt=deviation)
        tilt, slope = deviation * random.standard_normal(2), FLOOR_DEVIATION * random.standard_normal(2)
        base, bias = np.zeros(2), BIAS * random.standard_normal(2)
        for k in range(200):
            before, tilt = tilt, wander(random, tilt, deviation, PERIOD / TILT_TIME_CONSTANT)
            slope, known = wander(random, slope, FLOOR_DEVIATION, 0.01 / FLOOR_LENGTH), kalman.tilt.copy()
            # the base does not turn: the IMU turns to right itself, and the gyroscope measures its bias and its noise
            measured = bias - kalman.biases[:2] + NOISE / math.sqrt(PERIOD) * random.standard_normal(2)
            kalman.follow_tilt(0.0, *(tilt - before - measured * PERIOD))
            kalman.predict(0.0, PERIOD, 0.01, arm=arm, sample=ImuSample(time=PERIOD))
            (x, y), z = tilt - before - (kalman.tilt - known), arm[2]
            base += -y * z, x * z
            if k % 5 == 0:
                kalman.settle_tilt(5 * PERIOD)
                kalman.level(*(tilt + slope + PLANE_DEVIATION * random.standard_normal(2)))
            base += kalman.correction[:2]
            kalman.correction[:] = 0.0
        errors = np.concatenate((-base, tilt - kalman.tilt))
        squares.append(errors @ np.linalg.solve(kalman.covariance[np.ix_(places, places)], errors) / 4.0)
    assert 0.5 < np.mean(squares) < 2.0


def test_it_learns_biases_of_the_tilt_at_rest():
    kalman, random = WheelInertialFilter(4, 1.0, NOISE, BIAS, 0.0, radius=RADIUS, tilt=0.01), np.random.default_rng(7)
    for _ in range(300):
        kalman.rest(np.array((BIAS, -BIAS, 0.0)) + NOISE / math.sqrt(PERIOD) * random.standard_normal(3), PERIOD)
    deviation = NOISE / math.sqrt(300 * PERIOD)
    np.testing.assert_allclose(kalman.biases[:2], (BIAS, -BIAS), atol=4.0 * deviation)
    assert kalman.covariance[GYRO_BIAS, GYRO_BIAS] == pytest.approx(1.0 / (deviation**-2 + BIAS**-2), rel=1e-6)


def test_a_slope_is_no_error_of_the_tilt():
    kalman = WheelInertialFilter(4, 1.0, NOISE, BIAS, 0.0, radius=RADIUS, tilt=0.01)
    assert not kalman.level(0.2, 0.0) and not kalman.tilt[0] and kalman.level(0.005, 0.0) and kalman.tilt[0] > 0.0


def test_the_noise_of_the_gyroscope_limits_what_is_learned_at_rest():
    kalman, random = filtered(), np.random.default_rng(2)
    drive(kalman, random, 100, rest=100)
    assert kalman.bias_variance > 0.5 * NOISE**2 / (100 * PERIOD)


SHARE, RATE = 0.8, 0.3
PUSH = 0.05
"""Gravity times the time of an accelerometer [m/s]."""
AXIS = np.array((0.1, -0.2, math.sqrt(0.95)))
STATE = np.random.default_rng(11).normal(scale=0.05, size=kernel.RADIUS + 4)


def values(**changed):
    """Make what the kernels read and write, of four wheels."""
    size = len(STATE)
    square = {name: np.zeros((size, size)) for name in ("covariance", "transition", "noise", "half")}
    arrays = {
        **square,
        "state": STATE.copy(),
        "axes": np.stack((np.zeros(3), np.zeros(3), AXIS)),
        "rows": np.zeros((4, 3, size)),
        "innovations": np.zeros((4, 3)),
        "rolling": np.ones(4),
        "pushed": np.array((0.01, -0.02, 0.03, 1e-4, PUSH)),
    }
    return kernel.FILTER.tuple(size=size, count=4, **(arrays | changed))


def jacobian(function, at):
    """Compute central differences."""
    step = 1e-6 * np.eye(len(at))
    return np.stack([(function(at + each) - function(at - each)) / 2e-6 for each in step], axis=1)


@pytest.mark.parametrize("share", [SHARE, 0.0])
def test_the_jacobian_of_wheels_is_that_of_their_velocity(share):
    """It is (1 - e) (v + (u - share (b_z + n) + c) z x r); without an IMU there is no bias, and no scrubbing."""
    at = STATE.copy()
    at[kernel.RADIUS :] = 0.0
    for wheel in range(4):

        def velocity(state, wheel=wheel):
            bias = AXIS @ state[GYRO_BIAS : GYRO_BIAS + 3] + state[kernel.GYRO_NOISE]
            turn = RATE - share * bias + (state[kernel.SCRUB] if share else 0.0)
            return (1.0 - state[kernel.RADIUS + wheel]) * (state[kernel.VELOCITY : GYRO_BIAS] + turn * ACROSS[wheel])

        expected = np.zeros(3)
        kalman = values(state=at)
        kernel.wheel_velocity(kalman, wheel, ARMS[wheel], RATE, share, expected)
        kernel.set_wheel_rows(kalman, wheel, ARMS[wheel], share, expected)
        np.testing.assert_allclose(expected, velocity(at), atol=1e-15)
        np.testing.assert_allclose(kalman.rows[wheel], jacobian(velocity, at), atol=1e-9)


@pytest.mark.parametrize("imu_time", [PERIOD, 0.0])
def test_the_jacobian_of_the_pose_is_that_of_its_integral(imu_time):
    """A tilt that errs leads uphill; scrubbing turns the base only without an IMU."""
    heading = 0.7
    velocity = np.array((0.3, -0.2, 0.05))
    at = np.zeros(len(STATE))
    at[kernel.VELOCITY : GYRO_BIAS] = velocity

    def integrate(state):
        after, (x, y, z) = state.copy(), state[kernel.VELOCITY : GYRO_BIAS]
        turn = heading + state[HEADING]
        a, b = state[TILT : TILT + 2]
        after[0] += PERIOD * (math.cos(turn) * x - math.sin(turn) * y)
        after[1] += PERIOD * (math.sin(turn) * x + math.cos(turn) * y)
        after[2] += PERIOD * (z + b * velocity[0] - a * velocity[1])
        bias = AXIS @ state[GYRO_BIAS : GYRO_BIAS + 3] + state[kernel.GYRO_NOISE]
        after[HEADING] -= imu_time * bias if imu_time else PERIOD * state[kernel.SCRUB]
        return after

    kalman = values(state=at)
    kernel.set_pose_process(kalman, heading, PERIOD, imu_time)
    np.testing.assert_allclose(kalman.transition, jacobian(integrate, at), atol=1e-9)


def test_the_jacobian_of_the_process_is_that_of_its_equations():
    """Axes of velocity, slope and tilt turn; a bias tilts, and moves the ground point by that turn and its arm.

    A tilt that errs lets gravity push the velocity.
    """
    arm = np.array((0.1, -0.05, -0.6))
    heading, turn = 0.4, 0.02
    keep, slope_keep = 0.9, 0.7
    axes = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))[0]

    def rotated(angle, pair):
        return np.array(((math.cos(angle), math.sin(angle)), (-math.sin(angle), math.cos(angle)))) @ pair

    def process(state):
        after = state.copy()
        tilting = PERIOD * axes @ state[GYRO_BIAS : GYRO_BIAS + 3]
        tilting[2] = 0.0
        x, y, z = np.cross(tilting, arm)
        after[:2] += rotated(-heading, (x, y))
        after[2] += z
        after[4:6] = rotated(turn, state[4:6]) + PUSH * np.array((-state[TILT + 1], state[TILT]))
        after[kernel.GYRO_NOISE] = 0.0
        after[kernel.SCRUB] *= keep
        after[TILT : TILT + 2] = rotated(turn, state[TILT : TILT + 2]) + tilting[:2]
        after[kernel.SLOPE : kernel.RADIUS] = slope_keep * rotated(turn, state[kernel.SLOPE : kernel.RADIUS])
        return after

    kalman = values(axes=axes)
    kernel.set_process(kalman, arm, heading, (turn, turn), PERIOD, (keep, slope_keep))
    np.testing.assert_allclose(kalman.transition, jacobian(process, STATE), atol=1e-9)


def test_the_covariance_is_propagated_and_corrected_as_matrices_are():
    """The kernel, which uses symmetry and considered states, agrees with full matrices."""
    random, size = np.random.default_rng(6), len(STATE)
    root = random.normal(size=(size, size))
    covariance = root @ root.T
    transition, noise = random.normal(size=(2, size, size))
    noise = noise @ noise.T
    state = STATE.copy()
    kalman = values(covariance=covariance, transition=transition, noise=noise, state=state)
    expected = transition @ covariance @ transition.T + noise
    kernel.propagate(kalman)
    np.testing.assert_allclose(covariance, expected, rtol=1e-10, atol=1e-10)
    row = random.normal(size=size)
    variance = row @ expected @ row + 0.3
    gain = expected @ row / variance
    gain[:HEADING] = gain[kernel.RADIUS :] = 0.0  # considered
    kernel.update(kalman, row, 0.2, 0.3, HEADING)
    np.testing.assert_allclose(state, STATE + 0.2 * gain, rtol=1e-10)
    left = np.eye(size) - np.outer(gain, row)
    np.testing.assert_allclose(covariance, left @ expected @ left.T + 0.3 * np.outer(gain, gain), atol=1e-8)


def test_the_velocity_has_the_covariance_of_a_mean():
    """Without smoothing it is the covariance of samples by their number."""
    speeds = np.random.default_rng(3).normal(0.0, 0.01, (4, 3))
    velocity, each, covariance = np.zeros(3), np.zeros((4, 3)), np.zeros((3, 3))
    filter_kernel.velocity_of_base(
        np.diag(-speeds.ravel()), np.ones(12), np.zeros(3), np.zeros((4, 3)), np.ones(4),
        velocity, each, 0.0, covariance,
    )  # fmt: skip
    np.testing.assert_allclose(velocity, speeds.mean(axis=0), atol=1e-15)
    np.testing.assert_allclose(covariance, np.cov(speeds, rowvar=False) / 4.0, atol=1e-15)
