"""Compiled steps of the Kalman filter of odometry, number by number. Arrays are described in `ContactKalman`."""

import math

from solfer.numerics.compilation import cached, part

LIKELY = 4.0
"""Deviations that an error of the tilt, or of a bias, has at most: what is further away is something else."""


@part
def _add(matrix, to, source, factor):
    """Let the error `to` have `factor` times the error `source` besides."""
    for k in range(len(matrix)):
        matrix[to, k] += factor * matrix[source, k]
    for k in range(len(matrix)):
        matrix[k, to] += factor * matrix[k, source]


@part
def _rotate(matrix, state, first, cosine, sine):
    """Express the errors and numbers `first` and `first` + 1 in axes that have turned."""
    a, b = state[first], state[first + 1]
    state[first], state[first + 1] = cosine * a + sine * b, cosine * b - sine * a
    for k in range(len(matrix)):
        a, b = matrix[first, k], matrix[first + 1, k]
        matrix[first, k], matrix[first + 1, k] = cosine * a + sine * b, cosine * b - sine * a
    for k in range(len(matrix)):
        a, b = matrix[k, first], matrix[k, first + 1]
        matrix[k, first], matrix[k, first + 1] = cosine * a + sine * b, cosine * b - sine * a


@part
def _forget(matrix, state, which, share, variance):
    """Let a number decay by a share, and grow uncertain by a variance."""
    for k in range(len(matrix)):
        matrix[which, k] *= 1.0 - share
    for k in range(len(matrix)):
        matrix[k, which] *= 1.0 - share
    matrix[which, which] += variance
    state[which] *= 1.0 - share


def _accelerate(covariance, state, turn, variance, share, scrubbing, noise):
    """Turn the axes by an angle [rad]; velocity, scrubbing and noise change with variances [m^2/s^2, rad^2/s^2]."""
    cosine, sine = math.cos(turn), math.sin(turn)
    _rotate(covariance, state, 4, cosine, sine)
    _rotate(covariance, state, len(state) - 2, cosine, sine)
    for axis in range(4, 7):
        covariance[axis, axis] += variance
    _forget(covariance, state, len(state) - 5, share, scrubbing)
    _forget(covariance, state, len(state) - 6, 1.0, noise)


def _lean(covariance, state, arm, axes, heading, turn, change, time, variance, slope_share, slope_variance):
    """Let the tilt's error t change by what the IMU tells besides the gyroscope [rad], and slopes of the ground decay.

    Its axes turn by an angle [rad]. Where t changes by more than that, by biases or noise, the base has gone further by
    that change x r than it is taken to have.
    """
    size, tilt, bias = len(state), len(state) - 4, len(state) - 8
    _rotate(covariance, state, tilt, math.cos(turn), math.sin(turn))
    cosine, sine, x, y, z = math.cos(heading), math.sin(heading), arm[0], arm[1], arm[2]
    ways = ((sine * z, cosine * z), (-cosine * z, sine * z), (y, -x))
    for axis in range(2):
        state[tilt + axis] += change[axis]
    for axis in range(5):
        to = axis if axis < 3 else tilt + axis - 3
        about_x, about_y = ways[axis] if axis < 3 else (1.0 * (axis == 3), 1.0 * (axis == 4))
        a = time * (about_x * axes[0, 0] + about_y * axes[1, 0])
        b = time * (about_x * axes[0, 1] + about_y * axes[1, 1])
        c = time * (about_x * axes[0, 2] + about_y * axes[1, 2])
        for k in range(size):
            covariance[to, k] += a * covariance[bias, k] + b * covariance[bias + 1, k] + c * covariance[7, k]
        for k in range(size):
            covariance[k, to] += a * covariance[k, bias] + b * covariance[k, bias + 1] + c * covariance[k, 7]
    for i in range(5):
        first = i if i < 3 else tilt + i - 3
        p, q = ways[i] if i < 3 else (1.0 * (i == 3), 1.0 * (i == 4))
        for j in range(5):
            second = j if j < 3 else tilt + j - 3
            r, s = ways[j] if j < 3 else (1.0 * (j == 3), 1.0 * (j == 4))
            covariance[first, second] += variance * (p * r + q * s)
    for which in range(size - 2, size):
        _forget(covariance, state, which, slope_share, slope_variance)


@part
def _apply_error(covariance, state, error, spread, mapped, first, count):
    """Correct the state by an error of the variance `spread`; `mapped[0]` is its covariance with the state."""
    size = len(state)
    for i in range(size):
        mapped[1, i] = 0.0 if i < first or 8 <= i < 8 + count else mapped[0, i] / spread
        state[i] += mapped[1, i] * error
    for i in range(size):
        for k in range(i + 1):
            entry = covariance[i, k] + spread * mapped[1, i] * mapped[1, k]
            entry -= mapped[1, i] * mapped[0, k] + mapped[0, i] * mapped[1, k]
            covariance[i, k] = covariance[k, i] = entry


@part
def _take(covariance, state, row, error, variance, mapped, first, count):
    """Take a number by its row, error and variance; numbers before `first`, and shares of radii, are not corrected."""
    size, spread = len(state), variance
    for i in range(size):
        total = 0.0
        for k in range(size):
            total += covariance[i, k] * row[k]
        mapped[0, i] = total
        spread += row[i] * total
    _apply_error(covariance, state, error, spread, mapped, first, count)


@part
def _take_sum(covariance, state, one, other, told, variance, mapped, first, count):
    """Take the sum of two numbers, or one of them where both are the same; see `_take`. Returns its error."""
    size, share = len(state), 1.0 * (one != other)
    error, spread = told - state[one] - share * state[other], variance
    for i in range(size):
        mapped[0, i] = covariance[i, one] + share * covariance[i, other]
    spread += mapped[0, one] + share * mapped[0, other]
    if error * error > LIKELY * LIKELY * spread:
        return False
    _apply_error(covariance, state, error, spread, mapped, first, count)
    return True


@part
def _error(state, row, told):
    """Return how far a number is from what is expected."""
    for k in range(len(state)):
        told -= row[k] * state[k]
    return told


@part
def _density(covariance, rows, told, state, variances, spread):
    """Return the density of what a wheel tells, three numbers with rows and variances [s^3/m^3]."""
    size = len(state)
    for i in range(3):
        spread[3, i] = _error(state, rows[i], told[i])
        for j in range(i + 1):
            spread[i, j] = 0.0
        for k in range(size):
            total = 0.0
            for m in range(size):
                total += rows[i, m] * covariance[m, k]
            for j in range(i + 1):
                spread[i, j] += total * rows[j, k]
        spread[i, i] += variances[i]
    # of S = L L^T: |L| and L^-1 e
    distance, root = 0.0, 1.0
    for i in range(3):
        for j in range(i + 1):
            entry = spread[i, j]
            for k in range(j):
                entry -= spread[i, k] * spread[j, k]
            spread[i, j] = math.sqrt(entry) if i == j else entry / spread[j, j]
        entry = spread[3, i]
        for k in range(i):
            entry -= spread[i, k] * spread[3, k]
        spread[3, i] = entry / spread[i, i]
        distance += spread[3, i] * spread[3, i]
        root *= spread[i, i]
    return math.exp(-0.5 * min(distance, 700.0)) / (math.sqrt(2.0 * math.pi) ** 3 * root)


def _correct(covariance, state, rows, told, arms, rate, share, axis, variances, outliers, believed, rolling, scratch):
    """Take what wheels tell [m/s], of those that are believed and that roll more likely than not."""
    count, scrub, noise = len(told), len(state) - 5, len(state) - 6
    bent = len(state) - 8
    bias = share * (axis[0] * state[bent] + axis[1] * state[bent + 1] + axis[2] * state[7] + state[noise])
    for wheel in range(count):
        x, y = arms[wheel, 0], arms[wheel, 1]
        # what is expected and not what is told: its noise would be taken for an error of the radius
        rows[wheel, 0, 8 + wheel] = -(state[4] - (rate - bias) * y)
        rows[wheel, 1, 8 + wheel] = -(state[5] + (rate - bias) * x)
        rows[wheel, 2, 8 + wheel] = -state[6]
        for which in range(3):
            at = 7 if which == 2 else bent + which
            rows[wheel, 0, at], rows[wheel, 1, at] = share * axis[which] * y, -share * axis[which] * x
        rows[wheel, 0, noise], rows[wheel, 1, noise] = share * y, -share * x
        # where the gyroscope is silent the turn is that of the wheels, with all that they scrub
        heard = 1.0 if share > 0.0 else 0.0
        rows[wheel, 0, scrub], rows[wheel, 1, scrub] = -heard * y, heard * x
        told[wheel, 0] += rate * y
        told[wheel, 1] -= rate * x
    likely = 0
    for wheel in range(count):
        density = _density(covariance, rows[wheel], told[wheel], state, variances[wheel], scratch)
        rolls = (1.0 - outliers[0]) * density
        rolling[wheel] = rolls / (rolls + outliers[0] * outliers[1])
        likely += believed[wheel] and rolling[wheel] > 0.5
    for wheel in range(count):
        # where all contradict the prediction is wrong, and not the wheels
        if likely > 1 and rolling[wheel] <= 0.5:
            believed[wheel] = False
        if believed[wheel]:
            for i in range(3):
                row, variance = rows[wheel, i], variances[wheel, i]
                # what wheels contradict each other by is more than radii: no place follows from it
                _take(covariance, state, row, _error(state, row, told[wheel, i]), variance, scratch, 3, count)
        elif rolling[wheel] > 0.5:
            rolling[wheel] = 0.5


def _advance(covariance, heading, period, time, axis, velocity, noises):
    """Let position and heading follow for a time `period` [s]; the gyroscope has told something for `time` [s]."""
    x, y = velocity[0], velocity[1]
    cosine, sine = math.cos(heading), math.sin(heading)
    _add(covariance, 0, 3, -(sine * x + cosine * y) * period)
    _add(covariance, 1, 3, (cosine * x - sine * y) * period)
    _add(covariance, 0, 4, cosine * period)
    _add(covariance, 0, 5, -sine * period)
    _add(covariance, 1, 4, sine * period)
    _add(covariance, 1, 5, cosine * period)
    _add(covariance, 2, 6, period)
    size = len(covariance)
    # a tilt that errs leads uphill
    _add(covariance, 2, size - 4, -y * period)
    _add(covariance, 2, size - 3, x * period)
    for which in range(3):
        _add(covariance, 3, 7 if which == 2 else size - 8 + which, -time * axis[which])
    _add(covariance, 3, size - 6, -time)
    if time == 0.0:
        _add(covariance, 3, size - 5, -period)
    covariance[0, 0] += noises[0]
    covariance[1, 1] += noises[0]
    covariance[3, 3] += noises[1]
    for which in (7, size - 8, size - 7):
        covariance[which, which] += noises[2]


def _level(covariance, state, error_x, error_y, variance, scratch, count):
    """Take how the plane through the contacts is turned about x and y [rad]: tilt's errors and the ground's slope.

    Returns whether it can be that of level ground; where it cannot nothing is taken of that axis.
    """
    first, taken = len(state) - 4, True
    for axis in range(2):
        told = error_x if axis == 0 else error_y
        taken &= _take_sum(covariance, state, first + axis, first + 2 + axis, told, variance, scratch, 0, count)
    return taken


def _right(covariance, state, variance, scratch, count):
    """Take the IMU's tilt for right with a variance [rad^2]."""
    for which in range(len(state) - 4, len(state) - 2):
        _take_sum(covariance, state, which, which, 0.0, variance, scratch, 3, count)


def _rest(covariance, state, angular, variance, scratch, count):
    """Take what the gyroscope tells of a robot that rests [rad/s] for its bias about x and y."""
    for axis in range(2):
        which = len(state) - 8 + axis
        _take_sum(covariance, state, which, which, angular[axis], variance, scratch, 3, count)


def _settle(covariance, which, variance, scratch):
    """Take a number for known with a variance."""
    spread = covariance[which, which] + variance
    for k in range(len(covariance)):
        scratch[0, k] = covariance[k, which]
    for i in range(len(covariance)):
        for k in range(len(covariance)):
            covariance[i, k] -= scratch[0, i] * scratch[0, k] / spread


_M, _V, _F = "float64[:, ::1]", "float64[::1]", "float64"
_T, _B = "float64[:, :, ::1]", "boolean[::1]"

accelerate = cached(f"void({_M}, {_V}, {_F}, {_F}, {_F}, {_F}, {_F})", _accelerate)
lean = cached(f"void({_M}, {_V}, {_V}, {_M}, {_F}, {_F}, {_V}, {_F}, {_F}, {_F}, {_F})", _lean)
correct = cached(f"void({_M}, {_V}, {_T}, {_M}, {_M}, {_F}, {_F}, {_V}, {_M}, {_V}, {_B}, {_V}, {_M})", _correct)
advance = cached(f"void({_M}, {_F}, {_F}, {_F}, {_V}, {_V}, {_V})", _advance)
level = cached(f"boolean({_M}, {_V}, {_F}, {_F}, {_F}, {_M}, int64)", _level)
right = cached(f"void({_M}, {_V}, {_F}, {_M}, int64)", _right)
rest = cached(f"void({_M}, {_V}, {_V}, {_F}, {_M}, int64)", _rest)
settle = cached(f"void({_M}, int64, {_F}, {_M})", _settle)
