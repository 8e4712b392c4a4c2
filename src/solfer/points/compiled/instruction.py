"""What the kernel executes: records of a program and of its instructions, and how kernels read them.

Instructions name values, Jacobians and parameters by their addresses, so that they may read memory of another
Handler; `solfer.points.program` makes them and keeps every array alive that they name. A Jacobian lies row by row in
memory, with as many columns as the program has DoFs. Only columns of joints that move a point are written, all others
are zero from the start.
"""

import numpy as np
from numba import carray, from_dtype, njit

from solfer.numerics.pointers import floats, integers, pointer_to

PROGRAM = np.dtype(
    [
        ("dofs", np.int64),  # columns of all Jacobians
        ("joints", np.int64),  # addresses of the arrays of a `solfer.model.KinematicTree`: Jacobian of the joints
        ("placements", np.int64),
        ("velocity", np.int64),
        ("acceleration", np.int64),  # address of the accelerations of the DoFs
        ("instructions", np.int64),  # address of the first instruction
        ("count", np.int64),  # number of instructions
    ]
)
"""A program; addresses are 0 where no point has a Robot."""

INSTRUCTION = np.dtype(
    [
        ("operation", np.int64),  # `solfer.points.compiled.kernel.Operation`
        ("value", np.int64),  # addresses of the point that is written
        ("jacobian", np.int64),
        ("offset", np.int64),  # of a dynamic point
        ("flags", np.int64),  # two int64: 1 if the next update clears the Jacobian, 1 if the Jacobian stays zero
        ("size", np.int64),  # numbers of the value
        ("rows", np.int64),  # rows of the Jacobian
        ("columns", np.int64),  # address of the DoFs that the operation runs over (int64)
        ("column_count", np.int64),
        ("first", np.int64),  # addresses of the operands; 0 for a Jacobian of zeros
        ("first_jacobian", np.int64),
        ("first_size", np.int64),
        ("second", np.int64),
        ("second_jacobian", np.int64),
        ("numbers", np.int64),  # address of parameters (float64)
        ("table", np.int64),  # address of parameters (int64, or records)
        ("table_rows", np.int64),
        ("joint", np.int64),  # joint that carries the point
        ("motion", np.int64),  # what of a link's motion: `LINEAR`, `ANGULAR` or their sum
    ]
)
"""One operation on one point; an address is 0 where there is nothing."""

FOLLOWER = np.dtype([("dof", np.int64), ("leader", np.int64), ("adds", np.int64)])
"""A follower in the table of `fold`: its DoF, that of its leader, and whether that has a column already."""

PRESSING = np.dtype([(name, np.int64) for name in ("value", "jacobian", "wrench", "flags", "holds_moment")])
"""A contact in the table of a centre of pressure: addresses, and whether it constrains a moment."""

LINEAR = 1
"""Linear part of a link's motion."""

ANGULAR = 2
"""Angular part of a link's motion."""

SMALLEST_LENGTH = 1e-9
"""Length below which a vector has no direction."""


programs = pointer_to(from_dtype(PROGRAM))
instructions = pointer_to(from_dtype(INSTRUCTION))
followers = pointer_to(from_dtype(FOLLOWER))
contacts = pointer_to(from_dtype(PRESSING))


@njit
def value_of(row):
    """Return the value that an instruction writes, shape (size,)."""
    return carray(floats(row.value), (row.size,))


@njit
def jacobian_of(row, program):
    """Return the Jacobian that an instruction writes, row by row, shape (rows * dofs,)."""
    return carray(floats(row.jacobian), (row.rows * program.dofs,))


@njit
def columns_of(row):
    """Return the DoFs that an instruction runs over, shape (m,)."""
    return carray(integers(row.columns), (row.column_count,))


@njit
def numbers_of(row, count):
    """Return the first `count` parameters of an instruction."""
    return carray(floats(row.numbers), (count,))


@njit
def joints_of(program):
    """Return the Jacobian of the joints: a row is the spatial velocity at the world's origin for one of each DoF."""
    return carray(floats(program.joints), (program.dofs, 6))


@njit
def placements_of(program):
    """Return the placements of the joints: rotation by columns, then the shift; shape (dofs + 1, 12)."""
    return carray(floats(program.placements), (program.dofs + 1, 12))


@njit
def velocity_of(program):
    """Return the velocities of the DoFs, shape (dofs,)."""
    return carray(floats(program.velocity), (program.dofs,))


@njit
def acceleration_of(program):
    """Return the accelerations of the DoFs, shape (dofs,)."""
    return carray(floats(program.acceleration), (program.dofs,))
