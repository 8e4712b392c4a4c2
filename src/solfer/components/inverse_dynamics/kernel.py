"""From the dynamics of a robot on contacts to a small QP, compiled.

Unknowns are x = (a, f / u): the accelerations of n DoFs, and k forces in units u. What equalities e fix is eliminated:
x_B = c + T z for as many *fixed* unknowns B, and z for the *free* ones.
"""

import numpy as np

from solfer.numerics.compilation import REORDERED, cached, part


@part
def _write_equalities(inertia, bias, jacobian, demanded, unit, dofs, holds, rows, sides):
    """Write the rows A x = b: no torque at some DoFs, and accelerations of contacts; no force where one is lifted."""
    size = len(bias)
    count = len(demanded)
    count_dofs = len(dofs)
    for i in range(count_dofs):
        dof = dofs[i]
        sides[i] = -bias[dof]
        for j in range(size):
            rows[i, j] = inertia[dof, j]
        for j in range(count):
            rows[i, size + j] = -unit * jacobian[j, dof]
    for i in range(count):
        rows[count_dofs + i] = 0.0
        sides[count_dofs + i] = 0.0
        if holds[i]:
            sides[count_dofs + i] = demanded[i]
            for j in range(size):
                rows[count_dofs + i, j] = jacobian[i, j]
        else:
            rows[count_dofs + i, size + i] = 1.0


@part
def _subtract(rows, sides, i, other, factor):
    """Subtract a multiple of row `other` from row i."""
    for j in range(rows.shape[1]):
        rows[i, j] -= factor * rows[other, j]
    sides[i] -= factor * sides[other]


@part
def _largest(row):
    """Find the column of the largest entry, and its size."""
    column = 0
    most = 0.0
    for j in range(len(row)):
        if abs(row[j]) > most:
            column = j
            most = abs(row[j])
    return column, most


@part
def _eliminate(rows, sides, first, fixed, scales, origins):
    """Bring rows to the form where each has a 1 in a column of its own, and zeros in those of the others.

    A contact may hold what others hold as well, such as the fourth wheel of a cart. Its row depends on theirs, so that
    forces N on these rows do nothing. In its place comes N^T f = 0: of all forces with one effect the smallest, as
    contacts of equal stiffness have them.

    Args:
        rows: A, shape (e, n + k); overwritten.
        sides: b, shape (e,); overwritten.
        first: First of the k rows of contacts.
        fixed: Columns of the rows' own unknowns, shape (e,); written.
        scales: Work space, shape (e,).
        origins: Work space: what the rows of contacts are made of, shape (k, k).

    Returns:
        Whether all rows have one.
    """
    count = len(rows)
    size = rows.shape[1] - (count - first)
    for i in range(count):
        scales[i] = _largest(rows[i])[1]
    for i in range(count - first):
        origins[i] = 0.0
        origins[i, i] = 1.0
    # what other rows leave of a row counts as zero below this ratio to its largest entry: rounding errors
    tolerance = 1e-9
    # contacts come first: torques that no drive has are then forces
    for step in range(count):
        i = (first + step) % count
        column, most = _largest(rows[i])
        if not most > tolerance * scales[i]:
            if i < first:
                return False
            rows[i] = 0.0
            sides[i] = 0.0
            for j in range(count - first):
                rows[i, size + j] = origins[i - first, j]
            for before in range(step):
                other = (first + before) % count
                if rows[i, fixed[other]] != 0.0:
                    _subtract(rows, sides, i, other, rows[i, fixed[other]])
            column, most = _largest(rows[i])
            if not most > tolerance:
                return False
        factor = 1.0 / rows[i, column]
        for j in range(rows.shape[1]):
            rows[i, j] *= factor
        sides[i] *= factor
        if i >= first:
            origins[i - first] *= factor
        rows[i, column] = 1.0
        fixed[i] = column
        for other in range(count):
            if other != i and rows[other, column] != 0.0:
                if i >= first and other >= first:
                    origins[other - first] -= rows[other, column] * origins[i - first]
                _subtract(rows, sides, other, i, rows[other, column])
                rows[other, column] = 0.0
    return True


@part
def _sort(rows, fixed, free, table):
    """Write the free unknowns in their order, and T."""
    count = 0
    for j in range(rows.shape[1]):
        is_free = True
        for i in range(len(fixed)):
            is_free = is_free and fixed[i] != j
        if is_free:
            free[count] = j
            count += 1
    for i in range(len(fixed)):
        for j in range(count):
            table[i, j] = -rows[i, free[j]]


@part
def _reduce(row, fixed, sides, free, table, out):
    """Write a row over the first unknowns x as one over z; return its constant part."""
    size = len(row)
    constant = 0.0
    for j in range(len(free)):
        out[j] = row[free[j]] if free[j] < size else 0.0
    for i in range(len(fixed)):
        if fixed[i] < size and row[fixed[i]] != 0.0:
            entry = row[fixed[i]]
            constant += entry * sides[i]
            for j in range(len(free)):
                out[j] += entry * table[i, j]
    return constant


@part
def _add_square(row, left, weight, hessian, gradient):
    """Add weight (row z - left)^2 / 2, of the Hessian its lower triangle."""
    for i in range(len(row)):
        entry = weight * row[i]
        if entry != 0.0:
            gradient[i] -= entry * left
            for j in range(i + 1):
                hessian[i, j] += entry * row[j]


@part
def _write_cost(jacobian, desired, smallest, fixed, sides, free, table, row, hessian, gradient):
    """Write the cost of all tasks, with a small weight of each unknown's square."""
    hessian[:] = 0.0
    gradient[:] = 0.0
    for i in range(len(desired)):
        constant = _reduce(jacobian[i], fixed, sides, free, table, row)
        _add_square(row, desired[i] - constant, 1.0, hessian, gradient)
    for i in range(len(fixed)):
        _add_square(table[i], -sides[i], smallest[fixed[i]], hessian, gradient)
    for i in range(len(free)):
        hessian[i, i] += smallest[free[i]]
        for j in range(i):
            hessian[j, i] = hessian[i, j]


def _build(
    inertia,
    bias,
    jacobian,
    demanded,
    unit,
    passive,
    holds,
    tasks,
    desired,
    smallest,
    driven,
    torques,
    cones,
    normals,
    most,
    lower_acceleration,
    upper_acceleration,
    rows,
    sides,
    fixed,
    free,
    table,
    work,
    origins,
    hessian,
    gradient,
    matrix,
    lower,
    upper,
    least,
    largest,
):
    """Write the QP over z; return whether the equalities have a solution.

    Rows of inequalities: torques of the driven DoFs, cones, normal forces, and the bounds of the fixed accelerations.
    """
    size = len(bias)
    count_forces = len(demanded)
    _write_equalities(inertia, bias, jacobian, demanded, unit, passive, holds, rows, sides)
    if not _eliminate(rows, sides, len(passive), fixed, work[0], origins):
        return False
    _sort(rows, fixed, free, table)
    _write_cost(tasks, desired, smallest, fixed, sides, free, table, work[1, : len(free)], hessian, gradient)
    row = work[2]
    place = 0
    for i in range(len(driven)):
        dof = driven[i]
        for j in range(size):
            row[j] = inertia[dof, j]
        for j in range(count_forces):
            row[size + j] = -unit * jacobian[j, dof]
        constant = bias[dof] + _reduce(row[: size + count_forces], fixed, sides, free, table, matrix[place])
        lower[place], upper[place] = -torques[i] - constant, torques[i] - constant
        place += 1
    row[:size] = 0.0
    for i in range(len(cones)):
        for j in range(count_forces):
            row[size + j] = cones[i, j]
        constant = _reduce(row[: size + count_forces], fixed, sides, free, table, matrix[place])
        lower[place] = -np.inf
        upper[place] = -constant
        place += 1
    for i in range(len(normals)):
        for j in range(count_forces):
            row[size + j] = normals[i, j]
        constant = _reduce(row[: size + count_forces], fixed, sides, free, table, matrix[place])
        lower[place], upper[place] = -constant, most[i] / unit - constant
        place += 1
    for i in range(len(fixed)):
        matrix[place] = table[i]
        lower[place], upper[place] = -np.inf, np.inf
        if fixed[i] < size:
            lower[place] = lower_acceleration[fixed[i]] - sides[i]
            upper[place] = upper_acceleration[fixed[i]] - sides[i]
        place += 1
    for i in range(len(free)):
        least[i], largest[i] = -np.inf, np.inf
        if free[i] < size:
            least[i], largest[i] = lower_acceleration[free[i]], upper_acceleration[free[i]]
    return True


def _finish(z, inertia, bias, jacobian, unit, passive, fixed, sides, free, table, acceleration, force, torque):
    """Write accelerations, forces [N] and torques of a solution z."""
    size = len(bias)
    for i in range(len(free) + len(fixed)):
        if i < len(free):
            unknown = free[i]
            value = z[i]
        else:
            unknown = fixed[i - len(free)]
            value = sides[i - len(free)]
            for j in range(len(free)):
                value += table[i - len(free), j] * z[j]
        if unknown < size:
            acceleration[unknown] = value
        else:
            force[unknown - size] = unit * value
    for i in range(size):
        torque[i] = bias[i]
        for j in range(size):
            torque[i] += inertia[i, j] * acceleration[j]
    for i in range(len(force)):
        for j in range(size):
            torque[j] -= jacobian[i, j] * force[i]
    for i in range(len(passive)):
        torque[passive[i]] = 0.0


def _touch(values, lower, upper, slack, active):
    """Write which values are at one of their limits, but for a small ratio of them, or of 1."""
    for i in range(len(values)):
        near = slack * max(1.0, abs(values[i]))
        active[i] = 1 if values[i] >= upper[i] - near or values[i] <= lower[i] + near else 0


_MATRIX = "float64[:, ::1]"
_VECTOR = "float64[::1]"
_INDICES = "int64[::1]"

build = cached(
    f"boolean({_MATRIX}, {_VECTOR}, {_MATRIX}, {_VECTOR}, float64, {_INDICES}, boolean[::1], {_MATRIX}, {_VECTOR}, "
    f"{_VECTOR}, {_INDICES}, {_VECTOR}, {_MATRIX}, {_MATRIX}, {_VECTOR}, {_VECTOR}, {_VECTOR}, {_MATRIX}, {_VECTOR}, "
    f"{_INDICES}, {_INDICES}, {_MATRIX}, {_MATRIX}, {_MATRIX}, {_MATRIX}, {_VECTOR}, {_MATRIX}, {_VECTOR}, {_VECTOR}, "
    f"{_VECTOR}, {_VECTOR})",
    _build,
    REORDERED,
)
finish = cached(
    f"void({_VECTOR}, {_MATRIX}, {_VECTOR}, {_MATRIX}, float64, {_INDICES}, {_INDICES}, {_VECTOR}, {_INDICES}, "
    f"{_MATRIX}, {_VECTOR}, {_VECTOR}, {_VECTOR})",
    _finish,
    REORDERED,
)
touch = cached(f"void({_VECTOR}, {_VECTOR}, {_VECTOR}, float64, {_INDICES})", _touch, REORDERED)
