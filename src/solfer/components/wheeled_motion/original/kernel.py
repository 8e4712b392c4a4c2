"""The original program's steering, compiled: two directions of a wheel that are merged, each low-passed."""

import math

from solfer.numerics.compilation import part

ORIGINAL_HALF_TURN = math.pi
"""Steering, camber and caster are the same for a wheel that has turned by half a turn."""

ROUNDED, QUARTER = 3.14159265, 1.57079632
"""Half a turn and a quarter of the original program, where it looks for the half of the circle [rad]."""

ROUNDED_TURN = 6.28318531
"""A whole turn there [rad]."""

OPPOSITE_ANGLE = math.pi / 2.0 + math.radians(10.0)
"""Angle from where a wheel points beyond which a direction is replaced by the opposite one, in the original [rad]."""

ORIGINAL_SLOW_SPEED, ORIGINAL_GAIN = 0.1, 1000.0
"""Below this speed [m/s] errors count by `ORIGINAL_GAIN` times the speed."""

ORIGINAL_REST_ERROR = 2e-3
"""Errors of vertices that no wheel steers for, where no motion is desired [m]."""

ORIGINAL_NEARNESS = 2e-4
"""Errors count whole where their way in one cycle is larger than this [m]."""


@part
def nearest(angle, other):
    """Return the angle nearest to another one among those that differ by half turns.

    Of two that are equally near, it is the larger one.
    """
    return angle - ORIGINAL_HALF_TURN * math.ceil((angle - other) / ORIGINAL_HALF_TURN - 0.5)


@part
def _branch(angle, other, reach):
    """Return which of the angles that differ by half turns counts beside another one, and the sign of its direction.

    It is the one of the same half of the circle, unless that is farther away than `reach`.
    """
    turns = math.floor((other + QUARTER) / ROUNDED) - math.floor((angle + QUARTER) / ROUNDED)
    angle += turns * ROUNDED
    if abs(angle - other) > reach:
        side = math.copysign(1.0, angle - other)
        angle -= side * ORIGINAL_HALF_TURN
        turns -= side
    return angle, -1.0 if turns % 2.0 else 1.0


@part
def _follow(before, speed_before, last, angle, speed, margin):
    """Turn a direction towards another one, or the one against it if that is nearer; return it and its speed.

    `last` is the last direction of the wheel; see `Steering`.
    """
    angle, sign = _branch(angle, before, ORIGINAL_HALF_TURN / 2.0)
    share = math.tanh(speed / margin)
    angle = before + share * (angle - before)
    speed = speed_before + share * (sign * speed - speed_before)
    angle, sign = _branch(angle, last, OPPOSITE_ANGLE)
    return angle, sign * speed


@part
def merge(wheel, law, wx, wy, ex, ey, speed):
    """Steer as the original program does; see `Steering`."""
    is_still = wx == 0.0 and wy == 0.0
    distance = math.hypot(ex, ey)
    if law.rests != 0.0 and is_still and distance < ORIGINAL_REST_ERROR:
        return
    wheel.aim = math.atan2(wy, wx)
    wheel.motion, wheel.motion_speed = _follow(
        wheel.motion, wheel.motion_speed, wheel.angle, wheel.aim, math.hypot(wx, wy), law.motion_margin
    )
    wheel.error, wheel.error_speed = _follow(
        wheel.error, wheel.error_speed, wheel.angle, math.atan2(ey, ex), law.tracking * distance, law.error_margin
    )
    scale = 1.0
    if speed < ORIGINAL_SLOW_SPEED and abs(wheel.error_speed * law.period) < ORIGINAL_NEARNESS:
        scale = ORIGINAL_GAIN * speed + abs(wheel.error_speed)
    trust = 1.0
    if scale < 1.0 and abs(wheel.motion_speed) < ORIGINAL_SLOW_SPEED:
        trust = scale + ORIGINAL_GAIN * abs(wheel.motion_speed)
    a = law.icm * wheel.motion_speed
    b = law.sp * wheel.error_speed
    size = math.sqrt(max(a * a + b * b + 2.0 * a * b * math.cos(wheel.motion - wheel.error), 0.0))
    b *= scale
    y = a * math.sin(wheel.motion) + b * math.sin(wheel.error)
    x = a * math.cos(wheel.motion) + b * math.cos(wheel.error)
    angle = nearest(math.atan2(y, x), wheel.angle)
    wheel.angle += math.tanh(size * trust / law.margin) * (angle - wheel.angle)
