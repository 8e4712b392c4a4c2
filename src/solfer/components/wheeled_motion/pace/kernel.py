"""How motions go on, compiled: the ratio of what is desired, where references come to, and velocities of others."""

import math

from solfer.numerics.blocks import BlockLayout
from solfer.numerics.compilation import cached, part

LATERAL_SPEED = 4e-3
"""Speed across a wheel with which its vertex may leave its way [m/s]."""

PACE, LIMIT_RATIO, HEADING = range(3)
"""Indices of the numbers of the references."""

VALUE, LIMITED, HELD, LAGS, FOLLOWED, SPEED = range(6)
"""State of the pace, see `solfer.components.wheeled_motion.pace.path.PathPace`: the pace, the factor by the limits,
that of joints at their bounds, that of a base that lags, that which all of them can follow, and the fastest vertex at
it [m/s]."""

GOING = BlockLayout(
    "Going",
    count=int,
    state=(float, 6),
    # rows of what is known of steered wheels, and heading and place of the base
    steered=(float, 4, "count"),
    base=(float, 3),
    # the references, and the vertices that are desired
    numbers=(float, 6),
    motion=(float, 3, 3),
    vertices=(float, 2, "count", 3),
    orientations=(float, 2, 4),
    desired=(float, "count", 3),
    error=(float, 6),  # of the base: rotation, place
    base_speed=float,
    turn_speed=float,
    vertex_speed=float,
    acceleration=float,  # of a vertex
    furthest=float,  # distance of the base from its reference
)
"""What `advance` reads and writes."""

_going_at = GOING.at

DESIRED_X, DESIRED_Y, DESIRED_Z, DESIRED_YAW_RATE, IN_WORLD, AGE, BEFORE = range(7)
"""State of velocities that others send; see `solfer.components.wheeled_motion.drive.Drive`."""


@part
def _limit(block, state):
    """Find the factor that scales what is desired to the limits."""
    velocity = block.motion[0]
    angular = block.motion[1]
    vertices = block.vertices[0]
    speed = math.sqrt(velocity[0] ** 2 + velocity[1] ** 2 + velocity[2] ** 2)
    ratio = block.base_speed / max(block.base_speed, speed)
    ratio = min(ratio, block.turn_speed / max(block.turn_speed, abs(angular[2])))
    for index in range(block.count):
        speed = math.sqrt(vertices[index, 0] ** 2 + vertices[index, 1] ** 2 + vertices[index, 2] ** 2)
        ratio = min(ratio, block.vertex_speed / max(block.vertex_speed, speed))
    state[LIMITED], state[VALUE] = ratio, ratio * state[FOLLOWED]


@part
def _lag_ratio(block):
    """Return the ratio with which a reference goes on that the base does not follow: where others hold, it waits."""
    error = block.error
    furthest_turn = 0.45  # [rad]
    distance = math.hypot(error[3], error[4]) / block.furthest
    angle = 2.0 * abs(error[2]) / furthest_turn
    # it slows down from a third of the largest error on, and rests at two thirds
    return min(max(2.0 - 3.0 * max(distance, angle), 0.0), 1.0)


@part
def _update(block, state, is_held, most, passed):
    """Find the ratio with which wheels and joints can follow."""
    steered = block.steered
    aims_row = 1
    speeds_row = 2
    measured_row = 3
    heading = block.base[0]
    fastest = 0.0
    across = LATERAL_SPEED
    for index in range(block.count):
        speed = steered[speeds_row, index]
        fastest = max(fastest, speed)
        across = max(across, speed * abs(math.sin(steered[aims_row, index] - steered[measured_row, index] + heading)))
    decay_rate = 8.0  # [1/s] where joints are at their bounds; it recovers with 1/s
    change = (-decay_rate if is_held else 1.0) * passed
    state[HELD] = min(max(state[HELD] + change, 0.0), max(most, state[HELD] - decay_rate * passed))
    state[LAGS] = _lag_ratio(block)
    ratio = min(LATERAL_SPEED / across, state[HELD], state[LAGS])
    if fastest > 0.0:
        before = state[FOLLOWED]
        step = block.acceleration * passed / fastest
        # vertices go on with twice the acceleration, brake with four times, and start with three times
        lower = min(before, state[SPEED] / fastest) - 4.0 * step
        ratio = min(max(ratio, lower), before + 2.0 * step, state[SPEED] / fastest + 3.0 * step)
    state[FOLLOWED], state[SPEED] = ratio, ratio * fastest
    state[VALUE] = ratio * state[LIMITED]


@part
def _multiply(a, b, out):
    """Write the product of two quaternions (x, y, z, w); `out` is neither of both."""
    out[0] = a[3] * b[0] + b[3] * a[0] + a[1] * b[2] - a[2] * b[1]
    out[1] = a[3] * b[1] + b[3] * a[1] + a[2] * b[0] - a[0] * b[2]
    out[2] = a[3] * b[2] + b[3] * a[2] + a[0] * b[1] - a[1] * b[0]
    out[3] = a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2]


@part
def _step(numbers, motion, velocities, vertices, orientations, period):
    """Let references go on for a time, at the pace."""
    velocity = motion[0]
    angular = motion[1]
    position = motion[2]
    orientation = orientations[0]
    tilt = orientations[1]
    time = period * numbers[PACE]
    for k in range(3):
        position[k] += time * velocity[k]
    for index in range(len(vertices)):
        for k in range(3):
            vertices[index, k] += time * velocities[index, k]
    heading = numbers[HEADING] + time * angular[2]
    numbers[HEADING] = heading - 2.0 * math.pi * math.floor(heading / (2.0 * math.pi) + 0.5)
    if angular[0] != 0.0 or angular[1] != 0.0:
        roll = 0.5 * time * angular[0]
        pitch = 0.5 * time * angular[1]
        both = (
            math.sin(roll) * math.cos(pitch),
            math.cos(roll) * math.sin(pitch),
            math.sin(roll) * math.sin(pitch),
            math.cos(roll) * math.cos(pitch),
        )
        _multiply(both, (tilt[0], tilt[1], tilt[2], tilt[3]), tilt)
    half = 0.5 * numbers[HEADING]
    _multiply((0.0, 0.0, math.sin(half), math.cos(half)), tilt, orientation)


def _advance(start, is_paced, is_first, is_held, most, passed):
    """Find the pace of this cycle, let references go on at it, and write the desired vertices.

    Args:
        start: Address of a `GOING`.
        is_paced: Whether the pace is found at all.
        is_first: Whether nothing has been commanded yet.
        is_held: Whether joints at their bounds hold the motion up.
        most: Largest pace.
        passed: Time for which they go on [s].
    """
    block = _going_at(start)
    numbers = block.numbers
    if is_paced:
        state = block.state
        _limit(block, state)
        if not is_first:
            _update(block, state, is_held, most, passed)
        numbers[LIMIT_RATIO], numbers[PACE] = state[LIMITED], state[VALUE]
    _step(numbers, block.motion, block.vertices[0], block.vertices[1], block.orientations, passed)
    block.desired[:] = block.vertices[1]


def _step_alone(motion, places, orientations, numbers, period):
    """See `_step`; arrays as `solfer.components.wheeled_motion.references.References` has them."""
    _step(numbers, motion, places[0], places[1], orientations, period)


def _follow(state, motion, heading, counted, passed, timeout, change, yaw_change):
    """Write the velocity of this cycle that follows a ratio of the one sent; return whether it rests for good."""
    velocity = motion[0]
    angular = motion[1]
    state[AGE] += passed
    x = velocity[0]
    y = velocity[1]
    z = velocity[2]
    in_world = state[IN_WORLD] != 0.0
    is_old = state[AGE] > timeout
    # what is seen from the heading turns with it, which is no change
    before = 0.0 if in_world else (heading if math.isnan(state[BEFORE]) else state[BEFORE])
    state[BEFORE] = heading
    cos = math.cos(before)
    sin = math.sin(before)
    vx = cos * x + sin * y
    vy = cos * y - sin * x
    counts = 0.0 if is_old else counted
    dx = counts * state[DESIRED_X] - vx
    dy = counts * state[DESIRED_Y] - vy
    dz = counts * state[DESIRED_Z] - z
    size = math.sqrt(dx * dx + dy * dy + dz * dz)
    ratio = 1.0 if size <= change else change / size
    vx = vx + ratio * dx
    vy = vy + ratio * dy
    z = z + ratio * dz
    angular[2] += min(max(counts * state[DESIRED_YAW_RATE] - angular[2], -yaw_change), yaw_change)
    cos, sin = (1.0, 0.0) if in_world else (math.cos(heading), math.sin(heading))
    velocity[0], velocity[1], velocity[2] = cos * vx - sin * vy, sin * vx + cos * vy, z
    if is_old and math.sqrt(vx * vx + vy * vy + z * z + angular[2] * angular[2]) < 1e-12:
        velocity[:] = 0.0
        angular[2] = 0.0
        return True
    return False


@part
def _gain(distance, lead, passed):
    """Return the velocity for each metre of an error: its last two millimetres take half a second."""
    lowest_speed = 4e-3  # [m/s, rad/s]
    return 0.0 if distance < 1e-9 else min(max(1.0 / lead, lowest_speed / distance), 1.0 / passed)


def _approach(errors, limits, motion, vertex_velocity, first, last, lead, passed):
    """Let velocities go to errors / lead, times one ratio so that none is larger than it may be; return that ratio.

    Rows of the base, of its heading, and of the vertices count from `first` to `last`. No speed is larger than that
    from which its way can be braked.
    """
    ratio = 1.0
    for index in range(first, last):
        error = errors[index]
        step = 0.5 * limits[index, 1] * passed
        distance = math.sqrt(error[0] ** 2 + error[1] ** 2 + error[2] ** 2)
        most = min(limits[index, 0], math.sqrt(step * step + 2.0 * limits[index, 1] * distance) - step)
        speed = _gain(distance, lead, passed) * distance
        if speed > most:
            ratio = min(ratio, most / speed)
    for index in range(first, last):
        rate = motion[index] if index < 2 else vertex_velocity[index - 2]
        error = errors[index]
        begin = 2 if index == 1 else 0
        most = limits[index, 1] * passed
        gain = ratio * _gain(math.sqrt(error[0] ** 2 + error[1] ** 2 + error[2] ** 2), lead, passed)
        size = 0.0
        for k in range(begin, 3):
            size += (gain * error[k] - rate[k]) ** 2
        fraction = 1.0 if size <= most * most else most / math.sqrt(size)
        for k in range(begin, 3):
            rate[k] += fraction * (gain * error[k] - rate[k])
    return ratio


_VECTOR = "float64[::1]"
_MATRIX = "float64[:, ::1]"

advance = cached("void(int64, boolean, boolean, boolean, float64, float64)", _advance)
step = cached(f"void({_MATRIX}, float64[:, :, ::1], {_MATRIX}, {_VECTOR}, float64)", _step_alone)
follow = cached(f"boolean({_VECTOR}, {_MATRIX}{6 * ', float64'})", _follow)
approach = cached(f"float64({_MATRIX}, {_MATRIX}, {_MATRIX}, {_MATRIX}, int64, int64, float64, float64)", _approach)
