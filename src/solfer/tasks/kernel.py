"""Loops over the rows of a stack of tasks, compiled. Arrays are described in `solfer.tasks.stack`.

Columns of the numbers of a row: gain, feed-forward velocity, weight, damping, largest correction.
"""

import math

import numpy as np

from solfer.numerics.blocks import BlockLayout
from solfer.numerics.compilation import REORDERED, cached, part
from solfer.numerics.dense import DENSE, backward, cholesky, forward

ROW_TOLERANCE = 1e-12
"""Ratio of a row's length below which its remainder beside other rows counts as zero: rounding errors and no more."""

CANCELLED = 0.5
"""Ratio of a row's squared length that has to be left, or else it is made orthogonal a second time: cancellation has
made its rounding errors larger. Source: B. Parlett, "The Symmetric Eigenvalue Problem", 1980, section 6-9."""

DESCENT = BlockLayout(
    "Descent",
    rows=int,
    cols=int,
    levels=int,
    largest=int,  # rows of a level
    height=int,  # the larger one of rows and columns
    slope_count=int,
    jacobian=(float, "rows", "cols"),
    velocity=(float, "rows"),
    numbers=(float, "rows", 5),
    ends=(int, "levels + 1"),
    projected=(float, "height", "cols"),
    basis=(float, "rows", "cols"),
    # the factor L of a level, then its residual
    square=(float, "largest + 1", "largest"),
    work=(float, 3, "cols"),
    # zeros, then the velocities after each level
    reached=(float, "levels + 1", "cols"),
    # what is left of the slope of each level's cost, as a ratio of its largest term
    slopes=(float, "slope_count"),
)
"""What `descend` reads and writes."""

_descent_at = DESCENT.at


@part
def _weigh(jacobian, places, masks, numbers, out):
    """Write sqrt(w) J of the rows of all tasks, without the columns of other DoFs."""
    rows, cols = out.shape
    for i in range(rows):
        root = math.sqrt(numbers[i, 2])
        row = places[i, 0]
        task = places[i, 2]
        for k in range(cols):
            out[i, k] = root * masks[task, k] * jacobian[row, k]


def _gather(jacobian, error, places, masks, numbers, out_jacobian, out_velocity):
    """Write the weighted rows of all tasks: sqrt(w) J, and sqrt(w) (K e + v), with K e in its bounds."""
    _weigh(jacobian, places, masks, numbers, out_jacobian)
    for i in range(len(out_velocity)):
        most = numbers[i, 4]
        correction = numbers[i, 0] * error[places[i, 1]]
        if abs(correction) > most:  # what is not a number stays so
            correction = math.copysign(most, correction)
        out_velocity[i] = math.sqrt(numbers[i, 2]) * (correction + numbers[i, 1])


def _gather_jacobian(jacobian, places, masks, numbers, out):
    """See `_weigh`."""
    _weigh(jacobian, places, masks, numbers, out)


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
def _square(row):
    """Compute the square of a row's length."""
    total = 0.0
    for k in range(len(row)):
        total += row[k] * row[k]
    return total


@part
def _clear(row, basis, start, end):
    """Subtract the part of a row along some rows of the basis, and what rounding left of it where much has gone."""
    before = _square(row)
    _remove(row, basis, start, end)
    if not _square(row) >= CANCELLED * before:
        _remove(row, basis, 0, end)


@part
def _ratio_left(row, whole):
    """Compute the ratio of a row's length that is left."""
    rest = length = 0.0
    for k in range(len(row)):
        rest += row[k] * row[k]
        length += whole[k] * whole[k]
    return math.sqrt(rest / length) if length > 0.0 else 0.0


@part
def _project(block, start, end, residual, out):
    """Write J' = J P of a level, whose P is 1 - W^T W with all rows W before it, and its residual r - J dq."""
    jacobian = block.jacobian
    projected = block.projected
    for i in range(start, end):
        entry = block.velocity[i]
        for k in range(block.cols):
            entry -= jacobian[i, k] * out[k]
            projected[i, k] = jacobian[i, k]
        residual[i - start] = entry
        _clear(projected[i], block.basis, 0, start)
        projected[i] *= _ratio_left(projected[i], jacobian[i]) > ROW_TOLERANCE


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
def _advance(block, start, end, residual, out):
    """Add the step J'^T (L L^T)^-1 (r - J dq)."""
    rows = end - start
    matrix = block.square[:rows, :rows]
    solved = residual[:rows]
    forward(matrix, solved)
    backward(matrix, solved)
    step = block.work[0]
    step[:] = 0.0
    for i in range(rows - 1, -1, -1):
        for k in range(block.cols):
            step[k] += solved[i] * block.projected[start + i, k]
    # rows that contradict each other have large parts in the step, which cancel out; their rounding errors do not
    _remove(step, block.basis, 0, start)
    for k in range(block.cols):
        out[k] += step[k]


@part
def _extend(jacobian, start, end, projected, basis, first):
    """Write orthonormal rows W that span those of J', zeros for dependent ones; by Gram and Schmidt.

    Rows of `projected` are orthogonal to those of the basis before the row `first`.
    """
    for i in range(start, end):
        basis[i] = projected[i]
        _clear(basis[i], basis, first, i)
        ratio = _ratio_left(basis[i], jacobian[i])
        basis[i] *= 1.0 / math.sqrt(np.dot(basis[i], basis[i])) if ratio > ROW_TOLERANCE else 0.0


@part
def _dimensions(basis, start):
    """Count the dimensions that the first `start` rows of the basis leave; dependent ones are zero."""
    rank = 0
    for j in range(start):
        for k in range(basis.shape[1]):
            if basis[j, k] != 0.0:
                rank += 1
                break
    return basis.shape[1] - rank


@part
def _complete(basis, start, free, work):
    """Write orthonormal columns F that span what the first `start` rows of the basis leave; return how many there are.

    Each begins as the unit vector of which most is left, as in a Cholesky decomposition of the projector
    F F' = 1 - W' W with pivoting, whose diagonal reports that.
    """
    cols = basis.shape[1]
    total = _dimensions(basis, start)
    column = work[0]
    left = work[1]
    factors = work[2]
    for k in range(cols):
        left[k] = 1.0
    for j in range(start):
        for k in range(cols):
            left[k] -= basis[j, k] ** 2
    for count in range(total):
        best = 0
        for k in range(1, cols):
            if left[k] > left[best]:
                best = k
        column[:] = 0.0
        column[best] = 1.0
        for j in range(start):
            entry = basis[j, best]
            if entry != 0.0:
                for k in range(cols):
                    column[k] -= entry * basis[j, k]
        _leave(column, free, free[best], count)
        if left[best] < CANCELLED:
            _remove(column, basis, 0, start)
            factors[:count] = 0.0
            for k in range(cols):
                for j in range(count):
                    factors[j] += column[k] * free[k, j]
            _leave(column, free, factors, count)
        scale = 1.0 / math.sqrt(_square(column))
        for k in range(cols):
            free[k, count] = scale * column[k]
            left[k] -= free[k, count] ** 2
        left[best] = -1.0
    return total


@part
def _leave(column, free, factors, count):
    """Subtract the first `count` columns F times their factors."""
    for k in range(len(column)):
        entry = 0.0
        for j in range(count):
            entry += free[k, j] * factors[j]
        column[k] -= entry


@part
def _finish(block, start, end, count, out):
    """Add the step of the last level in the coordinates z of what is left: (A' D^-2 A + 1) z = A' D^-2 (r - J dq).

    With A = J F, where F are the free columns, this is J'^T (J' J'^T + D^2)^-1 (r - J dq) = F z. Of the only level all
    columns are free: F = 1.
    """
    jacobian = block.jacobian
    free = block.projected
    square = block.square
    cols = block.cols
    row = block.work[0, :count]
    right = square[-1, :count]
    square[:count, :count] = 0.0
    right[:] = 0.0
    for j in range(count):
        square[j, j] = 1.0
    for i in range(start, end):
        left = block.velocity[i]
        weight = 1.0 / block.numbers[i, 3] ** 2
        row[:] = 0.0
        for k in range(cols):
            entry = jacobian[i, k]
            if entry != 0.0:  # of a posture, and of hands, most are
                left -= entry * out[k]
                if start:
                    for j in range(count):
                        row[j] += entry * free[k, j]
                else:
                    row[k] = entry
        for j in range(count):
            factor = weight * row[j]
            if factor != 0.0:
                right[j] += factor * left
                for k in range(j + 1):
                    square[j, k] += factor * row[k]
    matrix = square[:count, :count]
    cholesky(matrix)
    forward(matrix, right)
    backward(matrix, right)
    if not start:
        out[:] = right
        return
    for k in range(cols):
        entry = out[k]
        for j in range(count):
            entry += free[k, j] * right[j]
        out[k] = entry


@part
def _imbalance(block, start, end, before, out):
    """Compute the slope of a level's cost beside the levels before, as a ratio of its largest term, if that is > 1."""
    jacobian = block.jacobian
    step = block.work[0]
    cols = block.cols
    largest = 1.0
    step[:] = 0.0
    for i in range(start, end):
        left = block.velocity[i]
        for k in range(cols):
            left -= jacobian[i, k] * out[k]
        left /= block.numbers[i, 3] ** 2
        for k in range(cols):
            if jacobian[i, k] != 0.0:
                term = left * jacobian[i, k]
                step[k] += term
                largest = max(largest, abs(term))
    for k in range(cols):
        step[k] -= out[k] - before[k]
        largest = max(largest, abs(out[k] - before[k]))
    _clear(step, block.basis, 0, start)
    worst = 0.0
    for k in range(cols):
        worst = max(worst, abs(step[k]))
    return worst / largest


def _descend(address):
    """Write the velocities of all levels into the rows of `reached` behind the first; see `solfer.tasks.hierarchy`."""
    block = _descent_at(address)
    jacobian = block.jacobian
    projected = block.projected
    basis = block.basis
    residual = block.square[-1]
    for level in range(block.levels):
        start = block.ends[level]
        end = block.ends[level + 1]
        before = block.reached[level]
        out = block.reached[level + 1]
        out[:] = before
        is_last = level == block.levels - 1
        if is_last and end - start > _dimensions(basis, start):
            # `projected` is not needed any more
            count = _complete(basis, start, projected, block.work) if start else block.cols
            _finish(block, start, end, count, out)
        else:
            _project(block, start, end, residual, out)
            _factorise(block.numbers, start, end, projected, block.square)
            _advance(block, start, end, residual, out)
        if not is_last:
            _extend(jacobian, start, end, projected, basis, start)
        if block.slope_count:
            block.slopes[level] = _imbalance(block, start, end, before, out)


def _span(jacobian, start, end, basis):
    """Add the rows of a level to the orthonormal rows of all before it; see `_extend`."""
    _extend(jacobian, start, end, jacobian, basis, 0)


def _count_kept(steps, slopes, lower, upper, matrix, matrix_lower, matrix_upper, tolerance):
    """Count the first levels whose steps are the least of their costs and within all limits, but for a tolerance.

    Args:
        steps: Joint velocities of each level, shape (levels, n).
        slopes: What is left of the slopes of their costs, shape (levels,).
        lower: Bounds of velocities, shape (n,), or (0,) for none.
        upper: The other bounds.
        matrix: Inequalities, shape (rows, n).
        matrix_lower: Their lower limits, shape (rows,).
        matrix_upper: Their upper ones.
        tolerance: Largest violation, and slope.
    """
    for level in range(len(steps)):
        if not slopes[level] <= tolerance:
            return level
        for k in range(steps.shape[1]):
            # not a number is within no limits
            if not math.isfinite(steps[level, k]):
                return level
        for k in range(len(lower)):
            if not lower[k] - tolerance <= steps[level, k] <= upper[k] + tolerance:
                return level
        for i in range(len(matrix)):
            value = 0.0
            for k in range(steps.shape[1]):
                value += matrix[i, k] * steps[level, k]
            if not matrix_lower[i] - tolerance <= value <= matrix_upper[i] + tolerance:
                return level
    return len(steps)


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


def _limit_square(x, jacobian, least, largest, rate, matrix):
    """See `solfer.tasks.constraints.WorkspaceLimit`: write 2 x' J, and return the bounds."""
    square = 0.0
    for i in range(len(x)):
        square += x[i] * x[i]
    for k in range(matrix.shape[1]):
        entry = 0.0
        for i in range(len(x)):
            entry += x[i] * jacobian[i, k]
        matrix[0, k] = 2.0 * entry
    return min(least - square, 0.0) * rate, max(largest - square, 0.0) * rate


_MATRIX = "float64[:, ::1]"
_VECTOR = "float64[::1]"

gather = cached(
    f"void({_MATRIX}, {_VECTOR}, int64[:, ::1], {_MATRIX}, {_MATRIX}, {_MATRIX}, {_VECTOR})", _gather, REORDERED
)
gather_jacobian = cached(
    f"void({_MATRIX}, int64[:, ::1], {_MATRIX}, {_MATRIX}, {_MATRIX})", _gather_jacobian, REORDERED
)
descend = cached("void(int64)", _descend, REORDERED, sources=[DENSE])
count_kept = cached(
    f"int64({_MATRIX}, {_VECTOR}, {_VECTOR}, {_VECTOR}, {_MATRIX}, {_VECTOR}, {_VECTOR}, float64)",
    _count_kept,
    REORDERED,
)
span = cached(f"void({_MATRIX}, int64, int64, {_MATRIX})", _span, REORDERED)
objective = cached(f"void({_MATRIX}, {_VECTOR}, {_MATRIX}, {_VECTOR}, {_MATRIX}, {_VECTOR})", _objective, REORDERED)
limit_square = cached(
    f"UniTuple(float64, 2)({_VECTOR}, {_MATRIX}, float64, float64, float64, {_MATRIX})", _limit_square
)
