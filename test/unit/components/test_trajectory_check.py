"""Trajectories are checked whole, and what is wrong is named."""

from dataclasses import replace

import numpy as np
import pytest

from solfer.components.trajectories.check import (
    StaleTrajectory,
    TrajectoryCheck,
)
from solfer.errors import ComponentError, NotFinite, SizeMismatch, UnknownName
from solfer.interfaces.trajectories import JointTolerance, JointTrajectory, TrajectoryHeader, TrajectoryPoint

NAN = float("nan")
CHECK = TrajectoryCheck(
    ("hip", "knee", "ankle"),
    np.array([-1.0, -2.0, -np.inf]),
    np.array([1.0, 2.0, np.inf]),
    np.array([2.0, 3.0, 1.0]),
    np.array([0.0, 0.0, 2.0 * np.pi]),
)
GOOD = JointTrajectory(
    joint_names=("knee", "hip"),
    points=(
        TrajectoryPoint((0.5, 0.2), (0.1, 0.0), time_from_start=1.0),
        TrajectoryPoint((1.0, 0.4), (0.0, 0.0), time_from_start=2.0),
    ),
)


def motion(trajectory, start=(0.0, 0.0), velocity=(0.0, 0.0), now=0.0):
    """Check a trajectory; return its motion and its time."""
    places = CHECK.places(trajectory.joint_names)
    elapsed = CHECK.elapsed(trajectory, now)
    place = np.array(start)
    return CHECK.motion(trajectory, places, place, np.array(velocity), measured=place, elapsed=elapsed), elapsed


def changed(point, **fields):
    """Return the good trajectory with another point."""
    points = list(GOOD.points)
    points[point] = replace(points[point], **fields)
    return replace(GOOD, points=tuple(points))


def test_a_good_trajectory_makes_a_motion():
    found, time = motion(GOOD)
    position, velocity = np.zeros(2), np.zeros(2)
    found.at(1.0, position, velocity)
    assert position.tolist() == [0.5, 0.2] and velocity.tolist() == [0.1, 0.0] and time == 0.0 and found.end == 2.0


@pytest.mark.parametrize(
    "trajectory, error, parts",
    [
        (replace(GOOD, joint_names=("knie", "hip")), UnknownName, ("knie", "knee")),
        (replace(GOOD, joint_names=("hip", "hip")), ComponentError, ("'hip' is given twice",)),
        (replace(GOOD, joint_names=()), ComponentError, ("names no joint",)),
        (changed(1, time_from_start=1.0), ComponentError, ("point 2", "increase")),
        (changed(0, time_from_start=-0.5), ComponentError, ("point 1", "from 0 s")),
        (changed(1, time_from_start=NAN), NotFinite, ("a time",)),
        (changed(1, positions=(1.0,)), SizeMismatch, ("1 positions for 2 joints at point 2",)),
        (changed(1, velocities=()), SizeMismatch, ("0 velocities for 2 joints at point 2",)),
        (changed(0, positions=(0.5, NAN)), NotFinite, ("positions of joint 'hip' at point 1",)),
        (changed(0, velocities=(NAN, 0.0)), NotFinite, ("velocities of joint 'knee' at point 1",)),
        (changed(1, positions=(1.0, 1.5)), ComponentError, ("position 1.5", "'hip'", "-1 to 1 rad")),
        (changed(0, time_from_start=0.1), ComponentError, ("speed", "'knee'", "at most 3 rad/s")),
        (changed(1, velocities=(0.0, 0.3)), ComponentError, ("'hip' moves at 0.3", "come to rest")),
        (changed(0, effort=(1.0, 0.0)), ComponentError, ("efforts",)),
        (changed(0, positions=(), velocities=()), SizeMismatch, ("0 positions for 2 joints at point 1",)),
        (replace(GOOD, points=GOOD.points[:1] * 1001), ComponentError, ("1001 points",)),
        (
            replace(GOOD, header=TrajectoryHeader(1000.0)),
            ComponentError,
            ("stamped 1000.000 s, and now it is 0.000 s", "60 s ahead"),
        ),
    ],
)
def test_a_wrong_trajectory_is_refused(trajectory, error, parts):
    with pytest.raises(error) as caught:
        motion(trajectory)
    for part in parts:
        assert part in str(caught.value)


def test_accelerations_need_velocities():
    points = tuple(replace(point, velocities=(), accelerations=(0.0, 0.0)) for point in GOOD.points)
    with pytest.raises(ComponentError, match="without velocities"):
        motion(replace(GOOD, points=points))


def test_a_limit_counts_between_points_too():
    points = (
        TrajectoryPoint((0.9, 0.0), (1.5, 0.0), time_from_start=1.0),
        TrajectoryPoint((0.9, 0.0), (0.0, 0.0), time_from_start=2.0),
    )
    with pytest.raises(ComponentError, match="beyond the limits of joint 'hip'"):
        motion(replace(GOOD, joint_names=("hip", "knee"), points=points))


def test_a_joint_beyond_its_limit_may_come_back():
    found, _ = motion(GOOD, start=(2.1, 0.0))
    assert found.end == 2.0


def test_points_that_have_passed_are_left_out():
    late = replace(GOOD, header=TrajectoryHeader(100.0))
    found, time = motion(late, start=(0.6, 0.3), now=101.5)
    position, velocity = np.zeros(2), np.zeros(2)
    found.at(time, position, velocity)
    assert time == 1.5 and position.tolist() == [0.6, 0.3]
    with pytest.raises(StaleTrajectory, match="5 s ago"):
        motion(late, now=107.0)


@pytest.mark.parametrize("now, off", [(0.0, 0.0), (0.0, 5e-3), (107.0, 0.0)])
def test_a_trajectory_whose_end_is_reached_stays_there(now, off):
    point = replace(GOOD.points[-1], time_from_start=2.0 if now else 0.0)
    there = replace(GOOD, header=TrajectoryHeader(100.0 if now else 0.0), points=(point,))
    found, time = motion(there, start=(1.0 + off, 0.4), now=now)
    position, velocity = np.zeros(2), np.zeros(2)
    for passed in (0.0, 1.0):
        found.at(time + passed, position, velocity)
        assert position.tolist() == [1.0 + off, 0.4] and not velocity.any()


@pytest.mark.parametrize("start, velocity", [((1.0, 0.5), (0.0, 0.0)), ((1.0, 0.4), (0.1, 0.0))])
def test_an_end_that_has_passed_elsewhere_is_refused(start, velocity):
    with pytest.raises(StaleTrajectory, match="0 s ago"):
        motion(replace(GOOD, points=(replace(GOOD.points[-1], time_from_start=0.0),)), start, velocity)


def test_tolerances_belong_to_the_trajectory():
    given = (JointTolerance("hip", 0.1, -1.0), JointTolerance("knee", 0.0, 0.2))
    position, velocity = CHECK.tolerances(given, GOOD.joint_names)
    assert position.tolist() == [np.inf, 0.1] and velocity.tolist() == [0.2, np.inf]


@pytest.mark.parametrize(
    "tolerance, error, part",
    [
        (JointTolerance("ankle", 0.1), UnknownName, "ankle"),
        (JointTolerance("hip", NAN), NotFinite, "hip"),
        (JointTolerance("hip", -2.0), ComponentError, "-2"),
        (JointTolerance("hip", acceleration=1.0), ComponentError, "not measured"),
    ],
)
def test_a_wrong_tolerance_is_refused(tolerance, error, part):
    with pytest.raises(error, match=part):
        CHECK.tolerances((tolerance,), GOOD.joint_names)
