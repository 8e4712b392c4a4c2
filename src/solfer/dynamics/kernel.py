"""Recursions over the bodies of a robot, compiled, or read from the cache, on import.

Everything is written in world axes at the world's origin, where Pinocchio's kinematics leave the axes of the joints, so
that nothing has to be transformed from one body to the next. Body k is what joint k + 1 moves; its parent is body
`parents[k]`, or -1 for the world. A body's index is above its parent's, and a subtree is the bodies k to `last[k]`.
Source: R. Featherstone, "Rigid Body Dynamics Algorithms", 2008: tables 5.1 and 6.2 and section 6.5.
"""

import math

from solfer.numerics.blocks import BlockLayout
from solfer.numerics.compilation import REORDERED, cached, part

# what is to be computed, as a sum
PLACE = 1
"""The inertias of the bodies in world axes, which the others need after each change of positions."""

WITH_BIAS = 2
"""The bias force."""

WITH_INERTIA = 4
"""The inertia matrix."""

BODIES = BlockLayout(
    "Bodies",
    size=int,
    # the tree: see `KinematicTree`; the parent of each body
    joints=(float, "size", 6),
    placements=(float, "size + 1", 12),
    velocity=(float, "size"),
    masses=(float, "size + 1"),
    levers=(float, "size + 1", 3),
    inertias=(float, "size + 1", 3, 3),
    armature=(float, "size"),
    parents=(int, "size"),
    gravity=(float, 3),
    # inertias of a body alone, and of all that it carries; its velocity and acceleration; the force on it
    spatial=(float, "size", 10),
    composite=(float, "size", 10),
    motion=(float, "size", 12),
    force=(float, "size", 6),
    # results
    bias=(float, "size"),
    inertia=(float, "size", "size"),
)
"""What `compute` reads and writes."""

_bodies_at = BODIES.at

_MATRIX = "float64[:, ::1]"
_NUMBERS = "float64[::1]"
_INDICES = "int64[::1]"


@part
def _place(placements, masses, levers, inertias, spatial):
    """Write the spatial inertia of each body: mass, mass times centre, and xx, yy, zz, xy, xz, yz about the origin."""
    for k in range(len(spatial)):
        pose = placements[k + 1]
        mass = masses[k + 1]
        lever = levers[k + 1]
        inertia = inertias[k + 1]
        out = spatial[k]
        x = pose[0] * lever[0] + pose[3] * lever[1] + pose[6] * lever[2] + pose[9]
        y = pose[1] * lever[0] + pose[4] * lever[1] + pose[7] * lever[2] + pose[10]
        z = pose[2] * lever[0] + pose[5] * lever[1] + pose[8] * lever[2] + pose[11]
        out[0], out[1], out[2], out[3] = mass, mass * x, mass * y, mass * z
        out[4], out[5], out[6] = mass * (y * y + z * z), mass * (x * x + z * z), mass * (x * x + y * y)
        out[7], out[8], out[9] = -mass * x * y, -mass * x * z, -mass * y * z
        # R I R^T, the columns of R lie one after the other
        for i in range(3):
            for j in range(3):
                entry = inertia[i, j]
                ax = pose[3 * i]
                ay = pose[3 * i + 1]
                az = pose[3 * i + 2]
                bx = pose[3 * j]
                by = pose[3 * j + 1]
                bz = pose[3 * j + 2]
                out[4] += ax * entry * bx
                out[5] += ay * entry * by
                out[6] += az * entry * bz
                out[7] += ax * entry * by
                out[8] += ax * entry * bz
                out[9] += ay * entry * bz


@part
def _bias(joints, velocity, parents, spatial, gravity, motion, force, bias):
    """Write the bias force: the recursive Newton-Euler algorithm without accelerations of the DoFs.

    `motion` is velocity and acceleration of each body, `force` the force on it; linear first.
    """
    for k in range(len(parents)):
        joint = joints[k]
        rate = velocity[k]
        above = parents[k]
        here = motion[k]
        needed = force[k]
        body = spatial[k]
        if above < 0:
            ux = uy = uz = wx = wy = wz = 0.0
            ax = -gravity[0]
            ay = -gravity[1]
            az = -gravity[2]
            bx = 0.0
            by = 0.0
            bz = 0.0
        else:
            before = motion[above]
            ux = before[0]
            uy = before[1]
            uz = before[2]
            wx = before[3]
            wy = before[4]
            wz = before[5]
            ax = before[6]
            ay = before[7]
            az = before[8]
            bx = before[9]
            by = before[10]
            bz = before[11]
        sx = rate * joint[0]
        sy = rate * joint[1]
        sz = rate * joint[2]
        tx = rate * joint[3]
        ty = rate * joint[4]
        tz = rate * joint[5]
        # the joint's axis moves along with the body that carries it: V x S
        ax += wy * sz - wz * sy + uy * tz - uz * ty
        ay += wz * sx - wx * sz + uz * tx - ux * tz
        az += wx * sy - wy * sx + ux * ty - uy * tx
        bx += wy * tz - wz * ty
        by += wz * tx - wx * tz
        bz += wx * ty - wy * tx
        ux = ux + sx
        uy = uy + sy
        uz = uz + sz
        wx = wx + tx
        wy = wy + ty
        wz = wz + tz
        here[0] = ux
        here[1] = uy
        here[2] = uz
        here[3] = wx
        here[4] = wy
        here[5] = wz
        here[6] = ax
        here[7] = ay
        here[8] = az
        here[9] = bx
        here[10] = by
        here[11] = bz
        mass = body[0]
        hx = body[1]
        hy = body[2]
        hz = body[3]
        # momentum, and the force that the acceleration takes
        px = mass * ux + wy * hz - wz * hy
        py = mass * uy + wz * hx - wx * hz
        pz = mass * uz + wx * hy - wy * hx
        lx = hy * uz - hz * uy + body[4] * wx + body[7] * wy + body[8] * wz
        ly = hz * ux - hx * uz + body[7] * wx + body[5] * wy + body[9] * wz
        lz = hx * uy - hy * ux + body[8] * wx + body[9] * wy + body[6] * wz
        needed[0] = mass * ax + by * hz - bz * hy + wy * pz - wz * py
        needed[1] = mass * ay + bz * hx - bx * hz + wz * px - wx * pz
        needed[2] = mass * az + bx * hy - by * hx + wx * py - wy * px
        needed[3] = (
            hy * az - hz * ay + body[4] * bx + body[7] * by + body[8] * bz + wy * lz - wz * ly + uy * pz - uz * py
        )
        needed[4] = (
            hz * ax - hx * az + body[7] * bx + body[5] * by + body[9] * bz + wz * lx - wx * lz + uz * px - ux * pz
        )
        needed[5] = (
            hx * ay - hy * ax + body[8] * bx + body[9] * by + body[6] * bz + wx * ly - wy * lx + ux * py - uy * px
        )
    for k in range(len(parents) - 1, -1, -1):
        joint = joints[k]
        needed = force[k]
        above = parents[k]
        bias[k] = (
            joint[0] * needed[0]
            + joint[1] * needed[1]
            + joint[2] * needed[2]
            + joint[3] * needed[3]
            + joint[4] * needed[4]
            + joint[5] * needed[5]
        )
        if above >= 0:
            for i in range(6):
                force[above, i] += needed[i]


@part
def _inertia(joints, parents, spatial, composite, inertia):
    """Write both triangles of the inertia matrix: the composite-rigid-body algorithm. Zeros are not written."""
    composite[:] = spatial
    for k in range(len(parents) - 1, -1, -1):
        joint = joints[k]
        body = composite[k]
        above = parents[k]
        mass = body[0]
        hx = body[1]
        hy = body[2]
        hz = body[3]
        ux = joint[0]
        uy = joint[1]
        uz = joint[2]
        wx = joint[3]
        wy = joint[4]
        wz = joint[5]
        fx = mass * ux + wy * hz - wz * hy
        fy = mass * uy + wz * hx - wx * hz
        fz = mass * uz + wx * hy - wy * hx
        nx = hy * uz - hz * uy + body[4] * wx + body[7] * wy + body[8] * wz
        ny = hz * ux - hx * uz + body[7] * wx + body[5] * wy + body[9] * wz
        nz = hx * uy - hy * ux + body[8] * wx + body[9] * wy + body[6] * wz
        j = k
        while j >= 0:
            other = joints[j]
            entry = other[0] * fx + other[1] * fy + other[2] * fz + other[3] * nx + other[4] * ny + other[5] * nz
            inertia[k, j] = inertia[j, k] = entry
            j = parents[j]
        if above >= 0:
            for i in range(10):
                composite[above, i] += body[i]


def _compute(start, parts):
    """Compute bodies, bias force and inertia matrix with the rotors; `parts` is a sum of PLACE and what follows it."""
    bodies = _bodies_at(start)
    joints = bodies.joints
    parents = bodies.parents
    spatial = bodies.spatial
    if parts & PLACE:
        _place(bodies.placements, bodies.masses, bodies.levers, bodies.inertias, spatial)
    if parts & WITH_BIAS:
        _bias(joints, bodies.velocity, parents, spatial, bodies.gravity, bodies.motion, bodies.force, bodies.bias)
    if parts & WITH_INERTIA:
        _inertia(joints, parents, spatial, bodies.composite, bodies.inertia)
        for k in range(bodies.size):
            bodies.inertia[k, k] += bodies.armature[k]


def _inverse(inertia, parents, last, factor, roots, inverse):
    """Write both triangles of the inverse inertia M^-1 = W W^T, W = L^-1, from the factors M = L^T L.

    The factors have entries only where one body carries the other. `factor` contains L below the diagonal, row j from j
    on then column j of W; `roots` the inverse diagonal of L.

    Returns:
        -1, or the body at which the inertia matrix proves not to be positive definite.
    """
    size = len(parents)
    for k in range(size):
        j = k
        while j >= 0:
            factor[k, j] = inertia[k, j]
            j = parents[j]
    for k in range(size - 1, -1, -1):
        if not factor[k, k] > 0.0:
            return k
        roots[k] = 1.0 / math.sqrt(factor[k, k])
        i = parents[k]
        while i >= 0:
            factor[k, i] *= roots[k]
            i = parents[i]
        i = parents[k]
        while i >= 0:
            entry = factor[k, i]
            j = i
            while j >= 0:
                factor[i, j] -= entry * factor[k, j]
                j = parents[j]
            i = parents[i]
    for j in range(size):
        factor[j, j] = roots[j]
        for k in range(j + 1, last[j] + 1):
            total = 0.0
            i = parents[k]
            while i >= j:
                total += factor[k, i] * factor[j, i]
                i = parents[i]
            factor[j, k] = -total * roots[k]
    inverse[:] = 0.0
    for j in range(size):
        column = factor[j, j : last[j] + 1]
        for a in range(len(column)):
            entry = column[a]
            row = inverse[j + a, j : last[j] + 1]
            for b in range(len(column)):
                row[b] += entry * column[b]
    return -1


compute = cached("void(int64, int64)", _compute, REORDERED)
inverse = cached(f"int64({_MATRIX}, {_INDICES}, {_INDICES}, {_MATRIX}, {_NUMBERS}, {_MATRIX})", _inverse, REORDERED)
