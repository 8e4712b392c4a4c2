"""Residuals of the solution of a quadratic program, and what makes them smaller; parts of `active_set`'s kernel.

Constraint 2 i is the lower limit of inequality i, 2 i + 1 the upper one; the bounds of single unknowns follow.
Equality i is -1 - i. Each is normal . x >= side (for equalities =). `limits` are the arrays of a `Problem` from
`equality_matrix` on.
"""

import math

from solfer.numerics.compilation import part


@part
def _is_finite(numbers):
    """Return whether all numbers are finite."""
    for number in numbers:
        if not math.isfinite(number):
            return False
    return True


@part
def _are_limits(lower, upper):
    """Return whether no limit is a NaN."""
    for i in range(len(lower)):
        if math.isnan(lower[i]) or math.isnan(upper[i]):
            return False
    return True


@part
def is_sound(hessian, gradient, limits):
    """Return whether cost and matrices are finite, and no limit is a NaN."""
    equality_matrix, equality_vector, matrix, lower, upper, x_min, x_max = limits
    return (
        _is_finite(hessian.ravel())
        and _is_finite(gradient)
        and _is_finite(equality_matrix.ravel())
        and _is_finite(equality_vector)
        and _is_finite(matrix.ravel())
        and _are_limits(lower, upper)
        and _are_limits(x_min, x_max)
    )


@part
def is_contradictory(lower, upper):
    """Return whether a lower limit is above its upper one."""
    for i in range(len(lower)):
        if lower[i] > upper[i]:
            return True
    return False


@part
def normal_times(name, limits, x):
    """Compute the normal of a constraint times x."""
    matrix = limits[2]
    row = name // 2
    sign = 1.0 - 2.0 * (name % 2)
    total = 0.0
    if name >= 2 * len(matrix):
        return sign * x[row - len(matrix)]
    if name < 0:
        matrix = limits[0]
        row = -1 - name
        sign = 1.0
    for k in range(len(x)):
        total += matrix[row, k] * x[k]
    return sign * total


@part
def add_normal(name, factor, limits, out):
    """Add `factor` times the normal of a constraint."""
    matrix = limits[2]
    row = name // 2
    sign = 1.0 - 2.0 * (name % 2)
    if name >= 2 * len(matrix):
        out[row - len(matrix)] += sign * factor
        return
    if name < 0:
        matrix = limits[0]
        row = -1 - name
        sign = 1.0
    for k in range(len(out)):
        out[k] += sign * factor * matrix[row, k]


@part
def side(name, limits):
    """Return the side of a constraint."""
    if name < 0:
        return limits[1][-1 - name]
    row = name // 2
    rows = len(limits[2])
    is_upper = name % 2 == 1
    if row < rows:
        return -limits[4][row] if is_upper else limits[3][row]
    return -limits[6][row - rows] if is_upper else limits[5][row - rows]


@part
def lack(name, limits, x):
    """Compute by how much x violates a constraint, as a ratio of its side where that is larger than 1."""
    sides = side(name, limits)
    return (sides - normal_times(name, limits, x)) / max(1.0, abs(sides))


@part
def worst_equality(limits, x):
    """Compute by how much x violates equalities; also those that were left out because they depend on others."""
    worst = 0.0
    for i in range(len(limits[1])):
        worst = max(worst, abs(lack(-1 - i, limits, x)))
    return worst


@part
def is_proof(name, names, active, r, limits, x, rest, tolerance):
    """Return whether a constraint contradicts active ones that its normal depends on: n = N r, but side > sides . r.

    What is left of n - N r counts with the largest entry of x: the proof is none if the decomposition is inexact.
    """
    rest[:] = 0.0
    add_normal(name, 1.0, limits, rest)
    gap = side(name, limits)
    scale = max(1.0, abs(gap))
    for j in range(active):
        term = r[j] * side(names[j], limits)
        gap -= term
        scale = max(scale, abs(term))
        add_normal(names[j], -r[j], limits, rest)
    left = 0.0
    largest = 1.0
    for k in range(len(x)):
        left += abs(rest[k])
        largest = max(largest, abs(x[k]))
    return (abs(gap) if name < 0 else gap) > tolerance * scale + left * largest


@part
def _balance(cost, limits, rotated, factor, active, names, multipliers, x, slope, d):
    """Write slope H x + g, d = rotated slope, and the multipliers; return the ratio of the slope that they leave."""
    hessian, gradient, shift = cost
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
    for i in range(active - 1, -1, -1):
        entry = d[i]
        for k in range(i + 1, active):
            entry -= factor[i, k] * multipliers[k]
        multipliers[i] = entry / factor[i, i]
    for j in range(active):
        add_normal(names[j], -multipliers[j], limits, slope)
    rest = 0.0
    for i in range(size):
        rest = max(rest, abs(slope[i]))
    # terms of H x may be larger than what is left of them
    largest = max(largest, entry_of_hessian * entry_of_x)
    return (rest / largest if largest > 0.0 else 0.0), largest


@part
def refine(cost, limits, rotated, factor, active, names, multipliers, x, vectors, enough, passes):
    """Compute x and the multipliers again from the active constraints, by Newton steps with the decomposition.

    With N = J^-T (R; 0) and J^T H J = 1, where the rows of `rotated` are the columns of J = (J1 J2), a step is
    J1 R^-T (side - N^T x) - J2 J2^T (H x + g).

    Returns:
        The largest of the ratios that are left of slope and active constraints, and the scale of the slope.
    """
    slope = vectors[5]
    d = vectors[1]
    lacks = vectors[3]
    for index in range(passes + 1):
        worst, scale = _balance(cost, limits, rotated, factor, active, names, multipliers, x, slope, d)
        for j in range(active):
            worst = max(worst, abs(lack(names[j], limits, x)))
        if worst <= enough or index == passes:
            break
        for j in range(active):
            entry = side(names[j], limits) - normal_times(names[j], limits, x)
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
