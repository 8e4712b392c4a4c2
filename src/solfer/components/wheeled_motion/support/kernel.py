"""Where motions come to rest, compiled: the support polygon, wheels that tilt, legs that do not reach farther."""

import math

import numpy as np

from solfer.numerics.compilation import cached, part
from solfer.numerics.pointers import flags_at, indices_at, matrix_at, record_at, vector_at

FIRST, SECOND, INSIDE, NORMAL_X, NORMAL_Y, EDGE_SIZE = range(6)
"""Columns of edges: vertices, distance of the centre of mass, normal to the inside; and how many there are."""

MARGIN, REASON, AMOUNT, WORST, AGE, STATE_SIZE = range(6)
"""State of the guard: margin [m], what holds the motion, by how much, by which ratio to its bound, since when [s]."""

NOTHING, POLYGON, FIRST_ROW = range(3)
"""What holds the motion: nothing, the margin, the first of the rows that are watched; joints of legs follow these."""

GUARD = np.dtype(
    [
        *((name, np.int64) for name in ("count", "dofs", "rows")),
        # addresses of the polygon: places and Jacobians of vertices and centre of mass, which are lifted, edges
        *((name, np.int64) for name in ("points", "lifted", "order", "edges")),
        # first rows of the tasks; -1: there is no such task. Then addresses of their errors, rates by which errors go
        # away, desired rates, the way that is held, and joint velocities
        *((name, np.int64) for name in ("of_base", "of_vertices")),
        *((name, np.int64) for name in ("error", "away", "forward", "held", "velocity")),
        # rows that are watched, and their bounds; joints of the legs, and those that steer
        *((name, np.int64) for name in ("state", "watched_count", "watched", "bounds")),
        *((name, np.int64) for name in ("leg_count", "legs", "turning_count", "turning")),
        ("required_margin", np.float64),
    ]
)
"""What `hold_back` reads and writes, see `solfer.numerics.pointers.Memory`."""

_guard_at = record_at(GUARD)


@part
def _find(points, lifted, order, edges):
    """Write the edges between vertices on the ground, counterclockwise; return their number."""
    count = len(lifted)
    size = 0
    x = 0.0
    y = 0.0
    for index in range(count):
        if not lifted[index]:
            place = vector_at(points[index, 0], 2)
            order[size] = index
            x = x + place[0]
            y = y + place[1]
            size = size + 1
    x = x / size
    y = y / size
    for i in range(1, size):
        index = order[i]
        place = vector_at(points[index, 0], 2)
        angle = math.atan2(place[1] - y, place[0] - x)
        k = i
        while k > 0:
            other = vector_at(points[order[k - 1], 0], 2)
            if math.atan2(other[1] - y, other[0] - x) <= angle:
                break
            order[k] = order[k - 1]
            k -= 1
        order[k] = index
    center = vector_at(points[count, 0], 2)
    for i in range(size):
        first = order[i]
        second = order[(i + 1) % size]
        a = vector_at(points[first, 0], 2)
        b = vector_at(points[second, 0], 2)
        length = max(math.hypot(b[0] - a[0], b[1] - a[1]), 1e-9)
        nx = (a[1] - b[1]) / length
        ny = (b[0] - a[0]) / length
        edge = edges[i]
        edge[FIRST] = first
        edge[SECOND] = second
        edge[NORMAL_X] = nx
        edge[NORMAL_Y] = ny
        edge[INSIDE] = nx * (center[0] - a[0]) + ny * (center[1] - a[1])
    return size


@part
def _along(jacobian, dofs, nx, ny, velocity):
    """Return how fast a point moves along a normal [m/s]."""
    rows = matrix_at(jacobian, 2, dofs)
    x = 0.0
    y = 0.0
    for k in range(dofs):
        x += rows[0, k] * velocity[k]
        y += rows[1, k] * velocity[k]
    return nx * x + ny * y


@part
def _rate(memory, points, edge, velocity):
    """Return how fast the centre of mass moves away from an edge [m/s]."""
    first = int(edge[FIRST])
    second = int(edge[SECOND])
    center = memory.count
    a = vector_at(points[first, 0], 2)
    b = vector_at(points[second, 0], 2)
    c = vector_at(points[center, 0], 2)
    along = (c[0] - a[0]) * (b[0] - a[0]) + (c[1] - a[1]) * (b[1] - a[1])
    ratio = along / max((b[0] - a[0]) ** 2 + (b[1] - a[1]) ** 2, 1e-12)
    nx = edge[NORMAL_X]
    ny = edge[NORMAL_Y]
    dofs = memory.dofs
    start = _along(points[first, 1], dofs, nx, ny, velocity)
    end = _along(points[second, 1], dofs, nx, ny, velocity)
    return _along(points[center, 1], dofs, nx, ny, velocity) - start - ratio * (end - start)


@part
def _keep_margin(memory, state, velocity):
    """Find the ratio of joint velocities with which the margin does not fall below what is left, and the margin."""
    points = indices_at(memory.points, 2 * (memory.count + 1)).reshape((memory.count + 1, 2))
    edges = matrix_at(memory.edges, memory.count, EDGE_SIZE)
    lifted = flags_at(memory.lifted, memory.count)
    order = indices_at(memory.order, memory.count)
    ratio = 1.0
    is_short = False
    margin = math.inf
    horizon = 0.25  # [s] in which a motion may use up what is left of the margin
    top_speed = 0.4  # [m/s] that no motion has: edges that are far enough for it do not count
    for index in range(_find(points, lifted, order, edges)):
        edge = edges[index]
        margin = min(margin, edge[INSIDE])
        left = edge[INSIDE] - memory.required_margin
        if left > horizon * top_speed:
            continue
        rate = _rate(memory, points, edge, velocity)
        if left + horizon * ratio * rate < 0.0:
            ratio = max(0.0, -left / (horizon * rate)) if rate < 0.0 else 1.0
            is_short = True
    state[MARGIN] = margin
    return ratio, is_short


@part
def _lacks(memory, away, forward):
    """Whether base and vertices are behind along their desired direction.

    It is measured by the rates with which errors would go away along that way. Where the way leads back to where joints
    can follow, it is not held up.
    """
    along = square = 0.0
    for first, size in ((memory.of_base, 6), (memory.of_vertices, 3 * memory.count)):
        if first >= 0:
            for k in range(first, first + size):
                along += away[k] * forward[k]
                square += forward[k] * forward[k]
    return along > 1e-3 * math.sqrt(square)  # [m/s, rad/s]


@part
def _reason(memory, is_short, margin, speed, velocity):
    """Return what is beyond its bound most, how far it is, and by which ratio to the bound."""
    why, amount, worst = (POLYGON, margin, 1.0) if is_short else (NOTHING, 0.0, 1.0)
    watched = indices_at(memory.watched, memory.watched_count)
    bounds = vector_at(memory.bounds, memory.watched_count)
    error = vector_at(memory.error, memory.rows)
    for index in range(memory.watched_count):
        size = abs(error[watched[index]])
        if size > worst * bounds[index]:
            why = FIRST_ROW + index
            amount = size
            worst = size / bounds[index]
    if why != NOTHING:
        return why, amount, worst
    legs = indices_at(memory.legs, memory.leg_count)
    fastest = -1.0
    place = 0
    for index in range(memory.leg_count):
        size = abs(velocity[legs[index]])
        if size > fastest:
            fastest = size
            place = index
    steering = 0.0
    turning = indices_at(memory.turning, memory.turning_count)
    for index in range(memory.turning_count):
        steering = max(steering, abs(velocity[turning[index]]))
    # a leg is nearly straight whose joint is faster than 0.5 rad/s, 25 rad/m by the speed of the motion, and a quarter
    # of the speed of joints that steer: wheels that tilt and turn move their legs
    if fastest > max(0.5, 25.0 * speed, 0.25 * steering):
        return FIRST_ROW + memory.watched_count + place, fastest, 1.0
    return NOTHING, 0.0, 0.0


@part
def _guard(memory, state, is_short, forward, pace, velocity, passed):
    """Whether the motion is held, since it leads where the robot does not get on."""
    held = vector_at(memory.held, memory.rows)
    size = 0.0
    along = 0.0
    for k in range(memory.rows):
        size += forward[k] * forward[k]
        along += forward[k] * held[k]
    size = math.sqrt(size)
    if size == 0.0:
        return False
    is_other = along < 0.5 * size  # at an angle of more than 60 degrees to the way that is held
    why, amount, worst = _reason(memory, is_short, state[MARGIN], pace * size, velocity)
    if why != NOTHING and worst > (1.1 * state[WORST] if state[REASON] != NOTHING and is_other else 0.0):
        state[REASON] = why
        state[AMOUNT] = amount
        state[WORST] = worst
        state[AGE] = 0.0
        for k in range(memory.rows):
            held[k] = forward[k] / size
        return True
    if state[REASON] == NOTHING:
        return False
    state[AGE] += passed
    if state[AGE] > 1.0 and why == NOTHING:
        state[REASON] = state[AMOUNT] = state[WORST] = state[AGE] = 0.0
    return state[REASON] != NOTHING and not is_other


def _hold_back(start, pace, is_bound, passed):
    """Shorten joint velocities that may not go on; return whether the motion is held.

    Args:
        start: Address of a `GUARD`.
        pace: Ratio of the desired rates that goes on.
        is_bound: Whether a joint is at its bound.
        passed: Time since the cycle before [s].
    """
    memory = _guard_at(start)
    state = vector_at(memory.state, STATE_SIZE)
    velocity = vector_at(memory.velocity, memory.dofs)
    forward = vector_at(memory.forward, memory.rows)
    away = vector_at(memory.away, memory.rows)
    ratio, is_short = _keep_margin(memory, state, velocity)
    if ratio < 1.0:
        for k in range(memory.dofs):
            velocity[k] *= ratio
    is_bound = (is_bound or ratio < 1.0) and _lacks(memory, away, forward)
    return _guard(memory, state, is_short, forward, pace, velocity, passed) or is_bound


def _find_alone(points, lifted, order, edges):
    """See `_find`."""
    return _find(points, lifted, order, edges)


hold_back = cached("boolean(int64, float64, boolean, float64)", _hold_back)
find_edges = cached("int64(int64[:, ::1], boolean[::1], int64[::1], float64[:, ::1])", _find_alone)
