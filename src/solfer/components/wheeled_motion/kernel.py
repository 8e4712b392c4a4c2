"""Loops over the wheels, compiled: which way they are to point, and the errors and rates of the tasks."""

import math

from solfer.numerics.compilation import cached, part

PERIOD = math.pi
"""Steering, camber and caster are the same for a wheel that has turned by half a turn."""

SLOW, GAIN = 0.1, 1000.0
"""Below this speed [m/s] errors count by `GAIN` times the speed."""

RESTING = 2e-3
"""Errors of vertices that no wheel steers for, where no motion is wanted [m]."""

SMALL, AWAKE = 2.5e-3, 4e-3
"""Errors of a vertex that its wheel rests with, and that let it steer again, where no motion is wanted [m]."""

NEAR = 2e-4
"""Errors count whole where they want a larger way than this in one cycle [m]."""

ANGLE, AIM, MOTION, MOTION_SPEED, ERROR, ERROR_SPEED, IS_RESTING = range(7)
"""Columns of the state of wheels: what they aim at, then the directions that are merged, see `solfer.components.\
wheeled_motion.steering.Steering`."""

ACROSS, RATE, HALF, RESTS, ICM, SP, TRACKING, MOTION_MARGIN, ERROR_MARGIN, MARGIN, CYCLE = range(11)
"""Numbers of the law of steering."""


@part
def _wrapped(angle, period):
    """Return the angle in [-period / 2, period / 2)."""
    return angle - period * math.floor(angle / period + 0.5)


@part
def _nearest(angle, other, half):
    """Return the angle nearest to another one among those that differ by half turns, and the sign of its direction.

    Of two that are equally near, it is the larger one.
    """
    turns = math.ceil((angle - other) / PERIOD - 0.5)
    return angle - turns * half, -1.0 if turns % 2 else 1.0


@part
def _follow(wheel, column, angle, speed, margin, half):
    """Turn a direction towards another one, or the one against it if that is nearer."""
    angle, sign = _nearest(angle, wheel[column], half)
    share = math.tanh(abs(speed) / margin)
    wheel[column] += share * (angle - wheel[column])
    wheel[column + 1] += share * (sign * speed - wheel[column + 1])


@part
def _merge(wheel, law, wx, wy, ex, ey, speed):
    """Steer as the original program does; see `Steering`."""
    is_still, distance = wx == 0.0 and wy == 0.0, math.hypot(ex, ey)
    if law[RESTS] != 0.0 and is_still and distance < RESTING:
        return
    half = law[HALF]
    if is_still and _nearest(wheel[MOTION], wheel[ANGLE], PERIOD)[0] > PERIOD / 4.0:
        wheel[MOTION] -= PERIOD - half
    wheel[AIM] = math.atan2(wy, wx)
    _follow(wheel, MOTION, wheel[AIM], math.hypot(wx, wy), law[MOTION_MARGIN], half)
    _follow(wheel, ERROR, math.atan2(ey, ex), law[TRACKING] * distance, law[ERROR_MARGIN], half)
    scale = 1.0
    if speed < SLOW and abs(wheel[ERROR_SPEED] * law[CYCLE]) < NEAR:
        scale = GAIN * speed + abs(wheel[ERROR_SPEED])
    trust = min(scale, 1.0)
    if scale < 1.0 and abs(wheel[MOTION_SPEED]) < SLOW:
        trust += GAIN * abs(wheel[MOTION_SPEED])
    a, b = law[ICM] * wheel[MOTION_SPEED], law[SP] * wheel[ERROR_SPEED]
    size = math.sqrt(max(a * a + b * b + 2.0 * a * b * math.cos(wheel[MOTION] - wheel[ERROR]), 0.0))
    b *= scale
    y = a * math.sin(wheel[MOTION]) + b * math.sin(wheel[ERROR])
    x = a * math.cos(wheel[MOTION]) + b * math.cos(wheel[ERROR])
    angle, _ = _nearest(math.atan2(y, x), wheel[ANGLE], half)
    wheel[ANGLE] += math.tanh(size * trust / law[MARGIN]) * (angle - wheel[ANGLE])


@part
def _keep(wheel, law, wx, wy, ex, ey):
    """Steer so that the vertex stays with its reference; see `Steering`."""
    distance = math.hypot(ex, ey)
    is_resting = wx == 0.0 and wy == 0.0 and distance < (AWAKE if wheel[IS_RESTING] != 0.0 else SMALL)
    wheel[IS_RESTING] = 1.0 if is_resting else 0.0
    if is_resting:
        wheel[AIM] = wheel[ANGLE]
        return
    gain = law[ACROSS] * (1.0 - RESTING / distance) if distance > RESTING else 0.0
    x, y = wx + gain * ex, wy + gain * ey
    wheel[AIM], _ = _nearest(math.atan2(y, x), wheel[ANGLE], PERIOD)
    wheel[ANGLE] -= math.expm1(-law[RATE] * math.hypot(x, y)) * (wheel[AIM] - wheel[ANGLE])


def _steer(
    law,
    wheels,
    before,
    places,
    errors,
    velocities,
    directions,
    lifted,
    pose,
    center,
    heading,
    motion,
    turning,
    share,
    told,
):
    """Write where all wheels point and are to point; see `Steering.update`.

    `share` is that of the velocities which counts; `told` has the rows angles, aims, speeds and measured angles;
    `before` is the place and the heading of the last cycle.
    """
    cos, sin, turn, period = math.cos(heading), math.sin(heading), share * turning[2], law[CYCLE]
    vx, vy = share * (cos * motion[0] + sin * motion[1]), share * (cos * motion[1] - sin * motion[0])
    dx, dy = pose[0] - before[0], pose[1] - before[1]
    mx, my = (cos * dx + sin * dy) / period, (cos * dy - sin * dx) / period
    rate = _wrapped(heading - before[2], 2.0 * math.pi) / period
    before[0], before[1], before[2] = pose[0], pose[1], heading
    cx, cy = center[0] - pose[0], center[1] - pose[1]
    sx, sy = cos * cx + sin * cy, cos * cy - sin * cx
    for index in range(len(wheels)):
        wheel = wheels[index]
        px, py = places[index, 0] - sx, places[index, 1] - sy
        ex, ey = errors[index, 0], errors[index, 1]
        wx, wy = vx - py * turn + share * velocities[index, 0], vy + px * turn + share * velocities[index, 1]
        if law[ACROSS] != 0.0:
            _keep(wheel, law, wx, wy, ex, ey)
        else:
            _merge(wheel, law, wx, wy, ex, ey, math.hypot(mx - ey * rate, my + ex * rate))
        told[2, index] = math.hypot(wx, wy)
        told[3, index] = math.atan2(directions[index, 1], directions[index, 0])
        if lifted[index]:
            # it points where it does, and nothing waits for it
            angle = told[3, index] - heading
            wheel[ANGLE] = wheel[AIM] = wheel[MOTION] = wheel[ERROR] = angle
            wheel[MOTION_SPEED] = wheel[ERROR_SPEED] = told[2, index] = 0.0
        told[0, index], told[1, index] = wheel[ANGLE] + heading, wheel[AIM]


@part
def _find_base(place, pose, wanted_place, wanted_orientation, error):
    """Write the vector part of the quaternion that turns the base to its reference, and what is left of the way."""
    x, y, z, w = pose[3], pose[4], pose[5], pose[6]
    rx, ry, rz, rw = wanted_orientation[0], wanted_orientation[1], wanted_orientation[2], wanted_orientation[3]
    # q and -q are the same orientation
    sign = 1.0 if w * rw + x * rx + y * ry + z * rz >= 0.0 else -1.0
    error[0] = sign * (w * rx - rw * x - ry * z + rz * y)
    error[1] = sign * (w * ry - rw * y - rz * x + rx * z)
    error[2] = sign * (w * rz - rw * z - rx * y + ry * x)
    for k in range(3):
        error[3 + k] = wanted_place[k] - place[k]


@part
def _find_soft(angles, wanted, half, most, error):
    """Write the errors of angles of any number of half turns; references that are farther than `most` follow."""
    for index in range(len(angles)):
        away = _wrapped(wanted[index] - angles[index], half)
        error[index] = min(max(away, -most), most)
        wanted[index] = angles[index] + error[index]


@part
def _stay_in_range(angles, wanted, rows, turning, position, lower, upper, most):
    """Turn wheels the other way round whose joints of steering would leave their ranges."""
    for index in range(len(angles)):
        dof, error = turning[index], _wrapped(wanted[index] - angles[index], PERIOD)
        end = position[dof] + error * rows[index, dof]
        if not lower[dof] < end < upper[dof]:
            error -= math.copysign(PERIOD, error)
            # half a turn away is not to be taken for no way at all
            wanted[index] = angles[index] + min(max(error, -most), most)


def _find_errors(
    errors, place, pose, wanted_place, wanted_orientation, offsets, angles, aims, wanted, rows, turning, position,
    limits, camber, wanted_camber, caster, wanted_caster, half, most
):  # fmt: skip
    """Write the errors of all tasks; an empty array is that of a task that is not there.

    Args:
        errors: Errors of base, vertices, steering, camber, and caster.
        place: Place of what is tracked of the base, shape (3,) [m].
        pose: Pose of the base, shape (7,).
        wanted_place: Where it is wanted, shape (3,) [m].
        wanted_orientation: Quaternion that is wanted of the base, shape (4,).
        offsets: How far the vertices are behind their references, negative, as `RollingOffsets` has them [m].
        angles: Directions of the m wheels, shape (m,) [rad].
        aims: Where they are to point, shape (m,) [rad].
        wanted: Where they are wanted in the end, of any number of half turns; written, shape (m,) [rad].
        rows: Rows of their steering, shape (m, n).
        turning: DoFs that steer, shape (m,).
        position: Positions of all DoFs, shape (n,) [rad, m].
        limits: Ends of the ranges of all DoFs, shape (2, n); empty: they do not count.
        camber: Cambers, shape (m,) [rad].
        wanted_camber: What is wanted of them; it follows where it is too far, shape (m,) [rad].
        caster: Casters, shape (m,) [rad].
        wanted_caster: The same of these.
        half: Half a turn [rad].
        most: Largest errors of steering, camber, and caster [rad].
    """
    of_base, of_vertices, of_steering, of_camber, of_caster = errors
    if len(of_base):
        _find_base(place, pose, wanted_place, wanted_orientation, of_base)
    for index in range(len(of_vertices)):
        of_vertices[index] = -offsets[index]
    if len(of_steering):
        for index in range(len(aims)):
            wanted[index] = aims[index]
        if len(limits):
            _stay_in_range(angles, wanted, rows, turning, position, limits[0], limits[1], most[0])
        _find_soft(angles, wanted, half, most[0], of_steering)
    if len(of_camber):
        _find_soft(camber, wanted_camber, half, most[1], of_camber)
    if len(of_caster):
        _find_soft(caster, wanted_caster, half, most[2], of_caster)


def _find_soft_alone(angles, wanted, half, most, error):
    """See `_find_soft`."""
    _find_soft(angles, wanted, half, most, error)


def _feed_forward(of_base, of_steering, of_vertices, motion, turning, directions, velocities, lifted, heading):
    """Write the rates that are wanted of base, steering and vertices; an empty array: there is no such task."""
    if len(of_base):
        for k in range(3):
            of_base[k], of_base[3 + k] = turning[k], motion[k]
    for index in range(len(of_steering)):
        of_steering[index] = turning[2]
    if len(of_vertices) == 0:
        return
    cos, sin, count = math.cos(heading), math.sin(heading), len(lifted)
    for index in range(count):
        vx, vy = velocities[index, 0], velocities[index, 1]
        fx, fy = directions[index, 0], directions[index, 1]
        wx, wy, is_free = cos * vx - sin * vy, sin * vx + cos * vy, lifted[index]
        of_vertices[index] = fx * wx + fy * wy
        of_vertices[count + index] = fx * wy - fy * wx if is_free else 0.0
        of_vertices[2 * count + index] = velocities[index, 2] if is_free else 0.0


_MATRIX, _VECTOR, _FLAGS = "float64[:, ::1]", "float64[::1]", "boolean[::1]"

steer = cached(
    f"void({_VECTOR}, {_MATRIX}, {_VECTOR}, {_MATRIX}, {_MATRIX}, {_MATRIX}, {_MATRIX}, {_FLAGS}, {_VECTOR}, "
    f"{_VECTOR}, float64, {_VECTOR}, {_VECTOR}, float64, {_MATRIX})",
    _steer,
)
find_errors = cached(
    f"void(UniTuple({_VECTOR}, 5), {_VECTOR}, {_VECTOR}, {_VECTOR}, {_VECTOR}, {_VECTOR}, {_VECTOR}, {_VECTOR}, "
    f"{_VECTOR}, {_MATRIX}, int64[::1], {_VECTOR}, {_MATRIX}, {_VECTOR}, {_VECTOR}, {_VECTOR}, {_VECTOR}, float64, "
    f"{_VECTOR})",
    _find_errors,
)
find_soft = cached(f"void({_VECTOR}, {_VECTOR}, float64, float64, {_VECTOR})", _find_soft_alone)
feed_forward = cached(
    f"void({_VECTOR}, {_VECTOR}, {_VECTOR}, {_VECTOR}, {_VECTOR}, {_MATRIX}, {_MATRIX}, {_FLAGS}, float64)",
    _feed_forward,
)
