"""Positions of joints."""

from numba import carray, njit

from solfer.points.compiled.layout import NUMBERS, TABLE
from solfer.points.compiled.memory import floats, integers


@njit
def posture(line, dofs, columns, value, jacobian, with_jacobian):
    """Copy positions of DoFs; parameters: the positions of all, and the indices of those that count."""
    positions, indices = carray(floats(line[NUMBERS]), (dofs,)), carray(integers(line[TABLE]), (len(value),))
    for row in range(len(value)):
        value[row] = positions[indices[row]]
        if with_jacobian:
            for k in columns:  # those to which followers were added in the last update
                jacobian[row * dofs + k] = 0.0
            jacobian[row * dofs + indices[row]] = 1.0
