"""Listing 5 of the paper, line by line: the interface that all Robot Points share."""

import inspect

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from support.robots import centauro

import solfer.points
from solfer.points import LinearPoint, Point

EXPORTED = [getattr(solfer.points, name) for name in solfer.points.__all__]
KINDS = [kind for kind in EXPORTED if inspect.isclass(kind) and issubclass(kind, Point)]


@pytest.fixture
def robot():
    robot = centauro()
    robot.state.position[:] = np.random.default_rng(2).uniform(-0.5, 0.5, robot.size)
    robot.update()
    return robot


@pytest.fixture
def points(robot):
    points = LinearPoint("arm1_7", robot), LinearPoint("wheel_1", robot)
    for point in points:
        point.update()
    return points


METHODS = ("compute", "compute_jacobian", "assign", "__add__", "__sub__", "__iadd__", "__isub__")
PROPERTIES = ("value", "jacobian", "size", "rows", "cols")


def departures(kind):
    """Names of Listing 5 that a kind of Point has not as they are there."""
    missing = [name for name in METHODS if not callable(getattr(kind, name, None))]
    missing += [name for name in PROPERTIES if not isinstance(inspect.getattr_static(kind, name, None), property)]
    update = inspect.signature(kind.update).parameters
    return missing if "jacobian" in update and update["jacobian"].default is True else [*missing, "update"]


def test_listing_5_is_the_interface_of_every_point():
    assert {kind.__name__: departed for kind in KINDS if (departed := departures(kind))} == {}


def test_compute_functions_write_value_and_jacobian(robot, points):
    alone, point = LinearPoint("arm1_7", robot), points[0]
    alone.compute()
    assert_array_equal(alone.value, point.value)
    assert not alone.jacobian.any()
    alone.compute_jacobian()
    assert_array_equal(alone.jacobian, point.jacobian)


def test_update_may_skip_the_jacobian(robot, points):
    point, stale = points[0], points[0].jacobian.copy()
    robot.state.position[:] = 0.0
    robot.update()
    point.update(False)
    assert_array_equal(point.value, robot.kinematics.position("arm1_7"))
    assert_array_equal(point.jacobian, stale)
    point.update()
    assert np.abs(point.jacobian - robot.kinematics.jacobian("arm1_7")[:3]).max() < 1e-12


def test_sizes_are_those_of_value_and_jacobian(robot, points):
    for point in points:
        assert point.value.shape == (point.size,) == (3,)
        assert point.jacobian.shape == (point.rows, point.cols) == (3, robot.size)


def test_assignment_copies_value_and_jacobian(points):
    point, other = points
    assert point.assign(other) is point
    assert_array_equal(point.value, other.value)
    assert_array_equal(point.jacobian, other.jacobian)


@pytest.mark.parametrize("sign", [1.0, -1.0], ids=["plus", "minus"])
def test_sums_and_differences_are_new_points(points, sign):
    point, other = points
    value, jacobian = point.value.copy(), point.jacobian.copy()
    result = point + other if sign > 0 else point - other
    result.update()
    assert result is not point
    assert_array_equal(result.value, value + sign * other.value)
    assert_array_equal(result.jacobian, jacobian + sign * other.jacobian)
    assert_array_equal(point.value, value)


@pytest.mark.parametrize("sign", [1.0, -1.0], ids=["plus", "minus"])
def test_accumulation_changes_the_point_itself(points, sign):
    point, other = points
    same, value, jacobian = point, point.value.copy(), point.jacobian.copy()
    if sign > 0:
        point += other
    else:
        point -= other
    assert point is same
    assert_array_equal(point.value, value + sign * other.value)
    assert_array_equal(point.jacobian, jacobian + sign * other.jacobian)
