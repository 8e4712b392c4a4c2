"""The dual active-set method for strictly convex quadratic programs, compiled.

It begins at the least cost without any constraint and adds one violated constraint after the other: it needs no point
to start from, ends after finitely many exact steps, and detects contradictions reliably. Source: D. Goldfarb,
A. Idnani, "A numerically stable dual method for solving strictly convex quadratic programs", Mathematical Programming
27, 1983, whose names are used. The normals N of the active constraints, their sides s and multipliers u fulfil

    H x + g = N u,   N^T x = s,   H = L L^T,   L^-1 N = Q (R; 0),   J = L^-T Q = (J1 J2),   J^T H J = 1

Rows of `rotated` are the columns of J, the upper triangle of `factor` is R. A violated constraint n . x >= s becomes
active along

    d = J^T n = (d1; d2)
    z = J2 d2                 the step of x, along which n . x grows and N^T x stays
    r = R^-1 d1               the step of u is -r, that of the multiplier of n is 1
    t1 = least u_j / r_j      over inequalities with r_j > 0: the first multiplier is zero (`longest`)
    t2 = (s - n . x) / z . n  the constraint holds (`full`); infinite where n depends on N, so that z is zero

After a step t1 < t2 the constraint of that multiplier is dropped, and there are further steps; after t2 n is active.
If both are infinite, n = N r with r <= 0 for inequalities: no x fulfils n beside the active ones.

Constraint 2 i is the lower limit of inequality i, 2 i + 1 the upper one; the bounds of single unknowns follow.
Equality i is -1 - i. Each is normal . x >= side (for equalities =). Arrays come in groups, each in one order:

    problem  those of a `Problem`
    cost     hessian, gradient, and the number that is added to the diagonal of the Hessian
    limits   those of a `Problem` from `equality_matrix` on
    space    what `work_space` makes: rotated, factor, vectors, names, is_active
    work     rotated, factor, names of active constraints, normal, d, z, r, multipliers, slope H x + g
"""

import math

import numpy as np

from solfer.numerics.compilation import REORDERED, cached, part
from solfer.numerics.dense import DENSE, cholesky

SOLVED, INFEASIBLE, GAVE_UP, INACCURATE, NOT_FINITE = range(5)
"""Outcomes of a problem."""

DEPENDENT = 1e-9
"""Ratio of a normal outside the span of the active ones below which it counts as dependent on them."""


@part
def _check(cost, limits):
    """Return NOT_FINITE, or INFEASIBLE where a lower limit is above its upper one, else SOLVED."""
    hessian, gradient = cost
    equality_matrix, equality_vector, matrix, lower, upper, x_min, x_max = limits
    for numbers in (hessian.ravel(), gradient, equality_matrix.ravel(), equality_vector, matrix.ravel()):
        for number in numbers:
            if not math.isfinite(number):
                return NOT_FINITE
    outcome = SOLVED
    for least, most in ((lower, upper), (x_min, x_max)):
        for i in range(len(least)):
            if math.isnan(least[i]) or math.isnan(most[i]):
                return NOT_FINITE
            if least[i] > most[i]:
                outcome = INFEASIBLE
    return outcome


@part
def _row(name, limits):
    """Return the matrix of a constraint, its row there (beyond the last one for a bound), and its sign."""
    if name < 0:
        return limits[0], -1 - name, 1.0
    return limits[2], name // 2, 1.0 - 2.0 * (name % 2)


@part
def _normal_times(name, limits, x):
    """Compute the normal of a constraint times x."""
    matrix, row, sign = _row(name, limits)
    if row >= len(matrix):
        return sign * x[row - len(matrix)]
    total = 0.0
    for k in range(len(x)):
        total += matrix[row, k] * x[k]
    return sign * total


@part
def _add_normal(name, factor, limits, out):
    """Add `factor` times the normal of a constraint."""
    matrix, row, sign = _row(name, limits)
    if row >= len(matrix):
        out[row - len(matrix)] += sign * factor
        return
    for k in range(len(out)):
        out[k] += sign * factor * matrix[row, k]


@part
def _side(name, limits):
    """Return the side of a constraint."""
    _, sides, matrix, lower, upper, x_min, x_max = limits
    if name < 0:
        return sides[-1 - name]
    row = name // 2
    rows = len(matrix)
    if name % 2 == 1:
        return -upper[row] if row < rows else -x_max[row - rows]
    return lower[row] if row < rows else x_min[row - rows]


@part
def _lack(name, limits, x):
    """Compute by how much x violates a constraint, as a ratio of its side where that is larger than 1."""
    side = _side(name, limits)
    return (side - _normal_times(name, limits, x)) / max(1.0, abs(side))


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
        _add_normal(name, 1.0, limits, normal)
    return name, worst


@part
def _factorise(cost, factor, rotated, x):
    """Write L, J = L^-T, and x = -J J^T g, the minimum without constraints; return False if H is flat."""
    hessian, gradient, shift = cost
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
def _solve_upper(factor, active, d, out):
    """Write R^-1 d1."""
    for i in range(active - 1, -1, -1):
        entry = d[i]
        for k in range(i + 1, active):
            entry -= factor[i, k] * out[k]
        out[i] = entry / factor[i, i]


@part
def _directions(work, active):
    """Write d, z and r of a normal; return the ratio of d2 in d."""
    rotated, factor, _, normal, d, z, r, _, _ = work
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
    _solve_upper(factor, active, d, r)
    return math.sqrt(outside / (inside + outside)) if outside > 0.0 else 0.0


@part
def _rotate(first, second, cosine, sine):
    """Rotate two rows into each other."""
    for k in range(len(first)):
        before = first[k]
        first[k] = cosine * before + sine * second[k]
        second[k] = cosine * second[k] - sine * before


@part
def _add(work, active, name, multiplier):
    """Make a constraint active: d is the last column of R, by rotations that leave zeros behind its first numbers."""
    rotated, factor, names, _, d, _, _, multipliers, _ = work
    for j in range(len(d) - 1, active, -1):
        length = math.hypot(d[j - 1], d[j])
        if length > 0.0:
            _rotate(rotated[j - 1], rotated[j], d[j - 1] / length, d[j] / length)
            d[j - 1] = length
    for i in range(active + 1):
        factor[i, active] = d[i]
    names[active] = name
    multipliers[active] = multiplier
    return active + 1


@part
def _drop(work, active, which, is_active):
    """Let a constraint be active no more: column `which` of R is removed."""
    rotated, factor, names, _, _, _, _, multipliers, _ = work
    is_active[names[which]] = 0
    for j in range(which, active - 1):
        names[j] = names[j + 1]
        multipliers[j] = multipliers[j + 1]
        for i in range(active):
            factor[i, j] = factor[i, j + 1]
    for j in range(which, active - 1):
        length = math.hypot(factor[j, j], factor[j + 1, j])
        if length > 0.0:
            cosine = factor[j, j] / length
            sine = factor[j + 1, j] / length
            _rotate(rotated[j], rotated[j + 1], cosine, sine)
            _rotate(factor[j, j : active - 1], factor[j + 1, j : active - 1], cosine, sine)
    return active - 1


@part
def _is_proof(name, work, active, limits, x, tolerance):
    """Return whether a constraint contradicts active ones that its normal depends on: n = N r, but side > sides . r.

    What is left of n - N r counts with the largest entry of x: the proof is none if the decomposition is inexact.
    """
    _, _, names, _, _, _, r, _, rest = work
    rest[:] = 0.0
    _add_normal(name, 1.0, limits, rest)
    gap = _side(name, limits)
    scale = max(1.0, abs(gap))
    for j in range(active):
        term = r[j] * _side(names[j], limits)
        gap -= term
        scale = max(scale, abs(term))
        _add_normal(names[j], -r[j], limits, rest)
    left = 0.0
    largest = 1.0
    for k in range(len(x)):
        left += abs(rest[k])
        largest = max(largest, abs(x[k]))
    return (abs(gap) if name < 0 else gap) > tolerance * scale + left * largest


@part
def _equalities(limits, tolerance, work, x):
    """Make all equalities active that do not depend on others; return their number, -1 for a contradiction."""
    normal = work[3]
    z = work[5]
    active = 0
    for i in range(len(limits[1])):
        name = -1 - i
        normal[:] = 0.0
        _add_normal(name, 1.0, limits, normal)
        if _directions(work, active) < DEPENDENT:
            if _is_proof(name, work, active, limits, x, tolerance):
                return -1
            continue
        step = (limits[1][i] - _normal_times(name, limits, x)) / np.dot(z, normal)
        for k in range(len(x)):
            x[k] += step * z[k]
        active = _add(work, active, name, 0.0)
    return active


@part
def _blocking(names, multipliers, r, active):
    """Find the active inequality whose multiplier is the first to reach zero (-1 for none), and the step t1."""
    blocking = -1
    step = np.inf
    for j in range(active):
        if names[j] >= 0 and r[j] > 0.0 and multipliers[j] < step * r[j]:
            blocking = j
            step = multipliers[j] / r[j]
    return blocking, step


@part
def _negative(names, multipliers, active, least):
    """Find the active inequality with the least multiplier below `least` (-1 for none)."""
    which = -1
    for j in range(active):
        if names[j] >= 0 and multipliers[j] < least:
            which = j
            least = multipliers[j]
    return which


@part
def _balance(cost, limits, work, active, x):
    """Write H x + g - N u and u = R^-1 J1^T (H x + g); return the ratio of the slope that is left, and its scale."""
    hessian, gradient, shift = cost
    rotated, factor, names, _, d, _, _, multipliers, slope = work
    size = len(x)
    largest = 0.0
    entry_of_hessian = 0.0
    entry_of_x = 0.0
    for i in range(size):
        entry = gradient[i] + shift * x[i]
        for k in range(size):
            entry += hessian[i, k] * x[k]
        slope[i] = entry
        largest = max(largest, abs(gradient[i]))
        entry_of_hessian = max(entry_of_hessian, hessian[i, i] + shift)
        entry_of_x = max(entry_of_x, abs(x[i]))
    for i in range(size):
        d[i] = 0.0
        for k in range(size):
            d[i] += rotated[i, k] * slope[k]
    _solve_upper(factor, active, d, multipliers)
    for j in range(active):
        _add_normal(names[j], -multipliers[j], limits, slope)
    rest = 0.0
    for i in range(size):
        rest = max(rest, abs(slope[i]))
    # terms of H x may be larger than what is left of them
    largest = max(largest, entry_of_hessian * entry_of_x)
    return (rest / largest if largest > 0.0 else 0.0), largest


@part
def _refine(cost, limits, tolerance, work, active, x):
    """Compute x and u again from the active constraints, by Newton steps J1 R^-T (s - N^T x) - J2 J2^T (H x + g).

    Returns:
        The largest of the ratios that are left of slope and active constraints, and the scale of the slope.
    """
    rotated, factor, names, _, _, _, lacks, _, slope = work
    passes = 3
    for index in range(passes + 1):
        worst, scale = _balance(cost, limits, work, active, x)
        for j in range(active):
            worst = max(worst, abs(_lack(names[j], limits, x)))
        if worst <= 1e-3 * tolerance or index == passes:
            break
        for j in range(active):
            entry = _side(names[j], limits) - _normal_times(names[j], limits, x)
            for i in range(j):
                entry -= factor[i, j] * lacks[i]
            lacks[j] = entry / factor[j, j]
        for i in range(active):
            for k in range(len(x)):
                x[k] += lacks[i] * rotated[i, k]
        for i in range(active, len(x)):
            entry = 0.0
            for k in range(len(x)):
                entry += rotated[i, k] * slope[k]
            for k in range(len(x)):
                x[k] -= entry * rotated[i, k]
    return worst, scale


@part
def _attempt(cost, limits, tolerance, space, x):
    """Write x, the least of 1/2 x^T (H + shift) x + g^T x; return outcome, steps, and the largest residual."""
    rotated, factor, vectors, names, is_active = space
    normal = vectors[0]
    z = vectors[2]
    r = vectors[3]
    multipliers = vectors[4]
    work = (rotated, factor, names, normal, vectors[1], z, r, multipliers, vectors[5])
    residual = np.inf
    is_active[:] = 0
    if not _factorise(cost, factor, rotated, x):
        return GAVE_UP, 0, residual
    active = _equalities(limits, tolerance, work, x)
    if active < 0:
        return INFEASIBLE, 0, residual
    steps = 0
    most = 4 * len(is_active)
    while steps < most:
        name, violation = _most_violated(limits, tolerance, x, normal, is_active)
        if name < 0:
            residual, scale = _refine(cost, limits, tolerance, work, active, x)
            which = _negative(names, multipliers, active, -tolerance * scale)
            if which < 0 and _most_violated(limits, tolerance, x, normal, is_active)[0] < 0:
                for i in range(len(limits[1])):  # also those that depend on others
                    residual = max(residual, abs(_lack(-1 - i, limits, x)))
                return SOLVED if residual <= tolerance else INACCURATE, steps, residual
            steps += 1
            if which >= 0:
                active = _drop(work, active, which, is_active)
                _refine(cost, limits, tolerance, work, active, x)
            continue
        multiplier = 0.0
        while steps < most:
            steps += 1
            is_dependent = _directions(work, active) < DEPENDENT
            blocking, longest = _blocking(names, multipliers, r, active)
            full = np.inf if is_dependent else violation / np.dot(z, normal)
            step = min(longest, full)
            if step == np.inf:
                is_certain = _is_proof(name, work, active, limits, x, tolerance)
                return INFEASIBLE if is_certain else INACCURATE, steps, residual
            for j in range(active):
                multipliers[j] -= step * r[j]
            multiplier += step
            if not is_dependent:
                for k in range(len(x)):
                    x[k] += step * z[k]
                violation *= 1.0 - step / full
            if step == full:
                active = _add(work, active, name, multiplier)
                is_active[name] = 1
                break
            active = _drop(work, active, blocking, is_active)
    return GAVE_UP, steps, residual


def _solve(problem, tolerance, space, x):
    """Write x; return the outcome, the number of steps, and the largest residual.

    What is inexact because H is almost singular is solved again as a sequence of problems whose cost has the
    additional term shift |x - before|^2 / 2, which end at the same solution. Source: R. T. Rockafellar, "Monotone
    operators and the proximal point algorithm", SIAM Journal on Control and Optimization 14(5), 1976.
    """
    hessian, gradient = problem[:2]
    limits = problem[2:]
    outcome = _check(problem[:2], limits)
    if outcome != SOLVED:
        return outcome, 0, np.inf
    moved = space[2][6]
    before = space[2][7]
    outcome, steps, residual = _attempt((hessian, gradient, 0.0), limits, tolerance, space, x)
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
        outcome, more, residual = _attempt((hessian, moved, shift), limits, tolerance, space, x)
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


_M = "float64[:, ::1]"
_V = "float64[::1]"
_I = "int64[::1]"
solve = cached(
    f"Tuple((int64, int64, float64))(Tuple(({_M}, {_V}, {_M}, {_V}, {_M}, {_V}, {_V}, {_V}, {_V})), float64, "
    f"Tuple(({_M}, {_M}, {_M}, {_I}, {_I})), {_V})",
    _solve,
    REORDERED,
    sources=[DENSE],
)


def work_space(size: int, inequalities: int) -> tuple[np.ndarray, ...]:
    """Make the memory for problems of n unknowns and a number of inequalities besides the bounds of unknowns."""
    matrices = np.zeros((2, size, size))
    names = np.zeros(size, dtype=np.int64)
    is_active = np.zeros(2 * (size + inequalities), dtype=np.int64)
    return matrices[0], matrices[1], np.zeros((8, size)), names, is_active
