"""Wheels in the form of a torus: their lowest points, their angles, and what is along their rolling directions."""

import math

from numba import carray, njit

from solfer.numerics.pointers import booleans
from solfer.points.compiled.instruction import (
    SMALLEST_LENGTH,
    columns_of,
    floats,
    integers,
    jacobian_of,
    joints_of,
    numbers_of,
    placements_of,
    value_of,
)
from solfer.points.compiled.registry import kernel
from solfer.points.compiled.rigid import linear, placed, rotated


@kernel
def vertex(row, program, with_jacobian):
    """Update the lowest point of a torus; parameters: centre (3), axis (3) in the joint's frame, normal (3), radii.

    p = c - R d / |d| - r n with d = n - a (a.n), the part of the normal n across the axis a. Its derivative follows
    from the axis' velocity w x a.
    """
    _update(row, program, False, with_jacobian)


@kernel
def rolling(row, program, with_jacobian):
    """Update the same place with the Jacobian of the wheel's material there; parameters as in `vertex`."""
    _update(row, program, True, with_jacobian)


@njit
def _update(row, program, of_material, with_jacobian):
    value = value_of(row)
    numbers = numbers_of(row, 11)
    placement = placements_of(program)[row.joint]
    cx, cy, cz = placed(placement, numbers[0], numbers[1], numbers[2])
    ax, ay, az = rotated(placement, numbers[3], numbers[4], numbers[5])
    nx = numbers[6]
    ny = numbers[7]
    nz = numbers[8]
    ring = numbers[9]
    tube = numbers[10]
    along = ax * nx + ay * ny + az * nz
    dx = nx - along * ax
    dy = ny - along * ay
    dz = nz - along * az
    length = math.sqrt(dx * dx + dy * dy + dz * dz)
    # a wheel that lies flat touches the ground with its whole ring: its centre stands for it
    scale = 1.0 / length if length > SMALLEST_LENGTH else 0.0
    dx = dx * scale
    dy = dy * scale
    dz = dz * scale
    px = cx - ring * dx - tube * nx
    py = cy - ring * dy - tube * ny
    pz = cz - ring * dz - tube * nz
    value[0] = px
    value[1] = py
    value[2] = pz
    if not with_jacobian:
        return
    dofs = program.dofs
    joints = joints_of(program)
    jacobian = jacobian_of(row, program)
    for k in columns_of(row):
        column = joints[k]
        if of_material:
            vx, vy, vz = linear(column, px, py, pz)
        else:
            vx, vy, vz = linear(column, cx, cy, cz)
            ux = column[4] * az - column[5] * ay
            uy = column[5] * ax - column[3] * az
            uz = column[3] * ay - column[4] * ax
            across = ux * nx + uy * ny + uz * nz
            ux = -along * ux - across * ax
            uy = -along * uy - across * ay
            uz = -along * uz - across * az
            part = ux * dx + uy * dy + uz * dz
            factor = ring * scale
            vx = vx - factor * (ux - part * dx)
            vy = vy - factor * (uy - part * dy)
            vz = vz - factor * (uz - part * dz)
        jacobian[k] = vx
        jacobian[dofs + k] = vy
        jacobian[2 * dofs + k] = vz


@kernel
def camber(row, program, with_jacobian):
    """Update the camber of one of several wheels; parameters: its axle in the joint's frame (3); its number."""
    numbers = numbers_of(row, 3)
    placement = placements_of(program)[row.joint]
    index = _number_of(row)
    x, y, z = rotated(placement, numbers[0], numbers[1], numbers[2])
    value_of(row)[index] = -math.asin(min(max(z, -1.0), 1.0))
    if with_jacobian:
        length = max(math.hypot(x, y), SMALLEST_LENGTH)
        _write_angle(row, program, index, -y / length, x / length)


@kernel
def caster(row, program, with_jacobian):
    """Update the caster of one of several wheels.

    Parameters: its axle n and the axis u of its steering in the joint's frame (3 each); its number.
    """
    numbers = numbers_of(row, 6)
    placement = placements_of(program)[row.joint]
    index = _number_of(row)
    x, y, z = rotated(placement, numbers[0], numbers[1], numbers[2])
    ux, uy, uz = rotated(placement, numbers[3], numbers[4], numbers[5])
    wx = y * uz - z * uy
    wy = z * ux - x * uz
    wz = x * uy - y * ux
    value_of(row)[index] = math.atan2(wz, uz)
    if with_jacobian:
        # w x z and u x z, weighed by the parts of z along u and w
        scale = 1.0 / max(uz * uz + wz * wz, SMALLEST_LENGTH**2)
        _write_angle(row, program, index, scale * (uz * wy - wz * uy), scale * (wz * ux - uz * wx))


@njit
def _number_of(row):
    """Return the number of the wheel."""
    return carray(integers(row.table), (1,))[0]


@njit
def _write_angle(row, program, index, x, y):
    """Write the row of an angle that changes by x and y times the angular velocity of the link."""
    joints = joints_of(program)
    jacobian = jacobian_of(row, program)
    first = index * program.dofs
    for k in columns_of(row):
        jacobian[first + k] = x * joints[k, 3] + y * joints[k, 4]


@kernel
def rolling_offset(row, program, with_jacobian):
    """Update the offsets of a wheel's vertex, the first operand, as seen from the base, a pose, the second one.

    See `solfer.components.wheeled_motion.points.RollingOffsets`. Parameters: of all m wheels the references, places,
    errors (3 each), directions (2), axles (3) in the frames of their joints; heading of the base, which the first wheel
    writes, and the x and y of the cycle before. Table: the number of the wheel, m, the address of whether wheels are
    lifted, and, if x and y of the base are those of the cycle before, the address of their Jacobian.
    """
    table = carray(integers(row.table), (4,))
    index = table[0]
    count = table[1]
    late = table[3]
    is_lifted = carray(booleans(table[2]), (count,))[index]
    numbers = numbers_of(row, 14 * count + 3)
    three = 3 * index
    two = 2 * index
    reference = numbers[three : three + 3]
    place = numbers[3 * count + three : 3 * count + three + 3]
    error = numbers[6 * count + three : 6 * count + three + 3]
    heading = numbers[9 * count + two : 9 * count + two + 2]
    axle = numbers[11 * count + three : 11 * count + three + 3]
    base = numbers[14 * count :]
    vertex = carray(floats(row.first), (3,))
    pose = carray(floats(row.second), (7,))
    if index == 0:
        angle = 2.0 * math.atan2(pose[5], pose[6])
        base[0] = angle - 2.0 * math.pi * math.floor(angle / (2.0 * math.pi) + 0.5)
    cos = math.cos(base[0])
    sin = math.sin(base[0])
    bx, by = (base[1], base[2]) if late else (pose[0], pose[1])
    x, y, _ = rotated(placements_of(program)[row.joint], axle[0], axle[1], axle[2])
    length = max(math.hypot(x, y), SMALLEST_LENGTH)
    fx = y / length
    fy = -x / length
    gx = cos * reference[0] - sin * reference[1]
    gy = sin * reference[0] + cos * reference[1]
    ex = gx - (vertex[0] - bx)
    ey = gy - (vertex[1] - by)
    px = vertex[0] - pose[0]
    py = vertex[1] - pose[1]
    up = vertex[2] - reference[2]
    heading[0] = fx
    heading[1] = fy
    place[0], place[1], place[2] = cos * px + sin * py, cos * py - sin * px, vertex[2]
    error[0], error[1], error[2] = cos * ex + sin * ey, cos * ey - sin * ex, -up
    value = value_of(row)
    value[index] = -(fx * ex + fy * ey)
    value[count + index] = fy * ex - fx * ey if is_lifted else 0.0
    value[2 * count + index] = up if is_lifted else 0.0
    if not with_jacobian:
        return
    dofs = program.dofs
    jacobian = jacobian_of(row, program)
    of_vertex = carray(floats(row.first_jacobian), (3 * dofs,))
    of_pose = carray(floats(row.second_jacobian), (6 * dofs,))
    of_base = carray(floats(late if late else row.second_jacobian), (2 * dofs,))
    lever = fx * gy - fy * gx
    along = fx * gx + fy * gy
    first = index * dofs
    second = (count + index) * dofs
    third = (2 * count + index) * dofs
    for k in columns_of(row):
        dx = of_vertex[k] - of_base[k]
        dy = of_vertex[dofs + k] - of_base[dofs + k]
        rate = of_pose[5 * dofs + k]
        jacobian[first + k] = fx * dx + fy * dy + lever * rate
        jacobian[second + k] = fx * dy - fy * dx - along * rate if is_lifted else 0.0
        jacobian[third + k] = of_vertex[2 * dofs + k] if is_lifted else 0.0
