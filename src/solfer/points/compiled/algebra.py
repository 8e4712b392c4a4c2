"""Sums, differences and norms of other points."""

import math

from numba import carray, njit

from solfer.points.compiled.layout import (
    FIRST,
    FIRST_JACOBIAN,
    FOLD_WIDTH,
    NUMBERS,
    ROWS,
    SECOND,
    SECOND_JACOBIAN,
    SIZE,
    SIZE_OF_FIRST,
    SMALLEST,
    TABLE,
)
from solfer.points.compiled.memory import floats, integers


@njit
def total(line, dofs, sign, columns, value, jacobian, with_jacobian):
    """Compute the first operand plus `sign` times the second."""
    size = line[SIZE]
    a, b = carray(floats(line[FIRST]), (size,)), carray(floats(line[SECOND]), (size,))
    for i in range(size):
        value[i] = a[i] + sign * b[i]
    if with_jacobian:
        add(line, line[ROWS], dofs, sign, columns, jacobian)


@njit
def add(line, rows, dofs, sign, columns, jacobian):
    """Write the first `rows` rows of the first operand's Jacobian plus `sign` times those of the second's."""
    length, first, second = rows * dofs, line[FIRST_JACOBIAN], line[SECOND_JACOBIAN]
    a, b = carray(floats(first), (length,)), carray(floats(second), (length,))
    for index in range(rows):
        row = index * dofs
        for k in columns:
            jacobian[row + k] = (a[row + k] if first else 0.0) + (sign * b[row + k] if second else 0.0)


@njit
def orientation_difference(a, b, out):
    """Write the rotation vector [rad], world axes, length up to pi, that turns the quaternion `b` into `a`."""
    w = a[3] * b[3] + a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    x = -a[3] * b[0] + a[0] * b[3] - a[1] * b[2] + a[2] * b[1]
    y = -a[3] * b[1] + a[0] * b[2] + a[1] * b[3] - a[2] * b[0]
    z = -a[3] * b[2] - a[0] * b[1] + a[1] * b[0] + a[2] * b[3]
    sine = math.sqrt(x * x + y * y + z * z)
    sign = -1.0 if w < 0.0 else 1.0
    # 2 asin(s) / s tends to 2; the next term is s^2 / 3
    factor = sign * (2.0 * math.atan2(sine, sign * w) / sine if sine > SMALLEST else 2.0)
    out[0], out[1], out[2] = factor * x, factor * y, factor * z


@njit
def turn_difference(line, skipped, dofs, d, columns, jacobian):
    """Write the Jacobian of a difference d of orientations into the three rows behind `skipped` ones: L Ja - L' Jb.

    L = I - [d] / 2 + s [d]^2 is the inverse of the left Jacobian of SO(3); that of the right one is its transpose L'.
    Source: G. Chirikjian, "Stochastic Models, Information Theory, and Lie Groups", volume 2, 2012, section 10.6.
    """
    for index in range(skipped, skipped + 3):
        for k in columns:
            jacobian[index * dofs + k] = 0.0
    _add_turned(line[FIRST_JACOBIAN], 1.0, skipped * dofs, dofs, d, columns, jacobian)
    _add_turned(line[SECOND_JACOBIAN], -1.0, skipped * dofs, dofs, d, columns, jacobian)


@njit
def _add_turned(address, sign, first, dofs, d, columns, jacobian):
    """Add L J, or with the other sign -L' J, where the three rows of J begin at the entry `first` of an operand's."""
    if address == 0:
        return
    angle = math.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
    # s tends to 1 / 12; the next term is angle^2 / 720
    s = (1.0 - 0.5 * angle / math.tan(0.5 * angle)) / angle**2 if angle > 1e-3 else 1.0 / 12.0 + angle**2 / 720.0
    source = carray(floats(address), (first + 3 * dofs,))
    for k in columns:
        x, y, z = source[first + k], source[first + dofs + k], source[first + 2 * dofs + k]
        cx, cy, cz = d[1] * z - d[2] * y, d[2] * x - d[0] * z, d[0] * y - d[1] * x
        jacobian[first + k] += sign * (x + s * (d[1] * cz - d[2] * cy)) - 0.5 * cx
        jacobian[first + dofs + k] += sign * (y + s * (d[2] * cx - d[0] * cz)) - 0.5 * cy
        jacobian[first + 2 * dofs + k] += sign * (z + s * (d[0] * cy - d[1] * cx)) - 0.5 * cz


@njit
def pose_difference(line, dofs, columns, value, jacobian, with_jacobian):
    """Compute the difference of two poses: of the positions, then of the orientations."""
    a, b = carray(floats(line[FIRST]), (7,)), carray(floats(line[SECOND]), (7,))
    for i in range(3):
        value[i] = a[i] - b[i]
    orientation_difference(a[3:], b[3:], value[3:])
    if with_jacobian:
        add(line, 3, dofs, -1.0, columns, jacobian)
        turn_difference(line, 3, dofs, value[3:], columns, jacobian)


@njit
def norm(line, dofs, columns, value, jacobian, with_jacobian):
    """Compute the Euclidean norm of the operand; its Jacobian at zero is zero."""
    size = line[SIZE_OF_FIRST]
    a = carray(floats(line[FIRST]), (size,))
    square = 0.0
    for i in range(size):
        square += a[i] * a[i]
    value[0] = math.sqrt(square)
    if not with_jacobian:
        return
    scale = 1.0 / value[0] if value[0] > SMALLEST else 0.0
    for k in columns:
        jacobian[k] = 0.0
    if line[FIRST_JACOBIAN] == 0:
        return
    source = carray(floats(line[FIRST_JACOBIAN]), (size * dofs,))
    for i in range(size):
        for k in columns:
            jacobian[k] += scale * a[i] * source[i * dofs + k]


@njit
def fold(line, dofs, jacobian):
    """Add the columns of followers, times their ratios, to those of their leaders, and clear them.

    Parameters: the ratios; a table with the DoFs of each follower.
    """
    count = line[SIZE_OF_FIRST]
    table, ratios = carray(integers(line[TABLE]), (count, FOLD_WIDTH)), carray(floats(line[NUMBERS]), (count,))
    for index in range(count):
        follower, leader, is_there = table[index, 0], table[index, 1], table[index, 2]
        for row in range(line[ROWS]):
            first = row * dofs
            share = ratios[index] * jacobian[first + follower]
            jacobian[first + leader] = share + (jacobian[first + leader] if is_there else 0.0)
            jacobian[first + follower] = 0.0


@njit
def copy(line, dofs, value, jacobian, with_jacobian):
    """Copy value and Jacobian of the operand."""
    value[:] = carray(floats(line[FIRST]), (line[SIZE],))
    if with_jacobian and line[FIRST_JACOBIAN] != 0:
        jacobian[:] = carray(floats(line[FIRST_JACOBIAN]), (line[ROWS] * dofs,))
