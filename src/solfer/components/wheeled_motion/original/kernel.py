"""The original program's steering, compiled: two directions of a wheel that are merged, each low-passed."""

import math

from solfer.numerics.compilation import part

HALF_REVOLUTION = math.pi
"""Steering, camber and caster are the same for a wheel that has turned by half a revolution."""

ROUNDED_PI = 3.14159265
"""Half a revolution in the original program, where it looks for the half of the circle [rad]."""

ROUNDED_HALF_PI = 1.57079632
"""A quarter there [rad]."""

ROUNDED_TWO_PI = 6.28318531
"""A revolution there [rad]."""

OPPOSITE_ANGLE = math.pi / 2.0 + math.radians(10.0)
"""Angle from where a wheel points beyond which a direction is replaced by the opposite one, in the original [rad]."""

REST_ERROR = 2e-3
"""Errors of vertices that no wheel steers for, where no motion is desired [m]."""


@part
def nearest(angle, other):
    """Return the angle nearest to another one among those that differ by half revolutions.

    Of two that are equally near, it is the larger one.
    """
    return angle - HALF_REVOLUTION * math.ceil((angle - other) / HALF_REVOLUTION - 0.5)


@part
def _branch(angle, other, reach):
    """Return the angle among those that differ by half revolutions that counts beside another one, and its sign.

    It is the one of the same half of the circle, unless that is farther away than `reach`.
    """
    halves = math.floor((other + ROUNDED_HALF_PI) / ROUNDED_PI) - math.floor((angle + ROUNDED_HALF_PI) / ROUNDED_PI)
    angle += halves * ROUNDED_PI
    if abs(angle - other) > reach:
        side = math.copysign(1.0, angle - other)
        angle -= side * HALF_REVOLUTION
        halves -= side
    return angle, -1.0 if halves % 2.0 else 1.0


@part
def _follow(before, speed_before, last, angle, speed, margin):
    """Turn a direction towards another one, or the one against it if that is nearer; return it and its speed.

    `last` is the last direction of the wheel; see `Steering`.
    """
    angle, sign = _branch(angle, before, HALF_REVOLUTION / 2.0)
    ratio = math.tanh(speed / margin)
    angle = before + ratio * (angle - before)
    speed = speed_before + ratio * (sign * speed - speed_before)
    angle, sign = _branch(angle, last, OPPOSITE_ANGLE)
    return angle, sign * speed


@part
def merge(wheel, law, wx, wy, ex, ey, speed):
    """Steer as the original program does; see `Steering`."""
    is_still = wx == 0.0 and wy == 0.0
    distance = math.hypot(ex, ey)
    if law.rests != 0.0 and is_still and distance < REST_ERROR:
        return
    wheel.aim = math.atan2(wy, wx)
    wheel.motion, wheel.motion_speed = _follow(
        wheel.motion, wheel.motion_speed, wheel.angle, wheel.aim, math.hypot(wx, wy), law.motion_margin
    )
    wheel.error, wheel.error_speed = _follow(
        wheel.error, wheel.error_speed, wheel.angle, math.atan2(ey, ex), law.tracking * distance, law.error_margin
    )
    # below a slow speed [m/s] errors count by 1000 times the speed, but whole where their way in one cycle is long
    slow_speed = 0.1
    gain = 1000.0
    scale = 1.0
    if speed < slow_speed and abs(wheel.error_speed * law.period) < 2e-4:
        scale = gain * speed + abs(wheel.error_speed)
    trust = 1.0
    if scale < 1.0 and abs(wheel.motion_speed) < slow_speed:
        trust = scale + gain * abs(wheel.motion_speed)
    a = law.icm * wheel.motion_speed
    b = law.sp * wheel.error_speed
    size = math.sqrt(max(a * a + b * b + 2.0 * a * b * math.cos(wheel.motion - wheel.error), 0.0))
    b *= scale
    y = a * math.sin(wheel.motion) + b * math.sin(wheel.error)
    x = a * math.cos(wheel.motion) + b * math.cos(wheel.error)
    angle = nearest(math.atan2(y, x), wheel.angle)
    wheel.angle += math.tanh(size * trust / law.margin) * (angle - wheel.angle)
