"""Compiled steps of `FrictionCones`: friction pyramids on a ground whose normal turns."""

import math

from solfer.numerics.blocks import BlockLayout
from solfer.numerics.compilation import cached, part

CONES = BlockLayout(
    "Cones",
    count=int,
    force_count=int,
    cone_count=int,
    starts=(int, "count + 1"),
    # normals where they are, and where they go, of contacts whose forces are in world axes
    turns=(bool, "count"),
    present=(float, "count", 3),
    goals=(float, "count", 3),
    # rows of G: what a force has along a side, less its share of what it has along the normal
    owners=(int, "cone_count"),
    sides=(float, "cone_count", "force_count"),
    ratios=(float, "cone_count"),
    normals=(float, "count", "force_count"),
    cones=(float, "cone_count", "force_count"),
)
"""What the kernels read and write."""

_cones_at = CONES.at


@part
def _write(block):
    """Write G of sides, ratios and normals."""
    for i in range(block.cone_count):
        for j in range(block.force_count):
            block.cones[i, j] = block.sides[i, j] - block.ratios[i] * block.normals[block.owners[i], j]


def _write_cones(start):
    """See `_write`."""
    _write(_cones_at(start))


def _turn(start, share):
    """Bring normals nearer to their goals by a share of what is left; return whether any has moved."""
    block = _cones_at(start)
    settled = 1e-6  # [rad] below which a normal has come to its goal
    has_moved = False
    for i in range(block.count):
        present = block.present[i]
        left = 0.0
        for k in range(3):
            left = max(left, abs(block.goals[i, k] - present[k]))
        if left == 0.0:
            continue
        has_moved = True
        part_left = 1.0 - share if left > settled else 0.0
        square = 0.0
        for k in range(3):
            present[k] = block.goals[i, k] + part_left * (present[k] - block.goals[i, k])
            square += present[k] * present[k]
        for k in range(3 if part_left else 0):
            present[k] /= math.sqrt(square)
        if block.turns[i]:
            _turn_rows(block, i, present[0], present[1], present[2])
    if has_moved:
        _write(block)
    return has_moved


@part
def _turn_rows(block, index, x, y, z):
    """Write the rows of a contact with the normal (x, y, z): along it, and along both sides, as `across` has them."""
    first = block.starts[index]
    length = math.hypot(y, z)
    side_y = z / length
    side_z = -y / length
    ahead = (side_y * z - side_z * y, side_z * x, -side_y * x)
    side = (0.0, side_y, side_z)
    normal = (x, y, z)
    row = 0
    for i in range(block.cone_count):
        if block.owners[i] == index:
            sign = 1.0 if row % 2 == 0 else -1.0
            for k in range(3):
                block.sides[i, first + k] = sign * (ahead[k] if row < 2 else side[k])
            row += 1
    for k in range(3):
        block.normals[index, first + k] = normal[k]


write_cones = cached("void(int64)", _write_cones)
turn = cached("boolean(int64, float64)", _turn)
