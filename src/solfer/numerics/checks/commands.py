"""Joints that do not follow their commands."""

from solfer.numerics.compilation import cached


def _find_astray(desired, measured, dofs, places, record, stiffness, efforts, limits, passed):
    """Return the first joint that does not reach its command; -1: there is none.

    It has been 1 rad or m from it for 0.5 s, or 0.05 rad or m for 0.3 s with all the effort of its motor. Wheels that
    steer on the ground were half a radian behind where a busy loop left cycles out.

    Args:
        desired: Commanded positions.
        measured: Measured positions of all DoFs.
        dofs: Which of them are commanded.
        places: Which of those are watched.
        record: For how long each joint has been far away, and in vain with all effort.
        stiffness: Those without stiffness do not count.
        efforts: Measured efforts of all DoFs.
        limits: Efforts of the commanded ones from which on a motor does all that it can.
        passed: Time since the cycle before [s].
    """
    for k in places:
        away = desired[k] - measured[dofs[k]]
        effort = efforts[dofs[k]] if away > 0.0 else -efforts[dofs[k]]
        is_held = stiffness[k] > 0.0
        record[0, k] = record[0, k] + passed if is_held and abs(away) > 1.0 else 0.0
        is_vain = is_held and abs(away) > 0.05 and effort >= limits[k]
        record[1, k] = record[1, k] + passed if is_vain else 0.0
        if record[0, k] > 0.5 or record[1, k] > 0.3:
            return k
    return -1


def _find_stuck(desired, measured, dofs, places, record, passed):
    """Return the first joint that does not turn as it is commanded; -1: there is none.

    A joint lags by all of its command where it turns below 0.2 times it, and catches up where it turns faster, until it
    is stuck at 0.5 rad or m: a cumulative sum, so that nothing counts that a joint did before it was jammed.

    Args:
        desired: Commanded velocities.
        measured: Measured velocities of all DoFs.
        dofs: Which of them are commanded.
        places: Which of those are watched.
        record: Lag of each joint, and its way in the direction of its commands while it lagged.
        passed: Time since the cycle before [s].
    """
    ratio = 0.2
    for k in places:
        speed = abs(desired[k])
        velocity = measured[dofs[k]] if desired[k] >= 0.0 else -measured[dofs[k]]
        is_slow = velocity < ratio * speed
        lag = record[0, k] + passed * (speed if is_slow else -velocity / ratio)
        record[0, k] = max(lag, 0.0)
        record[1, k] = record[1, k] + passed * velocity if lag > 0.0 else 0.0
        if lag > 0.5:
            return k
    return -1


_ROW = "float64[::1]"
_DOFS = "int64[::1]"
_ROWS = "float64[:, ::1]"

find_astray = cached(f"int64({_ROW}, {_ROW}, {_DOFS}, {_DOFS}, {_ROWS}, {_ROW}, {_ROW}, {_ROW}, float64)", _find_astray)
find_stuck = cached(f"int64({_ROW}, {_ROW}, {_DOFS}, {_DOFS}, {_ROWS}, float64)", _find_stuck)
