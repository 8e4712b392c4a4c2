"""Pose and twist of a floating base, compiled: from those of a sensor that it carries, or from its six numbers.

With the pose (p_s, R_s) and the twist (v_s, w_s) of the sensor in the world, and its pose (r, R) and twist (v, w)
against the base in the axes of the base, the base has

    R_b = R_s R^T                    w_b = w_s - R_b w
    p_b = p_s - R_b r                v_b = v_s - w_b x R_b r - R_b v.
"""

import math
from functools import partial
from pathlib import Path

import numpy as np

from solfer.numerics import base_chart as chart
from solfer.numerics.base_chart import BaseChart
from solfer.numerics.compilation import cached, part

# options, as a sum
FROM_POSE = 1
"""The base follows from a pose."""

FROM_TWIST = 2
"""Its rates follow from a twist."""

OWN_AXES = 4
"""The twist is in the axes of the sensor, not of the world."""

WITH_ORIENTATION = 8
"""An orientation is given, by which such a twist is rotated."""

CONTINUOUS = 16
"""Angles continue without jumps by 2 pi."""


class Carried:
    """The base that carries a sensor.

    Args:
        base_chart: Chart of the base.
        values: Readings of the sensor: quaternion (x, y, z, w), position [m], linear [m/s] and angular velocity
            [rad/s], shape (13,).
        mount: Its place on the base: rotation to the base row by row, position [m], linear [m/s] and angular velocity
            [rad/s] in the axes of the base, shape (18,).

    Attributes:
        world: From the sensor's world to ours: rotation row by row, then shift [m], shape (12,).
        base: The six numbers of the base [m, rad], shape (6,).
        rates: Their rates [m/s, rad/s], shape (6,).
        write: write(base, rates, options) computes as `update`, into the first six of other numbers.
        update: update(options) computes `rates`, and `base` where a pose is given; without a pose, `base` is used as it
            is. The options are a sum of FROM_POSE, FROM_TWIST, OWN_AXES, WITH_ORIENTATION, CONTINUOUS.
    """

    def __init__(self, base_chart: BaseChart, values: np.ndarray, mount: np.ndarray):
        self.base = np.zeros(6)
        self.rates = np.zeros(6)
        self.world = np.concatenate((np.eye(3).ravel(), np.zeros(3)))
        self.write = partial(_update, values, mount, self.world, numbers_of(base_chart))
        self.update = partial(self.write, self.base, self.rates)


def numbers_of(base_chart: BaseChart) -> np.ndarray:
    """Return rotation and position of a chart one after the other, shape (12,)."""
    return np.concatenate((base_chart.rotation.ravel(), base_chart.position))


# In the kernel a matrix is nine numbers, row by row.


def _transposed(matrix):
    out = np.empty(9)
    for i in range(3):
        for j in range(3):
            out[3 * i + j] = matrix[3 * j + i]
    return out


def _times(left, right):
    """Multiply two matrices."""
    out = np.empty(9)
    for i in range(3):
        for j in range(3):
            total = 0.0
            for k in range(3):
                total += left[3 * i + k] * right[3 * k + j]
            out[3 * i + j] = total
    return out


def _rotated(matrix, vector):
    """Multiply a matrix and a vector."""
    out = np.empty(3)
    for i in range(3):
        out[i] = matrix[3 * i] * vector[0] + matrix[3 * i + 1] * vector[1] + matrix[3 * i + 2] * vector[2]
    return out


def _matrix(quaternion):
    """Compute the rotation of a quaternion (x, y, z, w), of any length but zero; see `rotation_from_quaternion`."""
    x = quaternion[0]
    y = quaternion[1]
    z = quaternion[2]
    w = quaternion[3]
    scale = 2.0 / (x * x + y * y + z * z + w * w)
    return np.array(
        (
            1.0 - scale * (y * y + z * z),
            scale * (x * y - z * w),
            scale * (x * z + y * w),
            scale * (x * y + z * w),
            1.0 - scale * (x * x + z * z),
            scale * (y * z - x * w),
            scale * (x * z - y * w),
            scale * (y * z + x * w),
            1.0 - scale * (x * x + y * y),
        )
    )


_transposed = part(_transposed)
_times = part(_times)
_rotated = part(_rotated)
_matrix = part(_matrix)
_angles = part(chart.angles_of)
_rates = part(chart.rates_of)
_rotation = part(chart.rotation_of)
_angular = part(chart.angular_of)


def update(values, mount, world, origin, base, rates, options):
    """Update the base; see `Carried.update`."""
    to_chart = _transposed(origin)
    sensor = world
    if options & WITH_ORIENTATION:
        sensor = _times(world, _matrix(values))
    if options & FROM_POSE:
        rotation = _times(sensor, _transposed(mount))
        arm = _rotated(rotation, mount[9:12])
        base[:3] = _rotated(to_chart, _rotated(world, values[4:7]) + world[9:12] - arm - origin[9:12])
        revolution = 2.0 * math.pi
        angles = _angles(_times(to_chart, rotation))
        for place in range(3):
            jump = round((base[3 + place] - angles[place]) / revolution) if options & CONTINUOUS else 0.0
            base[3 + place] = angles[place] + revolution * jump
    else:
        rotation = _times(origin, np.array(_rotation(base[3], base[4], base[5])))
        arm = _rotated(rotation, mount[9:12])
    if options & FROM_TWIST:
        axes = world
        if options & OWN_AXES:
            axes = sensor if options & WITH_ORIENTATION else _times(rotation, mount)
        angular = _rotated(axes, values[10:13]) - _rotated(rotation, mount[15:18])
        linear = _rotated(axes, values[7:10]) - _rotated(rotation, mount[12:15])
        linear[0] -= angular[1] * arm[2] - angular[2] * arm[1]
        linear[1] -= angular[2] * arm[0] - angular[0] * arm[2]
        linear[2] -= angular[0] * arm[1] - angular[1] * arm[0]
        rates[:3] = _rotated(to_chart, linear)
        wx, wy, wz = _rotated(to_chart, angular)
        rates[3], rates[4], rates[5] = _rates(base[3], base[4], wx, wy, wz)


_update = cached(f"void({'float64[::1], ' * 6}int64)", update, sources=[Path(chart.__file__)])


class BaseKinematics:
    """Pose and twist of a floating base in the world, by its six numbers: of its own link without kinematics.

    Args:
        base_chart: Chart of the base.

    Attributes:
        rotation: Rotation from the base to the world, shape (3, 3).
        position: Its position, shape (3,) [m].
        velocity: Linear, then angular velocity in world axes, shape (6,) [m/s, rad/s].
        update: update(base, rates) computes them of the six numbers [m, rad] and their rates, which may be the first
            ones of longer arrays.
    """

    def __init__(self, base_chart: BaseChart):
        self._numbers = np.zeros(18)
        self.rotation = self._numbers[:9].reshape(3, 3)
        self.position = self._numbers[9:12]
        self.velocity = self._numbers[12:]
        self.update = partial(_move, numbers_of(base_chart), self._numbers)


def move(origin, out, base, rates):
    """Compute pose and twist of the base; see `BaseKinematics`."""
    out[:9] = _times(origin, np.array(_rotation(base[3], base[4], base[5])))
    out[9:12] = _rotated(origin, base[:3]) + origin[9:12]
    out[12:15] = _rotated(origin, rates[:3])
    out[15:18] = _rotated(origin, np.array(_angular(base[3], base[4], rates[3], rates[4], rates[5])))


_move = cached(f"void({', '.join(['float64[::1]'] * 4)})", move, sources=[Path(chart.__file__)])


def _read_freedom(position, velocity, place, dof, motion):
    """Write the motion of a body from the numbers of its free joint in MuJoCo.

    Args:
        position: At `place` its position and its quaternion (w, x, y, z).
        velocity: At `dof` its linear velocity, and its angular velocity in its own axes.
        place: See above.
        dof: See above.
        motion: See `RobotInEngine.read_base`.
    """
    w = position[place + 3]
    ux = position[place + 4]
    uy = position[place + 5]
    uz = position[place + 6]
    vx = velocity[dof + 3]
    vy = velocity[dof + 4]
    vz = velocity[dof + 5]
    tx = 2.0 * (uy * vz - uz * vy)
    ty = 2.0 * (uz * vx - ux * vz)
    tz = 2.0 * (ux * vy - uy * vx)
    motion[0], motion[1], motion[2], motion[3] = ux, uy, uz, w
    for axis in range(3):
        motion[4 + axis] = position[place + axis]
        motion[7 + axis] = velocity[dof + axis]
    motion[10] = vx + w * tx + uy * tz - uz * ty
    motion[11] = vy + w * ty + uz * tx - ux * tz
    motion[12] = vz + w * tz + ux * ty - uy * tx


read_freedom = cached("void(float64[::1], float64[::1], int64, int64, float64[::1])", _read_freedom)
