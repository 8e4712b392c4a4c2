"""Compiled steps of the parts of `GroundForces`, number by number. Arrays are described there."""

from pathlib import Path

from solfer.numerics import base_chart, pointers
from solfer.numerics.blocks import BlockLayout
from solfer.numerics.compilation import REORDERED, cached, exact_part, part
from solfer.numerics.dense import DENSE, backward, cholesky, forward
from solfer.numerics.pointers import matrix_at, vector_at

POINTERS = Path(pointers.__file__)

_moment_of = exact_part(base_chart.moment_of)


@part
def _normal_matrix(jacobian, weights, columns, diagonal, factor):
    """Write the factor of J S J^T plus a number on the diagonal."""
    rows = len(jacobian)
    for i in range(rows):
        for j in range(i + 1):
            factor[i, j] = diagonal if i == j else 0.0
        for column in columns:
            weighted = jacobian[i, column] * weights[column]
            if weighted != 0.0:
                for j in range(i + 1):
                    factor[i, j] += weighted * jacobian[j, column]
    cholesky(factor)


@exact_part
def _fit(weights, columns, diagonal, factor, forces, rest, jacobian, world):
    """Write the forces that explain the world best, and what they leave."""
    _normal_matrix(jacobian, weights, columns, diagonal, factor)
    for i in range(len(forces)):
        forces[i] = 0.0
        for column in columns:
            forces[i] += jacobian[i, column] * weights[column] * world[column]
    forward(factor, forces)
    backward(factor, forces)
    for column in range(len(rest)):
        rest[column] = world[column]
    for i in range(len(forces)):
        for column in columns:
            rest[column] -= jacobian[i, column] * forces[i]


@exact_part
def _observe(bias, torque, inertia, velocity, before, period, coefficient, seen, value):
    """Let what the world does come nearer to h + M dv/dt - torque by a ratio of the difference.

    `seen` is work space. M is symmetric: its rows are its columns, and sums run through memory in its order.
    """
    count = len(value)
    for i in range(count):
        seen[i] = bias[i] - torque[i]
    for k in range(count):
        acceleration = (velocity[k] - before[k]) / period
        before[k] = velocity[k]
        row = inertia[k]
        for i in range(count):
            seen[i] += row[i] * acceleration
    for i in range(count):
        value[i] += coefficient * (seen[i] - value[i])


EXPLANATION = BlockLayout(
    "Explanation",
    row_count=int,
    dofs=int,
    # dynamics and torques, whether accelerations count, and what the world does
    bias=(float, "dofs"),
    torque=(float, "dofs"),
    observes=int,
    inertia=(float, "dofs", "dofs"),
    velocity=(float, "dofs"),
    before=(float, "dofs"),
    world=(float, "dofs"),
    # the same with offsets, and the forces that explain it best
    offsets=(float, "dofs"),
    corrected=(float, "dofs"),
    jacobian=(float, "row_count", "dofs"),
    weights=(float, "dofs"),
    column_count=int,
    columns=(int, "column_count"),
    diagonal=float,
    factor=(float, "row_count", "row_count"),
    forces=(float, "row_count"),
    rest=(float, "dofs"),
    # what is left at a floating base, in the axes of its chart and in those of the world
    is_floating=int,
    position=(float, "dofs"),
    rotation=(float, 3, 3),
    push=(float, 6),
)
"""What `explain` reads and writes."""

_explanation_at = EXPLANATION.at


def _explain(start, period, coefficient):
    """Write what the world does, the forces that explain it, and the push on the base; see `WeightedForces`."""
    block = _explanation_at(start)
    bias = block.bias
    torque = block.torque
    world = block.world
    rest = block.rest
    corrected = block.corrected
    if block.observes:
        _observe(bias, torque, block.inertia, block.velocity, block.before, period, coefficient, rest, world)
    else:
        for i in range(block.dofs):
            world[i] = bias[i] - torque[i]
    for i in range(block.dofs):
        corrected[i] = world[i] + block.offsets[i]
    _fit(block.weights, block.columns, block.diagonal, block.factor, block.forces, rest, block.jacobian, corrected)
    if block.is_floating:
        moment = _moment_of(block.position[3], block.position[4], rest[3], rest[4], rest[5])
        for axis in range(3):
            block.push[axis] = block.push[3 + axis] = 0.0
            for k in range(3):
                block.push[axis] += block.rotation[axis, k] * rest[k]
                block.push[3 + axis] += block.rotation[axis, k] * moment[k]


PUSHED = BlockLayout(
    "Pushed",
    count=int,
    dofs=int,
    # addresses of the Jacobians, the wrenches and the published forces of contacts
    sources=(int, "count"),
    wrenches=(int, "count"),
    ports=(int, "count"),
    normals=(float, "count", 3),
    velocity=(float, "dofs"),
    jacobian=(float, "3 * count", "dofs"),
    forces=(float, "count", 3),
    normal_forces=(float, "count"),
    speeds=(float, "count"),
    sums=(float, "count", 3),
    # J^T f - h, and the torques besides
    bias=(float, "dofs"),
    torque=(float, "dofs"),
    bias_force=(float, "dofs"),
    overall_force=(float, "dofs"),
)
"""What `gather`, `push`, `measure` and `publish` read and write."""

_pushed_at = PUSHED.at


def _gather(start):
    """Read the Jacobians of the contacts."""
    block = _pushed_at(start)
    for i in range(block.count):
        source = matrix_at(block.sources[i], 3, block.dofs)
        for axis in range(3):
            block.jacobian[3 * i + axis] = source[axis]


def _push(start, forces):
    """Write forces without torques to the contacts."""
    block = _pushed_at(start)
    for i in range(block.count):
        wrench = vector_at(block.wrenches[i], 6)
        for axis in range(3):
            wrench[axis] = forces[i, axis]
            wrench[3 + axis] = 0.0


def _measure(start):
    """Read the force of each contact; write its force and speed along its normal."""
    block = _pushed_at(start)
    for i in range(block.count):
        wrench = vector_at(block.wrenches[i], 6)
        block.normal_forces[i] = block.speeds[i] = 0.0
        for axis in range(3):
            row = block.jacobian[3 * i + axis]
            speed = 0.0
            for k in range(block.dofs):
                speed += row[k] * block.velocity[k]
            block.forces[i, axis] = wrench[axis]
            block.speeds[i] += block.normals[i, axis] * speed
            block.normal_forces[i] += block.normals[i, axis] * wrench[axis]


def _publish(start, touching):
    """Take forces of contacts that do not touch away; publish and sum up the others, and what they do to the DoFs."""
    block = _pushed_at(start)
    effect = block.bias_force
    effect[:] = 0.0
    for i in range(block.count):
        if not touching[i]:
            vector_at(block.wrenches[i], 6)[:] = 0.0
            block.forces[i] = 0.0
        vector_at(block.ports[i], 3)[:] = block.forces[i]
        for axis in range(3):
            force = block.forces[i, axis]
            block.sums[i, axis] += force
            row = block.jacobian[3 * i + axis]
            for k in range(block.dofs):
                effect[k] += row[k] * force
    for k in range(block.dofs):
        effect[k] -= block.bias[k]
        block.overall_force[k] = effect[k] + block.torque[k]


def _touch(limits, touching, lifted, times, forces, speeds, period):
    """Decide which contacts touch, see `Touch`.

    Args:
        limits: Force from which on one touches, below which it ends [N], time until it changes [s], and reduction of
            the force by the speed [Ns/m].
        touching: Which touch; written.
        lifted: Which are in the air for sure; written.
        times: For how long each was about to change, and has not touched [s]; written.
        forces: Their normal forces [N].
        speeds: Their speeds along the normal [m/s].
        period: Time since the cycle before [s].
    """
    begin, end, delay, reduction = limits
    for i in range(len(forces)):
        force = forces[i] - reduction * abs(speeds[i])
        changes = force < end if touching[i] else force > begin
        times[0, i] = times[0, i] + period if changes else 0.0
        if changes and times[0, i] >= delay - 1e-9:
            touching[i] = not touching[i]
            times[0, i] = 0.0
        times[1, i] = 0.0 if touching[i] else times[1, i] + period
        lifted[i] = times[1, i] > 0.1  # [s]


OFFSETS = BlockLayout(
    "Offsets",
    row_count=int,
    dofs=int,
    # weights while nothing pushes the base, and while something does
    calm=(float, "dofs"),
    pushed=(float, "dofs"),
    # columns that count, the first of them that is a joint, and a number on the diagonal of J S J^T
    column_count=int,
    columns=(int, "column_count"),
    first=int,
    diagonal=float,
    # by how much a cycle counts, by how much what is known fades in it, and what is known before
    fraction=float,
    decay=float,
    prior=float,
    # of the joints: information, the same times the offsets, and the offsets
    size=int,
    information=(float, "size", "size"),
    moments=(float, "size"),
    offsets=(float, "size"),
    value=(float, "dofs"),  # those of all DoFs
    # work space: the Jacobian of contacts that are not lifted
    jacobian=(float, "row_count", "dofs"),
    factor=(float, "row_count", "row_count"),
    spread=(float, "row_count", "size"),
    needed=(float, "row_count"),
    solved=(float, "size", "size"),
)
"""What `learn` reads and writes."""

_offsets_at = OFFSETS.at


@exact_part
def _spread_weights(block, weights, lifted, contacts):
    """Write the Jacobian without lifted contacts, and L^-1 J S of the joints, with the factor L of J S J^T."""
    jacobian = block.jacobian
    factor = block.factor
    spread = block.spread
    columns = block.columns
    for i in range(block.row_count):
        for k in range(block.dofs):
            jacobian[i, k] = 0.0 if lifted[i // 3] else contacts[i, k]
    _normal_matrix(jacobian, weights, columns, block.diagonal, factor)
    for i in range(block.row_count):
        row = spread[i]
        for a in range(block.size):
            column = columns[block.first + a]
            row[a] = jacobian[i, column] * weights[column]
        for k in range(i):
            for a in range(block.size):
                row[a] -= factor[i, k] * spread[k, a]
        for a in range(block.size):
            row[a] /= factor[i, i]


def _learn(start, contacts, world, lifted, pushed):
    """Add what a cycle reports of the offsets of the joints `columns[first:]`, and write the likeliest ones."""
    block = _offsets_at(start)
    weights = block.pushed if pushed else block.calm
    columns = block.columns
    fraction = block.fraction
    decay = block.decay
    spread = block.spread
    needed = block.needed
    solved = block.solved
    offsets = block.offsets
    _spread_weights(block, weights, lifted, contacts)
    for i in range(block.row_count):
        needed[i] = 0.0
        for column in columns:
            needed[i] += block.jacobian[i, column] * weights[column] * world[column]
    forward(block.factor, needed)
    for a in range(block.size):
        column = columns[block.first + a]
        left = weights[column] * world[column]
        row = solved[a]
        row[:] = 0.0
        row[a] = weights[column]
        for i in range(block.row_count):
            left -= spread[i, a] * needed[i]
            for b in range(a + 1):
                row[b] -= spread[i, a] * spread[i, b]
        block.moments[a] += -fraction * left - decay * block.moments[a]
        for b in range(a + 1):
            block.information[a, b] += fraction * row[b] - decay * block.information[a, b]
            row[b] = block.information[a, b]
        row[a] += block.prior
    cholesky(solved)
    for a in range(block.size):
        offsets[a] = block.moments[a]
    forward(solved, offsets)
    backward(solved, offsets)
    for a in range(block.size):
        block.value[columns[block.first + a]] = offsets[a]


_MATRIX = "float64[:, ::1]"
_VECTOR = "float64[::1]"

explain = cached("void(int64, float64, float64)", _explain, sources=[DENSE, Path(base_chart.__file__)])
learn = cached(f"void(int64, {_MATRIX}, {_VECTOR}, boolean[::1], boolean)", _learn, sources=[DENSE])
gather = cached("void(int64)", _gather, sources=[POINTERS])
push = cached(f"void(int64, {_MATRIX})", _push, sources=[POINTERS])
measure = cached("void(int64)", _measure, REORDERED, sources=[POINTERS])
publish = cached("void(int64, boolean[::1])", _publish, sources=[POINTERS])
touch = cached(
    f"void({_VECTOR}, boolean[::1], boolean[::1], {_MATRIX}, {_VECTOR}, {_VECTOR}, float64)",
    _touch,
)
