"""The height map on ground that is known: the base is as high as its wheels have measured."""

import math

import numpy as np
import pytest

from solfer.components.odometry.ground.height_kernel import FLOOR_TOLERANCE
from solfer.components.odometry.ground.height_map import HeightMap

PERIOD, SPEED, RADIUS, HEIGHT = 0.005, 0.3, 0.078, 0.6
PLACES = np.array(((0.55, 0.3), (0.55, -0.3), (-0.55, 0.3), (-0.55, -0.3)))
ALL, UP = np.ones(4), np.array((0.0, 0.0, 1.0))


def ridge(slope, length=3.0, top=2.0, begin=1.5):
    """Return the height of a ridge at a place along it [m], which is level before, on its top and behind."""
    edges = np.cumsum((begin, length, top, length))
    return lambda x: np.interp(x, edges, slope * np.array((0.0, length, length, 0.0)))


def drive(profile, way, velocity=(SPEED, 0.0), tilt=0.0, weights=ALL):
    """Drive over ground with a height at x [m], the tilt wrong by `tilt` [rad]; return the errors of the height [m].

    Joints and IMU measure how high wheels are against each other; the base is at their mean. Nothing measures its
    height: each cycle predicts the one before.
    """
    heights, direction = HeightMap(np.full(4, RADIUS)), np.array(velocity)
    heights.start(0.0)
    position, errors = np.array((0.0, 0.0, HEIGHT)), []
    for cycle in range(round(way / SPEED / PERIOD)):
        place = direction * (cycle + 1) * PERIOD
        ground = profile(place[0] + PLACES[:, 0])
        true = HEIGHT + float(ground.mean())
        arms = np.column_stack((PLACES, ground - true - tilt * PLACES[:, 0]))
        position[:2] = place
        missing = heights.missing_height(
            arms, UP, position, 0.0, weights, velocity=np.append(direction, 0.0), yaw_rate=0.0
        )
        raised = 0.0 if math.isnan(missing) else missing
        position[2] += raised
        heights.note(raised, weights)
        errors.append(position[2] - true)
    return np.array(errors), heights


@pytest.mark.slow
@pytest.mark.parametrize("degrees", [3.0, 5.0, 10.0, 15.0, -10.0])
def test_wheels_carry_the_base_over_edges(degrees):
    errors, heights = drive(ridge(math.tan(math.radians(degrees))), 11.0)
    assert np.abs(errors).max() < 2e-3 and heights.level


@pytest.mark.slow
@pytest.mark.parametrize("velocity", [(-SPEED, 0.0), (0.0, SPEED)])
def test_other_directions_work_alike(velocity):
    slope = math.tan(math.radians(10.0))
    if velocity[0] < 0.0:
        hill = ridge(slope)
        errors, _ = drive(lambda x: hill(-x), 11.0, velocity)
    else:  # along a level line nothing rises
        errors, _ = drive(lambda x: 0.0 * x, 5.0, velocity)
    assert np.abs(errors).max() < 1e-3


def test_a_wrong_tilt_counts_by_the_way():
    tilt, way = 1e-3, 4.0
    errors, _ = drive(ridge(math.tan(math.radians(10.0)), length=20.0), way, tilt=tilt)
    # on the slope the ways are measured wrongly by the tilt; before it the floor gives the height
    assert abs(errors[-1]) < 1.5 * tilt * (way - 0.95) + 1e-3


@pytest.mark.slow
def test_a_floor_that_is_uneven_stays_one():
    errors, heights = drive(lambda x: 0.5 * FLOOR_TOLERANCE * np.sin(4.0 * x), 20.0)
    assert heights.floor == 0.0 and np.abs(errors).max() < FLOOR_TOLERANCE


@pytest.mark.slow
def test_a_wheel_that_is_lifted_leaves_no_track():
    weights = np.array((1.0, 1.0, 0.0, 1.0))
    errors, heights = drive(ridge(math.tan(math.radians(10.0))), 11.0, weights=weights)
    assert heights._heads[2] == 0 and np.abs(errors).max() < 2e-3


def test_a_wheel_that_leaves_the_floor_takes_no_base_on_a_step_along():
    """Two wheels on a step have no floor and no track: they have come to rest."""
    heights, position = HeightMap(np.full(4, RADIUS)), np.array((0.0, 0.0, HEIGHT))
    heights.start(0.0)
    for cycle in range(800):
        lift = 1e-4 * max(0, min(cycle - 400, 300))
        arms = np.column_stack((PLACES, np.array((0.1, 0.1, 0.0, lift)) - HEIGHT))
        missing = heights.missing_height(arms, UP, position, 0.0, ALL, velocity=np.zeros(3), yaw_rate=0.0)
        position[2] += missing
        heights.note(missing, ALL)
        assert abs(position[2] - HEIGHT) < 0.3 * FLOOR_TOLERANCE
    assert position[2] == pytest.approx(HEIGHT, abs=1e-6)


def test_tracks_are_forgotten_but_not_the_floor():
    _, heights = drive(lambda x: 0.0 * x, 2.0)
    heights.forget()
    assert not heights._heads.any() and heights.floor == 0.0 and heights.level
