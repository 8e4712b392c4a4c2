"""Compiled models of `WheelInertialFilter`, which describes the state, its frames, and the equations."""

import math

from solfer.numerics.blocks import BlockLayout
from solfer.numerics.compilation import cached, exact_part, part
from solfer.numerics.dense import DENSE, cholesky, forward

POSITION = 0
"""Index of the position in the state, the first of its numbers."""

HEADING = 3
"""Index of the heading."""

VELOCITY = 4
"""Index of the velocity, as of the position."""

GYRO_BIAS = 7
"""Index of the bias of the gyroscope."""

GYRO_NOISE = 10
"""Index of its noise in this interval."""

SCRUB = 11
"""Index of the yaw rate by scrubbing."""

TILT = 12
"""Index of the error of the IMU's tilt."""

SLOPE = 14
"""Index of the slope of the floor."""

RADIUS = 16
"""Index of the errors of the radii, the last part."""

OUTLIER_GATE = 4.0
"""Standard deviations beyond which a scalar measurement is an outlier."""

SLIP_PRIOR = 0.02
"""Prior probability that a wheel slips."""

SLIP_DENSITY = 1.0 / 4.0**3
"""Density of the velocity of a wheel that slips [s^3/m^3]."""

FOOT_HEIGHT = 0.02
"""Standard deviation of the height of a foot on a floor [m]: soles give way, and floors are uneven."""


FILTER = BlockLayout(
    "Filter",
    size=int,
    count=int,  # number of wheels
    covariance=(float, "size", "size"),
    state=(float, "size"),
    axes=(float, 3, 3),
    # of each wheel: Jacobian of its velocity, innovation, and the probability that it rolls
    rows=(float, "count", 3, "size"),
    innovations=(float, "count", 3),
    rolling=(float, "count"),
    # F, Q, and work space
    transition=(float, "size", "size"),
    noise=(float, "size", "size"),
    half=(float, "size", "size"),
    # change of the velocity by the accelerometer [m/s], its variance [m^2/s^2], and gravity times its time [m/s]
    pushed=(float, 5),
)
"""What the kernels read and write."""

_filter_at = FILTER.at


@part
def set_identity(transition):
    """Write the identity."""
    size = len(transition)
    for i in range(size):
        for k in range(size):
            transition[i, k] = 1.0 if i == k else 0.0


@part
def set_rotation(transition, first, angle):
    """Write the block of two numbers whose axes turn about the vertical by an angle [rad]."""
    cosine = math.cos(angle)
    sine = math.sin(angle)
    transition[first, first] = cosine
    transition[first, first + 1] = sine
    transition[first + 1, first] = -sine
    transition[first + 1, first + 1] = cosine


@part
def tilt_moves(arm, heading, axis, out):
    """Write how far the ground point goes in the world by a small rotation about an axis (0, 1) of H: R (e x arm)."""
    cosine = math.cos(heading)
    sine = math.sin(heading)
    x, y = (0.0, -arm[2]) if axis == 0 else (arm[2], 0.0)
    out[0] = cosine * x - sine * y
    out[1] = sine * x + cosine * y
    out[2] = arm[1] if axis == 0 else -arm[0]


@part
def set_process(kalman, arm, heading, angles, imu_time, keeps):
    """Write the Jacobian of the process up to the wheels' measurement.

    A bias that errs turns the tilt wrongly for the time of the IMU's samples, and moves the base by that rotation.
    """
    transition = kalman.transition
    moves = kalman.half[0]
    yaw, tilt_yaw = angles
    scrub_keep, slope_keep = keeps
    set_identity(transition)
    set_rotation(transition, VELOCITY, yaw)
    set_rotation(transition, SLOPE, yaw)
    for row in range(2):
        for column in range(2):
            transition[SLOPE + row, SLOPE + column] *= slope_keep
    transition[GYRO_NOISE, GYRO_NOISE] = 0.0
    transition[SCRUB, SCRUB] = scrub_keep
    # where the tilt errs, gravity accelerates
    transition[VELOCITY, TILT + 1] = -kalman.pushed[4]
    transition[VELOCITY + 1, TILT] = kalman.pushed[4]
    if imu_time == 0.0:
        return
    set_rotation(transition, TILT, tilt_yaw)
    for axis in range(2):
        tilt_moves(arm, heading, axis, moves)
        for column in range(3):
            wrong = imu_time * kalman.axes[axis, column]
            transition[TILT + axis, GYRO_BIAS + column] = wrong
            for row in range(3):
                transition[POSITION + row, GYRO_BIAS + column] += moves[row] * wrong


@part
def set_pose_process(kalman, heading, period, imu_time):
    """Write the Jacobian of p += R(heading) v T and heading += (u - b - n) s; a tilt that errs leads uphill."""
    transition = kalman.transition
    axis = kalman.axes[2]
    cosine = math.cos(heading)
    sine = math.sin(heading)
    x = kalman.state[VELOCITY]
    y = kalman.state[VELOCITY + 1]
    set_identity(transition)
    transition[POSITION, HEADING] = -(sine * x + cosine * y) * period
    transition[POSITION + 1, HEADING] = (cosine * x - sine * y) * period
    transition[POSITION, VELOCITY] = cosine * period
    transition[POSITION, VELOCITY + 1] = -sine * period
    transition[POSITION + 1, VELOCITY] = sine * period
    transition[POSITION + 1, VELOCITY + 1] = cosine * period
    transition[POSITION + 2, VELOCITY + 2] = period
    transition[POSITION + 2, TILT] = -y * period
    transition[POSITION + 2, TILT + 1] = x * period
    for column in range(3):
        transition[HEADING, GYRO_BIAS + column] = -imu_time * axis[column]
    transition[HEADING, GYRO_NOISE] = -imu_time
    if imu_time == 0.0:  # the yaw is that of the wheels
        transition[HEADING, SCRUB] = -period


@part
def yaw_rate(kalman, rate, covered):
    """Return the yaw rate without bias and noise of the gyroscope [rad/s]."""
    axis = kalman.axes[2]
    state = kalman.state
    bias = axis[0] * state[GYRO_BIAS] + axis[1] * state[GYRO_BIAS + 1] + axis[2] * state[GYRO_BIAS + 2]
    return rate - covered * (bias + state[GYRO_NOISE])


@part
def wheel_velocity(kalman, wheel, arm, rate, covered, out):
    """Write the velocity that a wheel measures: (1 - e) (v + (yaw rate + scrub) z x r)."""
    state = kalman.state
    rate_about_z = yaw_rate(kalman, rate, covered)
    if covered > 0.0:
        rate_about_z += state[SCRUB]
    grown = 1.0 - state[RADIUS + wheel]
    out[0] = grown * (state[VELOCITY] - rate_about_z * arm[1])
    out[1] = grown * (state[VELOCITY + 1] + rate_about_z * arm[0])
    out[2] = grown * state[VELOCITY + 2]


@part
def set_wheel_rows(kalman, wheel, arm, covered, expected):
    """Write the Jacobian of `wheel_velocity`, which is `expected`; radii are those that the configuration has."""
    rows = kalman.rows[wheel]
    axis = kalman.axes[2]
    for i in range(3):
        rows[i, VELOCITY + i] = 1.0
        rows[i, RADIUS + wheel] = -expected[i]
    for column in range(3):
        rows[0, GYRO_BIAS + column] = covered * axis[column] * arm[1]
        rows[1, GYRO_BIAS + column] = -covered * axis[column] * arm[0]
    rows[0, GYRO_NOISE] = covered * arm[1]
    rows[1, GYRO_NOISE] = -covered * arm[0]
    rows[0, SCRUB] = -arm[1] if covered > 0.0 else 0.0
    rows[1, SCRUB] = arm[0] if covered > 0.0 else 0.0


@part
def propagate(kalman):
    """Write F P F^T + Q over P, symmetric to the bit; zeros of F are left out."""
    covariance = kalman.covariance
    transition = kalman.transition
    half = kalman.half
    size = kalman.size
    for i in range(size):
        half[i] = 0.0
        for j in range(size):
            factor = transition[i, j]
            if factor != 0.0:
                for k in range(size):
                    half[i, k] += factor * covariance[j, k]
    for k in range(size):
        for i in range(k + 1):
            covariance[k, i] = kalman.noise[k, i]
        for j in range(size):
            factor = transition[k, j]
            if factor != 0.0:
                for i in range(k + 1):
                    covariance[k, i] += factor * half[i, j]
        for i in range(k):
            covariance[i, k] = covariance[k, i]


@exact_part
def apply_gain(kalman, innovation, variance, first):
    """Correct the state by an innovation of a variance; its covariance with the state is in the work space.

    What precedes `first` and the radii are considered and not corrected (Schmidt). Whole rows are several numbers at
    once; as sums and products are as they are written, the covariance stays symmetric to the bit.
    """
    covariance = kalman.covariance
    state = kalman.state
    mapped = kalman.half[0]
    gain = kalman.half[1]
    size = kalman.size
    for i in range(size):
        gain[i] = mapped[i] / variance if first <= i < RADIUS else 0.0
        state[i] += gain[i] * innovation
    for i in range(size):
        one = gain[i]
        other = mapped[i]
        for k in range(size):
            covariance[i, k] += variance * (one * gain[k]) - (one * mapped[k] + other * gain[k])


@part
def update(kalman, row, innovation, variance, first):
    """Correct the state by a scalar measurement with a row of its Jacobian."""
    covariance = kalman.covariance
    mapped = kalman.half[0]
    size = kalman.size
    for i in range(size):
        mapped[i] = 0.0
    for k in range(size):
        if row[k] != 0.0:
            for i in range(size):
                mapped[i] += row[k] * covariance[k, i]
    for k in range(size):
        variance += row[k] * mapped[k]
    apply_gain(kalman, innovation, variance, first)


@part
def update_sum(kalman, one, other, measured, variance, first):
    """Correct the state by a measurement of the sum of two numbers, or of one (-1: no other); return if it passes."""
    covariance = kalman.covariance
    state = kalman.state
    mapped = kalman.half[0]
    size = kalman.size
    innovation = measured - state[one]
    for i in range(size):
        mapped[i] = covariance[one, i]
    if other >= 0:
        innovation -= state[other]
        for i in range(size):
            mapped[i] += covariance[other, i]
    variance += mapped[one] + (mapped[other] if other >= 0 else 0.0)
    if innovation * innovation > OUTLIER_GATE * OUTLIER_GATE * variance:
        return False
    apply_gain(kalman, innovation, variance, first)
    return True


@part
def likelihood(kalman, wheel, variance):
    """Return the density of a wheel's innovation, three numbers with rows and a variance each [s^3/m^3]."""
    covariance = kalman.covariance
    rows = kalman.rows[wheel]
    mapped = kalman.half[0]
    spread = kalman.half[2:6]
    size = kalman.size
    for i in range(3):
        for k in range(size):
            mapped[k] = 0.0
        for m in range(size):
            if rows[i, m] != 0.0:
                for k in range(size):
                    mapped[k] += rows[i, m] * covariance[m, k]
        for j in range(i + 1):
            total = variance if i == j else 0.0
            for k in range(size):
                total += mapped[k] * rows[j, k]
            spread[i, j] = total
    if not cholesky(spread[:3]):
        return 0.0
    whitened = spread[3, :3]
    whitened[:] = kalman.innovations[wheel]
    forward(spread, whitened)
    distance = 0.0
    root = 1.0
    for i in range(3):
        distance += whitened[i] * whitened[i]
        root *= spread[i, i]
    return math.exp(-0.5 * min(distance, 700.0)) / (math.sqrt(2.0 * math.pi) ** 3 * root)


def _predict(start, arm, heading, angles, imu_time, keeps, variances):
    """Propagate up to the wheels' measurement.

    `angles` are those by which the axes of velocity and tilt turn [rad]; `keeps` the ratios that scrubbing and slopes
    keep; `variances` those of velocity, scrubbing, gyroscope, tilt and slopes. `follow_tilt` changes the tilt itself.
    """
    kalman = _filter_at(start)
    state = kalman.state
    transition = kalman.transition
    noise = kalman.noise
    moves = kalman.half[0]
    set_process(kalman, arm, heading, angles, imu_time, keeps)
    noise[:] = 0.0
    pushed = kalman.pushed
    for axis in range(3):
        noise[VELOCITY + axis, VELOCITY + axis] = pushed[3] if pushed[3] > 0.0 else variances[0]
    noise[SCRUB, SCRUB] = variances[1]
    noise[GYRO_NOISE, GYRO_NOISE] = variances[2]
    for axis in range(2):
        noise[SLOPE + axis, SLOPE + axis] = variances[4]
        if imu_time > 0.0:
            tilt_moves(arm, heading, axis, moves)
            noise[TILT + axis, TILT + axis] += variances[3]
            for row in range(3):
                noise[POSITION + row, TILT + axis] += variances[3] * moves[row]
                noise[TILT + axis, POSITION + row] += variances[3] * moves[row]
                for column in range(3):
                    noise[POSITION + row, POSITION + column] += variances[3] * moves[row] * moves[column]
    for first in (VELOCITY, SLOPE):
        a = state[first]
        b = state[first + 1]
        state[first] = transition[first, first] * a + transition[first, first + 1] * b
        state[first + 1] = transition[first + 1, first] * a + transition[first + 1, first + 1] * b
    for axis in range(3):
        state[VELOCITY + axis] += pushed[axis]
    state[VELOCITY] -= pushed[4] * state[TILT + 1]
    state[VELOCITY + 1] += pushed[4] * state[TILT]
    state[SCRUB] *= keeps[0]
    state[GYRO_NOISE] = 0.0
    propagate(kalman)


@part
def update_height(kalman, arm, height):
    """Correct the state by the height of a foot on a floor, above which the base is [m]; x and y are not corrected."""
    row = kalman.half[7]
    row[:] = 0.0
    row[POSITION + 2] = 1.0
    innovation = -arm[2] - height - kalman.state[POSITION + 2]
    update(kalman, row, innovation, FOOT_HEIGHT * FOOT_HEIGHT, POSITION + 2)


def _correct(start, speeds, arms, rate, covered, variances, inliers, height, steps):
    """Correct the state by the velocities that wheels measure [m/s], of inliers that more likely roll than slip.

    With feet (`steps`) all may slip, and those that stand measure the `height` above a floor, unless it is NaN [m].
    """
    kalman = _filter_at(start)
    innovations = kalman.innovations
    rolling = kalman.rolling
    expected = kalman.half[6]
    likely = 0
    for wheel in range(kalman.count):
        wheel_velocity(kalman, wheel, arms[wheel], rate, covered, expected)
        set_wheel_rows(kalman, wheel, arms[wheel], covered, expected)
        for i in range(3):  # speeds are means over the interval, in whose middle half of the push is still to come
            innovations[wheel, i] = speeds[wheel, i] - expected[i] + 0.5 * kalman.pushed[i]
        rolls = (1.0 - SLIP_PRIOR) * likelihood(kalman, wheel, variances[wheel])
        rolling[wheel] = rolls / (rolls + SLIP_PRIOR * SLIP_DENSITY)
        likely += inliers[wheel] and rolling[wheel] > 0.5
    for wheel in range(kalman.count):
        # where all wheels contradict, the prediction is wrong; feet slip, or are in the air
        if (likely > 1 or steps) and rolling[wheel] <= 0.5:
            inliers[wheel] = False
        if inliers[wheel]:
            for i in range(3):
                wheel_velocity(kalman, wheel, arms[wheel], rate, covered, expected)
                innovation = speeds[wheel, i] - expected[i] + 0.5 * kalman.pushed[i]
                # what wheels contradict each other by is more than radii: no position follows from it
                update(kalman, kalman.rows[wheel, i], innovation, variances[wheel], HEADING)
            if not math.isnan(height):
                update_height(kalman, arms[wheel], height)
        elif rolling[wheel] > 0.5:
            rolling[wheel] = 0.5


def _integrate(start, heading, period, imu_time, variances):
    """Propagate the pose; variances are those of slip along x and y, of the yaw, and of the biases."""
    kalman = _filter_at(start)
    noise = kalman.noise
    set_pose_process(kalman, heading, period, imu_time)
    noise[:] = 0.0
    noise[POSITION, POSITION] = variances[0]
    noise[POSITION + 1, POSITION + 1] = variances[0]
    noise[HEADING, HEADING] = variances[1]
    for column in range(GYRO_BIAS, GYRO_BIAS + 3):
        noise[column, column] = variances[2]
    propagate(kalman)


def _level(start, about_x, about_y, variance):
    """Measure tilt plus slope about x and y [rad] by the plane through the contacts; return whether both pass."""
    kalman = _filter_at(start)
    passes = update_sum(kalman, TILT, SLOPE, about_x, variance, 0)
    return update_sum(kalman, TILT + 1, SLOPE + 1, about_y, variance, 0) and passes


def _measure(start, first, measured, variance):
    """Measure numbers of the state from the `first` on, one after the other; position is not corrected."""
    kalman = _filter_at(start)
    for index in range(len(measured)):
        update_sum(kalman, first + index, -1, measured[index], variance, HEADING)


def _condition(start, which, variance):
    """Reduce the covariance by a measurement of one number that is as expected."""
    kalman = _filter_at(start)
    covariance = kalman.covariance
    column = kalman.half[0]
    spread = covariance[which, which] + variance
    for k in range(kalman.size):
        column[k] = covariance[k, which]
    for i in range(kalman.size):
        for k in range(kalman.size):
            covariance[i, k] -= column[i] * column[k] / spread


def _write_covariances(start, density, heading, arm, period, velocity, pose, twist):
    """Write the covariances of a pose and of a twist; see `WheelInertialFilter.write_covariances`.

    The angular velocity errs by the gyroscope's white noise with a `density` and by its biases, and the base's origin
    moves by that and by the arm. The velocity errs by its covariance, and leads uphill by the error of the tilt.
    """
    kalman = _filter_at(start)
    white = density / period
    errors = kalman.covariance
    ahead = kalman.state[VELOCITY]
    left = kalman.state[VELOCITY + 1]
    resting = 1e-5  # [m/s] by encoders
    cosine = math.cos(heading)
    sine = math.sin(heading)
    pose[:] = 0.0
    twist[:] = 0.0
    for i in range(HEADING + 1):
        a = i if i < 3 else 5
        for j in range(HEADING + 1):
            pose[a, j if j < 3 else 5] = errors[i, j]
        # the tilt's error is subtracted
        x = -errors[i, TILT]
        y = -errors[i, TILT + 1]
        pose[a, 3], pose[a, 4] = cosine * x - sine * y, sine * x + cosine * y
        pose[3, a], pose[4, a] = pose[a, 3], pose[a, 4]
    xx = errors[TILT, TILT]
    xy = errors[TILT, TILT + 1]
    yy = errors[TILT + 1, TILT + 1]
    pose[3, 3] = cosine * cosine * xx - 2.0 * cosine * sine * xy + sine * sine * yy
    pose[4, 4] = sine * sine * xx + 2.0 * cosine * sine * xy + cosine * cosine * yy
    pose[3, 4] = cosine * sine * (xx - yy) + (cosine * cosine - sine * sine) * xy
    pose[4, 3] = pose[3, 4]
    for axis in range(3):
        twist[3 + axis, 3 + axis] = errors[GYRO_BIAS + axis, GYRO_BIAS + axis] + white
    twist[3, 4] = errors[GYRO_BIAS, GYRO_BIAS + 1]
    twist[4, 3] = twist[3, 4]
    xx = twist[3, 3]
    xy = twist[3, 4]
    yy = twist[4, 4]
    for i in range(3):
        a, b = (0.0, -arm[2]) if i == 0 else (arm[2], 0.0) if i == 1 else (-arm[1], arm[0])
        for j in range(3):
            c, d = (0.0, -arm[2]) if j == 0 else (arm[2], 0.0) if j == 1 else (-arm[1], arm[0])
            twist[i, j] = velocity[i, j] + a * (xx * c + xy * d) + b * (xy * c + yy * d)

    twist[2, 2] += (
        left * left * errors[TILT, TILT]
        - 2.0 * left * ahead * errors[TILT, TILT + 1]
        + ahead * ahead * errors[TILT + 1, TILT + 1]
    )
    for i in range(3):
        twist[i, i] += resting * resting


_F = "float64"
_V = "float64[::1]"
_M = "float64[:, ::1]"
_PAIR = "UniTuple(float64, 2)"

predict = cached(f"void(int64, {_V}, {_F}, {_PAIR}, {_F}, {_PAIR}, UniTuple(float64, 5))", _predict)
correct = cached(f"void(int64, {_M}, {_M}, {_F}, {_F}, {_V}, boolean[::1], {_F}, boolean)", _correct, sources=[DENSE])
integrate = cached(f"void(int64, {_F}, {_F}, {_F}, UniTuple(float64, 3))", _integrate)
level = cached(f"boolean(int64, {_F}, {_F}, {_F})", _level)
measure = cached(f"void(int64, int64, {_V}, {_F})", _measure)
condition = cached(f"void(int64, int64, {_F})", _condition)
write_covariances = cached(f"void(int64, {_F}, {_F}, {_V}, {_F}, {_M}, {_M}, {_M})", _write_covariances)
