"""Compiled models of `WheelInertialFilter`, which describes the state, its frames, and the equations."""

import math

from solfer.numerics.compilation import cached, part
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
def set_process(transition, axes, arm, heading, yaw, tilt_yaw, imu_time, scrub_keep, slope_keep, moves):
    """Write the Jacobian of the process up to the wheels' measurement.

    A bias that errs turns the tilt wrongly for the time of the IMU's samples, and moves the base by that rotation.
    """
    set_identity(transition)
    set_rotation(transition, VELOCITY, yaw)
    set_rotation(transition, SLOPE, yaw)
    for row in range(2):
        for column in range(2):
            transition[SLOPE + row, SLOPE + column] *= slope_keep
    transition[GYRO_NOISE, GYRO_NOISE] = 0.0
    transition[SCRUB, SCRUB] = scrub_keep
    if imu_time == 0.0:
        return
    set_rotation(transition, TILT, tilt_yaw)
    for axis in range(2):
        tilt_moves(arm, heading, axis, moves)
        for column in range(3):
            wrong = imu_time * axes[axis, column]
            transition[TILT + axis, GYRO_BIAS + column] = wrong
            for row in range(3):
                transition[POSITION + row, GYRO_BIAS + column] += moves[row] * wrong


@part
def set_pose_process(transition, axis, heading, velocity, period, imu_time):
    """Write the Jacobian of p += R(heading) v T and heading += (u - b - n) s; a tilt that errs leads uphill."""
    cosine = math.cos(heading)
    sine = math.sin(heading)
    x = velocity[0]
    y = velocity[1]
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
def yaw_rate(state, axis, rate, covered):
    """Return the yaw rate without bias and noise of the gyroscope [rad/s]."""
    bias = axis[0] * state[GYRO_BIAS] + axis[1] * state[GYRO_BIAS + 1] + axis[2] * state[GYRO_BIAS + 2]
    return rate - covered * (bias + state[GYRO_NOISE])


@part
def wheel_velocity(state, wheel, arm, axis, rate, covered, out):
    """Write the velocity that a wheel measures: (1 - e) (v + (yaw rate + scrub) z x r)."""
    rate_about_z = yaw_rate(state, axis, rate, covered)
    if covered > 0.0:
        rate_about_z += state[SCRUB]
    grown = 1.0 - state[RADIUS + wheel]
    out[0] = grown * (state[VELOCITY] - rate_about_z * arm[1])
    out[1] = grown * (state[VELOCITY + 1] + rate_about_z * arm[0])
    out[2] = grown * state[VELOCITY + 2]


@part
def set_wheel_rows(rows, wheel, arm, axis, covered, expected):
    """Write the Jacobian of `wheel_velocity`, which is `expected`; radii are those that the configuration has."""
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
def propagate(covariance, transition, noise, half):
    """Write F P F^T + Q over P; zeros of F are left out."""
    size = len(covariance)
    for i in range(size):
        half[i] = 0.0
        for j in range(size):
            factor = transition[i, j]
            if factor != 0.0:
                for k in range(size):
                    half[i, k] += factor * covariance[j, k]
    for k in range(size):
        for i in range(size):
            covariance[k, i] = noise[k, i]
        for j in range(size):
            factor = transition[k, j]
            if factor != 0.0:
                for i in range(size):
                    covariance[k, i] += factor * half[i, j]


@part
def apply_gain(covariance, state, innovation, variance, mapped, gain, first):
    """Correct the state by an innovation of a variance; `mapped` is its covariance with the state.

    What precedes `first` and the radii are considered and not corrected (Schmidt).
    """
    size = len(state)
    for i in range(size):
        gain[i] = mapped[i] / variance if first <= i < RADIUS else 0.0
        state[i] += gain[i] * innovation
    for i in range(size):
        for k in range(i + 1):
            change = variance * gain[i] * gain[k] - gain[i] * mapped[k] - mapped[i] * gain[k]
            covariance[i, k] += change
            covariance[k, i] = covariance[i, k]


@part
def update(covariance, state, row, innovation, variance, mapped, gain, first):
    """Correct the state by a scalar measurement with a row of its Jacobian."""
    size = len(state)
    for i in range(size):
        mapped[i] = 0.0
    for k in range(size):
        if row[k] != 0.0:
            for i in range(size):
                mapped[i] += row[k] * covariance[k, i]
    for k in range(size):
        variance += row[k] * mapped[k]
    apply_gain(covariance, state, innovation, variance, mapped, gain, first)


@part
def update_sum(covariance, state, one, other, measured, variance, mapped, gain, first):
    """Correct the state by a measurement of the sum of two numbers, or of one (-1: no other); return if it passes."""
    size = len(state)
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
    apply_gain(covariance, state, innovation, variance, mapped, gain, first)
    return True


@part
def likelihood(covariance, rows, innovation, variance, spread, mapped):
    """Return the density of a wheel's innovation, three numbers with rows and a variance each [s^3/m^3]."""
    size = len(covariance)
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
    whitened[:] = innovation
    forward(spread, whitened)
    distance = 0.0
    root = 1.0
    for i in range(3):
        distance += whitened[i] * whitened[i]
        root *= spread[i, i]
    return math.exp(-0.5 * min(distance, 700.0)) / (math.sqrt(2.0 * math.pi) ** 3 * root)


def _predict(covariance, state, axes, arm, heading, angles, imu_time, keeps, variances, transition, noise, half):
    """Propagate up to the wheels' measurement.

    `angles` are those by which the axes of velocity and tilt turn [rad]; `keeps` the ratios that scrubbing and slopes
    keep; `variances` those of velocity, scrubbing, gyroscope, tilt and slopes. `follow_tilt` changes the tilt itself.
    """
    scrub_keep, slope_keep = keeps
    moves = half[0]
    set_process(transition, axes, arm, heading, angles[0], angles[1], imu_time, scrub_keep, slope_keep, moves)
    noise[:] = 0.0
    for axis in range(3):
        noise[VELOCITY + axis, VELOCITY + axis] = variances[0]
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
    state[SCRUB] *= scrub_keep
    state[GYRO_NOISE] = 0.0
    propagate(covariance, transition, noise, half)


def _correct(
    covariance, state, rows, speeds, arms, rate, covered, axis, variances, inliers, rolling, innovations, half
):  # fmt: skip
    """Correct the state by the velocities that wheels measure [m/s], of inliers that more likely roll than slip."""
    count = len(speeds)
    mapped = half[0]
    gain = half[1]
    spread = half[2:6]
    expected = half[6]
    likely = 0
    for wheel in range(count):
        wheel_velocity(state, wheel, arms[wheel], axis, rate, covered, expected)
        set_wheel_rows(rows[wheel], wheel, arms[wheel], axis, covered, expected)
        for i in range(3):
            innovations[wheel, i] = speeds[wheel, i] - expected[i]
        density = likelihood(covariance, rows[wheel], innovations[wheel], variances[wheel], spread, mapped)
        rolls = (1.0 - SLIP_PRIOR) * density
        rolling[wheel] = rolls / (rolls + SLIP_PRIOR * SLIP_DENSITY)
        likely += inliers[wheel] and rolling[wheel] > 0.5
    for wheel in range(count):
        if likely > 1 and rolling[wheel] <= 0.5:  # where all contradict, the prediction is wrong
            inliers[wheel] = False
        if inliers[wheel]:
            for i in range(3):
                wheel_velocity(state, wheel, arms[wheel], axis, rate, covered, expected)
                innovation = speeds[wheel, i] - expected[i]
                # what wheels contradict each other by is more than radii: no position follows from it
                update(covariance, state, rows[wheel, i], innovation, variances[wheel], mapped, gain, HEADING)
        elif rolling[wheel] > 0.5:
            rolling[wheel] = 0.5


def _integrate(covariance, axis, heading, velocity, period, imu_time, variances, transition, noise, half):
    """Propagate the pose; variances are those of slip along x and y, of the yaw, and of the biases."""
    set_pose_process(transition, axis, heading, velocity, period, imu_time)
    noise[:] = 0.0
    noise[POSITION, POSITION] = variances[0]
    noise[POSITION + 1, POSITION + 1] = variances[0]
    noise[HEADING, HEADING] = variances[1]
    for column in range(GYRO_BIAS, GYRO_BIAS + 3):
        noise[column, column] = variances[2]
    propagate(covariance, transition, noise, half)


def _level(covariance, state, about_x, about_y, variance, half):
    """Measure tilt plus slope about x and y [rad] by the plane through the contacts; return whether both pass."""
    passes = update_sum(covariance, state, TILT, SLOPE, about_x, variance, half[0], half[1], 0)
    return update_sum(covariance, state, TILT + 1, SLOPE + 1, about_y, variance, half[0], half[1], 0) and passes


def _measure(covariance, state, which, measured, variance, half):
    """Measure one number of the state; position is not corrected."""
    return update_sum(covariance, state, which, -1, measured, variance, half[0], half[1], HEADING)


def _condition(covariance, which, variance, half):
    """Reduce the covariance by a measurement of one number that is as expected."""
    spread = covariance[which, which] + variance
    for k in range(len(covariance)):
        half[0, k] = covariance[k, which]
    for i in range(len(covariance)):
        for k in range(len(covariance)):
            covariance[i, k] -= half[0, i] * half[0, k] / spread


def _write_covariances(errors, heading, arm, white, pose, twist):
    """Write the covariances of a pose and of a twist; see `WheelInertialFilter.write_covariances`.

    The angular velocity errs by the gyroscope's variance `white` and by its biases, and the base's origin moves by that
    and by the arm.
    """
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
            twist[i, j] = errors[VELOCITY + i, VELOCITY + j] + a * (xx * c + xy * d) + b * (xy * c + yy * d)


_F = "float64"
_V = "float64[::1]"
_M = "float64[:, ::1]"
_PAIR = "UniTuple(float64, 2)"

predict = cached(
    f"void({_M}, {_V}, {_M}, {_V}, {_F}, {_PAIR}, {_F}, {_PAIR}, UniTuple(float64, 5), {_M}, {_M}, {_M})", _predict
)
correct = cached(
    f"void({_M}, {_V}, float64[:, :, ::1], {_M}, {_M}, {_F}, {_F}, {_V}, {_V}, boolean[::1], {_V}, {_M}, {_M})",
    _correct,
    sources=[DENSE],
)
integrate = cached(f"void({_M}, {_V}, {_F}, {_V}, {_F}, {_F}, UniTuple(float64, 3), {_M}, {_M}, {_M})", _integrate)
level = cached(f"boolean({_M}, {_V}, {_F}, {_F}, {_F}, {_M})", _level)
measure = cached(f"boolean({_M}, {_V}, int64, {_F}, {_F}, {_M})", _measure)
condition = cached(f"void({_M}, int64, {_F}, {_M})", _condition)
write_covariances = cached(f"void({_M}, {_F}, {_V}, {_F}, {_M}, {_M})", _write_covariances)
