"""Loops over the wheels, compiled: their desired directions, and the errors and rates of the tasks."""

import math
from pathlib import Path

import numpy as np

from solfer.components.wheeled_motion.original import kernel as original
from solfer.components.wheeled_motion.original.kernel import HALF_REVOLUTION, REST_ERROR, merge, nearest
from solfer.numerics.blocks import BlockLayout
from solfer.numerics.compilation import cached, exact_part, part

REST_DISTANCE = 2.5e-3
"""Error of a vertex that its wheel rests with, where no motion is desired [m]."""

WAKE_DISTANCE = 4e-3
"""Error of a vertex that lets its wheel steer again [m]."""

WAKE_TIME = 0.3
"""Time for which that error has to last [s]: an estimate of the base that is late for a moment would turn wheels on the
spot, and they the base."""

STEEPENING = 0.35
"""By how much the ground tilts a robot on its way onto a slope of 15 degrees, with wheels 0.75 m apart [1/m]."""

TURNING_SLOPE = 0.27
"""By how much a slope of 15 degrees tilts a robot that turns on it: the tangent [rad/rad]."""

STEEPEST = 0.5
"""By how much the ground rises at most on the way of the base: that wheels are lifted by straight legs is no rise."""

EXTRA_ANGLE = 0.35
"""By how much more than a quarter of a revolution a wheel goes on the way that it has begun [rad]."""

END_MARGIN = 0.1
"""How far from the end of its range another way has to end [rad]."""

LEAD_CYCLES = 4.0
"""Cycles before the end of its range at which a wheel begins the other way."""

PACE, LIMIT_RATIO, HEADING, WAITS, FLOOR, GROUND = range(6)
"""Indices of the numbers of the references; the last are the heights of the ground where it began, and where it is."""

TURNING_ARM = 0.1
"""Farthest that the middle of the wheels is from what the base turns about [m]: it moves up and down on a slope."""

UNEVENNESS = 0.01
"""By how much wheels on a floor are above or below it on average [m]: estimates of the base err, and legs yield."""

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

WHEELS = BlockLayout(
    "Wheels",
    count=int,
    dofs=int,
    rows=int,
    # the steering: its law, the wheels, place and heading of the base in the last cycle, and the rows `ANGLES` to
    # `MEASURED`
    law=(LAW, 1),
    wheels=(WHEEL_DTYPE, "count"),
    before=(float, 3),
    steered=(float, 4, "count"),
    # vertices, seen from the heading of the base
    places=(float, "count", 3),
    errors=(float, "count", 3),
    offsets=(float, "3 * count"),
    directions=(float, "count", 2),
    lifted=(bool, "count"),
    base=(float, 3),  # heading and place
    # references: the numbers `PACE` to `GROUND`, and the rows `VELOCITY` to `PLACE`
    numbers=(float, 6),
    motion=(float, 3, 3),
    velocities=(float, 2, "count", 3),
    orientations=(float, 2, 4),
    desired_camber=(float, "count"),
    desired_caster=(float, "count"),
    # points: pose of the base, what it turns about, what is tracked of it, and angles of the wheels
    pose=(float, 7),
    center=(float, 2),
    place=(float, 3),
    camber=(float, "count"),
    caster=(float, "count"),
    # joints: those that steer, where they are, where they are commanded, and the ends of their ranges
    turning_count=int,
    turning_dofs=(int, "turning_count"),
    measured=(float, "dofs"),
    position=(float, "dofs"),
    velocity=(float, "dofs"),
    has_ranges=int,
    lower=(float, "dofs"),
    upper=(float, "dofs"),
    # first rows of the tasks; -1: there is no such task
    of_base=int,
    of_vertices=int,
    of_steering=int,
    of_camber=int,
    of_caster=int,
    # tasks: rates by which errors go away, desired ones, and both
    steering_rows=(float, "count", "dofs"),
    aims=(float, "count"),
    largest_errors=(float, 3),
    error=(float, "rows"),
    gain=(float, "rows"),
    away=(float, "rows"),
    forward=(float, "rows"),
    rates=(float, "rows"),
    half=float,
    furthest=float,
    # largest speeds and accelerations of corrections, and largest speeds of corrections and motions together
    base_correction=float,
    turn_correction=float,
    vertex_correction=float,
    base_acceleration=float,
    turn_acceleration=float,
    vertex_acceleration=float,
    base_speed=float,
    turn_speed=float,
)
"""What the functions for wheels read and write."""

_wheels_at = WHEELS.at


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


@exact_part
def _steer(block):
    """Write where all wheels point and are to point; wheels that are lifted have no rows of steering."""
    law = block.law[0]
    before = block.before
    steered = block.steered
    velocities = block.velocities[0]
    pose = block.pose
    motion = block.motion[VELOCITY]
    heading = block.base[0]
    cx = block.center[0] - pose[0]
    cy = block.center[1] - pose[1]
    sx = math.cos(heading) * cx + math.sin(heading) * cy
    sy = math.cos(heading) * cy - math.sin(heading) * cx
    if law.across == 0.0:
        # where it steers, the original program has lost the sign of the heading: the angle of a quaternion has none
        heading = abs(_wrapped(heading, 2.0 * math.pi))
    period = law.period
    ratio = 0.0 if block.numbers[WAITS] != 0.0 else block.numbers[LIMIT_RATIO]
    yaw_rate = ratio * block.motion[ANGULAR, 2]
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
    for index in range(block.count):
        wheel = block.wheels[index]
        px = block.places[index, 0] - sx
        py = block.places[index, 1] - sy
        ex = block.errors[index, 0]
        ey = block.errors[index, 1]
        wx = vx - py * yaw_rate + ratio * velocities[index, 0]
        wy = vy + px * yaw_rate + ratio * velocities[index, 1]
        if law.across != 0.0:
            _keep(wheel, law, wx, wy, ex, ey)
        else:
            merge(wheel, law, wx, wy, ex, ey, math.hypot(mx - ey * rate, my + ex * rate))
        steered[SPEEDS, index] = math.hypot(wx, wy)
        steered[MEASURED, index] = math.atan2(block.directions[index, 1], block.directions[index, 0])
        if block.lifted[index]:
            # it points where it does, and nothing waits for it
            angle = steered[MEASURED, index] - heading
            wheel.angle = wheel.aim = wheel.motion = wheel.error = angle
            wheel.motion_speed = wheel.error_speed = wheel.rate = steered[SPEEDS, index] = 0.0
            if block.of_steering >= 0:
                block.steering_rows[index, :] = 0.0
        steered[ANGLES, index], steered[AIMS, index] = wheel.angle + heading, wheel.aim


@part
def _follow_ground(block):
    """Let the height of the ground follow the wheels that carry the robot, where they drive and it is no floor."""
    velocity = block.motion[VELOCITY]
    speed = math.hypot(velocity[0], velocity[1]) + TURNING_ARM * abs(block.motion[ANGULAR, 2])
    most = STEEPEST * block.law[0].period * block.numbers[PACE] * speed
    total = 0.0
    count = 0
    for index in range(block.count):
        if not block.lifted[index]:
            total += block.places[index, 2]
            count += 1
    if count:
        height = total / count
        ground = block.numbers[GROUND]
        change = min(max(ground, height - UNEVENNESS), height + UNEVENNESS) - ground
        block.numbers[GROUND] += min(max(change, -most), most)


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
def _choose_rotations(block, angles):
    """Write desired directions of wheels, by the shorter rotation whose end is within the range of the steering joint.

    The way goes from where the joint is measured, as the wheel is; its commanded position may be elsewhere, and has to
    be within its range after some cycles, whatever moves it. A wheel that has begun to turn keeps its
    way unless another one is much better, also where both are equal.
    """
    most = block.largest_errors[0]
    ahead = LEAD_CYCLES * block.law[0].period
    for index in range(block.count):
        dof = block.turning_dofs[index]
        lower = block.lower[dof]
        upper = block.upper[dof]
        rotation_left = block.wheels[index].rotation_left
        row = block.steering_rows[index, dof]
        place = block.measured[dof]
        rotation_left += _wrapped(block.aims[index] - angles[index] - rotation_left, HALF_REVOLUTION)
        position = block.position[dof]
        further = position + block.velocity[dof] * ahead
        end = place + rotation_left * row
        is_inside = lower < end < upper
        is_next_inside = lower < further < upper
        # what leaves the range shows which of the two others is the way back
        toward = (further - position) * row if is_inside and not is_next_inside else rotation_left
        other = rotation_left - math.copysign(HALF_REVOLUTION, toward)
        other_end = place + other * row
        is_inside = is_inside and is_next_inside
        is_long = abs(rotation_left) > HALF_REVOLUTION / 2.0 + EXTRA_ANGLE
        if (is_long or not is_inside) and lower + END_MARGIN < other_end < upper - END_MARGIN:
            rotation_left = other
        block.wheels[index].rotation_left = rotation_left
        # half a revolution away is not to be taken for no way at all
        block.aims[index] = angles[index] + min(max(rotation_left, -most), most)


def _find_errors(start, steers):
    """Write the errors of all tasks, and before, where it `steers`, where wheels are to point.

    Those of base, vertices, steering, camber, and caster; aims of the steering are the angles of `steered`, with
    joints that have ranges the ones within them, and references of camber and caster follow where they are too far.
    """
    block = _wheels_at(start)
    if steers:
        _steer(block)
    half = block.half
    error = block.error
    largest_errors = block.largest_errors
    if block.of_base >= 0:
        _find_base(block.place, block.pose, block.motion[PLACE], block.orientations[0], error[block.of_base :])
        if block.has_ranges:
            _follow_ground(block)
            error[block.of_base + 5] += block.numbers[GROUND] - block.numbers[FLOOR]
    if block.of_vertices >= 0:
        for index in range(3 * block.count):
            error[block.of_vertices + index] = -block.offsets[index]
    if block.of_steering >= 0:
        angles = block.steered[MEASURED]
        block.aims[:] = block.steered[ANGLES]
        if block.has_ranges:
            _choose_rotations(block, angles)
        _find_soft(angles, block.aims, half, largest_errors[0], error[block.of_steering :])
    if block.of_camber >= 0:
        _find_soft(block.camber, block.desired_camber, half, largest_errors[1], error[block.of_camber :])
    if block.of_caster >= 0:
        _find_soft(block.caster, block.desired_caster, half, largest_errors[2], error[block.of_caster :])


def _find_soft_alone(angles, desired, half, most, error):
    """See `_find_soft`."""
    _find_soft(angles, desired, half, most, error)


@part
def _feed_forward(block):
    """Write the desired rates of base, steering and vertices."""
    count = block.count
    forward = block.forward
    turning = block.motion[ANGULAR]
    if block.of_base >= 0:
        motion = block.motion[VELOCITY]
        for k in range(3):
            forward[block.of_base + k], forward[block.of_base + 3 + k] = turning[k], motion[k]
    if block.of_steering >= 0:
        for index in range(count):
            forward[block.of_steering + index] = turning[2]
    if block.of_vertices < 0:
        return
    velocities = block.velocities[0]
    directions = block.directions
    of_vertices = block.of_vertices
    cos = math.cos(block.base[0])
    sin = math.sin(block.base[0])
    for index in range(count):
        vx = velocities[index, 0]
        vy = velocities[index, 1]
        fx = directions[index, 0]
        fy = directions[index, 1]
        wx = cos * vx - sin * vy
        wy = sin * vx + cos * vy
        is_free = block.lifted[index]
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
def _turn_ahead(block, pace):
    """Let wheels turn as fast as the desired directions do, and no faster than an error may turn them.

    A wheel that is far from its direction goes there as fast as it may: its way may be the longer one. None is to turn
    beyond the end of the range of its joint, where other joints would have to do in its place what they hardly can.
    """
    largest_error = block.largest_errors[0]
    rates = block.rates
    with_base = pace * block.motion[ANGULAR, 2]
    for index in range(block.count):
        row = block.of_steering + index
        if abs(block.error[row]) < (1.0 - 1e-9) * largest_error:
            limit = largest_error * block.gain[row]
            rates[row] = min(max(rates[row] + block.wheels[index].rate, -limit), limit)
        if block.has_ranges:
            lower, upper = _room(block, index)
            rates[row] = min(max(rates[row], lower + with_base), upper + with_base)


@part
def _room(block, index):
    """Return the rates with which a wheel comes to the ends of the range of its joint in one cycle [rad/s]."""
    dof = block.turning_dofs[index]
    rate = 1.0 / block.law[0].period
    place = block.position[dof]
    by = rate * block.steering_rows[index, dof]
    first = by * min(block.lower[dof] - place, 0.0)
    second = by * max(block.upper[dof] - place, 0.0)
    return min(first, second), max(first, second)


@part
def _find_far(block):
    """Return the first row of the base's place, or of a vertex, whose error is larger than it may be; -1: none is."""
    if block.of_base >= 0:
        for k in range(block.of_base + 3, block.of_base + 6):
            if abs(block.error[k]) > block.furthest:
                return k
    if block.of_vertices >= 0:
        for k in range(block.of_vertices, block.of_vertices + 3 * block.count):
            if abs(block.error[k]) > block.furthest:
                return k
    return -1


def _find_rates(start, is_paced, feeds_forward):
    """Write the rates of all tasks: those by which errors go away, and at the pace the desired ones.

    With a pace errors move base and vertices no faster than they may, and the base together with its motion.

    Returns:
        Row of the base or of a vertex that is farther from its reference than it may be, with a pace; -1: none is.
    """
    block = _wheels_at(start)
    rates = block.rates
    for k in range(block.rows):
        rates[k] = block.gain[k] * block.error[k]
    if block.of_base >= 0 and block.lifted.any():
        # on three wheels and springs the robot rocks, which faster corrections of its place would amplify
        for k in range(block.of_base + 3, block.of_base + 6):
            rates[k] *= 0.25
    if is_paced:
        away = block.away
        period = block.law[0].period
        if block.of_base >= 0:
            turn_rise = period * block.turn_acceleration
            base_rise = period * block.base_acceleration
            # a gyroscope with a wrong scale or sign cannot turn the robot much faster than commanded, nor an IMU with
            # a wrong tilt tilt it much faster than the ground may where it drives
            turn_most = block.turn_correction
            velocity = block.motion[VELOCITY]
            yaw_rate = abs(block.motion[ANGULAR, 2])
            tilting = STEEPENING * math.hypot(velocity[0], velocity[1]) + TURNING_SLOPE * yaw_rate
            tilting *= block.numbers[PACE]
            turning = 0.1 * yaw_rate
            _correct(rates, away, block.of_base, 2, min(turn_most, 0.15 * turn_most + tilting), turn_rise)
            _correct(rates, away, block.of_base + 2, 1, min(turn_most, 0.15 * turn_most + turning), turn_rise)
            _correct(rates, away, block.of_base + 3, 3, block.base_correction, base_rise)
        if block.of_vertices >= 0:
            vertex_rise = period * block.vertex_acceleration
            _correct(rates, away, block.of_vertices, 3 * block.count, block.vertex_correction, vertex_rise)
    if feeds_forward:
        pace = block.numbers[PACE]
        _feed_forward(block)
        for k in range(block.rows):
            rates[k] += pace * block.forward[k]
        if is_paced and block.of_base >= 0:
            _shorten(rates, block.of_base, block.turn_speed)
            _shorten(rates, block.of_base + 3, block.base_speed)
        if is_paced and block.of_steering >= 0:
            _turn_ahead(block, pace)
    return _find_far(block) if is_paced else -1


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

find_errors = cached("void(int64, boolean)", _find_errors, sources=[Path(original.__file__)])
find_rates = cached("int64(int64, boolean, boolean)", _find_rates)
find_soft = cached(f"void({_VECTOR}, {_VECTOR}, float64, float64, {_VECTOR})", _find_soft_alone)
move = cached(f"void({_INDICES}, {_VECTOR}, float64, {_VECTOR}, {_VECTOR})", _move)
write_command = cached(f"void({_INDICES}, {_VECTOR}, {_VECTOR}, {_VECTOR}, {_VECTOR})", _write_command)
