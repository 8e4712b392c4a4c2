"""Rotations in the conventions of this package: Hamilton quaternions (x, y, z, w), URDF roll, pitch, yaw."""

import math
from collections.abc import Sequence

import numpy as np

from solfer.errors import NotFinite


def rotation_from_rpy(rpy: Sequence[float]) -> np.ndarray:
    """Rotation matrix Rz(yaw) Ry(pitch) Rx(roll) of a URDF's `rpy` [rad], shape (3, 3)."""
    roll, pitch, yaw = rpy
    cr, sr, cp, sp, cy, sy = (
        math.cos(roll), math.sin(roll), math.cos(pitch), math.sin(pitch), math.cos(yaw), math.sin(yaw)
    )
    return np.array([
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ])


def rotation_from_quaternion(quaternion: Sequence[float]) -> np.ndarray:
    """Rotation matrix of a quaternion (x, y, z, w) of any length but zero, shape (3, 3).

    Raises:
        NotFinite: The quaternion is zero or not finite, so that it stands for no rotation.
    """
    x, y, z, w = (float(value) for value in quaternion)
    square = x * x + y * y + z * z + w * w
    if not 0.0 < square < math.inf:
        raise NotFinite(f"({x:g}, {y:g}, {z:g}, {w:g}) is no orientation", expected="a quaternion of length 1")
    scale = 2.0 / square
    return np.array([
        [1.0 - scale * (y * y + z * z), scale * (x * y - z * w), scale * (x * z + y * w)],
        [scale * (x * y + z * w), 1.0 - scale * (x * x + z * z), scale * (y * z - x * w)],
        [scale * (x * z - y * w), scale * (y * z + x * w), 1.0 - scale * (x * x + y * y)],
    ])


def quaternion_from_rotation(rotation: np.ndarray) -> np.ndarray:
    """Unit quaternion (x, y, z, w), w >= 0, of a rotation matrix, shape (4,).

    Source: S. W. Shepperd, "Quaternion from Rotation Matrix", Journal of Guidance and Control 1(3), 1978: divide by
    the largest of the four components, which never is small.
    """
    trace = float(np.trace(rotation))
    largest = int(np.argmax((*np.diagonal(rotation), trace)))
    quaternion = np.empty(4)
    if largest == 3:
        quaternion[:3] = (
            rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]
        )
        quaternion[3] = 1.0 + trace
    else:
        i, j, k = largest, (largest + 1) % 3, (largest + 2) % 3
        quaternion[i] = 1.0 + 2.0 * rotation[i, i] - trace
        quaternion[j] = rotation[j, i] + rotation[i, j]
        quaternion[k] = rotation[k, i] + rotation[i, k]
        quaternion[3] = rotation[k, j] - rotation[j, k]
    quaternion /= math.copysign(np.linalg.norm(quaternion), quaternion[3])
    return quaternion
