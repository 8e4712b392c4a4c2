"""The centre of mass."""

from numba import carray, njit

from solfer.points.compiled.layout import NUMBERS, TABLE
from solfer.points.compiled.memory import floats, integers
from solfer.points.compiled.rigid import placed


@njit
def center_of_mass(line, joints, placements, value, jacobian, with_jacobian):
    """Centre of mass; parameters: parents of the joints; masses, levers (3), masses and moments (3) of subtrees.

    A joint moves the centre of mass by its subtree's share of the mass, at the subtree's centre of mass.
    """
    dofs = len(joints)
    bodies = dofs + 1
    parents = carray(integers(line[TABLE]), (bodies,))
    numbers = carray(floats(line[NUMBERS]), (8 * bodies,))
    masses, levers = numbers[:bodies], numbers[bodies:4 * bodies]
    subtrees, moments = numbers[4 * bodies:5 * bodies], numbers[5 * bodies:]
    moments[:3] = 0.0
    for body in range(1, bodies):
        x, y, z = placed(placements[body], levers[3 * body], levers[3 * body + 1], levers[3 * body + 2])
        moments[3 * body] = masses[body] * x
        moments[3 * body + 1] = masses[body] * y
        moments[3 * body + 2] = masses[body] * z
    share = 1.0 / subtrees[0]
    for body in range(bodies - 1, 0, -1):
        mx, my, mz = moments[3 * body], moments[3 * body + 1], moments[3 * body + 2]
        above = 3 * parents[body]
        moments[above] += mx
        moments[above + 1] += my
        moments[above + 2] += mz
        if with_jacobian:
            column, mass, k = joints[body - 1], subtrees[body], body - 1
            jacobian[k] = share * (mass * column[0] + column[4] * mz - column[5] * my)
            jacobian[dofs + k] = share * (mass * column[1] + column[5] * mx - column[3] * mz)
            jacobian[2 * dofs + k] = share * (mass * column[2] + column[3] * my - column[4] * mx)
    for i in range(3):
        value[i] = share * moments[i]
