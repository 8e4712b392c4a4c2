"""Measurements of joints that cannot be true."""

import math

from solfer.numerics.blocks import BlockLayout
from solfer.numerics.compilation import exact_part, part
from solfer.numerics.kernels import wrapped

LONGEST_INTERVAL = 1.0
"""Longest time between two stamps that counts [s]: another clock may be anywhere."""

WINDOW = 1.0
"""Time constant of sums of motions that two sensors measure [s]."""

GAP = 0.1
"""Longest time between messages that are summed [s]."""

STEP = 0.02
"""Way between two messages that contradicts the velocities [rad, m]: encoders have steps of a few mrad, and velocities
that are filtered for 20 ms lag behind accelerations of 100 rad/s2."""

# rows of what is remembered of each joint
PLACE = 0
"""Position of the last measurement that was possible."""

ARRIVAL = 1
"""Its arrival."""

STAMP = 2
"""Its stamp."""

LAST_VELOCITY = 3
"""Velocity of the last measurement, whether possible or not."""

LAST_STAMP = 4
"""Its stamp."""

LAST_POSITION = 5
"""Its position."""

STRAYED = 6
"""Sum of how far it moved otherwise than by its velocities."""

ALLOWED = 7
"""Sum of how far it may have."""

FROZEN_TIME = 8
"""For how long it was frozen in motion: what comes after that is compared with nothing."""

LIMIT = 9
"""How far `STRAYED` may be for position and velocities to agree again; 0 while they do."""

SHAKEN_UNTIL = 10
"""Until when its velocities do not show its ways."""

AGREES_SINCE = 11
"""Since when they agree again."""

AGREED = 12
"""Sum of the differences since then."""

ROWS = 13
"""Number of rows."""

LEAPS = BlockLayout(
    "Leaps",
    count=int,
    before=(float, ROWS, "count"),
    fastest=(float, "count"),  # largest speed of each joint; infinity: none is known
    revolutions=(float, "count"),  # what positions may jump by; 0: nothing
    endless=(bool, "count"),  # joints without ends
)
"""What `find_leap` reads, and what is remembered of each joint."""

_leaps_at = LEAPS.at


@part
def _is_struck(velocity, part, before, stamp):
    """Whether so many joints change their velocities at once that the robot strikes something.

    These are five that change them by 2 rad/s, m/s between two messages; a wrong encoder does not.
    """
    count = 0
    for k in part:
        if 0.0 < stamp - before[LAST_STAMP, k] < GAP and abs(velocity[k] - before[LAST_VELOCITY, k]) > 2.0:
            count += 1
    return count >= 5


@part
def _is_right_again(before, k, step, allowed, stamp, is_near):
    """Whether a joint that contradicted its velocities has moved by them for 0.5 s, near its place."""
    before[AGREED, k] += step
    if not is_near or abs(step) > allowed or abs(before[AGREED, k]) > STEP:
        before[AGREES_SINCE, k] = stamp
        before[AGREED, k] = 0.0
    return stamp - before[AGREES_SINCE, k] > 0.5


@part
def _reset_stray(before, k):
    """Forget how far a joint has strayed."""
    before[STRAYED, k] = before[ALLOWED, k] = before[LIMIT, k] = 0.0


@exact_part
def find_leap(start, position, velocity, part, arrival, stamp):
    """Find the first joint that cannot be where it is measured, or as fast; remember the measurement.

    Velocities that have always been zero were not measured. Where velocities differ from one message to the next, the
    joint may have moved faster or slower than both by as much.

    With the position q, the velocity v and the time T between two messages, a step strays by
    q - q' - T (v + v') / 2. The sum of such steps, S <- S / (1 + T / WINDOW) + s, may be 0.08 rad or m and the sum of
    T (0.2 max(|v|, |v'|) + |v - v'|): velocities may be filtered.

    Args:
        start: Address of a `LEAPS`.
        position: Measured positions.
        velocity: Measured velocities; empty: there are none.
        part: Indices of the joints that were measured.
        arrival: Arrival of the measurement.
        stamp: Its stamp.

    Returns:
        Index of the joint; plus the number of joints where it is too fast, plus twice that where it does not move by
        its velocities. -1: there is none.
    """
    block = _leaps_at(start)
    before = block.before
    fastest = block.fastest
    revolutions = block.revolutions
    endless = block.endless
    stray_distance = 0.08  # [rad, m]
    stamp_error = 0.005  # [s]
    shaking_time = 0.5  # [s] after the robot has struck something, for which velocities do not show the ways
    wrong = -1
    if len(velocity) and _is_struck(velocity, part, before, stamp):
        for k in part:
            before[SHAKEN_UNTIL, k] = stamp + shaking_time
    for k in part:
        away = wrapped(position[k] - before[PLACE, k], revolutions[k])
        elapsed = max(arrival - before[ARRIVAL, k], min(stamp - before[STAMP, k], LONGEST_INTERVAL))
        if wrong < 0 and abs(away) > 0.1 + 2.0 * fastest[k] * elapsed:
            wrong = k
        if len(velocity) and fastest[k] < math.inf:
            fast = velocity[k]
            slow = before[LAST_VELOCITY, k]
            passed = stamp - before[LAST_STAMP, k]
            if wrong < 0 and abs(fast) > 5.0 + 3.0 * fastest[k]:
                wrong = k + len(position)
            is_frozen = fast == slow and fast != 0.0 and position[k] == before[LAST_POSITION, k]
            step = wrapped(position[k] - before[LAST_POSITION, k], revolutions[k]) - 0.5 * passed * (fast + slow)
            is_shaken = before[SHAKEN_UNTIL, k] - shaking_time <= stamp < before[SHAKEN_UNTIL, k]
            was_frozen = before[FROZEN_TIME, k] > GAP and not is_frozen
            if is_shaken or passed >= GAP or passed < -LONGEST_INTERVAL or was_frozen:
                _reset_stray(before, k)
            elif passed > 0.0 and before[LIMIT, k] > 0.0:  # all counts until they agree, and nothing excuses it
                before[STRAYED, k] += step
                allowed = STEP + stamp_error * max(abs(fast), abs(slow))
                is_near = endless[k] or abs(away) < 0.02  # less than a contradiction
                if abs(before[STRAYED, k]) <= before[LIMIT, k]:
                    before[LIMIT, k] = 0.0
                elif _is_right_again(before, k, step, allowed, stamp, is_near):
                    _reset_stray(before, k)
            # velocities at two messages that are further apart do not show the way between them
            elif 0.0 < passed < 0.025 and (fast != 0.0 or slow != 0.0 or before[ALLOWED, k] > 0.0):
                keep = WINDOW / (WINDOW + passed)
                speed = max(abs(fast), abs(slow))
                allowed = passed * (0.2 * speed + abs(fast - slow))
                before[STRAYED, k] = keep * before[STRAYED, k] + step
                before[ALLOWED, k] = keep * before[ALLOWED, k] + allowed
                if abs(before[STRAYED, k]) > stray_distance + before[ALLOWED, k]:
                    before[LIMIT, k] = stray_distance + before[ALLOWED, k]
                # velocities do not show a quarter of the acceleration of a link that swings at 30 Hz and 8 rad/s
                allowed += STEP + stamp_error * speed + 400.0 * passed * passed
                if abs(step) > allowed:
                    before[STRAYED, k] = step
                    before[LIMIT, k] = allowed
                before[AGREES_SINCE, k] = stamp
                before[AGREED, k] = 0.0
            if wrong < 0 and before[LIMIT, k] > 0.0:
                wrong = k + 2 * len(position)
            if passed != 0.0:
                before[LAST_VELOCITY, k] = fast
                before[LAST_STAMP, k] = stamp
                before[LAST_POSITION, k] = position[k]
                before[FROZEN_TIME, k] = before[FROZEN_TIME, k] + passed if is_frozen else 0.0
    if wrong < 0:
        for k in part:
            before[PLACE, k] = position[k]
            before[ARRIVAL, k] = arrival
            before[STAMP, k] = stamp
    return wrong
