"""Rotations, the chart of a floating base and ramps, against SciPy and finite differences."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from solfer.errors import NotFinite, SizeMismatch
from solfer.numerics import BaseChart, Ramp
from solfer.numerics.rotations import (
    quaternion_from_rotation,
    quaternion_product,
    rotated,
    rotation_from_quaternion,
    rotation_from_rpy,
)

angle = st.floats(-3.1, 3.1)
tilt = st.floats(-1.5, 1.5)


def vectors(low, high, size=4):
    return arrays(float, size, elements=st.floats(low, high, allow_subnormal=False))


@pytest.fixture
def chart():
    return BaseChart((0.3, -0.2, 0.9), Rotation.from_euler("xyz", (0.2, -0.4, 1.1)).as_matrix())


@given(angle, angle, angle)
def test_rpy_is_the_fixed_axis_rotation_of_urdf(roll, pitch, yaw):
    expected = Rotation.from_euler("xyz", (roll, pitch, yaw)).as_matrix()
    assert_allclose(rotation_from_rpy((roll, pitch, yaw)), expected, atol=1e-14)


@given(vectors(-1.0, 1.0).filter(lambda q: np.linalg.norm(q) > 1e-3))
def test_quaternions_agree_with_scipy_both_ways(quaternion):
    rotation = rotation_from_quaternion(quaternion)
    assert_allclose(rotation, Rotation.from_quat(quaternion).as_matrix(), atol=1e-13)
    assert_allclose(rotation_from_quaternion(quaternion_from_rotation(rotation)), rotation, atol=1e-13)


@pytest.mark.slow
@given(vectors(-1.0, 1.0, 8).filter(lambda q: min(np.linalg.norm(q[:4]), np.linalg.norm(q[4:])) > 1e-3))
def test_plain_numbers_rotate_as_scipy_does(numbers):
    one, other = Rotation.from_quat(numbers[:4]), Rotation.from_quat(numbers[4:])
    product = quaternion_product(one.as_quat().tolist(), other.as_quat().tolist())
    assert_allclose(Rotation.from_quat(product).as_matrix(), (one * other).as_matrix(), atol=1e-13)
    assert_allclose(rotated(numbers[:3], other.as_quat()), other.apply(numbers[:3]), atol=1e-13)


@pytest.mark.parametrize("quaternion", [(0, 0, 0, 0), (math.nan, 0, 0, 1), (math.inf, 0, 0, 1)])
def test_no_orientation_is_refused(quaternion):
    with pytest.raises(NotFinite, match="not an orientation"):
        rotation_from_quaternion(quaternion)


@given(angle, tilt, angle)
def test_chart_turns_about_moving_axes(rx, ry, rz):
    base = np.array((0.1, -0.5, 2.0, rx, ry, rz))
    position, quaternion = BaseChart((0.0, 0.0, 0.5)).to_pose(base)
    assert_allclose(position, (0.1, -0.5, 2.5), atol=1e-15)
    expected = Rotation.from_euler("XYZ", (rx, ry, rz)).as_matrix()
    assert_allclose(rotation_from_quaternion(quaternion), expected, atol=1e-13)


@settings(deadline=None)
@given(vectors(-1.5, 1.5, 6))
def test_pose_and_back_with_an_origin(base):
    chart = BaseChart((0.3, -0.2, 0.9), rotation_from_rpy((0.2, -0.4, 1.1)))
    assert_allclose(chart.from_pose(*chart.to_pose(base), np.empty(6)), base, atol=1e-11)


@pytest.mark.parametrize("ry", [math.pi / 2, -math.pi / 2])
def test_pose_at_the_singularity_keeps_the_orientation(chart, ry):
    position, quaternion = chart.to_pose(np.array((1.0, 2.0, 3.0, 0.3, ry, 0.4)))
    base = chart.from_pose(position, quaternion, np.empty(6))
    again_position, again = chart.to_pose(base)
    assert_allclose(again_position, position, atol=1e-13)
    assert_allclose(rotation_from_quaternion(again), rotation_from_quaternion(quaternion), atol=1e-8)


def test_twist_is_the_derivative_of_the_pose(chart):
    random = np.random.default_rng(3)
    for _ in range(20):
        base, rates, step = random.uniform(-1.4, 1.4, 6), random.standard_normal(6), 1e-6
        linear, angular = chart.twist_from_rates(base, rates)
        before, q_before = chart.to_pose(base - step * rates)
        after, q_after = chart.to_pose(base + step * rates)
        assert_allclose(linear, (after - before) / (2 * step), atol=1e-8)
        turn = Rotation.from_quat(q_after) * Rotation.from_quat(q_before).inv()
        assert_allclose(angular, turn.as_rotvec() / (2 * step), atol=1e-8)
        assert_allclose(chart.rates_from_twist(base, linear, angular, np.empty(6)), rates, atol=1e-12)


def test_rates_stay_bounded_at_the_singularity(chart):
    base = np.array((0.0, 0.0, 0.0, 0.0, math.pi / 2, 0.0))
    rates = chart.rates_from_twist(base, np.zeros(3), np.ones(3), np.empty(6))
    assert np.isfinite(rates).all() and np.abs(rates).max() < 3e3


def sample(ramp, count=400):
    times = np.linspace(0.0, ramp.duration, count)
    positions, velocities = np.empty((count, ramp.size)), np.empty((count, ramp.size))
    for time, position, velocity in zip(times, positions, velocities, strict=True):
        ramp.at(time, position, velocity)
    return times, positions, velocities


@pytest.mark.slow
@settings(deadline=None, max_examples=60)
@given(vectors(-3, 3), vectors(-2, 2), vectors(-3, 3), vectors(0.1, 5))
def test_ramp_ends_at_rest_and_keeps_its_limits(start, start_velocity, goal, limits):
    ramp = Ramp(4)
    duration = ramp.plan(start, start_velocity, goal, limits)
    _, positions, velocities = sample(ramp)
    assert_allclose(positions[0], start if duration else goal, atol=1e-12)
    assert_allclose(velocities[0], start_velocity if duration else 0.0, atol=1e-12)
    assert_allclose(positions[-1], goal, atol=0)
    assert_allclose(velocities[-1], 0.0, atol=0)
    allowed = np.maximum(limits, np.abs(start_velocity))
    assert (np.abs(velocities) <= allowed * (1 + 1e-6)).all()


@pytest.mark.slow
@settings(deadline=None, max_examples=60)
@given(st.floats(0.01, 3), st.floats(-0.99, 0.99), st.floats(0.1, 5))
def test_no_shorter_ramp_keeps_the_limit(distance, ratio, limit):
    ramp = Ramp(1, stop_time=0.0)
    ramp.plan(np.zeros(1), np.array([ratio * limit]), np.array([distance]), np.array([limit]))
    _, _, velocities = sample(ramp, 2000)
    assert velocities.max() == pytest.approx(limit, rel=1e-5)


def test_from_rest_peak_is_fifteen_eighths_of_mean():
    ramp = Ramp(2)
    duration = ramp.plan(np.zeros(2), np.zeros(2), np.array((1.0, -0.25)), np.array((0.5, 0.5)))
    assert duration == pytest.approx(1.875 * 1.0 / 0.5, rel=1e-12)


def test_velocity_is_the_derivative_of_position():
    ramp = Ramp(2)
    ramp.plan(np.array((0.1, 0.5)), np.array((0.3, -0.6)), np.array((1.0, 0.5)), np.array((1.0, 0.8)))
    times, positions, velocities = sample(ramp, 4001)
    derivative = np.gradient(positions, times, axis=0)
    assert_allclose(derivative[1:-1], velocities[1:-1], atol=1e-5)
    acceleration = np.gradient(velocities, times, axis=0)
    assert_allclose(acceleration[[0, -1]], 0.0, atol=0.02)


def test_at_rest_at_goal_duration_is_zero():
    ramp, position, velocity = Ramp(3), np.empty(3), np.empty(3)
    assert ramp.plan(np.ones(3), np.zeros(3), np.ones(3), np.ones(3)) == 0.0
    ramp.at(0.0, position, velocity)
    assert_allclose(position, 1.0)
    assert_allclose(velocity, 0.0)


def test_a_moving_joint_stops_at_its_goal():
    ramp = Ramp(1, stop_time=0.2)
    assert ramp.plan(np.zeros(1), np.array([0.5]), np.zeros(1), np.ones(1)) == pytest.approx(0.1)


def test_an_unlimited_joint_has_the_common_duration():
    ramp = Ramp(2)
    assert ramp.plan(np.zeros(2), np.zeros(2), np.ones(2), np.array((1.0, math.inf))) == pytest.approx(1.875)


@pytest.mark.parametrize("limits", [(math.inf, math.inf), (0.0, 1.0), (-1.0, 1.0), (math.nan, 1.0)])
def test_limits_that_bound_nothing_are_refused(limits):
    with pytest.raises(NotFinite, match="limit"):
        Ramp(2).plan(np.zeros(2), np.zeros(2), np.ones(2), np.array(limits))


def test_wrong_sizes_and_nan_are_refused():
    with pytest.raises(SizeMismatch, match="2 joints got numbers of shape"):
        Ramp(2).plan(np.zeros(3), np.zeros(2), np.ones(2), np.ones(2))
    with pytest.raises(NotFinite, match="goal"):
        Ramp(2).plan(np.zeros(2), np.zeros(2), np.array((math.nan, 0.0)), np.ones(2))
