"""The original program's steering, compiled: two directions of a wheel that are merged, each low-passed."""

import math

from solfer.numerics.compilation import part

PERIOD = math.pi
"""Steering, camber and caster are the same for a wheel that has turned by half a turn."""

ROUNDED, QUARTER = 3.14159265, 1.57079632
"""Half a turn and a quarter of the original program, where it looks for the half of the circle [rad]."""

ROUNDED_TURN = 6.28318531
"""A whole turn there [rad]."""

REACH = math.pi / 2.0 + math.radians(10.0)
"""Angle from where a wheel points beyond which a direction is replaced by the opposite one, in the original [rad]."""

SLOW, GAIN = 0.1, 1000.0
"""Below this speed [m/s] errors count by `GAIN` times the speed."""

RESTING = 2e-3
"""Errors of vertices that no wheel steers for, where no motion is wanted [m]."""

NEAR = 2e-4
"""Errors count whole where they want a larger way than this in one cycle [m]."""

ANGLE, AIM, MOTION, MOTION_SPEED, ERROR, ERROR_SPEED, IS_RESTING, WAY, WANTED, TURN, STATES = range(11)
"""Columns of the state of wheels: what they aim at, then the directions that are merged, see `solfer.components.\
wheeled_motion.steering.Steering`; how far they have to turn; the direction that is wanted of their vertices, and how
fast it turns [rad/s]; and how many there are."""

ACROSS, RATE, RESTS, ICM, SP, TRACKING, MOTION_MARGIN, ERROR_MARGIN, MARGIN, CYCLE, LAW_SIZE = range(11)
"""Numbers of the law of steering, and how many there are."""


@part
def nearest(angle, other):
    """Return the angle nearest to another one among those that differ by half turns.

    Of two that are equally near, it is the larger one.
    """
    return angle - PERIOD * math.ceil((angle - other) / PERIOD - 0.5)


@part
def _branch(angle, other, reach):
    """Return which of the angles that differ by half turns counts beside another one, and the sign of its direction.

    It is the one of the same half of the circle, unless that is farther away than `reach`.
    """
    turns = math.floor((other + QUARTER) / ROUNDED) - math.floor((angle + QUARTER) / ROUNDED)
    angle += turns * ROUNDED
    if abs(angle - other) > reach:
        side = math.copysign(1.0, angle - other)
        angle -= side * PERIOD
        turns -= side
    return angle, -1.0 if turns % 2.0 else 1.0


@part
def _follow(wheel, column, angle, speed, margin):
    """Turn a direction towards another one, or the one against it if that is nearer; see `Steering`."""
    angle, sign = _branch(angle, wheel[column], PERIOD / 2.0)
    share = math.tanh(speed / margin)
    wheel[column] += share * (angle - wheel[column])
    wheel[column + 1] += share * (sign * speed - wheel[column + 1])
    wheel[column], sign = _branch(wheel[column], wheel[ANGLE], REACH)
    wheel[column + 1] *= sign


@part
def merge(wheel, law, wx, wy, ex, ey, speed):
    """Steer as the original program does; see `Steering`."""
    is_still, distance = wx == 0.0 and wy == 0.0, math.hypot(ex, ey)
    if law[RESTS] != 0.0 and is_still and distance < RESTING:
        return
    wheel[AIM] = math.atan2(wy, wx)
    _follow(wheel, MOTION, wheel[AIM], math.hypot(wx, wy), law[MOTION_MARGIN])
    _follow(wheel, ERROR, math.atan2(ey, ex), law[TRACKING] * distance, law[ERROR_MARGIN])
    scale = 1.0
    if speed < SLOW and abs(wheel[ERROR_SPEED] * law[CYCLE]) < NEAR:
        scale = GAIN * speed + abs(wheel[ERROR_SPEED])
    trust = 1.0
    if scale < 1.0 and abs(wheel[MOTION_SPEED]) < SLOW:
        trust = scale + GAIN * abs(wheel[MOTION_SPEED])
    a, b = law[ICM] * wheel[MOTION_SPEED], law[SP] * wheel[ERROR_SPEED]
    size = math.sqrt(max(a * a + b * b + 2.0 * a * b * math.cos(wheel[MOTION] - wheel[ERROR]), 0.0))
    b *= scale
    y = a * math.sin(wheel[MOTION]) + b * math.sin(wheel[ERROR])
    x = a * math.cos(wheel[MOTION]) + b * math.cos(wheel[ERROR])
    angle = nearest(math.atan2(y, x), wheel[ANGLE])
    wheel[ANGLE] += math.tanh(size * trust / law[MARGIN]) * (angle - wheel[ANGLE])
