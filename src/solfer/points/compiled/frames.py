"""Frames that others are seen from: points in the axes of a frame, level frames, and directions of sight."""

import math

from numba import carray, njit

from solfer.points.compiled.instruction import SMALLEST, columns_of, floats, jacobian_of, numbers_of, value_of
from solfer.points.compiled.registry import kernel
from solfer.points.compiled.rigid import quaternion


@njit
def _axes(q):
    """Return the columns of the rotation of a unit quaternion (x, y, z, w), one below the other."""
    x, y, z, w = q[0], q[1], q[2], q[3]
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
    size, value = row.first_size, value_of(row)
    a, b = carray(floats(row.first), (size,)), carray(floats(row.second), (7,))
    r, linear, angular = _axes(b[3:]), size != 4, size != 3
    dx = dy = dz = 0.0
    if linear:
        dx, dy, dz = a[0] - b[0], a[1] - b[1], a[2] - b[2]
        value[0], value[1], value[2] = _into(r, dx, dy, dz)
    if angular:
        _turn_back(a[size - 4 :], b[3:], value[size - 4 :])
    if not with_jacobian:
        return
    dofs, jacobian, turning = program.dofs, jacobian_of(row, program), 3 if linear else 0
    for k in columns_of(row):
        wx, wy, wz = _column(row.second_jacobian, 3, k, dofs)
        if linear:
            ax, ay, az = _column(row.first_jacobian, 0, k, dofs)
            bx, by, bz = _column(row.second_jacobian, 0, k, dofs)
            x, y, z = _into(r, ax - bx - wy * dz + wz * dy, ay - by - wz * dx + wx * dz, az - bz - wx * dy + wy * dx)
            jacobian[k], jacobian[dofs + k], jacobian[2 * dofs + k] = x, y, z
        if angular:
            ax, ay, az = _column(row.first_jacobian, turning, k, dofs)
            x, y, z = _into(r, ax - wx, ay - wy, az - wz)
            first = turning * dofs + k
            jacobian[first], jacobian[first + dofs], jacobian[first + 2 * dofs] = x, y, z


@njit
def _turn_back(a, b, out):
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
    value, numbers = value_of(row), numbers_of(row, 9)
    a, q = carray(floats(row.first), (7,)), _axes(carray(floats(row.first), (7,))[3:])
    nx, ny, nz, falls, crosses = numbers[3], numbers[4], numbers[5], numbers[7], numbers[8]
    ux = q[0] * numbers[0] + q[3] * numbers[1] + q[6] * numbers[2]
    uy = q[1] * numbers[0] + q[4] * numbers[1] + q[7] * numbers[2]
    uz = q[2] * numbers[0] + q[5] * numbers[1] + q[8] * numbers[2]
    along = ux * nx + uy * ny + uz * nz
    tx, ty, tz = ux - along * nx, uy - along * ny, uz - along * nz
    square = tx * tx + ty * ty + tz * tz
    # an axis along the normal has no heading: the frame keeps its last one
    if square > SMALLEST**2:
        scale = 1.0 / math.sqrt(square)
        fx, fy, fz = tx * scale, ty * scale, tz * scale
        if crosses != 0.0:
            fx, fy, fz = fy * nz - fz * ny, fz * nx - fx * nz, fx * ny - fy * nx
        _write_frame(fx, fy, fz, nx, ny, nz, value[3:])
    shift = falls * (a[0] * nx + a[1] * ny + a[2] * nz - numbers[6])
    value[0], value[1], value[2] = a[0] - shift * nx, a[1] - shift * ny, a[2] - shift * nz
    if not with_jacobian:
        return
    dofs, jacobian = program.dofs, jacobian_of(row, program)
    lean = along / square if square > SMALLEST**2 else 0.0
    for k in columns_of(row):
        x, y, z = _column(row.first_jacobian, 0, k, dofs)
        drop = falls * (x * nx + y * ny + z * nz)
        jacobian[k], jacobian[dofs + k], jacobian[2 * dofs + k] = x - drop * nx, y - drop * ny, z - drop * nz
        x, y, z = _column(row.first_jacobian, 3, k, dofs)
        turn = x * nx + y * ny + z * nz - lean * (x * tx + y * ty + z * tz)
        jacobian[3 * dofs + k], jacobian[4 * dofs + k], jacobian[5 * dofs + k] = turn * nx, turn * ny, turn * nz


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
    a, b = carray(floats(row.first), (7,)), carray(floats(row.second), (3,))
    r = _axes(a[3:])
    dx, dy, dz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    length = math.sqrt(dx * dx + dy * dy + dz * dz)
    # a target at the origin is in no direction
    scale = 1.0 / length if length > SMALLEST else 0.0
    dx, dy, dz = dx * scale, dy * scale, dz * scale
    value[0], value[1], value[2] = _into(r, dx, dy, dz)
    if not with_jacobian:
        return
    dofs, jacobian = program.dofs, jacobian_of(row, program)
    for k in columns_of(row):
        ax, ay, az = _column(row.first_jacobian, 0, k, dofs)
        bx, by, bz = _column(row.second_jacobian, 0, k, dofs)
        wx, wy, wz = _column(row.first_jacobian, 3, k, dofs)
        x, y, z = scale * (bx - ax), scale * (by - ay), scale * (bz - az)
        along = x * dx + y * dy + z * dz
        x, y, z = x - along * dx, y - along * dy, z - along * dz
        x, y, z = _into(r, x - wy * dz + wz * dy, y - wz * dx + wx * dz, z - wx * dy + wy * dx)
        jacobian[k], jacobian[dofs + k], jacobian[2 * dofs + k] = x, y, z


@kernel
def base_pose(row, program, with_jacobian):
    """Write the position of the first operand, a pose, or x and y of the second one, if there is one, behind zeros.

    The rows are those of the angular velocity, then of the position.
    """
    value, pose = value_of(row), carray(floats(row.first), (7,))
    value[:3], value[3:] = 0.0, pose[:3]
    has_center = row.second != 0
    if has_center:
        value[3:5] = carray(floats(row.second), (3,))[:2]
    if not with_jacobian:
        return
    dofs, jacobian = program.dofs, jacobian_of(row, program)
    for k in columns_of(row):
        x, y, z = _column(row.first_jacobian, 3, k, dofs)
        jacobian[k], jacobian[dofs + k], jacobian[2 * dofs + k] = x, y, z
        x, y, z = _column(row.first_jacobian, 0, k, dofs)
        if has_center:
            x, y, _ = _column(row.second_jacobian, 0, k, dofs)
        jacobian[3 * dofs + k], jacobian[4 * dofs + k], jacobian[5 * dofs + k] = x, y, z
