"""The centre of pressure."""

from numba import carray, njit

from solfer.points.compiled.layout import CONTACT_WIDTH, NUMBERS, SIZE_OF_FIRST, SMALLEST_FORCE, TABLE
from solfer.points.compiled.memory import floats, integers


@njit
def center_of_pressure(line, dofs, columns, value, jacobian, with_jacobian):
    """Mean of the contacts' positions in the plane across the normal, weighted with their normal forces.

    Parameters: the normal (3); a table with the addresses of every contact. Without force nothing presses: the value
    stays, and the Jacobian is zero.
    """
    count = line[SIZE_OF_FIRST]
    table = carray(integers(line[TABLE]), (count, CONTACT_WIDTH))
    normal = carray(floats(line[NUMBERS]), (3,))
    pressed = 0.0
    for contact in table:
        pressed += _normal_force(contact, normal)
    if with_jacobian:
        for index in range(3):
            for k in columns:
                jacobian[index * dofs + k] = 0.0
    if pressed < SMALLEST_FORCE:
        return
    value[:] = 0.0
    for contact in table:
        weight = _normal_force(contact, normal) / pressed
        if weight == 0.0:
            continue
        position = carray(floats(contact[0]), (3,))
        _add_across(weight, normal, position[0], position[1], position[2], value, 0, 1)
        if with_jacobian and contact[1] != 0:
            source = carray(floats(contact[1]), (3 * dofs,))
            for k in columns:
                _add_across(weight, normal, source[k], source[dofs + k], source[2 * dofs + k], jacobian, k, dofs)


@njit
def _normal_force(contact, normal):
    """Force of the ground along the normal [N]; a contact does not pull."""
    force, flags = carray(floats(contact[2]), (3,)), carray(integers(contact[3]), (2,))
    along = normal[0] * force[0] + normal[1] * force[1] + normal[2] * force[2]
    return 0.0 if flags[1] else max(along, 0.0)


@njit
def _add_across(weight, normal, x, y, z, out, first, step):
    """Add `weight` times the part of a vector across the normal to three entries of `out`."""
    along = normal[0] * x + normal[1] * y + normal[2] * z
    out[first] += weight * (x - along * normal[0])
    out[first + step] += weight * (y - along * normal[1])
    out[first + 2 * step] += weight * (z - along * normal[2])
