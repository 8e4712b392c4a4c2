"""The centre of mass and the centre of pressure."""

from numba import carray, njit

from solfer.points.compiled.instruction import (
    columns_of,
    contacts,
    floats,
    integers,
    jacobian_of,
    joints_of,
    numbers_of,
    placements_of,
    value_of,
)
from solfer.points.compiled.registry import kernel
from solfer.points.compiled.rigid import placed


@kernel
def center_of_mass(row, program, with_jacobian):
    """Compute the centre of mass; a joint moves it by its subtree's part of the mass, at the subtree's centre of mass.

    Parameters: parents of the joints; masses, levers (3), inertias (9), memory for the moments of subtrees (3 of 9),
    and the masses of subtrees.
    """
    joints = joints_of(program)
    placements = placements_of(program)
    value = value_of(row)
    jacobian = jacobian_of(row, program)
    dofs = program.dofs
    bodies = dofs + 1
    parents = carray(integers(row.table), (bodies,))
    numbers = numbers_of(row, 23 * bodies)
    masses = numbers[:bodies]
    levers = numbers[bodies : 4 * bodies]
    moments = numbers[13 * bodies : 16 * bodies]
    subtrees = numbers[22 * bodies :]
    moments[:3] = 0.0
    for body in range(1, bodies):
        x, y, z = placed(placements[body], levers[3 * body], levers[3 * body + 1], levers[3 * body + 2])
        moments[3 * body] = masses[body] * x
        moments[3 * body + 1] = masses[body] * y
        moments[3 * body + 2] = masses[body] * z
    scale = 1.0 / subtrees[0]
    for body in range(bodies - 1, 0, -1):
        mx = moments[3 * body]
        my = moments[3 * body + 1]
        mz = moments[3 * body + 2]
        above = 3 * parents[body]
        moments[above] += mx
        moments[above + 1] += my
        moments[above + 2] += mz
        if with_jacobian:
            column = joints[body - 1]
            mass = subtrees[body]
            k = body - 1
            jacobian[k] = scale * (mass * column[0] + column[4] * mz - column[5] * my)
            jacobian[dofs + k] = scale * (mass * column[1] + column[5] * mx - column[3] * mz)
            jacobian[2 * dofs + k] = scale * (mass * column[2] + column[3] * my - column[4] * mx)
    for i in range(3):
        value[i] = scale * moments[i]


@kernel
def center_of_pressure(row, program, with_jacobian):
    """Compute the mean of the contacts' positions across the normal, weighted with their normal forces.

    A contact with a moment t and the normal force f presses n x t / f beside its position. Parameters: the normal n
    (3); a table of `instruction.PRESSING`. Without normal forces the value stays, and the Jacobian is zero.
    """
    dofs = program.dofs
    columns = columns_of(row)
    value = value_of(row)
    jacobian = jacobian_of(row, program)
    table = carray(contacts(row.table), (row.table_rows,))
    normal = numbers_of(row, 3)
    pressed = 0.0
    for one in range(row.table_rows):
        pressed += _normal_force(table[one], normal)
    if with_jacobian:
        for index in range(3):
            for k in columns:
                jacobian[index * dofs + k] = 0.0
    if pressed < 1e-6:  # [N]
        return
    value[:] = 0.0
    for one in range(row.table_rows):
        contact = table[one]
        weight = _normal_force(contact, normal) / pressed
        if weight == 0.0:
            continue
        position = carray(floats(contact.value), (3,))
        _add_across(weight, normal, position[0], position[1], position[2], value, 0, 1)
        if contact.holds_moment:
            torque = carray(floats(contact.wrench), (6,))[3:]
            for i in range(3):
                j = (i + 1) % 3
                k = (i + 2) % 3
                value[i] += (normal[j] * torque[k] - normal[k] * torque[j]) / pressed
        if with_jacobian and contact.jacobian != 0:
            source = carray(floats(contact.jacobian), (3 * dofs,))
            for k in columns:
                _add_across(weight, normal, source[k], source[dofs + k], source[2 * dofs + k], jacobian, k, dofs)


@njit
def _normal_force(contact, normal):
    """Compute the force of the ground along the normal [N]; a contact does not pull."""
    force = carray(floats(contact.wrench), (3,))
    flags = carray(integers(contact.flags), (2,))
    along = normal[0] * force[0] + normal[1] * force[1] + normal[2] * force[2]
    return 0.0 if flags[1] else max(along, 0.0)


@njit
def _add_across(weight, normal, x, y, z, out, first, step):
    """Add `weight` times the part of a vector across the normal to three entries of `out`."""
    along = normal[0] * x + normal[1] * y + normal[2] * z
    out[first] += weight * (x - along * normal[0])
    out[first + step] += weight * (y - along * normal[1])
    out[first + 2 * step] += weight * (z - along * normal[2])
