"""Measured orientations of a link that cannot be true."""

import math

from solfer.numerics.checks.joints import GAP, LONGEST_INTERVAL, WINDOW
from solfer.numerics.compilation import cached, part

TILT_MARGIN = 0.1
"""Margin of a link's tilt [rad]."""

FORCE_WINDOW = 1.5
"""Time constant of the mean specific force [s], in which a velocity may change by 1.5 m/s."""

SHORT = 0.1
"""Time constant of the angles that are covered [s]: noise and a sway cover one, and turn nothing."""

GRAVITY = 9.81
"""Specific force at rest [m/s^2]."""

# what is remembered
NEWEST = 0
"""Quaternion of the last message, 4 numbers."""

ARRIVAL = 4
"""Its arrival."""

STAMP = 5
"""Its stamp."""

ROTATION = 6
"""Sum of rotations by the orientation, 3 numbers."""

RATES = 9
"""Sum of rotations by the rates, 3 numbers."""

COVERED = 12
"""Angle that the link has covered within `SHORT` by the orientation, and by the rates."""

FORCE = 14
"""Sum of the specific force in the world's axes, 3 numbers."""

IS_APART = 17
"""Whether the rotations contradicted each other."""

FROZEN_TIME = 18
"""For how long the orientation was frozen."""

ACCEPTED = 19
"""Quaternion that was accepted last, 4 numbers."""

LEAPT = 23
"""By how much the tilt has leapt from there; 0: it has not."""

WITNESSED = 24
"""For how long the specific force was measured since then."""

FORCE_SIZE = 25
"""Mean size of the specific force."""

IS_DISTRUSTED = 26
"""Whether others have found it to be wrong; until it rests."""

STILL = 27
"""Quaternion from which the tilt has not moved, 4 numbers."""

STILL_TIME = 31
"""For how long."""

NUMBERS = 32
"""How many numbers these are."""


@part
def _tilt_between(quaternion, before, first):
    """Return by what angle the vertical of a quaternion differs from that of the one at `first` [rad]."""
    x, y, z, w = quaternion
    u = before[first]
    v = before[first + 1]
    s = before[first + 2]
    c = before[first + 3]
    upright = (
        4.0 * (x * z - y * w) * (u * s - v * c)
        + 4.0 * (y * z + x * w) * (v * s + u * c)
        + (1.0 - 2.0 * (x * x + y * y)) * (1.0 - 2.0 * (u * u + v * v))
    )
    return math.acos(min(1.0, max(-1.0, upright)))


@part
def _find_tilt_leap(quaternion, arrival, stamp, before):
    """Note whether the tilt has leapt since the message before; the first one is accepted."""
    if before[ARRIVAL] == -math.inf:
        before[FORCE + 2] = FORCE_WINDOW * GRAVITY  # a robot that starts by accelerating is not askew
        before[FORCE_SIZE] = GRAVITY
        return
    elapsed = max(arrival - before[ARRIVAL], min(stamp - before[STAMP], LONGEST_INTERVAL))
    tilt = _tilt_between(quaternion, before, NEWEST)
    if tilt > TILT_MARGIN + 6.0 * min(elapsed, 0.1):  # [rad/s], [s]: how fast a link can tilt, and for how long
        before[ROTATION:FROZEN_TIME] = 0.0
        before[LEAPT] = max(before[LEAPT], _tilt_between(quaternion, before, ACCEPTED))
        before[WITNESSED] = 0.0


@part
def _add_force(quaternion, force, passed, before):
    """Add the specific force, in the world's axes, while it is that of a robot that neither falls nor turns fast."""
    fx = force[0]
    fy = force[1]
    fz = force[2]
    size = math.sqrt(fx * fx + fy * fy + fz * fz)
    if abs(size - GRAVITY) < 1.0:  # beyond it is not gravity that is measured, as in a fall
        # R f = f + 2 w (a x f) + 2 a x (a x f), where a is the axis of the quaternion
        x, y, z, w = quaternion
        px = y * fz - z * fy
        py = z * fx - x * fz
        pz = x * fy - y * fx
        keep = FORCE_WINDOW / (FORCE_WINDOW + passed)
        before[FORCE] = keep * before[FORCE] + passed * (fx + 2.0 * (w * px + y * pz - z * py))
        before[FORCE + 1] = keep * before[FORCE + 1] + passed * (fy + 2.0 * (w * py + z * px - x * pz))
        before[FORCE + 2] = keep * before[FORCE + 2] + passed * (fz + 2.0 * (w * pz + x * py - y * px))
        before[WITNESSED] += passed
    if size > 0.0:
        size = min(size, 2.0 * GRAVITY)  # an impact is none of other units
        before[FORCE_SIZE] += (size - before[FORCE_SIZE]) * passed / FORCE_WINDOW


@part
def _find_skew(quaternion, before):
    """Return a leap of the tilt, or an angle between the vertical and the specific force, that is too large."""
    largest = 0.1  # angle between the vertical and the mean specific force [rad]
    askew = math.atan2(math.sqrt(before[FORCE] ** 2 + before[FORCE + 1] ** 2), before[FORCE + 2])
    if before[LEAPT] > 0.0:
        is_witnessed = before[WITNESSED] > 0.5 and askew < largest
        if not is_witnessed and _tilt_between(quaternion, before, ACCEPTED) > TILT_MARGIN:
            return 1, before[LEAPT]
        before[LEAPT] = 0.0
        before[FORCE + 2] += FORCE_WINDOW * GRAVITY
        return 0, 0.0
    return (3, askew) if askew > largest else (0, 0.0)


@part
def _find_rest(quaternion, passed, before):
    """Trust a link again that has not tilted for a while."""
    if _tilt_between(quaternion, before, STILL) > 0.02:  # [rad]
        for k in range(4):
            before[STILL + k] = quaternion[k]
        before[STILL_TIME] = 0.0
    before[STILL_TIME] += passed
    if before[STILL_TIME] > 0.5:  # [s]
        before[IS_DISTRUSTED] = 0.0


@part
def _compare_rotations(values, last, own_axes, passed, rate, before):
    """Compare the rotation since the quaternion before, in the axes of the link or of the world, with the rates."""
    fastest = 10.0  # rate beyond which the orientation has to rotate as fast: else it is a spike [rad/s]
    x = values[0]
    y = values[1]
    z = values[2]
    w = values[3]
    u, v, s, c = last
    side = 1.0 if own_axes else -1.0
    sign = 2.0 if c * w + u * x + v * y + s * z >= 0.0 else -2.0
    tx = sign * (c * x - w * u - side * (v * z - s * y))
    ty = sign * (c * y - w * v - side * (s * x - u * z))
    tz = sign * (c * z - w * s - side * (u * y - v * x))
    dx = tx - passed * values[10]
    dy = ty - passed * values[11]
    dz = tz - passed * values[12]
    if rate > fastest and math.sqrt(dx * dx + dy * dy + dz * dz) > 0.5 * passed * rate:
        return 4, rate
    if math.sqrt(tx * tx + ty * ty + tz * tz) > 0.05 + fastest * passed:  # the orientation was corrected
        return 0, 0.0
    keep = 1.0 if before[IS_APART] else WINDOW / (WINDOW + passed)  # what contradicted stays until it agrees again
    short_keep = SHORT / (SHORT + passed)
    before[COVERED] = short_keep * before[COVERED] + math.sqrt(tx * tx + ty * ty + tz * tz)
    before[COVERED + 1] = short_keep * before[COVERED + 1] + passed * rate
    rotated = rates = apart = 0.0
    for axis, angle in enumerate((tx, ty, tz)):
        before[ROTATION + axis] = keep * before[ROTATION + axis] + angle
        before[RATES + axis] = keep * before[RATES + axis] + passed * values[10 + axis]
        rotated += before[ROTATION + axis] ** 2
        rates += before[RATES + axis] ** 2
        apart += (before[ROTATION + axis] - before[RATES + axis]) ** 2
    contradicts = math.sqrt(apart) > 0.08 + 0.3 * (math.sqrt(rotated) + math.sqrt(rates))
    before[IS_APART] = 1.0 if contradicts else 0.0
    if contradicts:
        return 2, math.sqrt(rotated)
    # what rotates covers the angle of its rates; an orientation that shakes may cover more
    is_apart = before[COVERED + 1] > 0.008 + 2.0 * before[COVERED]
    return (4, before[COVERED + 1] / SHORT) if is_apart else (0, 0.0)


@part
def _find_fault(values, own_axes, force, arrival, stamp, before):
    """Check an orientation as `_check_rotation` does; remember it, whether it counts or not."""
    quaternion = values[0], values[1], values[2], values[3]
    last = before[NEWEST], before[NEWEST + 1], before[NEWEST + 2], before[NEWEST + 3]
    is_first = before[ARRIVAL] == -math.inf
    passed = stamp - before[STAMP]
    _find_tilt_leap(quaternion, arrival, stamp, before)
    before[NEWEST : NEWEST + 4] = values[:4]
    before[ARRIVAL] = arrival
    before[STAMP] = stamp
    is_frozen = quaternion == last
    if passed >= GAP or passed < -LONGEST_INTERVAL or (before[FROZEN_TIME] > GAP and not is_frozen):
        before[ROTATION:FORCE] = 0.0
        before[IS_APART] = 0.0
    before[FROZEN_TIME] = before[FROZEN_TIME] + passed if is_frozen else 0.0
    is_next = not is_first and 0.0 < passed < GAP
    rate = math.sqrt(values[10] ** 2 + values[11] ** 2 + values[12] ** 2)
    if is_next and rate < 0.5:  # [rad/s]: a sensor that rotates faster does not measure gravity alone
        _add_force(quaternion, force, passed, before)
    fault, size = _find_skew(quaternion, before)
    if before[IS_DISTRUSTED]:
        if is_next:
            _find_rest(quaternion, passed, before)
        if fault == 0 and before[IS_DISTRUSTED]:
            return 6, 0.0
    if fault or not is_next or rate == 0.0:  # many senders leave rates zero
        return fault, size
    fault, size = _compare_rotations(values, last, own_axes, passed, rate, before)
    # Beyond these bounds [m/s^2] it is in other units, or without gravity: a push that topples a robot within a second
    # makes it 13.
    if fault == 0 and not 6.8 < before[FORCE_SIZE] < 15.8:
        return 5, before[FORCE_SIZE]
    return fault, size


def _check_rotation(values, own_axes, force, arrival, stamp, before):
    """Check whether a link can have rotated like this since the measurement before.

    Args:
        values: Quaternion (x, y, z, w), position, linear and angular velocity.
        own_axes: Whether velocities are in the axes of the link.
        force: Specific force in the axes of the link; zeros if it is not measured.
        arrival: Arrival of the measurement.
        stamp: Its stamp.
        before: What is remembered, shape (NUMBERS,).

    Returns:
        1 and an angle: the tilt has leapt by it. 2: it rotates by this angle, and otherwise by its rates. 3: the
        specific force is so far from the vertical. 4: rates are so large [rad/s], and the orientation does not follow.
        0: none. 5: the mean specific force is so large [m/s^2], which refutes nothing. 6: others distrust the link.
    """
    fault, size = _find_fault(values, own_axes, force, arrival, stamp, before)
    if fault == 0 or fault == 5:
        before[ACCEPTED : ACCEPTED + 4] = values[:4]
    return fault, size


check_rotation = cached(
    "Tuple((int64, float64))(float64[::1], boolean, float64[::1], float64, float64, float64[::1])",
    _check_rotation,
)
