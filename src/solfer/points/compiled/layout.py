"""Layout of a program: a header and one instruction a point, rows of an int64 array.

Instructions name values, Jacobians and parameters by their addresses, so that they may read memory of another
Handler; `solfer.points.program` makes the rows and keeps every array alive that they name. A Jacobian lies row by row
in memory, with as many columns as the header specifies. Only columns of joints that move a point are written, all
others are zero from the start.
"""

DOFS, JOINT_JACOBIAN, PLACEMENTS, VELOCITY, ACCELERATION = range(5)
"""Columns of the header: number of DoFs, then addresses of the arrays of a `solfer.model.KinematicTree`, and of the
accelerations of the DoFs."""

(
    OPERATION,
    VALUE,
    JACOBIAN,
    FIRST,
    FIRST_JACOBIAN,
    SECOND,
    SECOND_JACOBIAN,
    NUMBERS,
    TABLE,
    COLUMNS,
    COUNT,
    SIZE,
    ROWS,
    SIZE_OF_FIRST,
    JOINT,
    FLAGS,
) = range(16)
"""Columns of an instruction: operation; addresses of the point, of its two operands (0 for a Jacobian of zeros), of
its parameters (float64, int64) and of the list of its columns (int64); numbers of columns, values and rows; number of
values of the first operand, or of contacts; the joint that carries the point; address of two
flags (int64): 1 if the next update clears the Jacobian, 1 if the Jacobian stays zero."""

WIDTH = 16

POSITION, ORIENTATION, POSE, LINEAR_VELOCITY, ANGULAR_VELOCITY, SPATIAL_VELOCITY = 1, 2, 3, 5, 6, 7
"""Operations on rigid bodies, by bits: 1 linear, 2 angular, 4 velocity."""

(
    COPY,
    PLUS,
    MINUS,
    ORIENTATION_MINUS,
    POSE_MINUS,
    NORM,
    CENTER_OF_MASS,
    VERTEX,
    ROLLING,
    PRESSURE,
    ANGULAR_MOMENTUM,
    POSTURE,
    FOLD,
) = range(8, 21)
"""All other operations; the last one adds the columns of followers to those of their leaders."""

ACCELERATED = 32
"""Added to the operation of a velocity or of a wheel: its acceleration. The offset goes to the first operand."""

SMALLEST = 1e-9
"""Length below which a vector has no direction."""

SMALLEST_FORCE = 1e-6
"""Sum of normal forces below which there is no centre of pressure [N]."""

FOLD_WIDTH = 3
"""Columns of a follower in the table of a fold: its DoF, that of its leader, and whether that has a column already."""

CONTACT_WIDTH = 5
"""Columns of a contact in the table of a centre of pressure: addresses of value, Jacobian, wrench and flags, and
whether it constrains a moment."""
