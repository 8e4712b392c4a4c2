"""The angular momentum of the whole robot about its centre of mass."""

from numba import carray, njit

from solfer.points.compiled.instruction import (
    integers,
    jacobian_of,
    joints_of,
    numbers_of,
    placements_of,
    value_of,
    velocity_of,
)
from solfer.points.compiled.registry import kernel
from solfer.points.compiled.rigid import linear, placed, rotated


@kernel
def angular_momentum(row, program, with_jacobian):
    """Compute the angular momentum; a joint at unit speed gives it that of all that the joint carries, I w + s x v.

    I is the inertia of what it carries about the centre of mass G of the robot, s the first moment of its mass about G,
    w the angular velocity and v the velocity at G. Parameters: parents of the joints; masses, levers (3), inertias (9),
    then memory for s (3) and I (6: xx, xy, xz, yy, yz, zz).
    """
    joints = joints_of(program)
    placements = placements_of(program)
    velocity = velocity_of(program)
    value = value_of(row)
    jacobian = jacobian_of(row, program)
    dofs = program.dofs
    bodies = dofs + 1
    parents = carray(integers(row.table), (bodies,))
    numbers = numbers_of(row, 22 * bodies)
    moments = numbers[13 * bodies : 16 * bodies]
    inertias = numbers[16 * bodies :]
    gx, gy, gz = _center(placements, numbers[:bodies], numbers[bodies : 4 * bodies], moments)
    inertias[:6] = 0.0
    for body in range(1, bodies):
        mass = numbers[body]
        first = 3 * body
        x = moments[first] - gx
        y = moments[first + 1] - gy
        z = moments[first + 2] - gz
        _rotate_inertia(
            placements[body], numbers[4 * bodies + 9 * body : 4 * bodies + 9 * body + 9], inertias, 6 * body
        )
        _shift_inertia(mass, x, y, z, inertias, 6 * body)
        moments[first], moments[first + 1], moments[first + 2] = mass * x, mass * y, mass * z
    value[:] = 0.0
    for body in range(bodies - 1, 0, -1):
        above = parents[body]
        k = body - 1
        for i in range(3):
            moments[3 * above + i] += moments[3 * body + i]
        for i in range(6):
            inertias[6 * above + i] += inertias[6 * body + i]
        column = joints[k]
        i = inertias[6 * body : 6 * body + 6]
        s = moments[3 * body : 3 * body + 3]
        vx, vy, vz = linear(column, gx, gy, gz)
        wx = column[3]
        wy = column[4]
        wz = column[5]
        hx = i[0] * wx + i[1] * wy + i[2] * wz + s[1] * vz - s[2] * vy
        hy = i[1] * wx + i[3] * wy + i[4] * wz + s[2] * vx - s[0] * vz
        hz = i[2] * wx + i[4] * wy + i[5] * wz + s[0] * vy - s[1] * vx
        value[0] += hx * velocity[k]
        value[1] += hy * velocity[k]
        value[2] += hz * velocity[k]
        if with_jacobian:
            jacobian[k] = hx
            jacobian[dofs + k] = hy
            jacobian[2 * dofs + k] = hz


@njit
def _center(placements, masses, levers, centers):
    """Write the centres of mass of all bodies; return that of the robot."""
    total = 0.0
    gx = 0.0
    gy = 0.0
    gz = 0.0
    centers[:3] = 0.0
    for body in range(1, len(masses)):
        first = 3 * body
        mass = masses[body]
        x, y, z = placed(placements[body], levers[first], levers[first + 1], levers[first + 2])
        centers[first] = x
        centers[first + 1] = y
        centers[first + 2] = z
        total = total + mass
        gx = gx + mass * x
        gy = gy + mass * y
        gz = gz + mass * z
    scale = 1.0 / total if total > 0.0 else 0.0
    return scale * gx, scale * gy, scale * gz


@njit
def _rotate_inertia(placement, inertia, out, first):
    """Write R I R^T, where the columns of R are placement[0:3], [3:6], [6:9]."""
    for index in range(6):
        out[first + index] = 0.0
    for j in range(3):
        x, y, z = rotated(placement, inertia[j], inertia[3 + j], inertia[6 + j])
        rx = placement[3 * j]
        ry = placement[3 * j + 1]
        rz = placement[3 * j + 2]
        out[first] += x * rx
        out[first + 1] += x * ry
        out[first + 2] += x * rz
        out[first + 3] += y * ry
        out[first + 4] += y * rz
        out[first + 5] += z * rz


@njit
def _shift_inertia(mass, x, y, z, out, first):
    """Add the inertia of a mass at (x, y, z)."""
    out[first] += mass * (y * y + z * z)
    out[first + 1] -= mass * x * y
    out[first + 2] -= mass * x * z
    out[first + 3] += mass * (x * x + z * z)
    out[first + 4] -= mass * y * z
    out[first + 5] += mass * (x * x + y * y)
