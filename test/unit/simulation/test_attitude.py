"""The filter that computes an orientation from gyroscopes and accelerometers."""

import numpy as np
import pinocchio as pin
import pytest

from solfer.numerics.rotations import rotation_from_rpy
from solfer.simulation.sensors.attitude import AttitudeFilter

DT = 0.002  # [s]
GRAVITY = np.array([0.0, 0.0, 9.81])
TILTED = rotation_from_rpy((0.2, -0.3, 1.0))


def started(rotation=TILTED, **times):
    """Make a filter that begins at rest with a rotation."""
    attitude = AttitudeFilter(**({"time_constant": 2.0, "bias_time": 30.0} | times))
    attitude.start(rotation, rotation.T @ GRAVITY)
    return attitude


def rest(attitude, seconds, bias, rotation=TILTED):
    """Let a sensor at rest measure with a bias of its gyroscopes."""
    for _ in range(round(seconds / DT)):
        attitude.update(np.asarray(bias), rotation.T @ GRAVITY, DT)


def errors(attitude, rotation=TILTED):
    """Return tilt and heading of the estimate relative to a rotation, about axes of the world [rad]."""
    x, y, z = pin.log3(attitude.rotation @ rotation.T)
    return np.hypot(x, y), z


def test_it_begins_upright_with_the_heading_given():
    attitude = AttitudeFilter(2.0, 30.0)
    attitude.start(rotation_from_rpy((0.0, 0.0, 1.0)), TILTED.T @ GRAVITY)
    np.testing.assert_allclose(attitude.rotation.T[:, 2], TILTED.T[:, 2], atol=1e-12)


def test_exact_gyroscopes_follow_a_motion():
    attitude, rotation = started(), TILTED.copy()
    for step in range(5000):
        angular = np.array([np.sin(0.01 * step), 0.5 * np.cos(0.013 * step), 0.3])
        rotation = rotation @ pin.exp3(DT * angular)
        attitude.update(angular, rotation.T @ GRAVITY, DT)
    np.testing.assert_allclose(attitude.rotation, rotation, atol=1e-9)
    np.testing.assert_allclose(attitude.rotation @ attitude.rotation.T, np.eye(3), atol=1e-9)


def test_a_wrong_tilt_decays_by_its_time_constant():
    attitude = started(bias_time=3600.0)
    attitude.rotation[:] = rotation_from_rpy((0.02, 0.0, 0.0)) @ attitude.rotation
    rest(attitude, 2.0, np.zeros(3))
    tilt, heading = errors(attitude)
    assert tilt == pytest.approx(0.02 / np.e, rel=0.02)
    assert heading == pytest.approx(0.0, abs=1e-4)


def test_the_heading_drifts_with_the_vertical_bias():
    bias, attitude = 3.5e-3, started()
    rest(attitude, 10.0, TILTED.T @ np.array([0.0, 0.0, bias]))
    tilt, heading = errors(attitude)
    assert heading == pytest.approx(10.0 * bias, rel=1e-3)
    assert tilt < 1e-6


@pytest.mark.slow
def test_a_bias_of_tilt_is_learned():
    bias, attitude = np.array([3.5e-3, 0.0, 0.0]), started(bias_time=5.0)
    rest(attitude, 4.0, TILTED.T @ bias)
    assert 0.2 * 3.5e-3 * 2.0 < errors(attitude)[0] < 3.5e-3 * 2.0
    rest(attitude, 40.0, TILTED.T @ bias)
    assert errors(attitude)[0] < 1e-4
    np.testing.assert_allclose(TILTED @ attitude.bias, bias, atol=2e-5)


def test_slow_samples_right_it_as_well():
    bias, attitude = TILTED.T @ np.array([3.5e-3, 0.0, 0.0]), started(time_constant=0.01, bias_time=0.01)
    for _ in range(50):
        attitude.update(bias, TILTED.T @ GRAVITY, 10.0)
    assert errors(attitude)[0] < 1e-6
    np.testing.assert_allclose(attitude.bias, bias, atol=1e-6)


@pytest.mark.parametrize("force", [(0.0, 0.0, 0.0), (1e-13, -0.5, 0.0), (-4.0, 1.0, 2.0)])
def test_a_start_without_weight_keeps_the_tilt(force):
    attitude = AttitudeFilter(2.0, 30.0)
    attitude.start(TILTED, np.array(force))
    np.testing.assert_array_equal(attitude.rotation, TILTED)


@pytest.mark.parametrize("force", [(0.0, 0.0, 0.0), (1e-13, -0.5, 0.0), (-4.0, 1.0, 2.0)])
def test_a_fall_without_weight_turns_on(force):
    attitude = started()
    attitude.update(np.array([0.0, 0.0, 1.0]), np.array(force), DT)
    np.testing.assert_allclose(attitude.rotation, TILTED @ pin.exp3(np.array([0.0, 0.0, DT])), atol=1e-12)
