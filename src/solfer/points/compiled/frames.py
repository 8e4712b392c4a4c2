"""Frames that others are seen from: points in the axes of a frame, level frames, and directions of sight."""

import math

from numba import carray, njit

from solfer.points.compiled.instruction import (
    SMALLEST_LENGTH,
    columns_of,
    floats,
    jacobian_of,
    numbers_of,
    value_of,
)
from solfer.points.compiled.registry import kernel
from solfer.points.compiled.rigid import quaternion


@njit
def _axes(q):
    """Return the columns of the rotation of a unit quaternion (x, y, z, w), one below the other."""
    x = q[0]
    y = q[1]
    z = q[2]
    w = q[3]
    return (
        1.0 - 2.0 * (y * y + z * z),
        2.0 * (x * y + w * z),
        2.0 * (x * z - w * y),
        2.0 * (x * y - w * z),
        1.0 - 2.0 * (x * x + z * z),
        2.0 * (y * z + w * x),
        2.0 * (x * z + w * y),
        2.0 * (y * z - w * x),
        1.0 - 2.0 * (x * x + y * y),
    )


@njit
def _into(r, x, y, z):
    """Rotate a vector from the world into the axes r."""
    return (
        r[0] * x + r[1] * y + r[2] * z,
        r[3] * x + r[4] * y + r[5] * z,
        r[6] * x + r[7] * y + r[8] * z,
    )


@njit
def _entry(address, index):
    """Return an entry of an operand's Jacobian; zero where it has none."""
    return carray(floats(address), (index + 1,))[index] if address else 0.0


@njit
def _column(address, first, k, dofs):
    """Return the three rows from row `first` on of an operand's Jacobian in column k."""
    start = first * dofs + k
    return _entry(address, start), _entry(address, start + dofs), _entry(address, start + 2 * dofs)


@kernel
def relative(row, program, with_jacobian):
    """Compute position, orientation or pose of the first operand in the axes of the second one, a pose."""
    size = row.first_size
    value = value_of(row)
    a = carray(floats(row.first), (size,))
    b = carray(floats(row.second), (7,))
    r = _axes(b[3:])
    linear = size != 4
    angular = size != 3
    dx = dy = dz = 0.0
    if linear:
        dx = a[0] - b[0]
        dy = a[1] - b[1]
        dz = a[2] - b[2]
        value[0], value[1], value[2] = _into(r, dx, dy, dz)
    if angular:
        _rotate_back(a[size - 4 :], b[3:], value[size - 4 :])
    if not with_jacobian:
        return
    dofs = program.dofs
    jacobian = jacobian_of(row, program)
    rotating = 3 if linear else 0
    for k in columns_of(row):
        wx, wy, wz = _column(row.second_jacobian, 3, k, dofs)
        if linear:
            ax, ay, az = _column(row.first_jacobian, 0, k, dofs)
            bx, by, bz = _column(row.second_jacobian, 0, k, dofs)
            x, y, z = _into(r, ax - bx - wy * dz + wz * dy, ay - by - wz * dx + wx * dz, az - bz - wx * dy + wy * dx)
            jacobian[k] = x
            jacobian[dofs + k] = y
            jacobian[2 * dofs + k] = z
        if angular:
            ax, ay, az = _column(row.first_jacobian, rotating, k, dofs)
            x, y, z = _into(r, ax - wx, ay - wy, az - wz)
            first = rotating * dofs + k
            jacobian[first] = x
            jacobian[first + dofs] = y
            jacobian[first + 2 * dofs] = z


@njit
def _rotate_back(a, b, out):
    """Write the quaternion a as seen from b, w >= 0."""
    w = b[3] * a[3] + b[0] * a[0] + b[1] * a[1] + b[2] * a[2]
    sign = -1.0 if w < 0.0 else 1.0
    out[0] = sign * (b[3] * a[0] - b[0] * a[3] - b[1] * a[2] + b[2] * a[1])
    out[1] = sign * (b[3] * a[1] - b[1] * a[3] - b[2] * a[0] + b[0] * a[2])
    out[2] = sign * (b[3] * a[2] - b[2] * a[3] - b[0] * a[1] + b[1] * a[0])
    out[3] = sign * w


@kernel
def level(row, program, with_jacobian):
    """Update a frame whose z is a normal n, at the first operand, a pose; see `solfer.points.frames`.

    Parameters: an axis in the frame of the operand (3), n (3), the height along n (1), whether the origin goes down to
    that height (1), and whether the axis gives y instead of x (1).
    """
    value = value_of(row)
    numbers = numbers_of(row, 9)
    a = carray(floats(row.first), (7,))
    q = _axes(carray(floats(row.first), (7,))[3:])
    nx = numbers[3]
    ny = numbers[4]
    nz = numbers[5]
    falls = numbers[7]
    crosses = numbers[8]
    ux = q[0] * numbers[0] + q[3] * numbers[1] + q[6] * numbers[2]
    uy = q[1] * numbers[0] + q[4] * numbers[1] + q[7] * numbers[2]
    uz = q[2] * numbers[0] + q[5] * numbers[1] + q[8] * numbers[2]
    along = ux * nx + uy * ny + uz * nz
    tx = ux - along * nx
    ty = uy - along * ny
    tz = uz - along * nz
    square = tx * tx + ty * ty + tz * tz
    # an axis along the normal has no heading: the frame keeps its last one
    if square > SMALLEST_LENGTH**2:
        scale = 1.0 / math.sqrt(square)
        fx = tx * scale
        fy = ty * scale
        fz = tz * scale
        if crosses != 0.0:
            fx, fy, fz = fy * nz - fz * ny, fz * nx - fx * nz, fx * ny - fy * nx
        _write_frame(fx, fy, fz, nx, ny, nz, value[3:])
    shift = falls * (a[0] * nx + a[1] * ny + a[2] * nz - numbers[6])
    value[0], value[1], value[2] = a[0] - shift * nx, a[1] - shift * ny, a[2] - shift * nz
    if not with_jacobian:
        return
    dofs = program.dofs
    jacobian = jacobian_of(row, program)
    tilt = along / square if square > SMALLEST_LENGTH**2 else 0.0
    for k in columns_of(row):
        x, y, z = _column(row.first_jacobian, 0, k, dofs)
        drop = falls * (x * nx + y * ny + z * nz)
        jacobian[k], jacobian[dofs + k], jacobian[2 * dofs + k] = x - drop * nx, y - drop * ny, z - drop * nz
        x, y, z = _column(row.first_jacobian, 3, k, dofs)
        yaw = x * nx + y * ny + z * nz - tilt * (x * tx + y * ty + z * tz)
        jacobian[3 * dofs + k], jacobian[4 * dofs + k], jacobian[5 * dofs + k] = yaw * nx, yaw * ny, yaw * nz


@njit
def _write_frame(x, y, z, nx, ny, nz, out):
    """Write the quaternion of the frame with these x and z axes."""
    columns = (x, y, z, ny * z - nz * y, nz * x - nx * z, nx * y - ny * x, nx, ny, nz)
    qx, qy, qz, qw = quaternion(columns)
    sign = -1.0 if qw < 0.0 else 1.0
    out[0], out[1], out[2], out[3] = sign * qx, sign * qy, sign * qz, sign * qw


@kernel
def sight(row, program, with_jacobian):
    """Compute the direction from the first operand, a pose, to the second one, a position, in the axes of the pose."""
    value = value_of(row)
    a = carray(floats(row.first), (7,))
    b = carray(floats(row.second), (3,))
    r = _axes(a[3:])
    dx = b[0] - a[0]
    dy = b[1] - a[1]
    dz = b[2] - a[2]
    length = math.sqrt(dx * dx + dy * dy + dz * dz)
    # a target at the origin is in no direction
    scale = 1.0 / length if length > SMALLEST_LENGTH else 0.0
    dx = dx * scale
    dy = dy * scale
    dz = dz * scale
    value[0], value[1], value[2] = _into(r, dx, dy, dz)
    if not with_jacobian:
        return
    dofs = program.dofs
    jacobian = jacobian_of(row, program)
    for k in columns_of(row):
        ax, ay, az = _column(row.first_jacobian, 0, k, dofs)
        bx, by, bz = _column(row.second_jacobian, 0, k, dofs)
        wx, wy, wz = _column(row.first_jacobian, 3, k, dofs)
        x = scale * (bx - ax)
        y = scale * (by - ay)
        z = scale * (bz - az)
        along = x * dx + y * dy + z * dz
        x = x - along * dx
        y = y - along * dy
        z = z - along * dz
        x, y, z = _into(r, x - wy * dz + wz * dy, y - wz * dx + wx * dz, z - wx * dy + wy * dx)
        jacobian[k] = x
        jacobian[dofs + k] = y
        jacobian[2 * dofs + k] = z


@kernel
def base_pose(row, program, with_jacobian):
    """Write the position of the first operand, a pose, or x and y of the second one, if there is one, behind zeros.

    The rows are those of the angular velocity, then of the position.
    """
    value = value_of(row)
    pose = carray(floats(row.first), (7,))
    value[:3], value[3:] = 0.0, pose[:3]
    has_center = row.second != 0
    if has_center:
        value[3:5] = carray(floats(row.second), (3,))[:2]
    if not with_jacobian:
        return
    dofs = program.dofs
    jacobian = jacobian_of(row, program)
    for k in columns_of(row):
        x, y, z = _column(row.first_jacobian, 3, k, dofs)
        jacobian[k] = x
        jacobian[dofs + k] = y
        jacobian[2 * dofs + k] = z
        x, y, z = _column(row.first_jacobian, 0, k, dofs)
        if has_center:
            x, y, _ = _column(row.second_jacobian, 0, k, dofs)
        jacobian[3 * dofs + k] = x
        jacobian[4 * dofs + k] = y
        jacobian[5 * dofs + k] = z
