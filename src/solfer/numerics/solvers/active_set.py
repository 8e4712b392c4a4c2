"""The dual active-set method for strictly convex quadratic programs, compiled.

It begins at the least cost without any constraint and adds one violated constraint after the other: it needs no point
to start from, ends after finitely many exact steps, and detects contradictions reliably. Source: D. Goldfarb,
A. Idnani, "A numerically stable dual method for solving strictly convex quadratic programs", Mathematical Programming
27, 1983, whose names are used: H = L L^T, rows of `rotated` are the columns of L^-T Q, N are the normals of the active
constraints, and R is the upper factor of L^-1 N = Q R.
"""

import math
from pathlib import Path

import numpy as np

from solfer.errors import SizeMismatch
from solfer.numerics.compilation import REORDERED, cached, part
from solfer.numerics.dense import DENSE, cholesky
from solfer.numerics.solvers import residuals
from solfer.numerics.solvers.problem import Problem
from solfer.numerics.solvers.residuals import (
    add_normal,
    is_contradictory,
    is_proof,
    is_sound,
    normal_times,
    refine,
    worst_equality,
)

SOLVED, INFEASIBLE, GAVE_UP, INACCURATE, NOT_FINITE = range(5)
"""Outcomes of a problem."""

DEPENDENT = 1e-9
"""Ratio of a normal outside the span of the active ones below which it counts as dependent on them."""


@part
def _factorise(hessian, gradient, shift, factor, rotated, x):
    """Write L, the columns of L^-T as rows of `rotated`, and the minimum without constraints; False if H is flat.

    `shift` is added to the diagonal of H.
    """
    size = len(gradient)
    largest = 0.0
    for i in range(size):
        largest = max(largest, hessian[i, i])
        for j in range(i):
            factor[i, j] = hessian[i, j]
        factor[i, i] = hessian[i, i] + shift
    if not cholesky(factor, 1e-13 * largest):
        return False
    # these are the rows of L^-1
    for i in range(size):
        rotated[i] = 0.0
        rotated[i, i] = 1.0
        for k in range(i):
            for m in range(k + 1):
                rotated[i, m] -= factor[i, k] * rotated[k, m]
        for m in range(i + 1):
            rotated[i, m] /= factor[i, i]
    x[:] = 0.0
    for i in range(size):
        entry = 0.0
        for m in range(i + 1):
            entry += rotated[i, m] * gradient[m]
        for m in range(i + 1):
            x[m] -= entry * rotated[i, m]
    return True


@part
def _directions(normal, rotated, factor, active, d, z, r):
    """Write d = rotated normal, the step z of x, and the step -r of the multipliers; return the ratio of z in d."""
    size = len(normal)
    z[:] = 0.0
    inside = outside = 0.0
    for i in range(size):
        entry = 0.0
        for k in range(size):
            entry += rotated[i, k] * normal[k]
        d[i] = entry
        if i < active:
            inside += entry * entry
        else:
            outside += entry * entry
            for k in range(size):
                z[k] += entry * rotated[i, k]
    for i in range(active - 1, -1, -1):
        entry = d[i]
        for k in range(i + 1, active):
            entry -= factor[i, k] * r[k]
        r[i] = entry / factor[i, i]
    return math.sqrt(outside / (inside + outside)) if outside > 0.0 else 0.0


@part
def _rotate(rotated, i, j, cosine, sine):
    """Rotate two rows into each other."""
    for k in range(rotated.shape[1]):
        first = rotated[i, k]
        second = rotated[j, k]
        rotated[i, k] = cosine * first + sine * second
        rotated[j, k] = cosine * second - sine * first


@part
def _add(rotated, factor, active, d):
    """Make d the last column of R, by rotations that leave zeros behind its first `active` + 1 numbers."""
    for j in range(len(d) - 1, active, -1):
        length = math.hypot(d[j - 1], d[j])
        if length > 0.0:
            _rotate(rotated, j - 1, j, d[j - 1] / length, d[j] / length)
            d[j - 1] = length
            d[j] = 0.0
    for i in range(active + 1):
        factor[i, active] = d[i]


@part
def _drop(rotated, factor, active, which, names, multipliers):
    """Remove column `which` of R, and its entries in the lists."""
    for j in range(which, active - 1):
        names[j], multipliers[j] = names[j + 1], multipliers[j + 1]
        for i in range(active):
            factor[i, j] = factor[i, j + 1]
    for j in range(which, active - 1):
        length = math.hypot(factor[j, j], factor[j + 1, j])
        if length > 0.0:
            cosine = factor[j, j] / length
            sine = factor[j + 1, j] / length
            _rotate(rotated, j, j + 1, cosine, sine)
            for k in range(j, active - 1):
                first = factor[j, k]
                second = factor[j + 1, k]
                factor[j, k], factor[j + 1, k] = cosine * first + sine * second, cosine * second - sine * first


@part
def _most_violated(limits, tolerance, x, normal, is_active):
    """Find the constraint that x violates most: its name (-1 for none) and by how much; write its normal."""
    _, _, matrix, lower, upper, x_min, x_max = limits
    rows, size = matrix.shape
    name = -1
    worst = 0.0
    for i in range(rows + size):
        if i < rows:
            value = 0.0
            low = lower[i]
            high = upper[i]
            for k in range(size):
                value += matrix[i, k] * x[k]
        else:
            value = x[i - rows]
            low = x_min[i - rows]
            high = x_max[i - rows]
        if low - value > worst and not is_active[2 * i] and low - value > tolerance * max(1.0, abs(low)):
            name = 2 * i
            worst = low - value
        if value - high > worst and not is_active[2 * i + 1] and value - high > tolerance * max(1.0, abs(high)):
            name = 2 * i + 1
            worst = value - high
    if name >= 0:
        normal[:] = 0.0
        add_normal(name, 1.0, limits, normal)
    return name, worst


@part
def _equalities(limits, tolerance, rotated, factor, x, vectors, names):
    """Make all equalities active that do not depend on others; return their number, -1 for a contradiction."""
    normal = vectors[0]
    d = vectors[1]
    z = vectors[2]
    r = vectors[3]
    multipliers = vectors[4]
    slope = vectors[5]
    active = 0
    for i in range(len(limits[1])):
        normal[:] = 0.0
        add_normal(-1 - i, 1.0, limits, normal)
        if _directions(normal, rotated, factor, active, d, z, r) < DEPENDENT:
            if is_proof(-1 - i, names, active, r, limits, x, slope, tolerance):
                return -1
            continue
        step = (limits[1][i] - normal_times(-1 - i, limits, x)) / np.dot(z, normal)
        for k in range(len(x)):
            x[k] += step * z[k]
        _add(rotated, factor, active, d)
        names[active] = -1 - i
        multipliers[active] = 0.0
        active += 1
    return active


@part
def _blocking(names, multipliers, r, active):
    """Find the active inequality whose multiplier is the first to reach zero (-1 for none), and the step until then."""
    blocking = -1
    step = np.inf
    for j in range(active):
        if names[j] >= 0 and r[j] > 0.0 and multipliers[j] < step * r[j]:
            blocking = j
            step = multipliers[j] / r[j]
    return blocking, step


@part
def _negative(names, multipliers, active, scale, tolerance):
    """Find the active inequality with the least multiplier that is clearly negative (-1 for none)."""
    which = -1
    least = -tolerance * scale
    for j in range(active):
        if names[j] >= 0 and multipliers[j] < least:
            which = j
            least = multipliers[j]
    return which


@part
def _attempt(cost, limits, tolerance, rotated, factor, vectors, names, is_active, x):
    """Write x, the least of 1/2 x^T (H + shift) x + g^T x; return outcome, steps, and the largest residual."""
    normal = vectors[0]
    d = vectors[1]
    z = vectors[2]
    r = vectors[3]
    multipliers = vectors[4]
    slope = vectors[5]
    hessian, gradient, shift = cost
    residual = np.inf
    precise = 1e-3 * tolerance  # residual at which x is not refined any more
    passes = 3  # times that it is refined, at most
    is_active[:] = 0
    if not _factorise(hessian, gradient, shift, factor, rotated, x):
        return GAVE_UP, 0, residual
    active = _equalities(limits, tolerance, rotated, factor, x, vectors, names)
    if active < 0:
        return INFEASIBLE, 0, residual
    steps = 0
    most = 4 * len(is_active)
    while steps < most:
        name, violation = _most_violated(limits, tolerance, x, normal, is_active)
        if name < 0:
            residual, scale = refine(
                cost,
                limits,
                rotated,
                factor,
                active,
                names,
                multipliers,
                x,
                vectors,
                precise,
                passes,
            )
            which = _negative(names, multipliers, active, scale, tolerance)
            if which < 0 and _most_violated(limits, tolerance, x, normal, is_active)[0] < 0:
                residual = max(residual, worst_equality(limits, x))
                return SOLVED if residual <= tolerance else INACCURATE, steps, residual
            steps += 1
            if which >= 0:
                is_active[names[which]] = 0
                _drop(rotated, factor, active, which, names, multipliers)
                active -= 1
                refine(
                    cost,
                    limits,
                    rotated,
                    factor,
                    active,
                    names,
                    multipliers,
                    x,
                    vectors,
                    precise,
                    passes,
                )
            continue
        multiplier = 0.0
        while steps < most:
            steps += 1
            is_dependent = _directions(normal, rotated, factor, active, d, z, r) < DEPENDENT
            blocking, longest = _blocking(names, multipliers, r, active)
            full = np.inf if is_dependent else violation / np.dot(z, normal)
            step = min(longest, full)
            if step == np.inf:
                is_certain = is_proof(name, names, active, r, limits, x, slope, tolerance)
                return INFEASIBLE if is_certain else INACCURATE, steps, residual
            for j in range(active):
                multipliers[j] -= step * r[j]
            multiplier += step
            if not is_dependent:
                for k in range(len(x)):
                    x[k] += step * z[k]
                violation *= 1.0 - step / full
            if step == full:
                _add(rotated, factor, active, d)
                names[active] = name
                multipliers[active] = multiplier
                is_active[name] = 1
                active += 1
                break
            is_active[names[blocking]] = 0
            _drop(rotated, factor, active, blocking, names, multipliers)
            active -= 1
    return GAVE_UP, steps, residual


_MATRIX = "float64[:, ::1]"
_VECTOR = "float64[::1]"


def solve(
    hessian,
    gradient,
    equality_matrix,
    equality_vector,
    matrix,
    lower,
    upper,
    x_min,
    x_max,
    tolerance,
    rotated,
    factor,
    vectors,
    names,
    is_active,
    x,
):
    """Write x; return the outcome, the number of steps, and the largest residual.

    What is inexact because H is almost singular is solved again as a sequence of problems whose cost has the
    additional term shift |x - before|^2 / 2, which end at the same solution. Source: R. T. Rockafellar, "Monotone
    operators and the proximal point algorithm", SIAM Journal on Control and Optimization 14(5), 1976.
    """
    limits = (equality_matrix, equality_vector, matrix, lower, upper, x_min, x_max)
    if not is_sound(hessian, gradient, limits):
        return NOT_FINITE, 0, np.inf
    if is_contradictory(lower, upper) or is_contradictory(x_min, x_max):
        return INFEASIBLE, 0, np.inf
    work = vectors[:6]
    moved = vectors[6]
    before = vectors[7]
    outcome, steps, residual = _attempt(
        (hessian, gradient, 0.0), limits, tolerance, rotated, factor, work, names, is_active, x
    )
    if outcome != INACCURATE:
        return outcome, steps, residual
    entry = 0.0
    for i in range(len(x)):
        entry = max(entry, hessian[i, i])
    shift = 1e-9 * entry
    before[:] = 0.0
    for _ in range(4):
        for i in range(len(x)):
            moved[i] = gradient[i] - shift * before[i]
        outcome, more, residual = _attempt(
            (hessian, moved, shift), limits, tolerance, rotated, factor, work, names, is_active, x
        )
        steps += more
        if outcome != SOLVED:
            return outcome, steps, residual
        slope = 0.0
        scale = 0.0
        for i in range(len(x)):
            slope = max(slope, shift * abs(x[i] - before[i]))
            scale = max(scale, abs(gradient[i]), entry * abs(x[i]))
        residual += slope / scale if scale > 0.0 else 0.0
        if residual <= tolerance:
            return SOLVED, steps, residual
        before[:] = x
    return INACCURATE, steps, residual


_compiled = cached(
    f"Tuple((int64, int64, float64))({_MATRIX}, {_VECTOR}, {_MATRIX}, {_VECTOR}, {_MATRIX}, {_VECTOR}, {_VECTOR}, "
    f"{_VECTOR}, {_VECTOR}, float64, {_MATRIX}, {_MATRIX}, {_MATRIX}, int64[::1], int64[::1], {_VECTOR})",
    solve,
    REORDERED,
    sources=[DENSE, Path(residuals.__file__)],
)


class ActiveSet:
    """Solves problems of one size; memory is fixed when it is made.

    Args:
        size: Number of unknowns n.
        inequalities: Number of inequalities besides the bounds of single unknowns.
        tolerance: Largest residual of a solution, see `Solution.residual`.
    """

    def __init__(self, size: int, inequalities: int, tolerance: float):
        self._tolerance = tolerance
        self._rotated = np.zeros((size, size))
        self._factor = np.zeros((size, size))
        self._vectors = np.zeros((8, size))
        self._names = np.zeros(size, dtype=np.int64)
        self._is_active = np.zeros(2 * (size + inequalities), dtype=np.int64)

    def solve(self, problem: Problem, out: np.ndarray) -> tuple[int, int, float]:
        """Write x into `out`, shape (n,); return the outcome, the number of steps, and the largest residual.

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
                problem.x_min,
                problem.x_max,
                self._tolerance,
                self._rotated,
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
