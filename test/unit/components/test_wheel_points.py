"""The Points of `wheeled_motion`: their Jacobians agree with finite differences of their values."""

import json

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.robots import centauro

from solfer.components.wheeled_motion.points import BasePose, Camber, Caster, RollingOffsets
from solfer.points import CenterOfMass, SpatialPoint, SupportVertex
from solfer.tasks.task import updated_in_order

WHEELS = ("wheel_1", "wheel_2", "wheel_3", "wheel_4")
LOWER = 30  # DoFs of the lower body and the base


@pytest.fixture
def robot(repository):
    robot = centauro()
    robot.state.position[:] = json.loads((repository / "test/data/original_wheels.json").read_text())["q0"]
    robot.update()
    return robot


def test_points_agree_with_finite_differences(robot):
    """Angles of wheels, poses of the base and offsets at random postures; lifted wheels add rows of their own."""
    random = np.random.default_rng(3)
    robot.state.position[:LOWER] += random.uniform(-0.2, 0.2, LOWER)
    axes = np.array([(0.0, 0.0, (-1.0) ** index) for index in range(4)])
    pose = SpatialPoint("pelvis", robot)
    vertices = [SupportVertex(link, robot, 0.01, 0.068, axis) for link, axis in zip(WHEELS, axes, strict=True)]
    carriers = [f"ankle2_{index}" for index in (1, 2, 3, 4)]
    angles = [Camber(robot, WHEELS, axes), Caster(robot, carriers, axes[:, [0, 2, 1]])]
    points = [*angles, *(BasePose(robot, pose, CenterOfMass(robot), tracked) for tracked in (False, True))]
    for point in points:
        rows = slice(3, 6) if isinstance(point, BasePose) else slice(None)
        change, jacobian = differences(robot, point, random)
        assert_allclose(jacobian[rows], change[rows], atol=1e-6)
    robot.state.position[3:5] = 0.0  # its heading turns as the base does where that is level
    offsets = RollingOffsets(robot, vertices, axes, pose)
    update(robot, offsets)
    # at its reference the direction of rolling does not matter
    offsets.reference[:] = offsets.states
    for lifted in (False, True):  # across and upwards count where a wheel is lifted
        offsets.lifted[1:3] = lifted
        change, jacobian = differences(robot, offsets, random)
        assert_allclose(jacobian, change, atol=1e-6)


def update(robot, point):
    robot.update()
    for part in updated_in_order(point):
        part.update()


def differences(robot, point, random, step=1e-6):
    """Return how fast a point changes in a random motion, and what its Jacobian says."""
    update(robot, point)
    velocity = random.uniform(-1.0, 1.0, robot.size)
    expected, before = point.jacobian @ velocity, robot.state.position.copy()
    values = []
    for sign in (1.0, -1.0):
        robot.state.position[:] = before + sign * step * velocity
        update(robot, point)
        values.append(point.value.copy())
    robot.state.position[:] = before
    update(robot, point)
    return (values[0] - values[1]) / (2.0 * step), expected
