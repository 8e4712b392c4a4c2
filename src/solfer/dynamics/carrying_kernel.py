"""Torques with which contacts bear a robot, compiled, or read from the cache, on import; see `dynamics.carrying`.

The vectors of a basis are rows, so that sums over the DoFs run through memory in its order.
"""

import math

from solfer.numerics.blocks import BlockLayout
from solfer.numerics.compilation import REORDERED, cached, part
from solfer.numerics.dense import DENSE, backward, cholesky, forward

CARRYING = BlockLayout(
    "Carrying",
    dofs=int,
    free_count=int,
    free=(int, "free_count"),  # DoFs without torque
    # orthonormal rows Q^T, as many as the rank, and Q^T h; B B^T
    span=(float, "dofs", "dofs"),
    along=(float, "dofs"),
    held=(float, "free_count", "free_count"),
    # what contacts have to bear besides: h_free - B Q^T h, then a solution of B B^T x
    load=(float, "free_count"),
    torque=(float, "dofs"),
    # work space
    squares=(float, 2, "dofs"),
    factor=(float, "free_count", "free_count"),
)
"""What `carry` and `bear` write."""

_carrying_at = CARRYING.at


@part
def _dot(a, b):
    """Compute the product of two vectors."""
    total = 0.0
    for k in range(len(a)):
        total += a[k] * b[k]
    return total


@part
def _add(factor, vector, out):
    """Add a vector times a factor."""
    for k in range(len(out)):
        out[k] += factor * vector[k]


@part
def _span(jacobian, tolerance, span, squares):
    """Write orthonormal rows that span those of the Jacobian; return how many there are.

    Gram and Schmidt's method with the longest of the remaining rows first, which shows the rank as a QR decomposition
    with column pivoting does: remainders shorter than `tolerance` times the first row count as zero. A row of which
    less than half of the squared length is left is made orthogonal a second time: cancellation has made its rounding
    errors larger. Source: B. Parlett, "The Symmetric Eigenvalue Problem", 1980, section 6-9.
    """
    count = len(jacobian)
    longest = 0.0
    left = squares[0]
    whole = squares[1]
    for i in range(count):
        span[i] = jacobian[i]
        left[i] = whole[i] = _dot(span[i], span[i])
    for r in range(count):
        best = r
        for i in range(r + 1, count):
            if left[i] > left[best]:
                best = i
        row = span[r]
        other = span[best]
        if best != r:
            for k in range(len(row)):
                row[k], other[k] = other[k], row[k]
            left[best], left[r] = left[r], left[best]
            whole[best], whole[r] = whole[r], whole[best]
        if left[r] < 0.5 * whole[r]:
            for j in range(r):
                _add(-_dot(row, span[j]), span[j], row)
            left[r] = _dot(row, row)
        length = math.sqrt(left[r])
        longest = max(longest, length)
        if length <= tolerance * longest:
            return r
        for k in range(len(row)):
            row[k] /= length
        for i in range(r + 1, count):
            _add(-_dot(span[i], row), row, span[i])
            left[i] = _dot(span[i], span[i])
    return count


@part
def _write_torque(block, bias, rank):
    """Write tau = h - Q x, with x = `along` + B^T `load`; zero for the DoFs `free`."""
    free = block.free
    torque = block.torque
    torque[:] = bias
    for r in range(rank):
        entry = block.along[r]
        for i in range(block.free_count):
            entry += block.span[r, free[i]] * block.load[i]
        _add(-entry, block.span[r], torque)
    for i in range(block.free_count):
        torque[free[i]] = 0.0


def _carry(start, jacobian, bias, tolerance, weak):
    """Write the torques where contacts hold the DoFs `free` well; see `solfer.dynamics.carrying.CarryingTorques`.

    Args:
        start: Address of a `CARRYING`.
        jacobian: That of the contacts, shape (k, n).
        bias: Bias force h, shape (n,).
        tolerance: Ratio to the longest row below which what is left of another one counts as zero.
        weak: Least eigenvalue of B B^T where all is held well.

    Returns:
        The rank, and whether all is held well; if not, `torque` is not written, and `load` is what has to be borne.
    """
    block = _carrying_at(start)
    free = block.free
    span = block.span
    along = block.along
    held = block.held
    load = block.load
    factor = block.factor
    size = block.free_count
    rank = _span(jacobian, tolerance, span, block.squares)
    for r in range(rank):
        along[r] = _dot(span[r], bias)
    for i in range(size):
        load[i] = bias[free[i]]
        for r in range(rank):
            load[i] -= along[r] * span[r, free[i]]
        for j in range(i + 1):
            entry = 0.0
            for r in range(rank):
                entry += span[r, free[i]] * span[r, free[j]]
            held[i, j] = held[j, i] = entry
    if rank and size:
        factor[:] = held
        for i in range(size):
            factor[i, i] -= weak
        if not cholesky(factor):
            return rank, False
        factor[:] = held
        cholesky(factor)
        forward(factor, load)
        backward(factor, load)
    _write_torque(block, bias, rank)
    return rank, True


def _bear(start, bias, rank):
    """Write the torques where contacts hold the DoFs `free` weakly, with `load` solved."""
    _write_torque(_carrying_at(start), bias, rank)


carry = cached(
    "Tuple((int64, boolean))(int64, float64[:, ::1], float64[::1], float64, float64)",
    _carry,
    REORDERED,
    sources=[DENSE],
)
bear = cached("void(int64, float64[::1], int64)", _bear, REORDERED)
