"""Compiled look-ups on short vectors: finite, within bounds, gather, scatter. One call where NumPy needs several."""

import math

import numpy as np
from numba import carray

from solfer.numerics.compilation import cached, part
from solfer.numerics.pointers import floats


def all_finite(values: np.ndarray, flags: np.ndarray) -> bool:
    """Return whether all numbers are finite.

    Args:
        values: The numbers.
        flags: Set for each number to whether it is finite; booleans of the same shape.
    """
    return b"\0" not in np.isfinite(values, out=flags).tobytes()


def _inside(values, lower, upper):
    """Return whether each value is finite and within its bounds."""
    for index in range(len(values)):
        value = values[index]
        if not (value - value == 0.0 and lower[index] <= value <= upper[index]):  # false for NaN
            return False
    return True


inside = cached("boolean(float64[::1], float64[::1], float64[::1])", _inside)


def _finite(values):
    """Return whether all values are finite."""
    total = 0.0
    for value in values:
        total += value - value  # NaN for infinity and NaN
    return total == 0.0


finite = cached("boolean(float64[::1])", _finite)


def _tables_finite(first, second):
    """Return whether all values of two tables are finite."""
    total = 0.0
    for table in (first, second):
        for row in table:
            for value in row:
                total += value - value
    return total == 0.0


tables_finite = cached("boolean(float64[:, ::1], float64[:, ::1])", _tables_finite)


def _gather(numbers, rows, source, places, out):
    """Write numbers[rows][:, source] to out[:, places].

    Returns the index, row by row, of the first one that is not finite; -1 if all are.
    """
    wrong = -1
    count = len(source)
    for row in range(len(rows)):
        for index in range(count):
            number = numbers[rows[row], source[index]]
            out[row, places[index]] = number
            if number - number != 0.0 and wrong < 0:  # infinity and NaN
                wrong = row * count + index
    return wrong


def _scatter(values, places, dofs, arrays):
    """Write values[row, places] to the entries dofs[places] of the array at the address arrays[row], for each row.

    Returns the rows that this changed, a bit each.
    """
    changed = 0
    for row in range(len(arrays)):
        out = carray(floats(arrays[row]), (1,))
        for index in range(len(places)):
            place = places[index]
            dof = dofs[place]
            value = values[row, place]
            if out[dof] != value:
                changed |= 1 << row
            out[dof] = value
    return changed


def _collect(arrays, dofs, out):
    """Write the entries `dofs` of the array at the address arrays[row] to out[row], for each row."""
    for row in range(len(arrays)):
        values = carray(floats(arrays[row]), (1,))
        for index in range(len(dofs)):
            out[row, index] = values[dofs[index]]


@part
def _wrapped(displacement, turn):
    """Return a displacement without whole turns; a turn of 0 is none."""
    return displacement - turn * math.floor(displacement / turn + 0.5) if turn else displacement


def _unwrap(position, part, before, turns, added):
    """Add whole turns to positions of senders that count within one turn, so that none moves by more than half of it.

    Args:
        position: Positions, as they came; written.
        part: Indices of the positions that came.
        before: The positions before, NaN: there is none; and the least and largest ones that came.
        turns: What positions may jump by; 0: nothing.
        added: What was added before; written.
    """
    for k in part:
        if turns[k]:
            came = position[k]
            least = min(before[1, k], came)
            largest = max(before[2, k], came)
            if before[0, k] == before[0, k] and largest - least <= turns[k] * (1.0 + 1e-6):
                added[k] = turns[k] * math.floor((before[0, k] - came) / turns[k] + 0.5)
            position[k] = came + added[k]


unwrap = cached("void(float64[::1], int64[::1], float64[:, ::1], float64[::1], float64[::1])", _unwrap)


def _keep_turns(position, part, before, added):
    """Keep positions that `unwrap` has written, for the next ones."""
    for k in part:
        came = position[k] - added[k]
        before[0, k], before[1, k], before[2, k] = position[k], min(before[1, k], came), max(before[2, k], came)


keep_turns = cached("void(float64[::1], int64[::1], float64[:, ::1], float64[::1])", _keep_turns)


def _shorten(displacements, turns):
    """Remove whole turns from displacements, in place; a turn of 0 is none.

    Args:
        displacements: Differences of positions, one row at a time.
        turns: What positions may jump by, one of each column.
    """
    for row in displacements:
        for k in range(len(turns)):
            row[k] = _wrapped(row[k], turns[k])


shorten = cached("void(float64[:, ::1], float64[::1])", _shorten)


LEAP, JOINT_SPEED_MARGIN = 0.1, 5.0
"""Margins of the place and the speed of a joint [rad, m], [rad/s, m/s]."""

LONGEST_INTERVAL = 1.0
"""Longest time between two stamps that counts [s]: another clock may be anywhere."""

SUMMED, GAP = 1.0, 0.1
"""Time over which motions are summed that two sensors measure, and longest one between messages that are summed [s]."""

KNOWN = 0.025
"""Time between two messages from which on the velocities at both do not show the way between them [s]."""

STRAY, STRAY_SHARE = 0.08, 0.2
"""Way of a joint that contradicts its velocities [rad, m], and as a share of its way by them: they may be filtered."""


CHECK_STEP, CHECK_LATENESS, HIDDEN_ACCELERATION = 0.02, 0.005, 400.0
"""Way of a joint between two messages that contradicts its velocities [rad, m]: encoders have steps of a few mrad, and
velocities that are filtered for 20 ms lag behind accelerations of 100 rad/s2. Time by which stamps may be wrong [s].
Acceleration that velocities do not show [rad/s2, m/s2]: a quarter of that of a link which swings at 30 Hz and 8 rad/s.
"""


RETURNED, AGREED = 0.02, 0.5
"""Distance from where a joint was accepted last at which it is right again [rad, m]: less than a contradiction; and for
how long it has to move by its velocities until then [s]. A joint without ends may be anywhere."""

STRUCK, JOLT, SHAKEN = 5, 2.0, 0.5
"""Number of joints that change their velocities at once by more than the second between two messages [rad/s, m/s] where
the robot strikes something: a wrong encoder does not. Time for which the velocities of joints do not show their ways
then [s]."""


@part
def _is_struck(velocity, part, before, stamp):
    """Whether so many joints change their velocities at once that the robot strikes something."""
    count = 0
    for k in part:
        if 0.0 < stamp - before[4, k] < GAP and abs(velocity[k] - before[3, k]) > JOLT:
            count += 1
    return count >= STRUCK


@part
def _is_right_again(before, k, step, doubt, stamp, is_near):
    """Whether a joint that contradicted its velocities has moved by them for long, and was near its place meanwhile."""
    before[12, k] += step
    if not is_near or abs(step) > doubt or abs(before[12, k]) > CHECK_STEP:
        before[11, k] = stamp
        before[12, k] = 0.0
    return stamp - before[11, k] > AGREED


def _find_leap(position, velocity, part, before, fastest, turns, endless, arrival, stamp):
    """Find the first joint that cannot be where it is measured, or as fast; remember the measurement.

    Velocities that have always been zero were not measured. Where velocities differ from one message to the next, the
    joint may have moved faster or slower than both by as much.

    Args:
        position: Measured positions.
        velocity: Measured velocities; empty: there are none.
        part: Indices of the joints that were measured.
        before: Position, arrival and stamp of the last measurement that was possible, of each joint; velocity, stamp
            and position of the last one; then summed how far it moved otherwise than by its velocities, and how far it
            may have; for how long it was frozen in motion: what comes after that is compared with nothing; and how far
            that sum may be for its position and its velocities to agree again, 0 while they do; until when its
            velocities do not show its ways; and since when they agree again, and the sum since then.
        fastest: Largest speed of each joint; infinity: none is known.
        turns: What positions may jump by; 0: nothing.
        endless: Whether each joint has no ends.
        arrival: Arrival of the measurement.
        stamp: Its stamp.

    Returns:
        Index of the joint; plus the number of joints where it is too fast, plus twice that where it does not move by
        its velocities. -1: there is none.
    """
    wrong = -1
    if len(velocity) and _is_struck(velocity, part, before, stamp):
        for k in part:
            before[10, k] = stamp + SHAKEN
    for k in part:
        away = _wrapped(position[k] - before[0, k], turns[k])
        elapsed = max(arrival - before[1, k], min(stamp - before[2, k], LONGEST_INTERVAL))
        if wrong < 0 and abs(away) > LEAP + 2.0 * fastest[k] * elapsed:
            wrong = k
        if len(velocity) and fastest[k] < math.inf:
            fast = velocity[k]
            slow = before[3, k]
            passed = stamp - before[4, k]
            if wrong < 0 and abs(fast) > JOINT_SPEED_MARGIN + 3.0 * fastest[k]:
                wrong = k + len(position)
            is_frozen = fast == slow and fast != 0.0 and position[k] == before[5, k]
            step = _wrapped(position[k] - before[5, k], turns[k]) - 0.5 * passed * (fast + slow)
            is_shaken = before[10, k] - SHAKEN <= stamp < before[10, k]
            if is_shaken or passed >= GAP or passed < -LONGEST_INTERVAL or (before[8, k] > GAP and not is_frozen):
                before[6, k] = before[7, k] = before[9, k] = 0.0
            elif passed > 0.0 and before[9, k] > 0.0:  # all counts until they agree, and no doubt excuses it meanwhile
                before[6, k] += step
                doubt = CHECK_STEP + CHECK_LATENESS * max(abs(fast), abs(slow))
                is_near = endless[k] or abs(away) < RETURNED
                if abs(before[6, k]) <= before[9, k]:
                    before[9, k] = 0.0
                elif _is_right_again(before, k, step, doubt, stamp, is_near):
                    before[6, k] = before[7, k] = before[9, k] = 0.0
            elif 0.0 < passed < KNOWN and (fast != 0.0 or slow != 0.0 or before[7, k] > 0.0):
                keep = SUMMED / (SUMMED + passed)
                speed = max(abs(fast), abs(slow))
                doubt = passed * (STRAY_SHARE * speed + abs(fast - slow))
                before[6, k], before[7, k] = keep * before[6, k] + step, keep * before[7, k] + doubt
                if abs(before[6, k]) > STRAY + before[7, k]:
                    before[9, k] = STRAY + before[7, k]
                doubt += CHECK_STEP + CHECK_LATENESS * speed + HIDDEN_ACCELERATION * passed * passed
                if abs(step) > doubt:
                    before[6, k] = step
                    before[9, k] = doubt
                before[11, k] = stamp
                before[12, k] = 0.0
            if wrong < 0 and before[9, k] > 0.0:
                wrong = k + 2 * len(position)
            if passed != 0.0:
                before[3, k], before[4, k], before[5, k] = fast, stamp, position[k]
                before[8, k] = before[8, k] + passed if is_frozen else 0.0
    if wrong < 0:
        for k in part:
            before[0, k] = position[k]
            before[1, k] = arrival
            before[2, k] = stamp
    return wrong


find_leap = cached(
    "int64(float64[::1], float64[::1], int64[::1], float64[:, ::1], float64[::1], float64[::1], boolean[::1],"
    " float64, float64)",
    _find_leap,
)


TILTED, TILTING, TILT_WINDOW = 0.1, 6.0, 0.1
"""Margin of a link's tilt [rad], how fast it can tilt [rad/s], and longest time for which that counts [s]."""

JUMPED, CHECK_TURN_SHARE, FOLLOWED = 0.05, 10.0, 0.5
"""Turns beyond which an orientation was corrected, and has not turned [rad], [rad/s]; share of a turn by such rates by
which the orientation turns otherwise: they are spikes."""

APART, APART_SHARE = 0.08, 0.3
"""Difference of two turns that contradict each other [rad], and as a share of both."""

CHECK_SKEW, SKEWED_TIME, WITNESSED = 0.1, 1.5, 0.5
"""Angle between the vertical and a mean specific force that contradict each other [rad]; time over which that is the
mean [s], so that a velocity may change by 1.5 m/s; and for how long it has to agree with a tilt that leapt [s]."""

GRAVITY, CHECK_UNEVENNESS, CHECK_TURN_LIMIT = 9.81, 1.0, 0.5
"""Specific force at rest, how far it may be from that [m/s^2], and how fast its sensor may turn [rad/s]: beyond that
it is not gravity that is measured, as in a fall."""

WEAKEST_FORCE = 6.8
STRONGEST_FORCE = 15.8
"""Sizes of the mean specific force of 1.5 s beyond which it is in other units, or without gravity [m/s^2]: a push that
topples a robot within a second makes it 13."""


@part
def _tilted(x, y, z, w, before, row):
    """Return by what angle the vertical of a quaternion differs from that of the one at `row` [rad]."""
    u = before[row]
    v = before[row + 1]
    s = before[row + 2]
    c = before[row + 3]
    upright = (
        4.0 * (x * z - y * w) * (u * s - v * c)
        + 4.0 * (y * z + x * w) * (v * s + u * c)
        + (1.0 - 2.0 * (x * x + y * y)) * (1.0 - 2.0 * (u * u + v * v))
    )
    return math.acos(min(1.0, max(-1.0, upright)))


@part
def _find_fault(values, own_axes, force, arrival, stamp, before):
    """Check an orientation as `_check_turn` does; remember it, whether it counts or not."""
    x = values[0]
    y = values[1]
    z = values[2]
    w = values[3]
    u = before[0]
    v = before[1]
    s = before[2]
    c = before[3]
    elapsed = max(arrival - before[4], min(stamp - before[5], LONGEST_INTERVAL))
    known = before[4] > -math.inf
    passed = stamp - before[5]
    if known:
        tilt = _tilted(x, y, z, w, before, 0)
        if tilt > TILTED + TILTING * min(elapsed, TILT_WINDOW):
            before[6:16] = 0.0
            before[21] = max(before[21], _tilted(x, y, z, w, before, 17))
            before[22] = 0.0
    else:
        before[14] = SKEWED_TIME * GRAVITY  # a robot that starts by accelerating is not askew
        before[23] = GRAVITY
    before[0] = x
    before[1] = y
    before[2] = z
    before[3] = w
    before[4] = arrival
    before[5] = stamp
    is_frozen = x == u and y == v and z == s and w == c
    if passed >= GAP or passed < -LONGEST_INTERVAL or (before[16] > GAP and not is_frozen):
        before[6:12] = 0.0
        before[15] = 0.0
    before[16] = before[16] + passed if is_frozen else 0.0
    is_next = known and 0.0 < passed < GAP
    rate = math.sqrt(values[10] ** 2 + values[11] ** 2 + values[12] ** 2)
    fx = force[0]
    fy = force[1]
    fz = force[2]
    even = abs(math.sqrt(fx * fx + fy * fy + fz * fz) - GRAVITY) < CHECK_UNEVENNESS
    if is_next and even and rate < CHECK_TURN_LIMIT:
        # R f = f + 2 w (a x f) + 2 a x (a x f), where a is the axis of the quaternion
        px = y * fz - z * fy
        py = z * fx - x * fz
        pz = x * fy - y * fx
        keep = SKEWED_TIME / (SKEWED_TIME + passed)
        before[12] = keep * before[12] + passed * (fx + 2.0 * (w * px + y * pz - z * py))
        before[13] = keep * before[13] + passed * (fy + 2.0 * (w * py + z * px - x * pz))
        before[14] = keep * before[14] + passed * (fz + 2.0 * (w * pz + x * py - y * px))
        before[22] += passed
    if is_next and rate < CHECK_TURN_LIMIT and fx * fx + fy * fy + fz * fz > 0.0:
        size = min(math.sqrt(fx * fx + fy * fy + fz * fz), 2.0 * GRAVITY)  # an impact is none of other units
        before[23] += (size - before[23]) * passed / SKEWED_TIME
    askew = math.atan2(math.sqrt(before[12] ** 2 + before[13] ** 2), before[14])
    if before[21] > 0.0:
        is_witnessed = before[22] > WITNESSED and askew < CHECK_SKEW
        if not is_witnessed and _tilted(x, y, z, w, before, 17) > TILTED:
            return 1, before[21]
        before[21] = 0.0
        before[14] += SKEWED_TIME * GRAVITY
        askew = 0.0
    if askew > CHECK_SKEW:
        return 3, askew
    if not is_next or rate == 0.0:  # many senders leave them zero
        return 0, 0.0
    fault = 0 if WEAKEST_FORCE < before[23] < STRONGEST_FORCE else 5
    keep = SUMMED / (SUMMED + passed)
    # the turn since then: in the axes of the link, or in those of the world
    side = 1.0 if own_axes else -1.0
    sign = 2.0 if c * w + u * x + v * y + s * z >= 0.0 else -2.0
    tx = sign * (c * x - w * u - side * (v * z - s * y))
    ty = sign * (c * y - w * v - side * (s * x - u * z))
    tz = sign * (c * z - w * s - side * (u * y - v * x))
    dx = tx - passed * values[10]
    dy = ty - passed * values[11]
    dz = tz - passed * values[12]
    if rate > CHECK_TURN_SHARE and math.sqrt(dx * dx + dy * dy + dz * dz) > FOLLOWED * passed * rate:
        return 4, rate
    if math.sqrt(tx * tx + ty * ty + tz * tz) > JUMPED + CHECK_TURN_SHARE * passed:
        return fault, before[23]
    if before[15]:  # what contradicted stays in the sums until it agrees again
        keep = 1.0
    turned = rates = apart = 0.0
    for axis, turn in enumerate((tx, ty, tz)):
        before[6 + axis] = keep * before[6 + axis] + turn
        before[9 + axis] = keep * before[9 + axis] + passed * values[10 + axis]
        turned += before[6 + axis] ** 2
        rates += before[9 + axis] ** 2
        apart += (before[6 + axis] - before[9 + axis]) ** 2
    contradicts = math.sqrt(apart) > APART + APART_SHARE * (math.sqrt(turned) + math.sqrt(rates))
    before[15] = 1.0 if contradicts else 0.0
    return (2, math.sqrt(turned)) if contradicts else (fault, before[23])


def _check_turn(values, own_axes, force, arrival, stamp, before):
    """Check whether a link can have turned like this since the measurement before.

    Args:
        values: Quaternion (x, y, z, w), position, linear and angular velocity.
        own_axes: Whether velocities are in the axes of the link.
        force: Specific force in the axes of the link; zeros if it is not measured.
        arrival: Arrival of the measurement.
        stamp: Its stamp.
        before: Quaternion, arrival and stamp of the measurement before; sums of turns by orientation and by rates; sum
            of the specific force in the world's axes; whether the turns contradicted each other; for how long the
            orientation was frozen; the quaternion that was accepted last; by how much the tilt has leapt from there, 0:
            it has not; for how long the specific force was measured since then; and its mean size.

    Returns:
        1 and an angle: the tilt has leapt by it. 2: it turns by this angle, and otherwise by its rates. 3: the specific
        force is so far from the vertical. 4: rates are so large [rad/s], and the orientation does not follow. 0: none.
        5: the mean specific force is so large [m/s^2], which refutes nothing.
    """
    fault, size = _find_fault(values, own_axes, force, arrival, stamp, before)
    if fault == 0 or fault == 5:
        before[17:21] = values[:4]
    return fault, size


check_turn = cached(
    "Tuple((int64, float64))(float64[::1], boolean, float64[::1], float64, float64, float64[::1])",
    _check_turn,
)


CHECK_DISTANCE, LONG = 1.0, 0.5
"""Distance from its command at which a joint does not follow it [rad, m], and for how long [s]: wheels that steer on
the ground were half a radian behind where a busy loop left cycles out."""

FOLLOWING_LAG, LAG_SHARE = 0.5, 0.2
"""How far a joint may lag behind before it does not follow [rad, m], and the share of its command at which it does not
lag."""


def _find_astray(desired, measured, dofs, places, record, stiffness, passed):
    """Return the first joint that has been far from its command for long; -1: there is none.

    Args:
        desired: Commanded positions.
        measured: Measured positions of all DoFs.
        dofs: Which of them are commanded.
        places: Which of those are watched.
        record: First row: for how long each joint has been far away.
        stiffness: Those without stiffness do not count.
        passed: Time since the cycle before [s].
    """
    for k in places:
        is_away = abs(desired[k] - measured[dofs[k]]) > CHECK_DISTANCE and stiffness[k] > 0.0
        record[0, k] = record[0, k] + passed if is_away else 0.0
        if record[0, k] > LONG:
            return k
    return -1


def _find_stuck(desired, measured, dofs, places, record, passed):
    """Return the first joint that does not turn as it is commanded; -1: there is none.

    A joint lags by all of its command where it turns below `LAG_SHARE` of it, and catches up where it turns faster:
    a cumulative sum, so that nothing counts that a joint did before it was jammed.

    Args:
        desired: Commanded velocities.
        measured: Measured velocities of all DoFs.
        dofs: Which of them are commanded.
        places: Which of those are watched.
        record: Lag of each joint, and its way in the direction of its commands while it lagged.
        passed: Time since the cycle before [s].
    """
    for k in places:
        speed = abs(desired[k])
        velocity = measured[dofs[k]] if desired[k] >= 0.0 else -measured[dofs[k]]
        is_slow = velocity < LAG_SHARE * speed
        lag = record[0, k] + passed * (speed if is_slow else -velocity / LAG_SHARE)
        record[0, k] = max(lag, 0.0)
        record[1, k] = record[1, k] + passed * velocity if lag > 0.0 else 0.0
        if lag > FOLLOWING_LAG:
            return k
    return -1


_ROW = "float64[::1]"
_DOFS = "int64[::1]"
_ROWS = "float64[:, ::1]"
find_astray = cached(f"int64({_ROW}, {_ROW}, {_DOFS}, {_DOFS}, {_ROWS}, {_ROW}, float64)", _find_astray)
find_stuck = cached(f"int64({_ROW}, {_ROW}, {_DOFS}, {_DOFS}, {_ROWS}, float64)", _find_stuck)


def _keep(block, kept, steps):
    """Copy rows, and return the largest change of a number.

    Args:
        block: Rows of numbers.
        kept: The same before, and afterwards.
        steps: For each row the time that makes a way of its numbers, which are velocities [s]; 0: these are places;
            negative: they do not count.
    """
    displacement = 0.0
    for row in range(len(block)):
        step = steps[row]
        for index in range(len(block[row])):
            number = block[row, index]
            if step >= 0.0:
                displacement = max(displacement, abs(number - kept[row, index]) if step == 0.0 else step * abs(number))
            kept[row, index] = number
    return displacement


keep = cached("float64(float64[:, ::1], float64[:, ::1], float64[::1])", _keep)
gather = cached("int64(float64[:, ::1], int64[::1], int64[::1], int64[::1], float64[:, ::1])", _gather)
scatter = cached("int64(float64[:, ::1], int64[::1], int64[::1], int64[::1])", _scatter)
collect = cached("void(int64[::1], int64[::1], float64[:, ::1])", _collect)
