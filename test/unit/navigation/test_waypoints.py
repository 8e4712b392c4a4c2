"""The follower of way-points, on a base that integrates its velocities."""

import math

import numpy as np
import pytest

from solfer.errors import SolferError
from solfer_tools.navigation import DriveLimits, Waypoint, WaypointFollower

PERIOD = 0.02  # [s]


def drive(follower, start=(0.0, 0.0, 0.0), lag=0.0, most=600.0, pace=lambda time: 1.0):
    """Drive a base that follows the velocity with a lag [s]; poses and velocities (T, 3)."""
    pose, velocity = np.array(start), np.zeros(3)
    poses, velocities, lefts = [pose.copy()], [np.zeros(3)], []
    while follower.step(tuple(pose), PERIOD, pace(len(lefts) * PERIOD)):
        velocity += (np.array(follower.velocity) - velocity) * (PERIOD / lag if lag else 1.0)
        pose = pose + velocity * PERIOD
        poses.append(pose.copy())
        velocities.append(np.array(follower.velocity))
        lefts.append(follower.left)
        assert len(lefts) * PERIOD < most, "it does not arrive"
    return np.array(poses), np.array(velocities), np.array(lefts)


def distance_to(polygon, places):
    """Return the distances of places from a polygon."""
    distances = []
    for (x0, y0), (x1, y1) in zip(polygon, polygon[1:], strict=False):
        way = np.array((x1 - x0, y1 - y0))
        share = np.clip(((places - (x0, y0)) @ way) / (way @ way), 0.0, 1.0)
        distances.append(np.linalg.norm(places - (x0, y0) - share[:, None] * way, axis=1))
    return np.min(distances, axis=0)


@pytest.mark.parametrize("lag", [0.0, 0.15])
@pytest.mark.parametrize("seed", range(6))
def test_it_passes_way_points_and_stops_at_the_last(seed, lag):
    """Random courses, on bases with and without lag: way-points are passed, limits of speed and acceleration kept."""
    random = np.random.default_rng(seed)
    limits = DriveLimits(random.uniform(0.1, 1.0), random.uniform(0.1, 0.5), 0.5, random.uniform(0.2, 0.5))
    places = random.uniform(-2.0, 2.0, (int(random.integers(1, 5)), 2))
    headings = [float(random.uniform(-3.0, 3.0)) if random.random() < 0.6 else None for _ in places]
    goals = [Waypoint(*map(float, place), heading) for place, heading in zip(places, headings, strict=True)]
    follower, start = WaypointFollower(goals, limits), random.uniform(-2.0, 2.0, 3)
    poses, velocities, lefts = drive(follower, start, lag)
    assert not any(follower.velocity) and follower.left == 0.0
    assert math.dist(poses[-1, :2], places[-1]) <= WaypointFollower.ARRIVAL_DISTANCE + limits.speed * lag
    if headings[-1] is not None:
        assert abs(math.remainder(poses[-1, 2] - headings[-1], math.tau)) <= WaypointFollower.ARRIVAL_ANGLE + 0.5 * lag
    for place in places:
        assert np.linalg.norm(poses[:, :2] - place, axis=1).min() <= WaypointFollower.PASSING_DISTANCE
    speeds = np.linalg.norm(velocities[:, :2], axis=1)
    assert speeds.max() <= limits.speed + 1e-9 and np.abs(velocities[:, 2]).max() <= limits.turn_speed + 1e-9
    change = np.diff(velocities, axis=0) / PERIOD
    assert np.linalg.norm(change[:, :2], axis=1).max() <= limits.acceleration + 1e-9
    assert np.abs(change[:, 2]).max() <= limits.turn_acceleration + 1e-9
    away = distance_to([start[:2], *places], poses[:, :2])
    assert away.max() <= 3.0 * WaypointFollower.PASSING_DISTANCE


def test_the_time_of_a_straight_way_is_that_of_a_trapezoid():
    """With a deceleration of 0.8 of the limit; the end is slower, and takes less than 4 s more."""
    follower = WaypointFollower([Waypoint(3.0, 0.0)], DriveLimits(0.2, 0.2))
    poses, _, _ = drive(follower)
    shortest = 3.0 / 0.2 + 0.5 * 0.2 / 0.2 + 0.5 * 0.2 / 0.16
    assert shortest - 0.1 < len(poses) * PERIOD < shortest + 4.0
    np.testing.assert_allclose(poses[:, 1:], 0.0, atol=1e-12)


def test_the_time_left_is_about_what_it_takes():
    goals = [Waypoint(2.0, 0.0), Waypoint(2.0, 1.0), Waypoint(0.0, 1.0, 3.0)]
    poses, _, lefts = drive(WaypointFollower(goals, DriveLimits()))
    taken = len(poses) * PERIOD - np.arange(len(lefts)) * PERIOD
    middle = lefts > 3.0
    assert np.all(np.abs(lefts - taken)[middle] <= 0.25 * taken[middle] + 3.0)


def test_it_slows_down_for_a_bend_and_not_for_a_way_that_goes_straight_on():
    goals = [Waypoint(0.1, 0.0), Waypoint(2.0, 0.0), Waypoint(4.0, 0.0), Waypoint(4.0, 2.0)]
    poses, velocities, _ = drive(WaypointFollower(goals, DriveLimits(0.4, 0.4)))
    speeds = np.linalg.norm(velocities[:, :2], axis=1)
    near = [np.linalg.norm(poses[:, :2] - (goal.x, goal.y), axis=1) < 0.08 for goal in goals]
    assert speeds[near[1]].min() > 0.39 and speeds[near[2]].min() < 0.15


def test_at_a_pace_of_zero_it_stops_within_its_acceleration_and_goes_on():
    follower = WaypointFollower([Waypoint(2.0, 0.0)], DriveLimits(0.3, 0.3))
    poses, velocities, _ = drive(follower, pace=lambda time: 0.0 if 3.0 <= time < 6.0 else 1.0)
    times = np.arange(len(velocities)) * PERIOD
    assert np.all(velocities[(times > 4.1) & (times < 6.0)] == 0.0)
    assert np.abs(np.diff(velocities[:, 0])).max() <= 0.3 * PERIOD + 1e-9
    assert math.dist(poses[-1, :2], (2.0, 0.0)) <= WaypointFollower.ARRIVAL_DISTANCE


def test_it_turns_the_short_way():
    _, velocities, _ = drive(WaypointFollower([Waypoint(0.0, 0.0, -3.0)], DriveLimits()), start=(0.0, 0.0, 3.0))
    assert velocities[:, 2].min() >= 0.0 and velocities[:, 2].max() > 0.05


def test_a_base_that_is_there_does_not_move():
    poses, _, _ = drive(WaypointFollower([Waypoint(1.0, 2.0, 0.5)], DriveLimits()), start=(1.0, 2.0, 0.5))
    assert len(poses) == 1


@pytest.mark.parametrize("numbers", [(math.nan, 0.0), (0.0, math.inf), (0.0, 0.0, math.nan), (2e4, 0.0)])
def test_a_way_point_has_finite_numbers(numbers):
    with pytest.raises(SolferError, match="way-point"):
        Waypoint(*numbers)


def test_there_has_to_be_a_way_point():
    with pytest.raises(SolferError, match="no way-point"):
        WaypointFollower([], DriveLimits())
