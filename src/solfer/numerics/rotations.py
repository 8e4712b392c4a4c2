"""Rotations: Hamilton quaternions (x, y, z, w), roll, pitch and yaw of URDF, and other conventions."""

import math
from collections.abc import Sequence

import numpy as np

from solfer.errors import ConfigError, NotFinite, PipeError

QUATERNION_ORDERS = ("xyzw", "wxyz")
"""Orders in which the four numbers of a quaternion are written."""

QUATERNION_KINDS = ("HAMILTONIAN", "JPL")
"""Quaternions with i j = k, which rotate vectors as q v q*, and those with j i = k, which rotate them as q* v q.

The same rotation has opposite vector parts in the two kinds. Source: J. Sola, "Quaternion kinematics for the
error-state Kalman filter", arXiv:1711.02508, section 3.
"""

UNIT_TOLERANCE = 1e-2
"""Largest deviation of the square of an external quaternion's length from one, as in tf2; it is made one."""


def rotation_from_rpy(rpy: Sequence[float] | np.ndarray) -> np.ndarray:
    """Compute the rotation matrix Rz(yaw) Ry(pitch) Rx(roll) of a URDF's `rpy` [rad], shape (3, 3)."""
    roll, pitch, yaw = rpy
    cr = math.cos(roll)
    sr = math.sin(roll)
    cp = math.cos(pitch)
    sp = math.sin(pitch)
    cy = math.cos(yaw)
    sy = math.sin(yaw)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def rotation_from_quaternion(quaternion: Sequence[float] | np.ndarray) -> np.ndarray:
    """Compute the rotation matrix of a quaternion (x, y, z, w) of any length but zero, shape (3, 3).

    Raises:
        NotFinite: The quaternion is zero or not finite, so that it stands for no rotation.
    """
    x, y, z, w = map(float, quaternion)
    square = x * x + y * y + z * z + w * w
    if not 0.0 < square < math.inf:
        raise NotFinite(f"({x:g}, {y:g}, {z:g}, {w:g}) is not an orientation", expected="a quaternion of length 1")
    scale = 2.0 / square
    return np.array(
        [
            [1.0 - scale * (y * y + z * z), scale * (x * y - z * w), scale * (x * z + y * w)],
            [scale * (x * y + z * w), 1.0 - scale * (x * x + z * z), scale * (y * z - x * w)],
            [scale * (x * z - y * w), scale * (y * z + x * w), 1.0 - scale * (x * x + y * y)],
        ]
    )


def is_unit(quaternion: Sequence[float]) -> bool:
    """Return whether an external quaternion has about the length 1, so that it stands for an orientation."""
    return abs(sum(number * number for number in quaternion) - 1.0) <= UNIT_TOLERANCE


def normalize(quaternions: np.ndarray) -> bool:
    """Give external quaternions, shape (4,) or (n, 4), the length 1, in place; return whether one was inexact.

    Raises:
        PipeError: One has not about this length, or is not finite.
    """
    if quaternions.ndim > 1:
        return any([normalize(quaternion) for quaternion in quaternions])
    norm = math.hypot(*quaternions.tolist())
    deviation = abs(norm * norm - 1.0)
    if not deviation <= UNIT_TOLERANCE:
        raise PipeError(f"an orientation with norm {norm:.6g}", expected="a unit quaternion")
    quaternions /= norm
    return deviation > 1e-3  # more than the rounding of numbers of 32 bits, or of three digits


class QuaternionConvention:
    """Notation in which another system writes a quaternion that rotates between the same two frames.

    Args:
        order: One of QUATERNION_ORDERS.
        kind: One of QUATERNION_KINDS.

    Attributes:
        is_ours: Whether it is that of a Hamilton quaternion (x, y, z, w).
    """

    def __init__(self, order: str = "xyzw", kind: str = "HAMILTONIAN"):
        self.is_ours = order == "xyzw" and kind == "HAMILTONIAN"
        self._indices = np.array((0, 1, 2, 3) if order == "xyzw" else (1, 2, 3, 0))
        self._signs = np.array((1.0, 1.0, 1.0, 1.0) if kind == "HAMILTONIAN" else (-1.0, -1.0, -1.0, 1.0))

    def read(self, quaternion: np.ndarray, out: np.ndarray) -> np.ndarray:
        """Write the Hamilton quaternion (x, y, z, w) of an external one into `out`; shape (4,) each, not the same."""
        if self.is_ours:
            out[...] = quaternion
            return out
        np.take(quaternion, self._indices, out=out, mode="clip")
        return np.multiply(out, self._signs, out=out)

    def write(self, quaternion: np.ndarray, out: np.ndarray) -> np.ndarray:
        """Write the external quaternion of a Hamilton one (x, y, z, w) into `out`; shape (4,) each, not the same."""
        if self.is_ours:
            out[...] = quaternion
            return out
        out[self._indices] = quaternion
        out[self._indices] *= self._signs
        return out


def quaternion_product(
    left: Sequence[float] | np.ndarray, right: Sequence[float] | np.ndarray
) -> tuple[float, float, float, float]:
    """Multiply two quaternions of plain numbers, each of length 4."""
    ax, ay, az, aw = left
    bx, by, bz, bw = right
    return (
        aw * bx + bw * ax + ay * bz - az * by,
        aw * by + bw * ay + az * bx - ax * bz,
        aw * bz + bw * az + ax * by - ay * bx,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def rotated(
    vector: Sequence[float] | np.ndarray, quaternion: Sequence[float] | np.ndarray
) -> tuple[float, float, float]:
    """Rotate a vector of plain numbers, of length 3, by a unit quaternion: v + 2 w (u x v) + 2 u x (u x v)."""
    vx, vy, vz = vector
    ux, uy, uz, w = quaternion
    tx = 2.0 * (uy * vz - uz * vy)
    ty = 2.0 * (uz * vx - ux * vz)
    tz = 2.0 * (ux * vy - uy * vx)
    return (
        vx + w * tx + uy * tz - uz * ty,
        vy + w * ty + uz * tx - ux * tz,
        vz + w * tz + ux * ty - uy * tx,
    )


def rotation_from_angles(angles: Sequence[float] | np.ndarray, axes: Sequence[int]) -> np.ndarray:
    """Compute the rotation matrix of three angles about the moving axes x, y, z, shape (3, 3).

    Args:
        angles: Angles about x, y and z [rad].
        axes: Order in which the frame is turned, a permutation of 0, 1, 2: (0, 1, 2) is Rx Ry Rz, (2, 1, 0) is
            Rz Ry Rx, which are roll, pitch and yaw of a URDF.
    """
    rotation = np.eye(3)
    for axis in axes:
        rotation = rotation @ _about_axis(axis, angles[axis])
    return rotation


def _about_axis(axis: int, angle: float) -> np.ndarray:
    rotation = np.eye(3)
    i = (axis + 1) % 3
    j = (axis + 2) % 3
    rotation[i, i] = rotation[j, j] = math.cos(angle)
    rotation[j, i] = math.sin(angle)
    rotation[i, j] = -rotation[j, i]
    return rotation


def cross(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Compute the cross product of two vectors, shape (3,) each; twenty times as fast as `numpy.cross`."""
    (a, b, c), (x, y, z) = left.tolist(), right.tolist()
    return np.array((b * z - c * y, c * x - a * z, a * y - b * x))


def require_rotation(matrix: np.ndarray, what: str) -> None:
    """Check that a matrix, shape (3, 3), is orthonormal with the determinant 1.

    Raises:
        ConfigError: It is not; the error contains the reason, and calls it `what`.
    """
    error = float(np.abs(matrix.T @ matrix - np.eye(3)).max())
    if not error <= 1e-6:
        raise ConfigError(
            f"{what} is not a rotation: its columns are not orthonormal, R^T R is {error:.3g} off",
            expected="columns of length 1 that are orthogonal to each other",
        )
    if np.linalg.det(matrix) < 0.0:
        raise ConfigError(f"{what} is not a rotation: its determinant is -1", expected="a right-handed matrix")


def quaternion_from_rotation(rotation: np.ndarray) -> np.ndarray:
    """Compute the unit quaternion (x, y, z, w), w >= 0, of a rotation matrix, shape (4,).

    Source: S. W. Shepperd, "Quaternion from Rotation Matrix", Journal of Guidance and Control 1(3), 1978: divide by
    the largest of the four components, which never is small.
    """
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = rotation.tolist()
    largest = max(xx, yy, zz, xx + yy + zz)
    if largest == xx:
        quaternion = (1.0 + xx - yy - zz, yx + xy, zx + xz, zy - yz)
    elif largest == yy:
        quaternion = (yx + xy, 1.0 + yy - xx - zz, zy + yz, xz - zx)
    elif largest == zz:
        quaternion = (zx + xz, zy + yz, 1.0 + zz - xx - yy, yx - xy)
    else:
        quaternion = (zy - yz, xz - zx, yx - xy, 1.0 + xx + yy + zz)
    x, y, z, w = quaternion
    length = math.copysign(math.hypot(x, y, z, w), w)
    return np.array((x / length, y / length, z / length, w / length))


def rotation_onto(axis: Sequence[float] | np.ndarray) -> np.ndarray:
    """Compute a rotation whose z is along an axis of any length but zero, shape (3, 3)."""
    z = np.asarray(axis) / np.linalg.norm(axis)
    x = np.cross((0.0, 1.0, 0.0) if abs(z[1]) < 0.9 else (0.0, 0.0, 1.0), z)
    x /= np.linalg.norm(x)
    return np.column_stack((x, np.cross(z, x), z))


def whole_revolutions(displacements: np.ndarray, revolutions: np.ndarray) -> np.ndarray:
    """Return whole revolutions in displacements, shape (..., n) [rad]: without them, none is longer than half of one.

    Args:
        displacements: Differences of positions, shape (..., n) [rad, m].
        revolutions: Angle after which each joint is where it was [rad]; 0: there is none.
    """
    return np.asarray(revolutions * np.rint(displacements / np.where(revolutions > 0.0, revolutions, 1.0)))
