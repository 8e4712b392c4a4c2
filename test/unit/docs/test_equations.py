"""The page of equations has the numbers of the code, and its ICR is where the desired velocities vanish."""

import importlib
import re

import numpy as np
import pytest
from numpy.testing import assert_allclose

from solfer.components.odometry.kalman import ImuSample, WheelInertialFilter
from solfer.components.odometry.kalman_kernel import HEADING, RADIUS, VELOCITY

CONSTANT = re.compile(r"^\| .* \| ([\d.e-]+) \| `([\w.]+)\.(\w+)` \|$", re.MULTILINE)


@pytest.fixture(scope="module")
def page(repository):
    return (repository / "docs/explanation/estimation_and_driving.md").read_text()


def test_constants_of_the_page_are_those_of_the_code(page):
    found = CONSTANT.findall(page)
    assert len(found) >= 8
    for number, module, name in found:
        assert float(number) == getattr(importlib.import_module(f"solfer.components.{module}"), name), name


def test_the_center_of_rotation_is_at_rest():
    center, velocity, rate = np.array((0.1, -0.2, 0.0)), np.array((0.3, 0.1, 0.0)), 0.7
    up = np.array((0.0, 0.0, 1.0))
    place = center + np.cross(up, velocity) / rate
    assert_allclose(velocity + rate * np.cross(up, place - center), 0.0, atol=1e-15)


def test_a_correction_is_that_of_the_page():
    """Wheel by wheel and row by row, in plain NumPy: innovation, gain without position and radii, and covariance."""
    kalman = WheelInertialFilter(2, acceleration=1.0, noise=1e-3, bias=1e-2, walk=1e-6, radius=0.0)
    kalman.predict(yaw=0.01, period=0.02, sample=ImuSample(time=0.02))
    arms = np.array(((0.3, 0.4, -0.9), (-0.3, 0.4, -0.9)))
    speeds = np.array(((0.01, 0.002, 0.0), (0.011, 0.001, 0.001)))
    state, covariance = kalman.state.copy(), kalman.covariance.copy()
    rate, variance = 0.5, 1e-4
    kalman.correct(speeds, arms, rate, 1.0, variances=np.full(2, variance), inliers=np.ones(2, dtype=bool))
    for speed, arm in zip(speeds, arms, strict=True):
        for axis in range(3):
            state, covariance = corrected(state, covariance, speed, arm, axis, rate, variance)
    assert_allclose(kalman.state, state, atol=1e-12)
    assert_allclose(kalman.covariance, covariance, atol=1e-12)


def expected(state, arm, rate):
    """Return h(x) of the page, of a wheel whose radius does not err, with the gyroscope's time s = T."""
    turn = rate - state[VELOCITY + 5] - state[10] + state[11]
    return state[VELOCITY : VELOCITY + 3] + turn * np.cross((0.0, 0.0, 1.0), arm)


def corrected(state, covariance, speed, arm, axis, rate, variance):
    """Return state and covariance after one scalar update; the row of H is that of finite differences."""
    row = [(expected(state + step, arm, rate) - expected(state, arm, rate))[axis] for step in np.eye(len(state))]
    row = np.array(row)
    spread = row @ covariance @ row + variance
    gain = covariance @ row / spread
    gain[:HEADING] = gain[RADIUS:] = 0.0
    innovation = speed[axis] - expected(state, arm, rate)[axis]
    mapped = covariance @ row
    change = spread * np.outer(gain, gain) - np.outer(gain, mapped) - np.outer(mapped, gain)
    return state + gain * innovation, covariance + change
