"""Loops over the wheels, compiled: their desired directions, and the errors and rates of the tasks."""

import math
from pathlib import Path

import numpy as np

from solfer.components.wheeled_motion.original import kernel as original
from solfer.components.wheeled_motion.original.kernel import HALF_REVOLUTION, REST_ERROR, merge, nearest
from solfer.numerics.compilation import cached, part
from solfer.numerics.pointers import flags_at, indices_at, matrix_at, record_at, records_at, vector_at

REST_DISTANCE = 2.5e-3
"""Error of a vertex that its wheel rests with, where no motion is desired [m]."""

WAKE_DISTANCE = 4e-3
"""Error of a vertex that lets its wheel steer again [m]."""

WAKE_TIME = 0.3
"""Time for which that error has to last [s]: an estimate of the base that is late for a moment would turn wheels on the
spot, and they the base."""

EXTRA_ANGLE = 0.35
"""By how much more than a quarter of a revolution a wheel goes on the way that it has begun [rad]."""

END_MARGIN = 0.1
"""How far from the end of its range another way has to end [rad]."""

LEAD_CYCLES = 4.0
"""Cycles before the end of its range at which a wheel begins the other way."""

PACE, LIMIT_RATIO, HEADING, WAITS = range(4)
"""Indices of the numbers of the references."""

VELOCITY, ANGULAR, PLACE = range(3)
"""Rows of what is desired of the base."""

ANGLES, AIMS, SPEEDS, MEASURED = range(4)
"""Rows of what is known of steered wheels."""

TUNED = ("icm", "sp", "tracking", "motion_margin", "error_margin", "margin")
"""Numbers of the original's law of steering."""

LAW = np.dtype([(name, np.float64) for name in ("across", "rate", "rests", *TUNED, "period")])
"""Numbers of the laws of steering, see `solfer.components.wheeled_motion.steering.Steering`."""

WHEEL_DTYPE = np.dtype(
    [
        *((name, np.float64) for name in ("angle", "aim", "motion", "motion_speed", "error", "error_speed")),
        *((name, np.float64) for name in ("rest", "rotation_left", "desired", "rate")),
    ]
)
"""State of a wheel that steers: its direction and where it aims [rad]; the directions that are merged and their speeds
[rad, m/s]; whether it rests, 1 or less as its error persists, how far it has to turn [rad], the desired direction of
its contact point, and the rate of that direction [rad/s]."""

WHEELS_DTYPE = np.dtype(
    [
        *((name, np.int64) for name in ("count", "dofs", "rows")),
        # addresses of the steering: its law, states of the wheels, place and heading of the last cycle, and these rows
        *((name, np.int64) for name in ("law", "wheels", "before", "steered")),
        # of the vertices: places, errors, offsets, directions, which are lifted; heading of the base
        *((name, np.int64) for name in ("places", "errors", "offsets", "directions", "lifted", "base")),
        # of the references
        *((name, np.int64) for name in ("numbers", "motion", "velocities", "orientation")),
        *((name, np.int64) for name in ("desired_camber", "desired_caster")),
        # of the points: pose of the base, what it turns about, what is tracked of it, and angles of the wheels
        *((name, np.int64) for name in ("pose", "center", "place", "camber", "caster")),
        # of the joints: which of them steer, measured positions, commanded ones, velocities, and ends of
        # their ranges; 0: they have none
        *((name, np.int64) for name in ("turning_dofs", "measured", "position", "velocity", "lower", "upper")),
        # first rows of the tasks; -1: there is no such task
        *((name, np.int64) for name in ("of_base", "of_vertices", "of_steering", "of_camber", "of_caster")),
        # addresses of the tasks: rows of the steering, aims within the ranges, largest errors, errors, gains, rates,
        # rates by which errors go away, and desired rates
        *(
            (name, np.int64)
            for name in ("steering_rows", "aims", "largest_errors", "error", "gain", "rates", "away", "forward")
        ),
        *((name, np.float64) for name in ("half", "furthest")),
        # largest speeds and accelerations of corrections, and largest speeds of corrections and motions together
        *((f"{name}_correction", np.float64) for name in ("base", "turn", "vertex")),
        *((f"{name}_acceleration", np.float64) for name in ("base", "turn", "vertex")),
        *((f"{name}_speed", np.float64) for name in ("base", "turn")),
    ]
)
"""What the functions for wheels read and write, see `solfer.numerics.pointers.Memory`."""

_wheels_at = record_at(WHEELS_DTYPE)
_law_at = record_at(LAW)
_states_at = records_at(WHEEL_DTYPE)


@part
def _wrapped(angle, period):
    """Return the angle in [-period / 2, period / 2)."""
    return angle - period * math.floor(angle / period + 0.5)


@part
def _find_rate(wheel, wx, wy, period):
    """Find how fast the desired direction of a vertex turns; one that jumps to the opposite one does not."""
    if wx == 0.0 and wy == 0.0:
        wheel.rate = 0.0
        wheel.desired = math.nan
        return
    desired = math.atan2(wy, wx)
    # of a vertex that has just been at rest nothing is known
    wheel.rate = 0.0 if math.isnan(wheel.desired) else _wrapped(desired - wheel.desired, HALF_REVOLUTION) / period
    wheel.desired = desired


@part
def _keep(wheel, law, wx, wy, ex, ey):
    """Steer so that the vertex stays with its reference; see `Steering`."""
    distance = math.hypot(ex, ey)
    _find_rate(wheel, wx, wy, law.period)
    if wx != 0.0 or wy != 0.0:
        wheel.rest = 0.0
    elif distance < (WAKE_DISTANCE if wheel.rest > 0.0 else REST_DISTANCE):
        wheel.rest = 1.0
    else:
        wheel.rest = max(wheel.rest - law.period / WAKE_TIME, 0.0)
    if wheel.rest > 0.0:
        wheel.aim = wheel.angle
        return
    gain = law.across * (1.0 - REST_ERROR / distance) if distance > REST_ERROR else 0.0
    x = wx + gain * ex
    y = wy + gain * ey
    wheel.aim = nearest(math.atan2(y, x), wheel.angle)
    wheel.angle -= math.expm1(-law.rate * math.hypot(x, y)) * (wheel.aim - wheel.angle)


def _steer(start):
    """Write where all wheels point and are to point; wheels that are lifted have no rows of steering."""
    memory = _wheels_at(start)
    count = memory.count
    dofs = memory.dofs
    law = _law_at(memory.law)
    wheels = _states_at(memory.wheels, count)
    before = vector_at(memory.before, 3)
    steered = matrix_at(memory.steered, 4, count)
    places = matrix_at(memory.places, count, 3)
    errors = matrix_at(memory.errors, count, 3)
    velocities = matrix_at(memory.velocities, count, 3)
    directions = matrix_at(memory.directions, count, 2)
    lifted = flags_at(memory.lifted, count)
    pose = vector_at(memory.pose, 7)
    center = vector_at(memory.center, 2)
    motion = matrix_at(memory.motion, 3, 3)[VELOCITY]
    numbers = vector_at(memory.numbers, 4)
    heading = vector_at(memory.base, 1)[0]
    cx = center[0] - pose[0]
    cy = center[1] - pose[1]
    sx = math.cos(heading) * cx + math.sin(heading) * cy
    sy = math.cos(heading) * cy - math.sin(heading) * cx
    if law.across == 0.0:
        # where it steers, the original program has lost the sign of the heading: the angle of a quaternion has none
        heading = abs(_wrapped(heading, 2.0 * math.pi))
    period = law.period
    ratio = 0.0 if numbers[WAITS] != 0.0 else numbers[LIMIT_RATIO]
    yaw_rate = ratio * matrix_at(memory.motion, 3, 3)[ANGULAR][2]
    cos = math.cos(heading)
    sin = math.sin(heading)
    vx = ratio * (cos * motion[0] + sin * motion[1])
    vy = ratio * (cos * motion[1] - sin * motion[0])
    dx = pose[0] - before[0]
    dy = pose[1] - before[1]
    mx = (cos * dx + sin * dy) / period
    my = (cos * dy - sin * dx) / period
    rate = _wrapped(heading - before[2], 2.0 * math.pi) / period
    before[0], before[1], before[2] = pose[0], pose[1], heading
    for index in range(count):
        wheel = wheels[index]
        px = places[index, 0] - sx
        py = places[index, 1] - sy
        ex = errors[index, 0]
        ey = errors[index, 1]
        wx = vx - py * yaw_rate + ratio * velocities[index, 0]
        wy = vy + px * yaw_rate + ratio * velocities[index, 1]
        if law.across != 0.0:
            _keep(wheel, law, wx, wy, ex, ey)
        else:
            merge(wheel, law, wx, wy, ex, ey, math.hypot(mx - ey * rate, my + ex * rate))
        steered[SPEEDS, index] = math.hypot(wx, wy)
        steered[MEASURED, index] = math.atan2(directions[index, 1], directions[index, 0])
        if lifted[index]:
            # it points where it does, and nothing waits for it
            angle = steered[MEASURED, index] - heading
            wheel.angle = wheel.aim = wheel.motion = wheel.error = angle
            wheel.motion_speed = wheel.error_speed = wheel.rate = steered[SPEEDS, index] = 0.0
            if memory.of_steering >= 0:
                vector_at(memory.steering_rows + 8 * index * dofs, dofs)[:] = 0.0
        steered[ANGLES, index], steered[AIMS, index] = wheel.angle + heading, wheel.aim


@part
def _find_base(place, pose, desired_place, desired_orientation, error):
    """Write the vector part of the quaternion that turns the base to its reference, and the rest of the path."""
    x = pose[3]
    y = pose[4]
    z = pose[5]
    w = pose[6]
    rx = desired_orientation[0]
    ry = desired_orientation[1]
    rz = desired_orientation[2]
    rw = desired_orientation[3]
    # q and -q are the same orientation
    sign = 1.0 if w * rw + x * rx + y * ry + z * rz >= 0.0 else -1.0
    error[0] = sign * (w * rx - rw * x - ry * z + rz * y)
    error[1] = sign * (w * ry - rw * y - rz * x + rx * z)
    error[2] = sign * (w * rz - rw * z - rx * y + ry * x)
    for k in range(3):
        error[3 + k] = desired_place[k] - place[k]


@part
def _find_soft(angles, desired, half, most, error):
    """Write the errors of angles of any number of half revolutions; references that are farther than `most` follow."""
    for index in range(len(angles)):
        away = _wrapped(desired[index] - angles[index], half)
        error[index] = min(max(away, -most), most)
        desired[index] = angles[index] + error[index]


@part
def _choose_rotations(wheels, angles, desired, rows, turning, measured, position, velocity, lower, upper, most, ahead):
    """Write desired directions of wheels, by the shorter rotation whose end is within the range of the steering joint.

    The way goes from where the joint is measured, as the wheel is; its commanded position may be elsewhere, and has to
    be within its range after the time `ahead` [s], whatever moves it. A wheel that has begun to turn keeps its
    way unless another one is much better, also where both are equal.
    """
    for index in range(len(angles)):
        dof = turning[index]
        rotation_left = wheels[index].rotation_left
        row = rows[index, dof]
        place = measured[dof]
        rotation_left += _wrapped(desired[index] - angles[index] - rotation_left, HALF_REVOLUTION)
        further = position[dof] + velocity[dof] * ahead
        end = place + rotation_left * row
        is_inside = lower[dof] < end < upper[dof]
        is_next_inside = lower[dof] < further < upper[dof]
        # what leaves the range shows which of the two others is the way back
        toward = (further - position[dof]) * row if is_inside and not is_next_inside else rotation_left
        other = rotation_left - math.copysign(HALF_REVOLUTION, toward)
        other_end = place + other * row
        is_inside = is_inside and is_next_inside
        is_long = abs(rotation_left) > HALF_REVOLUTION / 2.0 + EXTRA_ANGLE
        if (is_long or not is_inside) and lower[dof] + END_MARGIN < other_end < upper[dof] - END_MARGIN:
            rotation_left = other
        wheels[index].rotation_left = rotation_left
        # half a revolution away is not to be taken for no way at all
        desired[index] = angles[index] + min(max(rotation_left, -most), most)


def _find_errors(start):
    """Write the errors of all tasks.

    Those of base, vertices, steering, camber, and caster; aims of the steering are the angles of `steered`, with
    joints that have ranges the ones within them, and references of camber and caster follow where they are too far.
    """
    memory = _wheels_at(start)
    count = memory.count
    dofs = memory.dofs
    half = memory.half
    error = vector_at(memory.error, memory.rows)
    largest_errors = vector_at(memory.largest_errors, 3)
    if memory.of_base >= 0:
        _find_base(
            vector_at(memory.place, 3),
            vector_at(memory.pose, 7),
            matrix_at(memory.motion, 3, 3)[PLACE],
            vector_at(memory.orientation, 4),
            error[memory.of_base :],
        )
    if memory.of_vertices >= 0:
        offsets = vector_at(memory.offsets, 3 * count)
        for index in range(3 * count):
            error[memory.of_vertices + index] = -offsets[index]
    if memory.of_steering >= 0:
        steered = matrix_at(memory.steered, 4, count)
        desired = vector_at(memory.aims, count)
        desired[:] = steered[ANGLES]
        if memory.lower:
            rows = matrix_at(memory.steering_rows, count, dofs)
            lower = vector_at(memory.lower, dofs)
            upper = vector_at(memory.upper, dofs)
            turning = indices_at(memory.turning_dofs, count)
            position = vector_at(memory.position, dofs)
            velocity = vector_at(memory.velocity, dofs)
            ahead = LEAD_CYCLES * _law_at(memory.law).period
            wheels = _states_at(memory.wheels, count)
            angles = steered[MEASURED]
            given = wheels, angles, desired, rows, turning, vector_at(memory.measured, dofs), position, velocity
            _choose_rotations(*given, lower, upper, largest_errors[0], ahead)
        _find_soft(steered[MEASURED], desired, half, largest_errors[0], error[memory.of_steering :])
    if memory.of_camber >= 0:
        angles = vector_at(memory.camber, count)
        desired = vector_at(memory.desired_camber, count)
        _find_soft(angles, desired, half, largest_errors[1], error[memory.of_camber :])
    if memory.of_caster >= 0:
        angles = vector_at(memory.caster, count)
        desired = vector_at(memory.desired_caster, count)
        _find_soft(angles, desired, half, largest_errors[2], error[memory.of_caster :])


def _find_soft_alone(angles, desired, half, most, error):
    """See `_find_soft`."""
    _find_soft(angles, desired, half, most, error)


@part
def _feed_forward(memory, forward):
    """Write the desired rates of base, steering and vertices."""
    count = memory.count
    turning = matrix_at(memory.motion, 3, 3)[ANGULAR]
    if memory.of_base >= 0:
        motion = matrix_at(memory.motion, 3, 3)[VELOCITY]
        for k in range(3):
            forward[memory.of_base + k], forward[memory.of_base + 3 + k] = turning[k], motion[k]
    if memory.of_steering >= 0:
        for index in range(count):
            forward[memory.of_steering + index] = turning[2]
    if memory.of_vertices < 0:
        return
    velocities = matrix_at(memory.velocities, count, 3)
    directions = matrix_at(memory.directions, count, 2)
    lifted = flags_at(memory.lifted, count)
    of_vertices = memory.of_vertices
    heading = vector_at(memory.base, 1)[0]
    cos = math.cos(heading)
    sin = math.sin(heading)
    for index in range(count):
        vx = velocities[index, 0]
        vy = velocities[index, 1]
        fx = directions[index, 0]
        fy = directions[index, 1]
        wx = cos * vx - sin * vy
        wy = sin * vx + cos * vy
        is_free = lifted[index]
        forward[of_vertices + index] = fx * wx + fy * wy
        forward[of_vertices + count + index] = fx * wy - fy * wx if is_free else 0.0
        forward[of_vertices + 2 * count + index] = velocities[index, 2] if is_free else 0.0


@part
def _correct(rates, before, first, size, most, rise):
    """Let an error of a task move it no faster than it may, nor by more than `rise` faster than in the cycle before.

    It may slow down at once: an error that is nearly gone would be overshot.
    """
    for k in range(first, first + size):
        last = abs(before[k]) if before[k] * rates[k] > 0.0 else 0.0
        limit = min(most, last + rise)
        if abs(rates[k]) > limit:  # what is not a number stays so
            rates[k] = math.copysign(limit, rates[k])
        before[k] = rates[k]


@part
def _shorten(rates, first, most):
    """Let correction and motion together be no faster than the motion alone may be."""
    size = math.sqrt(rates[first] ** 2 + rates[first + 1] ** 2 + rates[first + 2] ** 2)
    if size > most:
        for k in range(first, first + 3):
            rates[k] *= most / size


@part
def _turn_ahead(memory, rates, gain, pace):
    """Let wheels turn as fast as the desired directions do, and no faster than an error may turn them.

    A wheel that is far from its direction goes there as fast as it may: its way may be the longer one. None is to turn
    beyond the end of the range of its joint, where other joints would have to do in its place what they hardly can.
    """
    wheels = _states_at(memory.wheels, memory.count)
    largest_error = vector_at(memory.largest_errors, 1)[0]
    error = vector_at(memory.error, memory.rows)
    with_base = pace * matrix_at(memory.motion, 3, 3)[ANGULAR][2]
    for index in range(memory.count):
        row = memory.of_steering + index
        if abs(error[row]) < (1.0 - 1e-9) * largest_error:
            limit = largest_error * gain[row]
            rates[row] = min(max(rates[row] + wheels[index].rate, -limit), limit)
        if memory.lower:
            lower, upper = _room(memory, index)
            rates[row] = min(max(rates[row], lower + with_base), upper + with_base)


@part
def _room(memory, index):
    """Return the rates with which a wheel comes to the ends of the range of its joint in one cycle [rad/s]."""
    dof = indices_at(memory.turning_dofs, memory.count)[index]
    rate = 1.0 / _law_at(memory.law).period
    lower = vector_at(memory.lower, memory.dofs)[dof]
    upper = vector_at(memory.upper, memory.dofs)[dof]
    place = vector_at(memory.position, memory.dofs)[dof]
    by = rate * matrix_at(memory.steering_rows, memory.count, memory.dofs)[index, dof]
    first = by * min(lower - place, 0.0)
    second = by * max(upper - place, 0.0)
    return min(first, second), max(first, second)


@part
def _find_far(memory, error):
    """Return the first row of the base's place, or of a vertex, whose error is larger than it may be; -1: none is."""
    if memory.of_base >= 0:
        for k in range(memory.of_base + 3, memory.of_base + 6):
            if abs(error[k]) > memory.furthest:
                return k
    if memory.of_vertices >= 0:
        for k in range(memory.of_vertices, memory.of_vertices + 3 * memory.count):
            if abs(error[k]) > memory.furthest:
                return k
    return -1


def _find_rates(start, is_paced, feeds_forward):
    """Write the rates of all tasks: those by which errors go away, and at the pace the desired ones.

    With a pace errors move base and vertices no faster than they may, and the base together with its motion.

    Returns:
        Row of the base or of a vertex that is farther from its reference than it may be, with a pace; -1: none is.
    """
    memory = _wheels_at(start)
    size = memory.rows
    rates = vector_at(memory.rates, size)
    gain = vector_at(memory.gain, size)
    error = vector_at(memory.error, size)
    for k in range(size):
        rates[k] = gain[k] * error[k]
    if is_paced:
        away = vector_at(memory.away, size)
        period = _law_at(memory.law).period
        if memory.of_base >= 0:
            turn_rise = period * memory.turn_acceleration
            base_rise = period * memory.base_acceleration
            # a gyroscope with a wrong scale or sign cannot turn the robot much faster than commanded
            turn_most = memory.turn_correction
            turn_most = min(turn_most, 0.15 * turn_most + 0.1 * abs(matrix_at(memory.motion, 3, 3)[ANGULAR][2]))
            _correct(rates, away, memory.of_base, 3, turn_most, turn_rise)
            _correct(rates, away, memory.of_base + 3, 3, memory.base_correction, base_rise)
        if memory.of_vertices >= 0:
            vertex_rise = period * memory.vertex_acceleration
            _correct(rates, away, memory.of_vertices, 3 * memory.count, memory.vertex_correction, vertex_rise)
    if feeds_forward:
        forward = vector_at(memory.forward, size)
        pace = vector_at(memory.numbers, 4)[PACE]
        _feed_forward(memory, forward)
        for k in range(size):
            rates[k] += pace * forward[k]
        if is_paced and memory.of_base >= 0:
            _shorten(rates, memory.of_base, memory.turn_speed)
            _shorten(rates, memory.of_base + 3, memory.base_speed)
        if is_paced and memory.of_steering >= 0:
            _turn_ahead(memory, rates, gain, pace)
    return _find_far(memory, error) if is_paced else -1


def _move(columns, rates, period, velocity, position):
    """Take over rates of some joints, and integrate them."""
    for k in columns:
        velocity[k] = rates[k]
        position[k] += period * rates[k]


def _write_command(columns, position, velocity, commanded_position, commanded_velocity):
    """Write positions and velocities of some joints."""
    for k in columns:
        commanded_position[k], commanded_velocity[k] = position[k], velocity[k]


_VECTOR = "float64[::1]"
_INDICES = "int64[::1]"

steer = cached("void(int64)", _steer, sources=[Path(original.__file__)])
find_errors = cached("void(int64)", _find_errors)
find_rates = cached("int64(int64, boolean, boolean)", _find_rates)
find_soft = cached(f"void({_VECTOR}, {_VECTOR}, float64, float64, {_VECTOR})", _find_soft_alone)
move = cached(f"void({_INDICES}, {_VECTOR}, float64, {_VECTOR}, {_VECTOR})", _move)
write_command = cached(f"void({_INDICES}, {_VECTOR}, {_VECTOR}, {_VECTOR}, {_VECTOR})", _write_command)
