"""Points and frames on rigid bodies."""

import math

from numba import njit

from solfer.points.compiled.instruction import (
    ANGULAR,
    LINEAR,
    columns_of,
    jacobian_of,
    joints_of,
    numbers_of,
    placements_of,
    value_of,
    velocity_of,
)
from solfer.points.compiled.registry import kernel


@njit
def rotated(placement, x, y, z):
    """Rotate a vector of a joint's frame into world axes; a placement is the rotation by columns, then the shift."""
    return (
        placement[0] * x + placement[3] * y + placement[6] * z,
        placement[1] * x + placement[4] * y + placement[7] * z,
        placement[2] * x + placement[5] * y + placement[8] * z,
    )


@njit
def placed(placement, x, y, z):
    """Transform a point of a joint's frame into the world."""
    x, y, z = rotated(placement, x, y, z)
    return x + placement[9], y + placement[10], z + placement[11]


@njit
def linear(column, x, y, z):
    """Compute the velocity of the point (x, y, z) by a column of the joints' Jacobian, given at the world's origin."""
    return (
        column[0] + column[4] * z - column[5] * y,
        column[1] + column[5] * x - column[3] * z,
        column[2] + column[3] * y - column[4] * x,
    )


@njit
def quaternion(r):
    """Compute the quaternion (x, y, z, w) of the rotation whose columns are r[0:3], r[3:6], r[6:9].

    Source: S. W. Shepperd, "Quaternion from Rotation Matrix", Journal of Guidance and Control 1(3), 1978.
    """
    trace = r[0] + r[4] + r[8]
    if trace >= r[0] and trace >= r[4] and trace >= r[8]:
        x = r[5] - r[7]
        y = r[6] - r[2]
        z = r[1] - r[3]
        w = 1.0 + trace
    elif r[0] >= r[4] and r[0] >= r[8]:
        x = 1.0 + 2.0 * r[0] - trace
        y = r[1] + r[3]
        z = r[2] + r[6]
        w = r[5] - r[7]
    elif r[4] >= r[8]:
        x = r[1] + r[3]
        y = 1.0 + 2.0 * r[4] - trace
        z = r[5] + r[7]
        w = r[6] - r[2]
    else:
        x = r[2] + r[6]
        y = r[5] + r[7]
        z = 1.0 + 2.0 * r[8] - trace
        w = r[1] - r[3]
    scale = 1.0 / math.sqrt(x * x + y * y + z * z + w * w)
    return x * scale, y * scale, z * scale, w * scale


@njit
def write_orientation(placement, fixed, out):
    """Write the quaternion of a frame with the constant quaternion `fixed` in a joint's frame; w >= 0."""
    ax, ay, az, aw = quaternion(placement)
    bx = fixed[0]
    by = fixed[1]
    bz = fixed[2]
    bw = fixed[3]
    w = aw * bw - ax * bx - ay * by - az * bz
    sign = -1.0 if w < 0.0 else 1.0
    out[0] = sign * (aw * bx + ax * bw + ay * bz - az * by)
    out[1] = sign * (aw * by - ax * bz + ay * bw + az * bx)
    out[2] = sign * (aw * bz + ax * by - ay * bx + az * bw)
    out[3] = sign * w


@kernel
def place(row, program, with_jacobian):
    """Update point and frame on a link; parameters: point (3) and quaternion of the frame (4) in the joint's frame."""
    _update(row, program, False, with_jacobian)


@kernel
def velocity(row, program, with_jacobian):
    """Update velocities of a point on a link and of the link; parameters as in `place`."""
    _update(row, program, True, with_jacobian)


@njit
def _update(row, program, moving, with_jacobian):
    """Write place or velocity, by `moving`, and the Jacobian, which is the same for both."""
    has_linear = row.motion & LINEAR
    angular = row.motion & ANGULAR
    first = 3 if row.motion & LINEAR else 0
    numbers = numbers_of(row, 7)
    placement = placements_of(program)[row.joint]
    value = value_of(row)
    dofs = program.dofs
    x, y, z = placed(placement, numbers[0], numbers[1], numbers[2])
    if moving:
        value[:] = 0.0
    else:
        if has_linear:
            value[0] = x
            value[1] = y
            value[2] = z
        if angular:
            write_orientation(placement, numbers[3:], value[first:])
    if not (moving or with_jacobian):
        return
    joints = joints_of(program)
    rates = velocity_of(program)
    jacobian = jacobian_of(row, program)
    for k in columns_of(row):
        column = joints[k]
        if has_linear:
            vx, vy, vz = linear(column, x, y, z)
            if with_jacobian:
                jacobian[k] = vx
                jacobian[dofs + k] = vy
                jacobian[2 * dofs + k] = vz
            if moving:
                value[0] += vx * rates[k]
                value[1] += vy * rates[k]
                value[2] += vz * rates[k]
        if angular:
            for i in range(3):
                if with_jacobian:
                    jacobian[(first + i) * dofs + k] = column[3 + i]
                if moving:
                    value[first + i] += column[3 + i] * rates[k]
