"""Lowest points of wheels in the form of a torus."""

import math

from numba import njit

from solfer.points.compiled.instruction import (
    SMALLEST,
    columns_of,
    jacobian_of,
    joints_of,
    numbers_of,
    placements_of,
    value_of,
)
from solfer.points.compiled.registry import kernel
from solfer.points.compiled.rigid import linear, placed, turned


@kernel
def vertex(row, program, with_jacobian):
    """Update the lowest point of a torus; parameters: centre (3), axis (3) in the joint's frame, normal (3), radii.

    p = c - R d / |d| - r n with d = n - a (a.n), the part of the normal n across the axis a. Its derivative follows
    from the axis' velocity w x a.
    """
    _update(row, program, False, with_jacobian)


@kernel
def rolling(row, program, with_jacobian):
    """Update the same place with the Jacobian of the wheel's material there; parameters as in `vertex`."""
    _update(row, program, True, with_jacobian)


@njit
def _update(row, program, of_material, with_jacobian):
    value, numbers, placement = value_of(row), numbers_of(row, 11), placements_of(program)[row.joint]
    cx, cy, cz = placed(placement, numbers[0], numbers[1], numbers[2])
    ax, ay, az = turned(placement, numbers[3], numbers[4], numbers[5])
    nx, ny, nz, ring, tube = numbers[6], numbers[7], numbers[8], numbers[9], numbers[10]
    along = ax * nx + ay * ny + az * nz
    dx, dy, dz = nx - along * ax, ny - along * ay, nz - along * az
    length = math.sqrt(dx * dx + dy * dy + dz * dz)
    # a wheel that lies flat touches the ground with its whole ring: its centre stands for it
    scale = 1.0 / length if length > SMALLEST else 0.0
    dx, dy, dz = dx * scale, dy * scale, dz * scale
    px, py, pz = cx - ring * dx - tube * nx, cy - ring * dy - tube * ny, cz - ring * dz - tube * nz
    value[0], value[1], value[2] = px, py, pz
    if not with_jacobian:
        return
    dofs, joints, jacobian = program.dofs, joints_of(program), jacobian_of(row, program)
    for k in columns_of(row):
        column = joints[k]
        if of_material:
            vx, vy, vz = linear(column, px, py, pz)
        else:
            vx, vy, vz = linear(column, cx, cy, cz)
            ux, uy, uz = (
                column[4] * az - column[5] * ay,
                column[5] * ax - column[3] * az,
                column[3] * ay - column[4] * ax,
            )
            turn = ux * nx + uy * ny + uz * nz
            ux, uy, uz = -along * ux - turn * ax, -along * uy - turn * ay, -along * uz - turn * az
            part = ux * dx + uy * dy + uz * dz
            factor = ring * scale
            vx, vy, vz = vx - factor * (ux - part * dx), vy - factor * (uy - part * dy), vz - factor * (uz - part * dz)
        jacobian[k], jacobian[dofs + k], jacobian[2 * dofs + k] = vx, vy, vz
