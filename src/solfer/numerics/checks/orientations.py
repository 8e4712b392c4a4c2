"""Measured orientations of a link that cannot be true."""

import math

from solfer.numerics.checks.joints import GAP, LONGEST_INTERVAL, WINDOW
from solfer.numerics.compilation import cached, part

TILT_MARGIN = 0.1
"""Margin of a link's tilt [rad]."""

TILT_SPEED = 6.0
"""How fast a link can tilt [rad/s]."""

TILT_TIME = 0.1
"""Longest time for which that counts [s]."""

JUMP = 0.05
"""Turn between two messages, beside that by FASTEST_TURN, beyond which an orientation was corrected [rad]."""

FASTEST_TURN = 10.0
"""Turn rate beyond which an orientation has to turn as fast: else it is a spike [rad/s]."""

SPIKE_RATIO = 0.5
"""Ratio of the turn by such a rate by which the orientation turns otherwise."""

TURN_DIFFERENCE = 0.08
"""Difference of two turns that contradict each other [rad]."""

TURN_RATIO = 0.3
"""The same, as a ratio of both."""

LARGEST_SKEW = 0.1
"""Angle between the vertical and a mean specific force that contradict each other [rad]."""

FORCE_WINDOW = 1.5
"""Time constant of that mean [s], in which a velocity may change by 1.5 m/s."""

WITNESS_TIME = 0.5
"""Time for which the specific force has to agree with a tilt that leapt [s]."""

GRAVITY = 9.81
"""Specific force at rest [m/s^2]."""

FORCE_MARGIN = 1.0
"""How far a specific force may be from that [m/s^2]: beyond it is not gravity that is measured, as in a fall."""

STEADY_RATE = 0.5
"""How fast its sensor may turn, likewise [rad/s]."""

WEAKEST_FORCE = 6.8
STRONGEST_FORCE = 15.8
"""Sizes of the mean specific force beyond which it is in other units, or without gravity [m/s^2]: a push that topples a
robot within a second makes it 13."""

# what is remembered
NEWEST = 0
"""Quaternion of the last message, 4 numbers."""

ARRIVAL = 4
"""Its arrival."""

STAMP = 5
"""Its stamp."""

TURNED = 6
"""Sum of turns by the orientation, 3 numbers."""

RATES = 9
"""Sum of turns by the rates, 3 numbers."""

FORCE = 12
"""Sum of the specific force in the world's axes, 3 numbers."""

IS_APART = 15
"""Whether the turns contradicted each other."""

FROZEN_TIME = 16
"""For how long the orientation was frozen."""

ACCEPTED = 17
"""Quaternion that was accepted last, 4 numbers."""

LEAPT = 21
"""By how much the tilt has leapt from there; 0: it has not."""

WITNESSED = 22
"""For how long the specific force was measured since then."""

FORCE_SIZE = 23
"""Mean size of the specific force."""

NUMBERS = 24


@part
def _tilt_between(x, y, z, w, before, first):
    """Return by what angle the vertical of a quaternion differs from that of the one at `first` [rad]."""
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
def _find_tilt_leap(x, y, z, w, arrival, stamp, before):
    """Note whether the tilt has leapt since the message before; the first one is accepted."""
    if before[ARRIVAL] == -math.inf:
        before[FORCE + 2] = FORCE_WINDOW * GRAVITY  # a robot that starts by accelerating is not askew
        before[FORCE_SIZE] = GRAVITY
        return
    elapsed = max(arrival - before[ARRIVAL], min(stamp - before[STAMP], LONGEST_INTERVAL))
    tilt = _tilt_between(x, y, z, w, before, NEWEST)
    if tilt > TILT_MARGIN + TILT_SPEED * min(elapsed, TILT_TIME):
        before[TURNED:FROZEN_TIME] = 0.0
        before[LEAPT] = max(before[LEAPT], _tilt_between(x, y, z, w, before, ACCEPTED))
        before[WITNESSED] = 0.0


@part
def _add_force(x, y, z, w, force, passed, before):
    """Add the specific force, in the world's axes, while it is that of a robot that neither falls nor turns fast."""
    fx = force[0]
    fy = force[1]
    fz = force[2]
    size = math.sqrt(fx * fx + fy * fy + fz * fz)
    if abs(size - GRAVITY) < FORCE_MARGIN:
        # R f = f + 2 w (a x f) + 2 a x (a x f), where a is the axis of the quaternion
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
def _find_skew(x, y, z, w, before):
    """Return a leap of the tilt, or an angle between the vertical and the specific force, that is too large."""
    askew = math.atan2(math.sqrt(before[FORCE] ** 2 + before[FORCE + 1] ** 2), before[FORCE + 2])
    if before[LEAPT] > 0.0:
        is_witnessed = before[WITNESSED] > WITNESS_TIME and askew < LARGEST_SKEW
        if not is_witnessed and _tilt_between(x, y, z, w, before, ACCEPTED) > TILT_MARGIN:
            return 1, before[LEAPT]
        before[LEAPT] = 0.0
        before[FORCE + 2] += FORCE_WINDOW * GRAVITY
        return 0, 0.0
    return (3, askew) if askew > LARGEST_SKEW else (0, 0.0)


@part
def _compare_turns(values, u, v, s, c, own_axes, passed, rate, before):
    """Compare the turn since the quaternion before, in the axes of the link or of the world, with the rates."""
    x = values[0]
    y = values[1]
    z = values[2]
    w = values[3]
    side = 1.0 if own_axes else -1.0
    sign = 2.0 if c * w + u * x + v * y + s * z >= 0.0 else -2.0
    tx = sign * (c * x - w * u - side * (v * z - s * y))
    ty = sign * (c * y - w * v - side * (s * x - u * z))
    tz = sign * (c * z - w * s - side * (u * y - v * x))
    dx = tx - passed * values[10]
    dy = ty - passed * values[11]
    dz = tz - passed * values[12]
    if rate > FASTEST_TURN and math.sqrt(dx * dx + dy * dy + dz * dz) > SPIKE_RATIO * passed * rate:
        return 4, rate
    if math.sqrt(tx * tx + ty * ty + tz * tz) > JUMP + FASTEST_TURN * passed:
        return 0, 0.0
    keep = 1.0 if before[IS_APART] else WINDOW / (WINDOW + passed)  # what contradicted stays until it agrees again
    turned = rates = apart = 0.0
    for axis, turn in enumerate((tx, ty, tz)):
        before[TURNED + axis] = keep * before[TURNED + axis] + turn
        before[RATES + axis] = keep * before[RATES + axis] + passed * values[10 + axis]
        turned += before[TURNED + axis] ** 2
        rates += before[RATES + axis] ** 2
        apart += (before[TURNED + axis] - before[RATES + axis]) ** 2
    contradicts = math.sqrt(apart) > TURN_DIFFERENCE + TURN_RATIO * (math.sqrt(turned) + math.sqrt(rates))
    before[IS_APART] = 1.0 if contradicts else 0.0
    return (2, math.sqrt(turned)) if contradicts else (0, 0.0)


@part
def _find_fault(values, own_axes, force, arrival, stamp, before):
    """Check an orientation as `_check_turn` does; remember it, whether it counts or not."""
    x = values[0]
    y = values[1]
    z = values[2]
    w = values[3]
    u = before[NEWEST]
    v = before[NEWEST + 1]
    s = before[NEWEST + 2]
    c = before[NEWEST + 3]
    is_first = before[ARRIVAL] == -math.inf
    passed = stamp - before[STAMP]
    _find_tilt_leap(x, y, z, w, arrival, stamp, before)
    before[NEWEST] = x
    before[NEWEST + 1] = y
    before[NEWEST + 2] = z
    before[NEWEST + 3] = w
    before[ARRIVAL] = arrival
    before[STAMP] = stamp
    is_frozen = x == u and y == v and z == s and w == c
    if passed >= GAP or passed < -LONGEST_INTERVAL or (before[FROZEN_TIME] > GAP and not is_frozen):
        before[TURNED:FORCE] = 0.0
        before[IS_APART] = 0.0
    before[FROZEN_TIME] = before[FROZEN_TIME] + passed if is_frozen else 0.0
    is_next = not is_first and 0.0 < passed < GAP
    rate = math.sqrt(values[10] ** 2 + values[11] ** 2 + values[12] ** 2)
    if is_next and rate < STEADY_RATE:
        _add_force(x, y, z, w, force, passed, before)
    fault, size = _find_skew(x, y, z, w, before)
    if fault or not is_next or rate == 0.0:  # many senders leave rates zero
        return fault, size
    fault, size = _compare_turns(values, u, v, s, c, own_axes, passed, rate, before)
    if fault == 0 and not WEAKEST_FORCE < before[FORCE_SIZE] < STRONGEST_FORCE:
        return 5, before[FORCE_SIZE]
    return fault, size


def _check_turn(values, own_axes, force, arrival, stamp, before):
    """Check whether a link can have turned like this since the measurement before.

    Args:
        values: Quaternion (x, y, z, w), position, linear and angular velocity.
        own_axes: Whether velocities are in the axes of the link.
        force: Specific force in the axes of the link; zeros if it is not measured.
        arrival: Arrival of the measurement.
        stamp: Its stamp.
        before: What is remembered, shape (NUMBERS,).

    Returns:
        1 and an angle: the tilt has leapt by it. 2: it turns by this angle, and otherwise by its rates. 3: the specific
        force is so far from the vertical. 4: rates are so large [rad/s], and the orientation does not follow. 0: none.
        5: the mean specific force is so large [m/s^2], which refutes nothing.
    """
    fault, size = _find_fault(values, own_axes, force, arrival, stamp, before)
    if fault == 0 or fault == 5:
        before[ACCEPTED : ACCEPTED + 4] = values[:4]
    return fault, size


check_turn = cached(
    "Tuple((int64, float64))(float64[::1], boolean, float64[::1], float64, float64, float64[::1])",
    _check_turn,
)
