"""Accelerations of points on rigid bodies and of the places where wheels touch the ground.

An acceleration is linear in the accelerations of the DoFs; its value at zero accelerations is its offset.
"""

import math

from numba import carray, njit

from solfer.points.compiled.instruction import (
    ANGULAR,
    LINEAR,
    SMALLEST_LENGTH,
    acceleration_of,
    columns_of,
    floats,
    joints_of,
    numbers_of,
    placements_of,
    value_of,
    velocity_of,
)
from solfer.points.compiled.registry import kernel
from solfer.points.compiled.rigid import placed, rotated


@kernel
def material_acceleration(row, program, with_jacobian):
    """Write the accelerations of a point on a link and of the link, and their offset; parameters as in `place`."""
    numbers = numbers_of(row, 3)
    offset = carray(floats(row.offset), (row.rows,))
    drift, spin, bias, motion = _twists(row, program)
    point = placed(placements_of(program)[row.joint], numbers[0], numbers[1], numbers[2])
    for rates, out in ((bias, offset), (motion, value_of(row))):
        if row.motion & LINEAR:
            _write(_material(point, drift, spin, rates[0], rates[1]), out, 0)
        if row.motion & ANGULAR:
            _write(rates[1], out, 3 if row.motion & LINEAR else 0)


@kernel
def vertex_acceleration(row, program, with_jacobian):
    """Write the acceleration of a wheel's lowest point, and its offset; parameters as in `vertex`."""
    _touch(row, program, False)


@kernel
def rolling_acceleration(row, program, with_jacobian):
    """Write the rate of change of the material's velocity at that point, and its offset; parameters as in `vertex`."""
    _touch(row, program, True)


@njit
def _touch(row, program, of_material):
    numbers = numbers_of(row, 11)
    offset = carray(floats(row.offset), (row.rows,))
    placement = placements_of(program)[row.joint]
    drift, spin, bias, motion = _twists(row, program)
    for rates, out in ((bias, offset), (motion, value_of(row))):
        _write(_touching(of_material, numbers, placement, drift, spin, rates[0], rates[1]), out, 0)


@njit
def _twists(row, program):
    """Compute spatial velocity and acceleration of the body at the world's origin, each as linear and angular part.

    The time derivatives are two pairs: with zero accelerations of the DoFs, and with the present ones.

    The axis of a joint moves along with what carries it: dS/dt = V x S. Source: R. Featherstone, "Rigid Body Dynamics
    Algorithms", 2008, sections 2.10 and 5.3.
    """
    joints = joints_of(program)
    velocity = velocity_of(program)
    acceleration = acceleration_of(program)
    drift = spin = linear = angular = full_linear = full_angular = (0.0, 0.0, 0.0)
    for k in columns_of(row):
        column = joints[k]
        rate = velocity[k]
        shift = (column[0], column[1], column[2])
        axis = (column[3], column[4], column[5])
        linear = _plus(linear, rate, _plus(_cross(spin, shift), 1.0, _cross(drift, axis)))
        angular = _plus(angular, rate, _cross(spin, axis))
        full_linear = _plus(full_linear, acceleration[k], shift)
        full_angular = _plus(full_angular, acceleration[k], axis)
        drift = _plus(drift, rate, shift)
        spin = _plus(spin, rate, axis)
    motion = _plus(full_linear, 1.0, linear), _plus(full_angular, 1.0, angular)
    return drift, spin, (linear, angular), motion


@njit
def _material(point, drift, spin, linear, angular):
    """Compute the acceleration of the body's material: that of the twist, and that of the point moving in its field."""
    speed = _plus(drift, 1.0, _cross(spin, point))
    return _plus(_plus(linear, 1.0, _cross(angular, point)), 1.0, _cross(spin, speed))


@njit
def _touching(of_material, numbers, placement, drift, spin, linear, angular):
    """Compute the acceleration of a wheel's lowest point, or the rate of change of its material's velocity there.

    The lowest point of the torus is p = c - R u - r n; parameters and u = d / |d| as in `vertex`, derivatives by the
    product rule.
    """
    center = placed(placement, numbers[0], numbers[1], numbers[2])
    axis = rotated(placement, numbers[3], numbers[4], numbers[5])
    normal = (numbers[6], numbers[7], numbers[8])
    ring = numbers[9]
    tube = numbers[10]
    axis_1 = _cross(spin, axis)
    axis_2 = _plus(_cross(angular, axis), 1.0, _cross(spin, axis_1))
    along = _dot(axis, normal)
    along_1 = _dot(axis_1, normal)
    along_2 = _dot(axis_2, normal)
    down = _plus(normal, -along, axis)
    length = math.sqrt(_dot(down, down))
    # a wheel that lies flat touches the ground with its whole ring: its centre stands for it
    scale = 1.0 / length if length > SMALLEST_LENGTH else 0.0
    down = _scaled(scale, down)
    down_1 = _scaled(-scale, _plus(_scaled(along_1, axis), along, axis_1))
    rate = _dot(down, down_1)
    down_1 = _plus(down_1, -rate, down)
    if of_material:
        point = _plus(_plus(center, -ring, down), -tube, normal)
        speed = _plus(_plus(drift, 1.0, _cross(spin, center)), -ring, down_1)
        return _plus(_plus(linear, 1.0, _cross(angular, point)), 1.0, _cross(spin, speed))
    down_2 = _scaled(-scale, _plus(_plus(_scaled(along_2, axis), 2.0 * along_1, axis_1), along, axis_2))
    # |d|'' / |d| is u'.d' / |d| + u.d'' / |d|, and d' / |d| = u' + rate u
    growth = _dot(down_1, down_1) + _dot(down, down_2)
    down_2 = _plus(_plus(down_2, -growth, down), -2.0 * rate, down_1)
    return _plus(_material(center, drift, spin, linear, angular), -ring, down_2)


@njit
def _cross(a, b):
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@njit
def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit
def _plus(a, factor, b):
    """Compute a + factor b."""
    return a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]


@njit
def _scaled(factor, a):
    return factor * a[0], factor * a[1], factor * a[2]


@njit
def _write(vector, out, first):
    out[first], out[first + 1], out[first + 2] = vector
