"""From the dynamics of a robot on contacts to a small QP, compiled.

Unknowns are x = (a, f / u): the accelerations of n DoFs, and k forces in units u. What equalities e fix is eliminated:
x_B = c + T z for as many *fixed* unknowns B, and z for the *free* ones.
"""

import numpy as np

from solfer.numerics.blocks import BlockLayout
from solfer.numerics.compilation import REORDERED, cached, part

WHOLE_BODY = BlockLayout(
    "WholeBody",
    dofs=int,
    force_count=int,
    inertia=(float, "dofs", "dofs"),
    bias=(float, "dofs"),
    passive_count=int,
    passive=(int, "passive_count"),  # DoFs without a drive
    driven_count=int,
    driven=(int, "driven_count"),
    torque_limits=(float, "driven_count"),
    lower_acceleration=(float, "dofs"),
    upper_acceleration=(float, "dofs"),
    # tasks: W J and W r, and the weight of each unknown's square
    row_count=int,
    task_rows=(float, "row_count", "dofs"),
    desired=(float, "row_count"),
    smallest=(float, "dofs + force_count"),
    # contacts, see `solfer.components.inverse_dynamics.ground.Ground`, and the accelerations that they are to have
    contact_count=int,
    cone_count=int,
    jacobian=(float, "force_count", "dofs"),
    demanded=(float, "force_count"),
    holds=(bool, "force_count"),
    cones=(float, "cone_count", "force_count"),
    normals=(float, "contact_count", "force_count"),
    largest=(float, "contact_count"),
    unit=float,
    # elimination: A of the equalities, b and then c, the fixed and the free unknowns, T, and work space
    fixed_count=int,
    free_count=int,
    rows=(float, "fixed_count", "dofs + force_count"),
    sides=(float, "fixed_count"),
    fixed=(int, "fixed_count"),
    free=(int, "free_count"),
    table=(float, "fixed_count", "free_count"),
    work=(float, 3, "dofs + force_count"),
    origins=(float, "force_count", "force_count"),
    # the QP over z
    limit_count=int,
    hessian=(float, "free_count", "free_count"),
    gradient=(float, "free_count"),
    matrix=(float, "limit_count", "free_count"),
    lower=(float, "limit_count"),
    upper=(float, "limit_count"),
    z_min=(float, "free_count"),
    z_max=(float, "free_count"),
    # the solution
    z=(float, "free_count"),
    acceleration=(float, "dofs"),
    force=(float, "force_count"),
    torque=(float, "dofs"),
)
"""What `build` and `finish` read and write."""

_whole_body_at = WHOLE_BODY.at


@part
def _write_equalities(body):
    """Write the rows A x = b: no torque at some DoFs, and accelerations of contacts; no force where one is lifted."""
    size = body.dofs
    first = body.passive_count
    rows = body.rows
    sides = body.sides
    for i in range(first):
        dof = body.passive[i]
        sides[i] = -body.bias[dof]
        for j in range(size):
            rows[i, j] = body.inertia[dof, j]
        for j in range(body.force_count):
            rows[i, size + j] = -body.unit * body.jacobian[j, dof]
    for i in range(body.force_count):
        rows[first + i] = 0.0
        sides[first + i] = 0.0
        if body.holds[i]:
            sides[first + i] = body.demanded[i]
            for j in range(size):
                rows[first + i, j] = body.jacobian[i, j]
        else:
            rows[first + i, size + i] = 1.0


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
def _reduce(body, row, out):
    """Write a row over the first unknowns x as one over z; return its constant part."""
    size = len(row)
    constant = 0.0
    for j in range(body.free_count):
        out[j] = row[body.free[j]] if body.free[j] < size else 0.0
    for i in range(body.fixed_count):
        if body.fixed[i] < size and row[body.fixed[i]] != 0.0:
            entry = row[body.fixed[i]]
            constant += entry * body.sides[i]
            for j in range(body.free_count):
                out[j] += entry * body.table[i, j]
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
def _write_cost(body):
    """Write the cost of all tasks, with a small weight of each unknown's square."""
    hessian = body.hessian
    gradient = body.gradient
    row = body.work[1, : body.free_count]
    hessian[:] = 0.0
    gradient[:] = 0.0
    for i in range(body.row_count):
        constant = _reduce(body, body.task_rows[i], row)
        _add_square(row, body.desired[i] - constant, 1.0, hessian, gradient)
    for i in range(body.fixed_count):
        _add_square(body.table[i], -body.sides[i], body.smallest[body.fixed[i]], hessian, gradient)
    for i in range(body.free_count):
        hessian[i, i] += body.smallest[body.free[i]]
        for j in range(i):
            hessian[j, i] = hessian[i, j]


def _build(start):
    """Write the QP over z; return whether the equalities have a solution.

    Rows of inequalities: torques of the driven DoFs, cones, normal forces, and the bounds of the fixed accelerations.
    """
    body = _whole_body_at(start)
    size = body.dofs
    matrix = body.matrix
    lower = body.lower
    upper = body.upper
    _write_equalities(body)
    if not _eliminate(body.rows, body.sides, body.passive_count, body.fixed, body.work[0], body.origins):
        return False
    _sort(body.rows, body.fixed, body.free, body.table)
    _write_cost(body)
    row = body.work[2]
    place = 0
    for i in range(body.driven_count):
        dof = body.driven[i]
        for j in range(size):
            row[j] = body.inertia[dof, j]
        for j in range(body.force_count):
            row[size + j] = -body.unit * body.jacobian[j, dof]
        constant = body.bias[dof] + _reduce(body, row, matrix[place])
        lower[place], upper[place] = -body.torque_limits[i] - constant, body.torque_limits[i] - constant
        place += 1
    row[:size] = 0.0
    for i in range(body.cone_count):
        row[size:] = body.cones[i]
        lower[place] = -np.inf
        upper[place] = -_reduce(body, row, matrix[place])
        place += 1
    for i in range(body.contact_count):
        row[size:] = body.normals[i]
        constant = _reduce(body, row, matrix[place])
        lower[place], upper[place] = -constant, body.largest[i] / body.unit - constant
        place += 1
    for i in range(body.fixed_count):
        fixed = body.fixed[i]
        matrix[place] = body.table[i]
        lower[place], upper[place] = -np.inf, np.inf
        if fixed < size:
            lower[place] = body.lower_acceleration[fixed] - body.sides[i]
            upper[place] = body.upper_acceleration[fixed] - body.sides[i]
        place += 1
    for i in range(body.free_count):
        free = body.free[i]
        body.z_min[i], body.z_max[i] = -np.inf, np.inf
        if free < size:
            body.z_min[i], body.z_max[i] = body.lower_acceleration[free], body.upper_acceleration[free]
    return True


@part
def _write_unknown(body, unknown, value):
    """Write an acceleration, or a force [N]."""
    if unknown < body.dofs:
        body.acceleration[unknown] = value
    else:
        body.force[unknown - body.dofs] = body.unit * value


def _finish(start):
    """Write accelerations, forces [N] and torques of a solution z: x_B = c + T z, and M a + h - Jc' f."""
    body = _whole_body_at(start)
    torque = body.torque
    for j in range(body.free_count):
        _write_unknown(body, body.free[j], body.z[j])
    for i in range(body.fixed_count):
        value = body.sides[i]
        for j in range(body.free_count):
            value += body.table[i, j] * body.z[j]
        _write_unknown(body, body.fixed[i], value)
    for i in range(body.dofs):
        torque[i] = body.bias[i]
        for j in range(body.dofs):
            torque[i] += body.inertia[i, j] * body.acceleration[j]
    for i in range(body.force_count):
        for j in range(body.dofs):
            torque[j] -= body.jacobian[i, j] * body.force[i]
    for i in range(body.passive_count):
        torque[body.passive[i]] = 0.0


def _touch(values, lower, upper, slack, active):
    """Write which values are at one of their limits, but for a small ratio of them, or of 1."""
    for i in range(len(values)):
        near = slack * max(1.0, abs(values[i]))
        active[i] = 1 if values[i] >= upper[i] - near or values[i] <= lower[i] + near else 0


build = cached("boolean(int64)", _build, REORDERED)
finish = cached("void(int64)", _finish, REORDERED)
touch = cached("void(float64[::1], float64[::1], float64[::1], float64, int64[::1])", _touch, REORDERED)
