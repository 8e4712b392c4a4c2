"""Where motions come to rest, compiled: the support polygon, wheels that tilt, legs that do not reach farther."""

import math

from solfer.numerics.blocks import BlockLayout
from solfer.numerics.compilation import cached, part
from solfer.numerics.pointers import matrix_at, vector_at

FIRST, SECOND, INSIDE, NORMAL_X, NORMAL_Y, EDGE_SIZE = range(6)
"""Columns of edges: vertices, distance of the centre of mass, normal to the inside; and how many there are."""

MARGIN, REASON, AMOUNT, WORST, AGE, STATE_SIZE = range(6)
"""State of the guard: margin [m], what holds the motion, by how much, by which ratio to its bound, since when [s]."""

NOTHING, POLYGON, FIRST_ROW = range(3)
"""What holds the motion: nothing, the margin, the first of the rows that are watched; joints of legs follow these."""

GUARD = BlockLayout(
    "Guard",
    count=int,
    dofs=int,
    rows=int,
    # the polygon: addresses of place and Jacobian of each vertex and of the centre of mass, and edges
    points=(int, "count + 1", 2),
    lifted=(bool, "count"),
    order=(int, "count"),
    edges=(float, "count", EDGE_SIZE),
    required_margin=float,
    # tasks: first rows, -1: there is none; Jacobian and rates, errors, rates by which they go away, desired rates, and
    # the way that is held
    of_base=int,
    of_vertices=int,
    jacobian=(float, "rows", "dofs"),
    rates=(float, "rows"),
    error=(float, "rows"),
    away=(float, "rows"),
    forward=(float, "rows"),
    held=(float, "rows"),
    velocity=(float, "dofs"),
    state=(float, STATE_SIZE),
    # rows that are watched, and their bounds
    watched_count=int,
    watched=(int, "watched_count"),
    bounds=(float, "watched_count"),
    # joints of the legs, and those that steer
    leg_count=int,
    legs=(int, "leg_count"),
    turning_count=int,
    turning=(int, "turning_count"),
)
"""What `hold_back` reads and writes."""

_guard_at = GUARD.at


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
def _rate(block, edge):
    """Return how fast the centre of mass moves away from an edge [m/s]."""
    points = block.points
    velocity = block.velocity
    first = int(edge[FIRST])
    second = int(edge[SECOND])
    center = block.count
    a = vector_at(points[first, 0], 2)
    b = vector_at(points[second, 0], 2)
    c = vector_at(points[center, 0], 2)
    along = (c[0] - a[0]) * (b[0] - a[0]) + (c[1] - a[1]) * (b[1] - a[1])
    ratio = along / max((b[0] - a[0]) ** 2 + (b[1] - a[1]) ** 2, 1e-12)
    nx = edge[NORMAL_X]
    ny = edge[NORMAL_Y]
    dofs = block.dofs
    start = _along(points[first, 1], dofs, nx, ny, velocity)
    end = _along(points[second, 1], dofs, nx, ny, velocity)
    return _along(points[center, 1], dofs, nx, ny, velocity) - start - ratio * (end - start)


@part
def _keep_margin(block):
    """Find the ratio of joint velocities with which the margin does not fall below what is left, and the margin."""
    points = block.points
    edges = block.edges
    ratio = 1.0
    is_short = False
    margin = math.inf
    horizon = 0.25  # [s] in which a motion may use up what is left of the margin
    top_speed = 0.4  # [m/s] that no motion has: edges that are far enough for it do not count
    for index in range(_find(points, block.lifted, block.order, edges)):
        edge = edges[index]
        margin = min(margin, edge[INSIDE])
        left = edge[INSIDE] - block.required_margin
        if left > horizon * top_speed:
            continue
        rate = _rate(block, edge)
        if left + horizon * ratio * rate < 0.0:
            ratio = max(0.0, -left / (horizon * rate)) if rate < 0.0 else 1.0
            is_short = True
    block.state[MARGIN] = margin
    return ratio, is_short


@part
def _lacks(block):
    """Whether joints move base and vertices slower along their desired direction than is desired.

    Where they are behind for another reason, as on a slope, whose way is longer, the motion is not held up.
    """
    along = square = 0.0
    for first, size in ((block.of_base, 6), (block.of_vertices, 3 * block.count)):
        if first >= 0:
            for k in range(first, first + size):
                if block.forward[k] != 0.0:
                    rate = block.rates[k]
                    for a in range(block.dofs):
                        rate -= block.jacobian[k, a] * block.velocity[a]
                    along += rate * block.forward[k]
                    square += block.forward[k] * block.forward[k]
    return along > 1e-3 * math.sqrt(square)  # [m/s, rad/s]


@part
def _reason(block, is_short, speed):
    """Return what is beyond its bound most, how far it is, and by which ratio to the bound."""
    why, amount, worst = (POLYGON, block.state[MARGIN], 1.0) if is_short else (NOTHING, 0.0, 1.0)
    for index in range(block.watched_count):
        size = abs(block.error[block.watched[index]])
        if size > worst * block.bounds[index]:
            why = FIRST_ROW + index
            amount = size
            worst = size / block.bounds[index]
    if why != NOTHING:
        return why, amount, worst
    velocity = block.velocity
    fastest = -1.0
    place = 0
    for index in range(block.leg_count):
        size = abs(velocity[block.legs[index]])
        if size > fastest:
            fastest = size
            place = index
    steering = 0.0
    for index in range(block.turning_count):
        steering = max(steering, abs(velocity[block.turning[index]]))
    # a leg is nearly straight whose joint is faster than 0.5 rad/s, 25 rad/m by the speed of the motion and of errors
    # that go away, and a quarter of the speed of joints that steer: wheels that tilt and turn move their legs
    if fastest > max(0.5, 25.0 * speed, 0.25 * steering):
        return FIRST_ROW + block.watched_count + place, fastest, 1.0
    return NOTHING, 0.0, 0.0


@part
def _guard(block, is_short, pace, passed):
    """Whether the motion is held, since it leads where the robot does not get on."""
    held = block.held
    forward = block.forward
    state = block.state
    size = 0.0
    along = 0.0
    speed = 0.0
    for k in range(block.rows):
        size += forward[k] * forward[k]
        along += forward[k] * held[k]
        speed += (pace * forward[k] + block.away[k]) ** 2
    size = math.sqrt(size)
    if size == 0.0:
        return False
    is_other = along < 0.5 * size  # at an angle of more than 60 degrees to the way that is held
    why, amount, worst = _reason(block, is_short, math.sqrt(speed))
    if why != NOTHING and worst > (1.1 * state[WORST] if state[REASON] != NOTHING and is_other else 0.0):
        state[REASON] = why
        state[AMOUNT] = amount
        state[WORST] = worst
        state[AGE] = 0.0
        for k in range(block.rows):
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
    block = _guard_at(start)
    ratio, is_short = _keep_margin(block)
    if ratio < 1.0:
        for k in range(block.dofs):
            block.velocity[k] *= ratio
    is_bound = (is_bound or ratio < 1.0) and _lacks(block)
    return _guard(block, is_short, pace, passed) or is_bound


def _find_alone(points, lifted, order, edges):
    """See `_find`."""
    return _find(points, lifted, order, edges)


hold_back = cached("boolean(int64, float64, boolean, float64)", _hold_back)
find_edges = cached("int64(int64[:, ::1], boolean[::1], int64[::1], float64[:, ::1])", _find_alone)
