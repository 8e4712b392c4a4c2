"""Positions of joints."""

from numba import carray

from solfer.points.compiled.instruction import columns_of, integers, jacobian_of, numbers_of, value_of
from solfer.points.compiled.registry import kernel


@kernel
def posture(row, program, with_jacobian):
    """Copy positions of DoFs; parameters: the positions of all, and the indices of those that count."""
    dofs = program.dofs
    columns = columns_of(row)
    value = value_of(row)
    jacobian = jacobian_of(row, program)
    positions = numbers_of(row, dofs)
    indices = carray(integers(row.table), (len(value),))
    for index in range(len(value)):
        value[index] = positions[indices[index]]
        if with_jacobian:
            for k in columns:  # those to which followers were added in the last update
                jacobian[index * dofs + k] = 0.0
            jacobian[index * dofs + indices[index]] = 1.0
