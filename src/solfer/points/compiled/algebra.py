"""Sums, differences and norms of other points."""

import math

from numba import carray, njit

from solfer.points.compiled.instruction import (
    SMALLEST_LENGTH,
    columns_of,
    floats,
    followers,
    jacobian_of,
    numbers_of,
    value_of,
)
from solfer.points.compiled.registry import kernel


@kernel
def plus(row, program, with_jacobian):
    """Compute the sum of both operands."""
    _add(row, program, 1.0, with_jacobian)


@kernel
def minus(row, program, with_jacobian):
    """Compute the first operand minus the second."""
    _add(row, program, -1.0, with_jacobian)


@njit
def _add(row, program, sign, with_jacobian):
    """Compute the first operand plus `sign` times the second."""
    value = value_of(row)
    a = carray(floats(row.first), (row.size,))
    b = carray(floats(row.second), (row.size,))
    for i in range(row.size):
        value[i] = a[i] + sign * b[i]
    if with_jacobian:
        _add_jacobians(row, program, row.rows, sign)


@njit
def _add_jacobians(row, program, rows, sign):
    """Write the first `rows` rows of the first operand's Jacobian plus `sign` times those of the second's."""
    dofs = program.dofs
    columns = columns_of(row)
    jacobian = jacobian_of(row, program)
    length = rows * dofs
    first = row.first_jacobian
    second = row.second_jacobian
    a = carray(floats(first), (length,))
    b = carray(floats(second), (length,))
    for index in range(rows):
        start = index * dofs
        for k in columns:
            jacobian[start + k] = (a[start + k] if first else 0.0) + (sign * b[start + k] if second else 0.0)


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
    factor = sign * (2.0 * math.atan2(sine, sign * w) / sine if sine > SMALLEST_LENGTH else 2.0)
    out[0], out[1], out[2] = factor * x, factor * y, factor * z


@kernel
def orientation_minus(row, program, with_jacobian):
    """Compute the difference of two orientations."""
    value = value_of(row)
    orientation_difference(carray(floats(row.first), (4,)), carray(floats(row.second), (4,)), value)
    if with_jacobian:
        _write_difference_jacobian(row, program, 0, value)


@njit
def _write_difference_jacobian(row, program, skipped, d):
    """Write the Jacobian of a difference d of orientations into the three rows behind `skipped` ones: L Ja - L' Jb.

    L = I - [d] / 2 + s [d]^2 is the inverse of the left Jacobian of SO(3); that of the right one is its transpose L'.
    Source: G. Chirikjian, "Stochastic Models, Information Theory, and Lie Groups", volume 2, 2012, section 10.6.
    """
    dofs = program.dofs
    columns = columns_of(row)
    jacobian = jacobian_of(row, program)
    for index in range(skipped, skipped + 3):
        for k in columns:
            jacobian[index * dofs + k] = 0.0
    _add_rotated(row.first_jacobian, 1.0, skipped * dofs, dofs, d, columns, jacobian)
    _add_rotated(row.second_jacobian, -1.0, skipped * dofs, dofs, d, columns, jacobian)


@njit
def _add_rotated(address, sign, first, dofs, d, columns, jacobian):
    """Add L J, or with the other sign -L' J, where the three rows of J begin at the entry `first` of an operand's."""
    if address == 0:
        return
    angle = math.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
    # s tends to 1 / 12; the next term is angle^2 / 720
    s = (1.0 - 0.5 * angle / math.tan(0.5 * angle)) / angle**2 if angle > 1e-3 else 1.0 / 12.0 + angle**2 / 720.0
    source = carray(floats(address), (first + 3 * dofs,))
    for k in columns:
        x = source[first + k]
        y = source[first + dofs + k]
        z = source[first + 2 * dofs + k]
        cx = d[1] * z - d[2] * y
        cy = d[2] * x - d[0] * z
        cz = d[0] * y - d[1] * x
        jacobian[first + k] += sign * (x + s * (d[1] * cz - d[2] * cy)) - 0.5 * cx
        jacobian[first + dofs + k] += sign * (y + s * (d[2] * cx - d[0] * cz)) - 0.5 * cy
        jacobian[first + 2 * dofs + k] += sign * (z + s * (d[0] * cy - d[1] * cx)) - 0.5 * cz


@kernel
def pose_minus(row, program, with_jacobian):
    """Compute the difference of two poses: of the positions, then of the orientations."""
    value = value_of(row)
    a = carray(floats(row.first), (7,))
    b = carray(floats(row.second), (7,))
    for i in range(3):
        value[i] = a[i] - b[i]
    orientation_difference(a[3:], b[3:], value[3:])
    if with_jacobian:
        _add_jacobians(row, program, 3, -1.0)
        _write_difference_jacobian(row, program, 3, value[3:])


@kernel
def norm(row, program, with_jacobian):
    """Compute the Euclidean norm of the operand; its Jacobian at zero is zero."""
    size = row.first_size
    value = value_of(row)
    a = carray(floats(row.first), (size,))
    square = 0.0
    for i in range(size):
        square += a[i] * a[i]
    value[0] = math.sqrt(square)
    if not with_jacobian:
        return
    dofs = program.dofs
    columns = columns_of(row)
    jacobian = jacobian_of(row, program)
    scale = 1.0 / value[0] if value[0] > SMALLEST_LENGTH else 0.0
    for k in columns:
        jacobian[k] = 0.0
    if row.first_jacobian == 0:
        return
    source = carray(floats(row.first_jacobian), (size * dofs,))
    for i in range(size):
        for k in columns:
            jacobian[k] += scale * a[i] * source[i * dofs + k]


@kernel
def fold(row, program, with_jacobian):
    """Add the columns of followers, times their ratios, to those of their leaders, and clear them.

    Parameters: the ratios; a table of `instruction.FOLLOWER`.
    """
    if not with_jacobian:
        return
    dofs = program.dofs
    jacobian = jacobian_of(row, program)
    table = carray(followers(row.table), (row.table_rows,))
    ratios = numbers_of(row, row.table_rows)
    for index in range(row.table_rows):
        follower = table[index]
        for line in range(row.rows):
            first = line * dofs
            moved = ratios[index] * jacobian[first + follower.dof]
            jacobian[first + follower.leader] = moved + (jacobian[first + follower.leader] if follower.adds else 0.0)
            jacobian[first + follower.dof] = 0.0


@kernel
def copy(row, program, with_jacobian):
    """Copy value and Jacobian of the operand."""
    value_of(row)[:] = carray(floats(row.first), (row.size,))
    if with_jacobian and row.first_jacobian != 0:
        jacobian = jacobian_of(row, program)
        jacobian[:] = carray(floats(row.first_jacobian), (len(jacobian),))
