"""What an inertial measurement unit measures, and what it lacks."""

from solfer.numerics.compilation import cached

NO_ORIENTATION = 1
"""It measures no orientation: all of it is zero or NaN, as some drivers publish it."""

NO_RATES = 2
"""It measures no angular velocity: all of it is NaN."""


def _read_imu(orientation, angular, acceleration, values, force):
    """Copy what an IMU measures; return the sum of what it lacks, which is written as no rotation, and at rest.

    Args:
        orientation: Its quaternion.
        angular: Its angular velocity [rad/s].
        acceleration: Its specific force [m/s^2].
        values: Quaternion, position, linear and angular velocity; the first and the last are written.
        force: The specific force; zeros where it is not finite.
    """
    are_zero = are_nan = no_rates = True
    for k in range(4):
        are_zero &= orientation[k] == 0.0
        are_nan &= orientation[k] != orientation[k]
    total = 0.0
    for k in range(3):
        no_rates &= angular[k] != angular[k]
        total += acceleration[k]
    no_orientation = are_zero or are_nan
    for k in range(4):
        values[k] = (1.0 if k == 3 else 0.0) if no_orientation else orientation[k]
    for k in range(3):
        values[10 + k] = 0.0 if no_rates else angular[k]
        force[k] = acceleration[k] if total - total == 0.0 else 0.0
    return (NO_ORIENTATION if no_orientation else 0) + (NO_RATES if no_rates else 0)


def _plausible(values, top_speed, top_rate):
    """Return whether all values of a body are finite, and no speed is beyond what robots can [m/s, rad/s]."""
    total = 0.0
    for k in range(13):
        total += values[k]
    if not total - total == 0.0:
        return False
    for k in range(3):
        if not (abs(values[7 + k]) < top_speed and abs(values[10 + k]) < top_rate):
            return False
    return True


_V = "float64[::1]"
read_imu = cached(f"int64({_V}, {_V}, {_V}, {_V}, {_V})", _read_imu)
plausible = cached(f"boolean({_V}, float64, float64)", _plausible)
