"""Compiled steps of odometry on wheels. Arrays are described in `Wheels`, `MeasuredBase` and `FilteredOdometry`."""

import math
from pathlib import Path

from solfer.numerics import base_chart as chart
from solfer.numerics.blocks import BlockLayout
from solfer.numerics.compilation import cached, part

_angles_of = part(chart.angles_of)
_rates_of = part(chart.rates_of)
_rotation_of = part(chart.rotation_of)


def _turn_back(places, origin, jacobian, arms, turned, cosine, sine):
    """Write arms and Jacobians in axes that are turned about the vertical, without the six columns of a base."""
    for i in range(len(places)):
        x = places[i, 0] - origin[0]
        y = places[i, 1] - origin[1]
        arms[i, 0], arms[i, 1], arms[i, 2] = cosine * x + sine * y, cosine * y - sine * x, places[i, 2] - origin[2]
        for k in range(turned.shape[1]):
            x = jacobian[3 * i, 6 + k]
            y = jacobian[3 * i + 1, 6 + k]
            turned[3 * i, k], turned[3 * i + 1, k] = cosine * x + sine * y, cosine * y - sine * x
            turned[3 * i + 2, k] = jacobian[3 * i + 2, 6 + k]


def _subtract_tilt(arms, jacobian, x, y):
    """Turn arms and Jacobians back by a small rotation about the axes x and y [rad]."""
    for i in range(len(arms)):
        a, b, c = arms[i]
        arms[i, 0], arms[i, 1], arms[i, 2] = a - y * c, b + x * c, c + y * a - x * b
        for k in range(jacobian.shape[1]):
            a = jacobian[3 * i, k]
            b = jacobian[3 * i + 1, k]
            c = jacobian[3 * i + 2, k]
            jacobian[3 * i, k], jacobian[3 * i + 1, k], jacobian[3 * i + 2, k] = a - y * c, b + x * c, c + y * a - x * b


@part
def turn_about_vertical(rotation, angle, out):
    """Write a rotation that is turned about the vertical by an angle [rad]."""
    cosine = math.cos(angle)
    sine = math.sin(angle)
    for k in range(3):
        x = rotation[0, k]
        y = rotation[1, k]
        out[0, k], out[1, k], out[2, k] = cosine * x - sine * y, sine * x + cosine * y, rotation[2, k]


POSE = BlockLayout(
    "Pose",
    # of the base, in the world and in its heading frame
    position=(float, 3),
    velocity=(float, 3),
    angular=(float, 3),
    # of the origin of its chart
    axes=(float, 3, 3),
    origin=(float, 3),
    # what is written: place, rotation in the world and in the chart, the six numbers and their rates
    place=(float, 3),
    rotation=(float, 3, 3),
    local=(float, 9),
    pose=(float, 6),
    rates=(float, 6),
)
"""What `write_pose` reads and writes."""

_pose_at = POSE.at


@part
def turn_by(rotation, before, after):
    """Turn a rotation, in its own axes, as a chart has turned from three angles to three others [rad]."""
    first = _rotation_of(before[0], before[1], before[2])
    second = _rotation_of(after[0], after[1], after[2])
    for i in range(3):
        x = rotation[i, 0]
        y = rotation[i, 1]
        z = rotation[i, 2]
        for k in range(3):
            total = 0.0
            for row in range(3):
                total += (x * first[3 * row] + y * first[3 * row + 1] + z * first[3 * row + 2]) * second[3 * row + k]
            rotation[i, k] = total


def _write_pose(start, base, heading, yaw, ahead, before, after, is_turned):
    """Write pose and rates of the base some time after its measurement; its angles go on without jumps by revolutions.

    Args:
        start: Address of the `POSE`.
        base: Rotation of the base as it was measured.
        heading: Heading of the base [rad].
        yaw: How far it has to be turned about the vertical for that [rad].
        ahead: The time [s].
        before: Angles of the base when it was measured [rad].
        after: The newest ones.
        is_turned: Whether these are known; else it goes on turning about the vertical.
    """
    written = _pose_at(start)
    cosine = math.cos(heading)
    sine = math.sin(heading)
    x, y, z = written.velocity
    velocity = cosine * x - sine * y, sine * x + cosine * y, z
    x, y, z = written.angular
    angular = cosine * x - sine * y, sine * x + cosine * y, z
    rotation = written.rotation
    turn_about_vertical(base, yaw if is_turned else yaw + ahead * z, rotation)
    if is_turned:
        turn_by(rotation, before, after)
    axes = written.axes
    pose = written.pose
    rates = written.rates
    for k in range(3):
        written.place[k] = written.position[k] + ahead * velocity[k]
    for k in range(3):
        pose[k] = rates[k] = 0.0
        for row in range(3):
            pose[k] += axes[row, k] * (written.place[row] - written.origin[row])
            rates[k] += axes[row, k] * velocity[row]
        for column in range(3):
            written.local[3 * k + column] = (
                axes[0, k] * rotation[0, column] + axes[1, k] * rotation[1, column] + axes[2, k] * rotation[2, column]
            )
    wx = axes[0, 0] * angular[0] + axes[1, 0] * angular[1] + axes[2, 0] * angular[2]
    wy = axes[0, 1] * angular[0] + axes[1, 1] * angular[1] + axes[2, 1] * angular[2]
    wz = axes[0, 2] * angular[0] + axes[1, 2] * angular[1] + axes[2, 2] * angular[2]
    angles = _angles_of(written.local)
    for k in range(3):
        pose[3 + k] = angles[k] + math.tau * round((pose[3 + k] - angles[k]) / math.tau)
    rates[3], rates[4], rates[5] = _rates_of(pose[3], pose[4], wx, wy, wz)


def _turn_rotation(rotation, angle, out):
    """See `turn_about_vertical`."""
    turn_about_vertical(rotation, angle, out)


def _turn_twist(rotation, heading, covariance, turned, half, out):
    """Write the covariance of a twist, in the heading frame, in the axes of the base with a rotation.

    Work space: the rotation from the base to the heading frame, and half of the product.
    """
    turn_about_vertical(rotation, -heading, turned)
    for i in range(6):
        block = i // 3 * 3
        for k in range(6):
            half[i, k] = 0.0
            for j in range(3):
                half[i, k] += turned[j, i - block] * covariance[block + j, k]
    for i in range(6):
        for k in range(6):
            block = k // 3 * 3
            out[i, k] = 0.0
            for j in range(3):
                out[i, k] += half[i, block + j] * turned[j, k - block]


def _joint_motion(position, before, step, legs, sway, keep):
    """Write the steps of the joints, and smooth them as `sway`; see `WheelMotion.find_step` for what it returns."""
    largest = largest_leg = largest_sway = 0.0
    for k in range(len(step)):
        step[k] = position[k] - before[k]
        sway[k] = keep * sway[k] + (1.0 - keep) * step[k]
        largest = max(largest, abs(step[k]))
        largest_sway = max(largest_sway, abs(sway[k]))
        if legs[k]:
            largest_leg = max(largest_leg, abs(step[k]))
    return largest, largest_leg, largest_sway


def _mean_rate(rotation, heading, angular, turned, time, averages, rates, axes):
    """Write the mean rate of the gyroscope over a time [s], and the axes from the base to the heading frame.

    Returns the variance of what it may have missed between its samples [rad^2/s^2].
    """
    rate = rates[0]
    before = rates[1]
    turn_about_vertical(rotation, -heading, axes)
    largest = 0.0
    for axis in range(3):
        largest = max(largest, abs(angular[axis]))
    square = 0.0
    for axis in range(3):
        # below 1e-6 rad/s the gyroscope is silent: no real one is as quiet
        measured = angular[axis] if largest > 1e-6 else turned[axis] / time
        rate[axis] = measured if averages else 0.5 * (measured + before[axis])
        square += (measured - before[axis]) ** 2
        before[axis] = measured
    return 0.25 * square / 3.0


MOTION = BlockLayout(
    "Motion",
    count=int,  # number of wheels
    joint_count=int,
    steps=bool,  # whether they are feet, of which all may be in the air: the base's origin stands for their mean
    # Jacobians and arms, now and at the measurement before; steps of the joints
    jacobian=(float, "3 * count", "joint_count"),
    jacobian_before=(float, "3 * count", "joint_count"),
    arms=(float, "count", 3),
    arms_before=(float, "count", 3),
    step=(float, "joint_count"),
    # torques of the joints, and which of them do not roll
    torques=(float, "joint_count"),
    legs=(bool, "joint_count"),
    # weights of wheels that touch, of those that also roll, and the spread of what is left of each one's velocity
    weights=(float, "count"),
    trusted=(float, "count"),
    spreads=(float, "count"),
    # displacements, means of arms, and the displacement of their mean by tilting
    displacements=(float, "count", 3),
    mean_arms=(float, "count", 3),
    arm=(float, 3),
    tilting=(float, 3),
    speeds=(float, "count", 3),
)
"""What wheels measure between two measurements of the joints."""

GROUND = BlockLayout(
    "Ground",
    count=int,
    slope=(float, 2),
    rise=(float, "count"),  # of each wheel above the others
    lifted=(bool, "count"),
    rolled=(float, "count"),  # how far each that is lifted has rolled as the others do [m]
    # slopes in the world that driving explains, how far those of the plane are from them, and the time since then
    followed=(float, 2),
    apart=(float, 1),
    since=(float, 1),
)
"""What `find_lifted` and `follow_plane` write."""

_motion_at = MOTION.at
_ground_at = GROUND.at


def _measure_displacements(start, turned):
    """Write displacements measured by wheels, with mean Jacobians and arms, and that of the ground point by tilting."""
    motion = _motion_at(start)
    displacements = motion.displacements
    mean = motion.mean_arms
    arm = motion.arm
    px = turned[0]
    py = turned[1]
    total = 0.0
    arm[:] = 0.0
    for i in range(motion.count):
        for axis in range(3):
            mean[i, axis] = 0.5 * (motion.arms[i, axis] + motion.arms_before[i, axis])
            row = 3 * i + axis
            displacement = 0.0
            for k in range(motion.joint_count):
                displacement += (motion.jacobian[row, k] + motion.jacobian_before[row, k]) * motion.step[k]
            displacements[i, axis] = -0.5 * displacement
            arm[axis] += motion.weights[i] * mean[i, axis]
        total += motion.weights[i]
        displacements[i, 0] -= py * mean[i, 2]
        displacements[i, 1] += px * mean[i, 2]
        displacements[i, 2] -= px * mean[i, 1] - py * mean[i, 0]
    for axis in range(3):
        arm[axis] = 0.0 if motion.steps else arm[axis] / total
    motion.tilting[0], motion.tilting[1], motion.tilting[2] = py * arm[2], -px * arm[2], px * arm[1] - py * arm[0]


def _measure_speeds(displacements, tilting, time, slip_ratio, encoder_deviation, spreads, variances, speeds):
    """Write the velocities of the ground point that wheels measure within a time [s], and their variances [m^2/s^2]."""
    for i in range(len(displacements)):
        square = 0.0
        for axis in range(3):
            speeds[i, axis] = (displacements[i, axis] + tilting[axis]) / time
            square += speeds[i, axis] ** 2
        deviation = slip_ratio * math.sqrt(square) + encoder_deviation
        variances[i] = max(deviation * deviation, spreads[i])


def _learn_spreads(start, velocity, yaw_rate, inliers, keep):
    """Smooth the squares of what is left of each wheel's velocity, and write the weights of the wheels that roll."""
    motion = _motion_at(start)
    speeds = motion.speeds
    arms = motion.mean_arms
    weights = motion.weights
    spreads = motion.spreads
    trusted = motion.trusted
    count = rolling = 0
    for i in range(motion.count):
        count += inliers[i]
        trusted[i] = weights[i] if inliers[i] else 0.0
        rolling += trusted[i] > 0.0
    # the wheel itself is in the mean
    factor = (1.0 - keep) * max(2, count) / (3.0 * (max(2, count) - 1.0))
    for i in range(motion.count):
        x = speeds[i, 0] - velocity[0] + yaw_rate * arms[i, 1]
        y = speeds[i, 1] - velocity[1] - yaw_rate * arms[i, 0]
        z = speeds[i, 2] - velocity[2]
        spreads[i] = keep * spreads[i] + factor * (x * x + y * y + z * z)
        if rolling < 2:
            trusted[i] = weights[i]


def _move_base(position, correction, velocity, pushed, tilting, heading, yaw, period):
    """Move the base by a correction, which is done then, and by its velocity in the middle of a yaw; return the yaw.

    Half of what an accelerometer `pushed` in the interval was not there in its middle.
    """
    for axis in range(3):
        position[axis] += correction[axis]
    yaw += correction[3]
    correction[:] = 0.0
    cosine = math.cos(heading + 0.5 * yaw)
    sine = math.sin(heading + 0.5 * yaw)
    x = (velocity[0] - 0.5 * pushed[0]) * period - tilting[0]
    y = (velocity[1] - 0.5 * pushed[1]) * period - tilting[1]
    position[0] += cosine * x - sine * y
    position[1] += sine * x + cosine * y
    position[2] += (velocity[2] - 0.5 * pushed[2]) * period - tilting[2]
    return yaw


@part
def fit_plane(weights, arms, without, slope):
    """Write the slopes of the plane through the contacts that count, without one of them; return whether there is one.

    Returns a point of that plane besides: the mean of these contacts.
    """
    total = x0 = y0 = z0 = xx = xy = yy = xz = yz = 0.0
    for i in range(len(arms)):
        if weights[i] > 0.0 and i != without:
            total += 1.0
            x0 += arms[i, 0]
            y0 += arms[i, 1]
            z0 += arms[i, 2]
    if total == 0.0:
        return False, 0.0, 0.0, 0.0
    x0 = x0 / total
    y0 = y0 / total
    z0 = z0 / total
    for i in range(len(arms)):
        if weights[i] > 0.0 and i != without:
            x = arms[i, 0] - x0
            y = arms[i, 1] - y0
            z = arms[i, 2] - z0
            xx += x * x
            xy += x * y
            yy += y * y
            xz += x * z
            yz += y * z
    determinant = xx * yy - xy * xy
    if total < 3.0 or determinant <= 1e-9:
        return False, x0, y0, z0
    slope[0], slope[1] = (yy * xz - xy * yz) / determinant, (xx * yz - xy * xz) / determinant
    return True, x0, y0, z0


def _plane(weights, arms, slope):
    """Write the slopes of the plane through the contacts that count, along x and y; return whether there is one."""
    return fit_plane(weights, arms, -1, slope)[0]


@part
def carries(motion, i):
    """Return whether torques press a wheel onto the ground; those of a leg in the air hold it up."""
    down = 0.0
    row = 3 * i + 2
    for k in range(motion.joint_count):
        if motion.legs[k]:
            down -= motion.jacobian[row, k] * motion.torques[k]
    return down > 0.0


@part
def sides(arms):
    """Return how far the contacts are apart along x and along y, at least 0.1 [m]."""
    x0 = x1 = arms[0, 0]
    y0 = y1 = arms[0, 1]
    for i in range(1, len(arms)):
        x0 = min(x0, arms[i, 0])
        x1 = max(x1, arms[i, 0])
        y0 = min(y0, arms[i, 1])
        y1 = max(y1, arms[i, 1])
    return max(x1 - x0, 0.1), max(y1 - y0, 0.1)


def _follow_plane(start, ground_start, heading, velocity, angular, measured, period):
    """Find the plane through the contacts, and how far it has turned in the world otherwise than by driving [rad].

    Where a robot drives onto another slope the ground turns below it at its speed over the distance of the wheels. It
    does not where the robot stands, however legs move and whatever pushes it: what tips it over lifts wheels. So slopes
    are followed as fast as that, while all wheels carry the robot and it tilts more slowly than in a fall.

    Args:
        start: Address of the motion of the wheels.
        ground_start: Address of the ground.
        heading: Heading of the base.
        velocity: Velocity of the ground point, shape (3,).
        angular: Angular velocity of the base, shape (3,).
        measured: Whether the IMU has measured the tilt.
        period: Time since the last measurement.

    Returns:
        0: there is no plane. 1: there is. 2: it has turned too far.
    """
    steepest = 0.3  # difference of two slopes onto which a robot drives
    margin = 0.03  # [rad/s] for which there is no reason
    uneven = 0.04  # [rad] as by stones
    height = 0.01  # [m] from which on a wheel counts as lifted
    motion = _motion_at(start)
    ground = _ground_at(ground_start)
    slope = ground.slope
    ground.since[0] += period
    if not fit_plane(motion.weights, motion.arms, -1, slope)[0]:
        ground.since[0] = math.inf
        return 0
    falls = math.sqrt(angular[0] ** 2 + angular[1] ** 2) > 0.5  # [rad/s]
    for i in range(motion.count):
        if falls or motion.weights[i] <= 0.0 or not carries(motion, i):
            ground.since[0] = math.inf
            return 1
    if not measured:
        return 1
    cosine = math.cos(heading)
    sine = math.sin(heading)
    length, width = sides(motion.arms)
    # where it turns about the vertical each of its sides climbs by one wheel
    rate = max(abs(velocity[0]) / length, abs(velocity[1]) / width) + 0.5 * abs(angular[2])
    allowed = (margin + steepest * rate) * ground.since[0]
    x = cosine * slope[0] - sine * slope[1] - ground.followed[0]
    y = sine * slope[0] + cosine * slope[1] - ground.followed[1]
    apart = math.sqrt(x * x + y * y)
    share = allowed / apart if apart > allowed else 1.0
    ground.followed[0] += share * x
    ground.followed[1] += share * y
    ground.apart[0] = (1.0 - share) * apart
    ground.since[0] = 0.0
    return 2 if ground.apart[0] > uneven + height / min(length, width) else 1


@part
def height_above_others(weights, arms, normal, i, slope):
    """Return how far a wheel is above the plane through the others [m]; where two are left its normal is known."""
    found, x, y, z = fit_plane(weights, arms, i, slope)
    if not found:
        slope[0], slope[1] = -normal[0] / normal[2], -normal[1] / normal[2]
    return arms[i, 2] - z - slope[0] * (arms[i, 0] - x) - slope[1] * (arms[i, 1] - y)


@part
def along_normal(displacements, arms, i, yaw, x, y, z):
    """Return a wheel's part of the base's displacement along a normal x, y, z, with a yaw [m]."""
    return (
        x * (displacements[i, 0] + yaw * arms[i, 1])
        + y * (displacements[i, 1] - yaw * arms[i, 0])
        + z * displacements[i, 2]
    )


@part
def along_normal_by_tilting(arms, i, px, py, x, y, z):
    """Return how far a wheel goes along a normal x, y, z by the rotations px and py of the base [m]."""
    return py * arms[i, 2] * x - px * arms[i, 2] * y + (px * arms[i, 1] - py * arms[i, 0]) * z


def _find_lifted(start, ground_start, yaw, turned, normal, clearance, forget):
    """Note how far legs have lifted wheels above the others [m], and which are lifted.

    A wheel that climbs rises too, but then it is the base that turns and not the leg that moves: of both ways the
    smaller one counts. How high a wheel is that was lifted is known by its place: no sum of ways would stay right.
    One that rolls as the others do has come to stand on something higher, and counts again.
    """
    motion = _motion_at(start)
    ground = _ground_at(ground_start)
    displacements = motion.displacements
    arms = motion.mean_arms
    trusted = motion.trusted
    rise = ground.rise
    lifted = ground.lifted
    px = turned[0]
    py = turned[1]
    x = normal[0]
    y = normal[1]
    z = normal[2]
    total = mean_tilting = mean_displacement = along = across = 0.0
    for i in range(motion.count):
        total += trusted[i]
        along += trusted[i] * (displacements[i, 0] + yaw * arms[i, 1])
        across += trusted[i] * (displacements[i, 1] - yaw * arms[i, 0])
        mean_tilting += trusted[i] * along_normal_by_tilting(arms, i, px, py, x, y, z)
        mean_displacement += trusted[i] * along_normal(displacements, arms, i, yaw, x, y, z)
    mean_tilting /= total
    mean_displacement /= total
    along /= total
    across /= total
    length = math.sqrt(along * along + across * across)
    for i in range(motion.count):
        # a wheel that goes up measures that the base goes down
        up = mean_displacement - along_normal(displacements, arms, i, yaw, x, y, z)
        by_leg = up - (along_normal_by_tilting(arms, i, px, py, x, y, z) - mean_tilting)
        if up * by_leg > 0.0:
            rise[i] += up if abs(up) < abs(by_leg) else by_leg
        if lifted[i] or rise[i] > clearance:
            above = height_above_others(motion.weights, arms, normal, i, ground.slope)
            lifted[i] = above > (0.5 * clearance if lifted[i] else clearance)
            rise[i] = above if lifted[i] else min(rise[i], clearance)
        if lifted[i]:
            u = displacements[i, 0] + yaw * arms[i, 1] - along
            v = displacements[i, 1] - yaw * arms[i, 0] - across
            rolls = u * u + v * v < 0.01 * length * length  # within a tenth
            ground.rolled[i] = max(0.0, ground.rolled[i] + (length if rolls else -3.0 * length))
            if ground.rolled[i] > 0.03:  # [m]
                lifted[i] = False
                rise[i] = 0.0
        if not lifted[i]:
            ground.rolled[i] = 0.0
            rise[i] *= forget


def _velocity_of_base(jacobian, rates, angular, arms, weights, velocity, each, keep, covariance):
    """Write the velocity of the base at which the material of wheels rests on average [m/s], and its covariance.

    This is that of a weighted mean of independent wheels, by how far `each` of them is from it, smoothed: with the
    shares p of the wheels and their residuals r, the sum of p^2 by 1 minus itself, times the sum of p r r^T.
    """
    wx, wy, wz = angular
    total = 0.0
    velocity[:] = 0.0
    for i in range(len(arms)):
        x, y, z = arms[i]
        each[i, 0], each[i, 1], each[i, 2] = wz * y - wy * z, wx * z - wz * x, wy * x - wx * y
        total += weights[i]
        for axis in range(3):
            for k in range(len(rates)):
                each[i, axis] -= jacobian[3 * i + axis, k] * rates[k]
            velocity[axis] += weights[i] * each[i, axis]
    squares = 0.0
    for axis in range(3):
        velocity[axis] /= total
    for i in range(len(arms)):
        squares += (weights[i] / total) ** 2
    for row in range(3):
        for column in range(row + 1):
            scatter = 0.0
            for i in range(len(arms)):
                share = weights[i] / total
                scatter += share * (each[i, row] - velocity[row]) * (each[i, column] - velocity[column])
            known = squares / (1.0 - squares) * scatter if squares < 0.999 else 0.0
            covariance[row, column] = keep * covariance[row, column] + (1.0 - keep) * known
            covariance[column, row] = covariance[row, column]


def _turned(rotation, known, heading, out):
    """Write the rotation from one that was known to another one as a vector [rad], in axes of a heading [rad].

    Returns whether it is less than a right angle; where it is not nothing is written.
    """
    trace = x = y = z = 0.0
    for k in range(3):
        for axis in range(3):
            trace += rotation[axis, k] * known[axis, k]
        x += 0.5 * (rotation[2, k] * known[1, k] - rotation[1, k] * known[2, k])
        y += 0.5 * (rotation[0, k] * known[2, k] - rotation[2, k] * known[0, k])
        z += 0.5 * (rotation[1, k] * known[0, k] - rotation[0, k] * known[1, k])
    if trace <= 1.0:
        return False
    sine = math.sqrt(x * x + y * y + z * z)
    factor = math.atan2(sine, 0.5 * (trace - 1.0)) / sine if sine > 1e-12 else 1.0
    a = factor * math.cos(heading)
    b = factor * math.sin(heading)
    out[0], out[1], out[2] = a * x + b * y, a * y - b * x, factor * z
    return True


_F = "float64"
_V = "float64[::1]"
_M = "float64[:, ::1]"
_B = "boolean[::1]"

turn_back = cached(f"void({_M}, {_V}, {_M}, {_M}, {_M}, {_F}, {_F})", _turn_back)
subtract_tilt = cached(f"void({_M}, {_M}, {_F}, {_F})", _subtract_tilt)
joint_motion = cached(f"UniTuple(float64, 3)({_V}, {_V}, {_V}, {_B}, {_V}, {_F})", _joint_motion)
mean_rate = cached(f"float64({_M}, {_F}, {_V}, {_V}, {_F}, boolean, {_M}, {_M})", _mean_rate)
measure_displacements = cached(f"void(int64, {_V})", _measure_displacements)
measure_speeds = cached(f"void({_M}, {_V}, {_F}, {_F}, {_F}, {_V}, {_V}, {_M})", _measure_speeds)
learn_spreads = cached(f"void(int64, {_V}, {_F}, {_B}, {_F})", _learn_spreads)
plane = cached(f"boolean({_V}, {_M}, {_V})", _plane)
follow_plane = cached(f"int64(int64, int64, {_F}, {_V}, {_V}, boolean, {_F})", _follow_plane)
move_base = cached(f"float64({_V}, {_V}, {_V}, {_V}, {_V}, {_F}, {_F}, {_F})", _move_base)
find_lifted = cached(f"void(int64, int64, {_F}, {_V}, {_V}, {_F}, {_F})", _find_lifted)
velocity_of_base = cached(f"void({_M}, {_V}, {_V}, {_M}, {_V}, {_V}, {_M}, {_F}, {_M})", _velocity_of_base)
turned = cached(f"boolean({_M}, {_M}, {_F}, {_V})", _turned)
turn_rotation = cached(f"void({_M}, {_F}, {_M})", _turn_rotation)
turn_twist = cached(f"void({_M}, {_F}, {_M}, {_M}, {_M}, {_M})", _turn_twist)
write_pose = cached(
    f"void(int64, {_M}, {_F}, {_F}, {_F}, {_V}, {_V}, boolean)", _write_pose, sources=[Path(chart.__file__)]
)
