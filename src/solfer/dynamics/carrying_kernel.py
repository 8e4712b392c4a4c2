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
    rows=(float, "free_count", "free_count"),
    part=(float, "free_count"),
)
"""What `carry` writes."""

_carrying_at = CARRYING.at

ROUNDING = 1e-16
"""Errors of products of unit vectors."""


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
def _split(matrix, rows):
    """Write rows whose products with themselves, r r^T, add up to a semidefinite matrix; return how many are not zero.

    Cholesky's method with the largest pivot first; what is left of the matrix is rounding errors.
    """
    size = len(matrix)
    for r in range(size):
        best = 0
        for i in range(1, size):
            if matrix[i, i] > matrix[best, best]:
                best = i
        pivot = matrix[best, best]
        if not pivot > ROUNDING:
            return r
        row = rows[r]
        root = math.sqrt(pivot)
        for i in range(size):
            row[i] = matrix[best, i] / root
        for i in range(size):
            _add(-row[i], row, matrix[i])
        matrix[best, best] = 0.0
    return size


@part
def _turn(row, other, product):
    """Turn two rows in their plane, so that they are at right angles; `product` is theirs."""
    half = 0.5 * (_dot(other, other) - _dot(row, row)) / product
    tangent = math.copysign(1.0, half) / (abs(half) + math.sqrt(1.0 + half * half))
    cosine = 1.0 / math.sqrt(1.0 + tangent * tangent)
    sine = cosine * tangent
    for k in range(len(row)):
        before = row[k]
        row[k] = cosine * before - sine * other[k]
        other[k] = sine * before + cosine * other[k]


@part
def _align(rows):
    """Turn rows until each is at right angles to the others; the sum of their r r^T stays.

    They then are eigenvectors of that sum, of the length sqrt(eigenvalue). Jacobi's method from one side. Source:
    K. Veselic, V. Hari, "A note on a one-sided Jacobi algorithm", Numerische Mathematik 56, 1989.
    """
    for _ in range(30):  # five are usual
        is_done = True
        for i in range(len(rows)):
            for j in range(i + 1, len(rows)):
                product = _dot(rows[i], rows[j])
                if abs(product) > 10.0 * ROUNDING:
                    _turn(rows[i], rows[j], product)
                    is_done = False
        if is_done:
            return


@part
def _solve_weakly(matrix, weak, rows, load, part):
    """Solve A x = b in place; for eigenvalues s below `weak`, s / weak^2 counts. Return how many are above.

    With s u u^T = r r^T, u u^T / s = r r^T / s^2. The matrix is overwritten.
    """
    rows = rows[: _split(matrix, rows)]
    _align(rows)
    part[:] = load
    load[:] = 0.0
    strong = 0
    for row in rows:
        eigenvalue = _dot(row, row)
        strong += eigenvalue > weak
        _add(_dot(row, part) / max(eigenvalue, weak) ** 2, row, load)
    return strong


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


@part
def _solve(block, weak):
    """Solve B B^T x = `load` in place; return how many DoFs are held well."""
    factor = block.factor
    load = block.load
    size = block.free_count
    factor[:] = block.held
    for i in range(size):
        factor[i, i] -= weak
    is_held = cholesky(factor)
    factor[:] = block.held
    if not is_held:
        return _solve_weakly(factor, weak, block.rows, load, block.part)
    cholesky(factor)
    forward(factor, load)
    backward(factor, load)
    return size


def _carry(start, jacobian, bias, tolerance, weak):
    """Write the torques with which contacts bear a robot; see `solfer.dynamics.carrying.CarryingTorques`.

    Args:
        start: Address of a `CARRYING`.
        jacobian: That of the contacts, shape (k, n).
        bias: Bias force h, shape (n,).
        tolerance: Ratio to the longest row below which what is left of another one counts as zero.
        weak: Least eigenvalue of B B^T where all is held well.

    Returns:
        The rank, and the number of DoFs `free` that are held.
    """
    block = _carrying_at(start)
    free = block.free
    span = block.span
    along = block.along
    held = block.held
    load = block.load
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
    carried = _solve(block, weak) if rank else 0
    _write_torque(block, bias, rank)
    return rank, carried


carry = cached(
    "UniTuple(int64, 2)(int64, float64[:, ::1], float64[::1], float64, float64)",
    _carry,
    REORDERED,
    sources=[DENSE],
)
