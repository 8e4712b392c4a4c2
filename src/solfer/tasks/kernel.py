"""Loops over the rows of a stack of tasks, compiled. Arrays are described in `solfer.tasks.stack`.

Columns of the numbers of a row: gain, feed-forward velocity, weight, damping.
"""

import math

from solfer.numerics.compilation import REORDERED, cached, part


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
def _project(jacobian, velocity, start, end, projected, basis, residual, out):
    """Write J' = J P of a level, whose P is 1 - W^T W with all rows W before it, and its residual r - J dq."""
    cols = jacobian.shape[1]
    for i in range(start, end):
        entry = velocity[i]
        for k in range(cols):
            entry -= jacobian[i, k] * out[k]
            projected[i, k] = jacobian[i, k]
        residual[i - start] = entry
        for j in range(start):
            entry = 0.0
            for k in range(cols):
                entry += jacobian[i, k] * basis[j, k]
            for k in range(cols):
                projected[i, k] -= entry * basis[j, k]


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
        # what is left of J' J'^T is not negative: less than D^2 is an error of rounding
        damping = numbers[start + i, 3]
        factor[i, i] = math.sqrt(damping**2 + max(entry, 0.0))


@part
def _advance(start, end, projected, factor, residual, basis, out):
    """Write the rows W = L^-1 J' of a level, and add its step W^T L^-1 (r - J dq)."""
    cols = projected.shape[1]
    for i in range(end - start):
        for k in range(cols):
            basis[start + i, k] = projected[start + i, k]
        for j in range(i):
            residual[i] -= factor[i, j] * residual[j]
            for k in range(cols):
                basis[start + i, k] -= factor[i, j] * basis[start + j, k]
        residual[i] /= factor[i, i]
        for k in range(cols):
            basis[start + i, k] /= factor[i, i]
            out[k] += residual[i] * basis[start + i, k]


def _descend(jacobian, velocity, numbers, ends, projected, basis, square, out):
    """Write the velocities of all levels one below the other into `out`; see `solfer.tasks.hierarchy`.

    With (J' J'^T + D^2)^-1 = L^-T L^-1 and W = L^-1 J', the step is J'# (r - J dq) = W^T L^-1 (r - J dq), and the
    projector of the next level is P - W^T W: it is never formed.
    """
    residual = square[-1]
    out[:] = 0.0
    for level in range(len(ends) - 1):
        start, end = ends[level], ends[level + 1]
        _project(jacobian, velocity, start, end, projected, basis, residual, out)
        _factorise(numbers, start, end, projected, square)
        _advance(start, end, projected, square, residual, basis, out)


def _objective(jacobian, velocity, numbers, before, hessian, gradient):
    """Write H and g of the cost of a level, divided by its least damping; see `solfer.tasks.qp_hierarchy`.

    H and g may be larger than the DoFs: what lies behind them stays.
    """
    rows, cols = jacobian.shape
    least = numbers[0, 3]
    for i in range(rows):
        least = min(least, numbers[i, 3])
    for m in range(cols):
        gradient[m] = -least * before[m]
        for k in range(cols):
            hessian[m, k] = 0.0
        hessian[m, m] = least
    for i in range(rows):
        factor = least / numbers[i, 3] ** 2
        for m in range(cols):
            entry = factor * jacobian[i, m]
            gradient[m] -= entry * velocity[i]
            if entry != 0.0:
                for k in range(cols):
                    hessian[m, k] += entry * jacobian[i, k]


_MATRIX, _VECTOR = "float64[:, ::1]", "float64[::1]"

gather = cached(f"void({_MATRIX}, {_VECTOR}, int64[:, ::1], {_MATRIX}, {_MATRIX}, {_MATRIX}, {_VECTOR})", _gather,
                REORDERED)
descend = cached(f"void({_MATRIX}, {_VECTOR}, {_MATRIX}, int64[::1], {_MATRIX}, {_MATRIX}, {_MATRIX}, {_VECTOR})",
                 _descend, REORDERED)
objective = cached(f"void({_MATRIX}, {_VECTOR}, {_MATRIX}, {_VECTOR}, {_MATRIX}, {_VECTOR})", _objective, REORDERED)
