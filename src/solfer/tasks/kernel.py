"""Loops over the rows of a stack of tasks, compiled. Arrays are described in `solfer.tasks.stack`.

Columns of the numbers of a row: gain, feed-forward velocity, weight, damping.
"""

import math

import numpy as np

from solfer.numerics.compilation import REORDERED, cached, part

TOLERANCE = 1e-12
"""Share of a row's length below which its remainder beside other rows counts as zero: rounding errors and no more."""


def _gather(jacobian, error, places, masks, numbers, out_jacobian, out_velocity):
    """Write the weighted rows of all tasks: sqrt(w) J without the columns of other DoFs, and sqrt(w) (K e + v)."""
    rows, cols = out_jacobian.shape
    for i in range(rows):
        root = math.sqrt(numbers[i, 2])
        out_velocity[i] = root * (numbers[i, 0] * error[places[i, 1]] + numbers[i, 1])
        row, task = places[i, 0], places[i, 2]
        for k in range(cols):
            out_jacobian[i, k] = root * masks[task, k] * jacobian[row, k]


@part
def _remove(row, basis, start, end):
    """Subtract the part of a row along some rows of the basis."""
    for j in range(start, end):
        entry = 0.0
        for k in range(len(row)):
            entry += row[k] * basis[j, k]
        for k in range(len(row)):
            row[k] -= entry * basis[j, k]


@part
def _share(row, whole):
    """Compute the share of a row's length that is left."""
    rest = length = 0.0
    for k in range(len(row)):
        rest += row[k] * row[k]
        length += whole[k] * whole[k]
    return math.sqrt(rest / length) if length > 0.0 else 0.0


@part
def _project(jacobian, velocity, start, end, projected, basis, residual, out):
    """Write J' = J P of a level, whose P is 1 - W^T W with all rows W before it, and its residual r - J dq."""
    cols = jacobian.shape[1]
    for i in range(start, end):
        entry = velocity[i]
        for k in range(cols):
            entry -= jacobian[i, k] * out[k]
            projected[i, k] = jacobian[i, k]
        residual[i - start] = entry
        _remove(projected[i], basis, 0, start)
        # the second pass removes the rounding errors of the first
        _remove(projected[i], basis, 0, start)
        projected[i] *= _share(projected[i], jacobian[i]) > TOLERANCE


@part
def _factorise(numbers, start, end, projected, factor):
    """Write the lower factor L of J' J'^T + D^2, by Cholesky decomposition."""
    cols = projected.shape[1]
    for i in range(end - start):
        for j in range(i + 1):
            entry = 0.0
            for k in range(cols):
                entry += projected[start + i, k] * projected[start + j, k]
            for k in range(j):
                entry -= factor[i, k] * factor[j, k]
            if i > j:
                factor[i, j] = entry / factor[j, j]
        # the remainder of J' J'^T is not negative: less than D^2 is a rounding error
        damping = numbers[start + i, 3]
        factor[i, i] = math.sqrt(damping**2 + max(entry, 0.0))


@part
def _advance(start, end, projected, basis, factor, residual, step, out):
    """Add the step J'^T (L L^T)^-1 (r - J dq)."""
    cols = projected.shape[1]
    step[:] = 0.0
    for i in range(end - start):
        for j in range(i):
            residual[i] -= factor[i, j] * residual[j]
        residual[i] /= factor[i, i]
    for i in range(end - start - 1, -1, -1):
        for j in range(i + 1, end - start):
            residual[i] -= factor[j, i] * residual[j]
        residual[i] /= factor[i, i]
        for k in range(cols):
            step[k] += residual[i] * projected[start + i, k]
    # rows that contradict each other have large parts in the step, which cancel out; their rounding errors do not
    _remove(step, basis, 0, start)
    for k in range(cols):
        out[k] += step[k]


@part
def _extend(jacobian, start, end, projected, basis):
    """Write orthonormal rows W that span those of J', zeros for dependent ones; by Gram and Schmidt, twice."""
    for i in range(start, end):
        basis[i] = projected[i]
        for _ in range(2):
            _remove(basis[i], basis, 0, i)
        share = _share(basis[i], jacobian[i])
        basis[i] *= 1.0 / math.sqrt(np.dot(basis[i], basis[i])) if share > TOLERANCE else 0.0


def _descend(jacobian, velocity, numbers, ends, projected, basis, square, step, out):
    """Write the velocities of all levels one below the other into `out`; see `solfer.tasks.hierarchy`."""
    residual = square[-1]
    out[:] = 0.0
    for level in range(len(ends) - 1):
        start, end = ends[level], ends[level + 1]
        _project(jacobian, velocity, start, end, projected, basis, residual, out)
        _factorise(numbers, start, end, projected, square)
        _advance(start, end, projected, basis, square, residual, step, out)
        if level < len(ends) - 2:
            _extend(jacobian, start, end, projected, basis)


def _span(jacobian, start, end, basis):
    """Add the rows of a level to the orthonormal rows of all before it; see `_extend`."""
    _extend(jacobian, start, end, jacobian, basis)


def _objective(jacobian, velocity, numbers, before, hessian, gradient):
    """Write H and g of the cost of a level, times the square of its least damping; see `solfer.tasks.qp_level`.

    H and g may be larger than the DoFs: entries behind them stay.
    """
    rows, cols = jacobian.shape
    least = numbers[0, 3]
    for i in range(rows):
        least = min(least, numbers[i, 3])
    for m in range(cols):
        gradient[m] = -(least**2) * before[m]
        for k in range(cols):
            hessian[m, k] = 0.0
        hessian[m, m] = least**2
    for i in range(rows):
        factor = (least / numbers[i, 3]) ** 2
        for m in range(cols):
            entry = factor * jacobian[i, m]
            gradient[m] -= entry * velocity[i]
            if entry != 0.0:
                for k in range(cols):
                    hessian[m, k] += entry * jacobian[i, k]


_MATRIX, _VECTOR = "float64[:, ::1]", "float64[::1]"

gather = cached(
    f"void({_MATRIX}, {_VECTOR}, int64[:, ::1], {_MATRIX}, {_MATRIX}, {_MATRIX}, {_VECTOR})", _gather, REORDERED
)
descend = cached(
    f"void({_MATRIX}, {_VECTOR}, {_MATRIX}, int64[::1], {_MATRIX}, {_MATRIX}, {_MATRIX}, {_VECTOR}, {_VECTOR})",
    _descend,
    REORDERED,
)
span = cached(f"void({_MATRIX}, int64, int64, {_MATRIX})", _span, REORDERED)
objective = cached(f"void({_MATRIX}, {_VECTOR}, {_MATRIX}, {_VECTOR}, {_MATRIX}, {_VECTOR})", _objective, REORDERED)
