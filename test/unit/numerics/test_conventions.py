"""Conventions of rotations other than ours, against SciPy."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from solfer.errors import ConfigError
from solfer.numerics.rotations import (
    QUATERNION_KINDS,
    QUATERNION_ORDERS,
    QuaternionConvention,
    require_rotation,
    rotation_from_angles,
    rotation_from_quaternion,
)

ROTATIONS = Rotation.random(20, random_state=7)


def foreign(rotation: Rotation, order: str, kind: str) -> np.ndarray:
    """Write a quaternion in another convention; JPL's rotates by its transposed Hamilton matrix."""
    same = rotation if kind == "HAMILTONIAN" else rotation.inv()
    return same.as_quat(scalar_first=order == "wxyz")


@pytest.mark.parametrize("order", QUATERNION_ORDERS)
@pytest.mark.parametrize("kind", QUATERNION_KINDS)
def test_quaternions_are_read_and_written_in_every_convention(order, kind):
    convention, ours, theirs = QuaternionConvention(order, kind), np.empty(4), np.empty(4)
    for rotation in ROTATIONS:
        given = foreign(rotation, order, kind)
        convention.read(given, ours)
        assert_allclose(rotation_from_quaternion(ours), rotation.as_matrix(), atol=1e-14)
        assert_allclose(convention.write(ours, theirs), given, atol=1e-15)


@pytest.mark.parametrize("order", QUATERNION_ORDERS)
@pytest.mark.parametrize("kind", QUATERNION_KINDS)
def test_another_convention_is_another_rotation(order, kind):
    if (order, kind) == ("xyzw", "HAMILTONIAN"):
        wrong = QuaternionConvention("wxyz")
    else:
        wrong = QuaternionConvention()
    read = wrong.read(foreign(ROTATIONS[0], order, kind), np.empty(4))
    assert np.abs(rotation_from_quaternion(read) - ROTATIONS[0].as_matrix()).max() > 0.1


@pytest.mark.parametrize("axes", [(0, 1, 2), (0, 2, 1), (1, 0, 2), (1, 2, 0), (2, 0, 1), (2, 1, 0)])
def test_angles_about_moving_axes_in_any_order(axes):
    angles = np.array((0.3, -0.9, 1.7))
    expected = Rotation.from_euler("".join("XYZ"[axis] for axis in axes), angles[list(axes)]).as_matrix()
    assert_allclose(rotation_from_angles(angles, axes), expected, atol=1e-15)


def test_rotation_matrices_are_recognised():
    require_rotation(ROTATIONS[3].as_matrix(), "this")
    with pytest.raises(ConfigError, match="determinant is -1"):
        require_rotation(np.diag((1.0, 1.0, -1.0)), "this")
    with pytest.raises(ConfigError, match="not orthonormal"):
        require_rotation(np.diag((1.0, 1.0, 1.01)), "this")
    with pytest.raises(ConfigError, match="not orthonormal"):
        require_rotation(np.zeros((3, 3)), "this")
