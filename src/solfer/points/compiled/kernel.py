"""The kernel: executes the points' instructions in order. It is compiled, or read from the cache, on import.

It keeps the lock of Python's interpreter: releasing it for a microsecond may cost milliseconds to get it back.
"""

from pathlib import Path

from numba import carray

from solfer.numerics.compilation import cached, digest
from solfer.points.compiled.acceleration import accelerate
from solfer.points.compiled.algebra import (
    copy,
    fold,
    norm,
    orientation_difference,
    pose_difference,
    total,
    turn_difference,
)
from solfer.points.compiled.centers import center_of_mass, center_of_pressure
from solfer.points.compiled.layout import (
    ACCELERATED,
    ACCELERATION,
    ANGULAR_MOMENTUM,
    CENTER_OF_MASS,
    COLUMNS,
    COPY,
    COUNT,
    DOFS,
    FIRST,
    FLAGS,
    FOLD,
    JACOBIAN,
    JOINT_JACOBIAN,
    MINUS,
    NORM,
    OPERATION,
    ORIENTATION_MINUS,
    PLACEMENTS,
    PLUS,
    POSE_MINUS,
    POSTURE,
    PRESSURE,
    ROLLING,
    ROWS,
    SECOND,
    SIZE,
    SPATIAL_VELOCITY,
    VALUE,
    VELOCITY,
    VERTEX,
)
from solfer.points.compiled.memory import floats, integers
from solfer.points.compiled.momentum import angular_momentum
from solfer.points.compiled.posture import posture
from solfer.points.compiled.rigid import rigid
from solfer.points.compiled.vertex import vertex


def _compile(sources: str):
    """Compile the kernels; the digest of their sources is in its closure, which is part of the cache's key."""

    def run(program, with_jacobians):
        """Update the points of a program; see `solfer.points.compiled.layout`."""
        sources  # noqa: B018 it has to be used to be in the closure
        dofs = program[0, DOFS]
        joints = carray(floats(program[0, JOINT_JACOBIAN]), (dofs, 6))
        placements = carray(floats(program[0, PLACEMENTS]), (dofs + 1, 12))
        velocity = carray(floats(program[0, VELOCITY]), (dofs,))
        acceleration = carray(floats(program[0, ACCELERATION]), (dofs,))
        for index in range(1, len(program)):
            line = program[index]
            is_accelerated = line[OPERATION] >= ACCELERATED
            operation = line[OPERATION] - ACCELERATED if is_accelerated else line[OPERATION]
            value = carray(floats(line[VALUE]), (line[SIZE],))
            jacobian = carray(floats(line[JACOBIAN]), (line[ROWS] * dofs,))
            columns = carray(integers(line[COLUMNS]), (line[COUNT],))
            flags = carray(integers(line[FLAGS]), (2,))
            if with_jacobians and flags[0]:
                jacobian[:] = 0.0
                flags[0] = 0
            with_jacobian = with_jacobians and not flags[1]
            if operation <= SPATIAL_VELOCITY:
                rigid(line, joints, placements, velocity, columns, value, jacobian, with_jacobian)
            elif operation == PLUS:
                total(line, dofs, 1.0, columns, value, jacobian, with_jacobian)
            elif operation == MINUS:
                total(line, dofs, -1.0, columns, value, jacobian, with_jacobian)
            elif operation == ORIENTATION_MINUS:
                a, b = carray(floats(line[FIRST]), (4,)), carray(floats(line[SECOND]), (4,))
                orientation_difference(a, b, value)
                if with_jacobian:
                    turn_difference(line, 0, dofs, value, columns, jacobian)
            elif operation == POSE_MINUS:
                pose_difference(line, dofs, columns, value, jacobian, with_jacobian)
            elif operation == NORM:
                norm(line, dofs, columns, value, jacobian, with_jacobian)
            elif operation == CENTER_OF_MASS:
                center_of_mass(line, joints, placements, value, jacobian, with_jacobian)
            elif operation == VERTEX or operation == ROLLING:
                vertex(line, joints, placements, columns, value, jacobian, with_jacobian)
            elif operation == PRESSURE:
                center_of_pressure(line, dofs, columns, value, jacobian, with_jacobian)
            elif operation == FOLD:
                if with_jacobian:
                    fold(line, dofs, jacobian)
            elif operation == ANGULAR_MOMENTUM:
                angular_momentum(line, joints, placements, velocity, value, jacobian, with_jacobian)
            elif operation == POSTURE:
                posture(line, dofs, columns, value, jacobian, with_jacobian)
            elif operation == COPY:
                copy(line, dofs, value, jacobian, with_jacobian)
            if is_accelerated:
                accelerate(line, joints, placements, velocity, acceleration, columns, value)

    def difference(a, b, out):
        """Compute a difference; see `orientation_difference`."""
        sources  # noqa: B018 as above
        orientation_difference(a, b, out)

    return (
        cached("void(int64[:, ::1], boolean)", run),
        cached("void(float64[::1], float64[::1], float64[::1])", difference),
    )


run, difference = _compile(digest(Path(__file__).parent.glob("*.py")))
