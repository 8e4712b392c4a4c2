"""The dual active-set method for strictly convex quadratic programs, compiled.

It begins at the least cost without any constraint and adds one violated constraint after the other: it needs no point
to start from, ends after finitely many exact steps, and detects contradictions reliably. Source: D. Goldfarb,
A. Idnani, "A numerically stable dual method for solving strictly convex quadratic programs", Mathematical Programming
27, 1983, whose names are used: H = L L^T, rows of `turned` are the columns of L^-T Q, N are the normals of the active
constraints, and R is the upper factor of L^-1 N = Q R.
"""

import math
from typing import TYPE_CHECKING

import numpy as np

from solfer.errors import SizeMismatch
from solfer.numerics.compilation import REORDERED, cached, part

if TYPE_CHECKING:
    from solfer.numerics.solvers.qp import Problem

SOLVED, INFEASIBLE, GAVE_UP = range(3)
"""Outcomes of a problem."""

DEPENDENT = 1e-9
"""Share of a normal outside the span of the active ones below which it counts as dependent on them."""

FLAT = 1e-13
"""Share of the largest entry of H below which a pivot of its decomposition counts as zero."""


@part
def _factorise(hessian, gradient, factor, turned, x):
    """Write L, the columns of L^-T as rows of `turned`, and the minimum without constraints; False if H is flat."""
    size = len(gradient)
    largest = 0.0
    for i in range(size):
        largest = max(largest, hessian[i, i])
    for i in range(size):
        for j in range(i + 1):
            entry = hessian[i, j]
            for k in range(j):
                entry -= factor[i, k] * factor[j, k]
            if i > j:
                factor[i, j] = entry / factor[j, j]
            elif entry > FLAT * largest:
                factor[i, i] = math.sqrt(entry)
            else:
                return False
    # these are the rows of L^-1
    for i in range(size):
        turned[i] = 0.0
        turned[i, i] = 1.0
        for k in range(i):
            for m in range(k + 1):
                turned[i, m] -= factor[i, k] * turned[k, m]
        for m in range(i + 1):
            turned[i, m] /= factor[i, i]
    x[:] = 0.0
    for i in range(size):
        entry = 0.0
        for m in range(i + 1):
            entry += turned[i, m] * gradient[m]
        for m in range(i + 1):
            x[m] -= entry * turned[i, m]
    return True


@part
def _directions(normal, turned, factor, active, d, z, r):
    """Write d = turned normal, the step z of x, and the step -r of the multipliers; return the share of d in z."""
    size = len(normal)
    z[:] = 0.0
    inside = outside = 0.0
    for i in range(size):
        entry = 0.0
        for k in range(size):
            entry += turned[i, k] * normal[k]
        d[i] = entry
        if i < active:
            inside += entry * entry
        else:
            outside += entry * entry
            for k in range(size):
                z[k] += entry * turned[i, k]
    for i in range(active - 1, -1, -1):
        entry = d[i]
        for k in range(i + 1, active):
            entry -= factor[i, k] * r[k]
        r[i] = entry / factor[i, i]
    return math.sqrt(outside / (inside + outside)) if outside > 0.0 else 0.0


@part
def _rotate(turned, i, j, cosine, sine):
    """Rotate two rows into each other."""
    for k in range(turned.shape[1]):
        first, second = turned[i, k], turned[j, k]
        turned[i, k] = cosine * first + sine * second
        turned[j, k] = cosine * second - sine * first


@part
def _add(turned, factor, active, d):
    """Make d the last column of R, by rotations that leave zeros behind its first `active` + 1 numbers."""
    for j in range(len(d) - 1, active, -1):
        length = math.hypot(d[j - 1], d[j])
        if length > 0.0:
            _rotate(turned, j - 1, j, d[j - 1] / length, d[j] / length)
            d[j - 1], d[j] = length, 0.0
    for i in range(active + 1):
        factor[i, active] = d[i]


@part
def _drop(turned, factor, active, which, names, multipliers):
    """Remove column `which` of R, and its entries in the lists."""
    for j in range(which, active - 1):
        names[j], multipliers[j] = names[j + 1], multipliers[j + 1]
        for i in range(active):
            factor[i, j] = factor[i, j + 1]
    for j in range(which, active - 1):
        length = math.hypot(factor[j, j], factor[j + 1, j])
        if length > 0.0:
            cosine, sine = factor[j, j] / length, factor[j + 1, j] / length
            _rotate(turned, j, j + 1, cosine, sine)
            for k in range(j, active - 1):
                first, second = factor[j, k], factor[j + 1, k]
                factor[j, k], factor[j + 1, k] = cosine * first + sine * second, cosine * second - sine * first


@part
def _most_violated(matrix, lower, upper, least, largest, x, normal, is_active):
    """Find the constraint that x violates most: its name (-1 for none) and by how much; write its normal.

    Constraint 2 i is the lower limit of row i, 2 i + 1 the upper one; those of single unknowns follow.
    """
    rows, size = matrix.shape
    name, worst = -1, 0.0
    for i in range(rows + size):
        if i < rows:
            value, low, high = 0.0, lower[i], upper[i]
            for k in range(size):
                value += matrix[i, k] * x[k]
        else:
            value, low, high = x[i - rows], least[i - rows], largest[i - rows]
        if low - value > worst and not is_active[2 * i]:
            name, worst = 2 * i, low - value
        if value - high > worst and not is_active[2 * i + 1]:
            name, worst = 2 * i + 1, value - high
    if name >= 0:
        sign, i = (1.0 if name % 2 == 0 else -1.0), name // 2
        normal[:] = 0.0
        for k in range(size):
            if i < rows:
                normal[k] = sign * matrix[i, k]
            elif k == i - rows:
                normal[k] = sign
    return name, worst


@part
def _equalities(matrix, vector, tolerance, turned, factor, x, normal, d, z, r, names, multipliers):
    """Make all equalities active; return their number, -1 if they contradict each other."""
    active = 0
    for i in range(len(vector)):
        lack = vector[i]
        for k in range(len(x)):
            normal[k] = matrix[i, k]
            lack -= matrix[i, k] * x[k]
        if _directions(normal, turned, factor, active, d, z, r) < DEPENDENT:
            if abs(lack) > tolerance:
                return -1
            continue
        step = lack / np.dot(z, normal)
        for k in range(len(x)):
            x[k] += step * z[k]
        _add(turned, factor, active, d)
        names[active], multipliers[active] = -1, 0.0
        active += 1
    return active


@part
def _blocking(names, multipliers, r, active):
    """Find the active inequality whose multiplier is the first to reach zero (-1 for none), and the step until then."""
    blocking, step = -1, np.inf
    for j in range(active):
        if names[j] >= 0 and r[j] > 0.0 and multipliers[j] < step * r[j]:
            blocking, step = j, multipliers[j] / r[j]
    return blocking, step


def _solve(
    hessian,
    gradient,
    equality_matrix,
    equality_vector,
    matrix,
    lower,
    upper,
    least,
    largest,
    tolerance,
    turned,
    factor,
    vectors,
    names,
    is_active,
    x,
):
    """Write x; return the outcome and the number of steps."""
    normal, d, z, r, multipliers = vectors[0], vectors[1], vectors[2], vectors[3], vectors[4]
    if not _factorise(hessian, gradient, factor, turned, x):
        return GAVE_UP, 0
    active = _equalities(
        equality_matrix, equality_vector, tolerance, turned, factor, x, normal, d, z, r, names, multipliers
    )
    if active < 0:
        return INFEASIBLE, 0
    is_active[:] = 0
    steps, most = 0, 4 * len(is_active)
    while steps < most:
        name, lack = _most_violated(matrix, lower, upper, least, largest, x, normal, is_active)
        if name < 0 or lack <= tolerance:
            return SOLVED, steps
        multiplier = 0.0
        while steps < most:
            steps += 1
            is_dependent = _directions(normal, turned, factor, active, d, z, r) < DEPENDENT
            blocking, longest = _blocking(names, multipliers, r, active)
            full = np.inf if is_dependent else lack / np.dot(z, normal)
            step = min(longest, full)
            if step == np.inf:
                return INFEASIBLE, steps
            for j in range(active):
                multipliers[j] -= step * r[j]
            multiplier += step
            if not is_dependent:
                for k in range(len(x)):
                    x[k] += step * z[k]
                lack *= 1.0 - step / full
            if step == full:
                _add(turned, factor, active, d)
                names[active], multipliers[active], is_active[name] = name, multiplier, 1
                active += 1
                break
            is_active[names[blocking]] = 0
            _drop(turned, factor, active, blocking, names, multipliers)
            active -= 1
    return GAVE_UP, steps


_MATRIX, _VECTOR = "float64[:, ::1]", "float64[::1]"
_PROBLEM = f"{_MATRIX}, {_VECTOR}, {_MATRIX}, {_VECTOR}, {_MATRIX}, {_VECTOR}, {_VECTOR}, {_VECTOR}, {_VECTOR}"
_compiled = cached(
    f"UniTuple(int64, 2)({_PROBLEM}, float64, {_MATRIX}, {_MATRIX}, {_MATRIX}, int64[::1], int64[::1], {_VECTOR})",
    _solve,
    REORDERED,
)


class ActiveSet:
    """Solves problems of one size; memory is fixed when it is made.

    Args:
        size: Number of unknowns n.
        inequalities: Number of inequalities besides the bounds of single unknowns.
        tolerance: Largest violation of a constraint.
    """

    def __init__(self, size: int, inequalities: int, tolerance: float):
        self._tolerance = tolerance
        self._turned, self._factor, self._vectors = np.zeros((size, size)), np.zeros((size, size)), np.zeros((5, size))
        self._names = np.zeros(size, dtype=np.int64)
        self._is_active = np.zeros(2 * (size + inequalities), dtype=np.int64)

    def solve(self, problem: "Problem", out: np.ndarray) -> tuple[int, int]:
        """Write x into `out`, shape (n,); return the outcome and the number of steps.

        Raises:
            SizeMismatch: An array of the problem is not float64 row by row.
        """
        try:
            return _compiled(
                problem.hessian,
                problem.gradient,
                problem.equality_matrix,
                problem.equality_vector,
                problem.inequality_matrix,
                problem.lower,
                problem.upper,
                problem.least,
                problem.largest,
                self._tolerance,
                self._turned,
                self._factor,
                self._vectors,
                self._names,
                self._is_active,
                out,
            )
        except TypeError as error:
            raise SizeMismatch(
                "an array of a problem is not float64 row by row",
                expected="arrays as np.ascontiguousarray makes them",
            ) from error
