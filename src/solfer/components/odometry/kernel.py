"""Compiled steps of the Kalman filter of odometry, number by number. Arrays are described in `ContactKalman`."""

import math

from solfer.numerics.compilation import cached, part


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


@part
def _lean_about(covariance, state, axis, x, y, z, share, variance):
    """Let the tilt's error about an axis decay and change; the position goes by x, y, z [m] for each rad of it."""
    tilt = len(state) - 4 + axis
    _add(covariance, 0, tilt, -share * x)
    _add(covariance, 1, tilt, -share * y)
    _add(covariance, 2, tilt, -share * z)
    _forget(covariance, state, tilt, share, 0.0)
    # the change of the error moves the base in the same moment
    covariance[0, 0] += variance * x * x
    covariance[0, 1] += variance * x * y
    covariance[1, 0] += variance * x * y
    covariance[0, 2] += variance * x * z
    covariance[2, 0] += variance * x * z
    covariance[1, 1] += variance * y * y
    covariance[1, 2] += variance * y * z
    covariance[2, 1] += variance * y * z
    covariance[2, 2] += variance * z * z
    covariance[0, tilt] += variance * x
    covariance[tilt, 0] += variance * x
    covariance[1, tilt] += variance * y
    covariance[tilt, 1] += variance * y
    covariance[2, tilt] += variance * z
    covariance[tilt, 2] += variance * z
    covariance[tilt, tilt] += variance


def _lean(covariance, state, arm, heading, share, variance, slope_share, slope_variance):
    """Let errors of the tilt, and slopes of the ground, decay by shares and change with variances [rad^2]."""
    cosine, sine, x, y, z = math.cos(heading), math.sin(heading), arm[0], arm[1], arm[2]
    # where the tilt's error grows by t the base has gone further by t x r than it is taken to have
    _lean_about(covariance, state, 0, sine * z, -cosine * z, y, share, variance)
    _lean_about(covariance, state, 1, cosine * z, sine * z, -x, share, variance)
    for which in range(len(state) - 2, len(state)):
        _forget(covariance, state, which, slope_share, slope_variance)


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
    for i in range(size):
        mapped[1, i] = 0.0 if i < first or 8 <= i < 8 + count else mapped[0, i] / spread
        state[i] += mapped[1, i] * error
    for i in range(size):
        for k in range(i + 1):
            entry = covariance[i, k] + spread * mapped[1, i] * mapped[1, k]
            entry -= mapped[1, i] * mapped[0, k] + mapped[0, i] * mapped[1, k]
            covariance[i, k] = covariance[k, i] = entry


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


def _correct(covariance, state, rows, told, arms, rate, share, variances, outliers, believed, rolling, scratch):
    """Take what wheels tell [m/s], of those that are believed and that roll more likely than not."""
    count, scrub, noise = len(told), len(state) - 5, len(state) - 6
    bias = share * (state[7] + state[noise])
    for wheel in range(count):
        x, y = arms[wheel, 0], arms[wheel, 1]
        # what is expected and not what is told: its noise would be taken for an error of the radius
        rows[wheel, 0, 8 + wheel] = -(state[4] - (rate - bias) * y)
        rows[wheel, 1, 8 + wheel] = -(state[5] + (rate - bias) * x)
        rows[wheel, 2, 8 + wheel] = -state[6]
        rows[wheel, 0, 7], rows[wheel, 1, 7] = share * y, -share * x
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


def _advance(covariance, heading, period, time, velocity, noises):
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
    _add(covariance, 3, 7, -time)
    _add(covariance, 3, len(covariance) - 6, -time)
    if time == 0.0:
        _add(covariance, 3, len(covariance) - 5, -period)
    covariance[0, 0] += noises[0]
    covariance[1, 1] += noises[0]
    covariance[3, 3] += noises[1]
    covariance[7, 7] += noises[2]


def _level(covariance, state, error_x, error_y, variance, row, scratch, count):
    """Take how the plane through the contacts is turned about x and y [rad]: tilt's errors and the ground's slope."""
    first = len(state) - 4
    for axis in range(2):
        row[:] = 0.0
        row[first + axis] = row[first + 2 + axis] = 1.0
        told = error_x if axis == 0 else error_y
        _take(covariance, state, row, _error(state, row, told), variance, scratch, 0, count)


def _settle(covariance, which, variance, scratch):
    """Take a number for known with a variance."""
    spread = covariance[which, which] + variance
    for k in range(len(covariance)):
        scratch[0, k] = covariance[k, which]
    for i in range(len(covariance)):
        for k in range(len(covariance)):
            covariance[i, k] -= scratch[0, i] * scratch[0, k] / spread


_M, _V, _F = "float64[:, ::1]", "float64[::1]", "float64"
_T = "float64[:, :, ::1]"

accelerate = cached(f"void({_M}, {_V}, {_F}, {_F}, {_F}, {_F}, {_F})", _accelerate)
lean = cached(f"void({_M}, {_V}, {_V}, {_F}, {_F}, {_F}, {_F}, {_F})", _lean)
correct = cached(f"void({_M}, {_V}, {_T}, {_M}, {_M}, {_F}, {_F}, {_M}, {_V}, boolean[::1], {_V}, {_M})", _correct)
advance = cached(f"void({_M}, {_F}, {_F}, {_F}, {_V}, {_V})", _advance)
level = cached(f"void({_M}, {_V}, {_F}, {_F}, {_F}, {_V}, {_M}, int64)", _level)
settle = cached(f"void({_M}, int64, {_F}, {_M})", _settle)
