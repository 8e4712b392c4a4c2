"""A floating base as six plain numbers."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from solfer.numerics.rotations import quaternion_from_rotation, rotation_from_quaternion

# All but the last of these functions are compiled as well (`solfer.numerics.twist_transport`).


def angles_of(rotation):
    """Compute rx, ry, rz [rad] of the rotation Rx(rx) Ry(ry) Rz(rz), nine numbers row by row."""
    cosine = math.hypot(rotation[0], rotation[1])
    ry = math.atan2(rotation[2], cosine)
    if cosine > 1e-9:
        return math.atan2(-rotation[5], rotation[8]), ry, math.atan2(-rotation[1], rotation[0])
    return math.atan2(rotation[7], rotation[4]), ry, 0.0


def rotation_of(rx, ry, rz):
    """Compute Rx(rx) Ry(ry) Rz(rz), nine numbers row by row."""
    cx = math.cos(rx)
    sx = math.sin(rx)
    cy = math.cos(ry)
    sy = math.sin(ry)
    cz = math.cos(rz)
    sz = math.sin(rz)
    return (
        cy * cz,
        -cy * sz,
        sy,
        cx * sz + sx * sy * cz,
        cx * cz - sx * sy * sz,
        -sx * cy,
        sx * sz - cx * sy * cz,
        sx * cz + cx * sy * sz,
        cx * cy,
    )


def rates_of(rx, ry, wx, wy, wz):
    """Compute rates of the three angles [rad/s] from an angular velocity in the axes of the chart's origin."""
    cx = math.cos(rx)
    sx = math.sin(rx)
    cy = math.cos(ry)
    sy = math.sin(ry)
    if abs(cy) < 1e-3:  # |ry| is closer than 0.06 degrees to pi/2
        cy = math.copysign(1e-3, cy)
    yaw = (cx * wz - sx * wy) / cy
    return wx - sy * yaw, cx * wy + sx * wz, yaw


def angular_of(rx, ry, roll, pitch, yaw):
    """Compute the angular velocity in the axes of the chart's origin [rad/s] from the rates of the three angles."""
    cx = math.cos(rx)
    sx = math.sin(rx)
    cy = math.cos(ry)
    return roll + math.sin(ry) * yaw, cx * pitch - sx * cy * yaw, sx * pitch + cx * cy * yaw


def moment_of(rx, ry, tx, ty, tz):
    """Compute the moment in the axes of the chart's origin [Nm] of efforts along the three angles: G^T t.

    Angular velocities w make rates G w, see `rates_of`.
    """
    cx = math.cos(rx)
    sx = math.sin(rx)
    cy = math.cos(ry)
    if abs(cy) < 1e-3:
        cy = math.copysign(1e-3, cy)
    along = (tz - math.sin(ry) * tx) / cy
    return tx, cx * ty - sx * along, sx * ty + cx * along


class BaseChart:
    """Position and orientation of a floating base as q = (x, y, z, rx, ry, rz) [m, rad], behind a fixed origin.

    With the origin's pose (p_o, R_o) in the world, the base is at p_o + R_o (x, y, z) and is rotated by
    R_o Rx(rx) Ry(ry) Rz(rz). The chart is singular at |ry| = pi/2, where rx and rz turn about the same axis: there
    `from_pose` sets rz to zero, and rates that belong to a twist are computed with |cos(ry)| >= 1e-3.

    Args:
        position: Position of the origin in the world, shape (3,) [m].
        rotation: Rotation from the origin to the world, shape (3, 3).
    """

    def __init__(self, position: ArrayLike = (0.0, 0.0, 0.0), rotation: np.ndarray | None = None):
        self.position = np.array(position, dtype=float)
        self.rotation = np.eye(3) if rotation is None else np.array(rotation, dtype=float, order="C")

    def from_pose(self, position: ArrayLike, quaternion: Sequence[float] | np.ndarray, out: np.ndarray) -> np.ndarray:
        """Write the six numbers of a pose.

        Args:
            position: Position of the base in world axes, shape (3,) [m].
            quaternion: Rotation from the base to the world (x, y, z, w), shape (4,).
            out: Result, shape (6,). rx, rz lie in [-pi, pi], ry in [-pi/2, pi/2].

        Raises:
            NotFinite: The quaternion is not an orientation.
        """
        return self.from_rotation(position, rotation_from_quaternion(quaternion), out)

    def from_rotation(self, position: ArrayLike, rotation: np.ndarray, out: np.ndarray) -> np.ndarray:
        """Write the six numbers as `from_pose`, with the rotation matrix from the base to the world, shape (3, 3)."""
        np.matmul(self.rotation.T, position - self.position, out=out[:3])
        out[3:] = angles_of((self.rotation.T @ rotation).ravel().tolist())
        return out

    def to_pose(self, base: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Compute position, shape (3,) [m], and quaternion (x, y, z, w), shape (4,), of the base in the world."""
        return self.position + self.rotation @ base[:3], quaternion_from_rotation(self.to_rotation(base))

    def to_rotation(self, base: np.ndarray) -> np.ndarray:
        """Compute the rotation from the base to the world, shape (3, 3)."""
        return self.rotation @ np.reshape(rotation_of(*base[3:6].tolist()), (3, 3))

    def rates_from_twist(
        self, base: np.ndarray, linear: np.ndarray, angular: np.ndarray, out: np.ndarray
    ) -> np.ndarray:
        """Write the rates of the six numbers that belong to a twist of the base.

        Args:
            base: The six numbers, shape (6,).
            linear: Velocity of the base's origin in world axes, shape (3,) [m/s].
            angular: Angular velocity of the base in world axes, shape (3,) [rad/s].
            out: Result, shape (6,) [m/s, rad/s].
        """
        rx, ry, _ = base[3:6].tolist()
        np.matmul(self.rotation.T, linear, out=out[:3])
        out[3:] = rates_of(rx, ry, *(self.rotation.T @ angular).tolist())
        return out

    def twist_from_rates(self, base: np.ndarray, rates: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Compute linear [m/s] and angular velocity [rad/s] of the base in world axes, shape (3,) each."""
        rx, ry, _ = base[3:6].tolist()
        return self.rotation @ rates[:3], self.rotation @ angular_of(rx, ry, *rates[3:6].tolist())
