"""Compiled step of `CommonSlip`, where arrays are described."""

import math
from pathlib import Path

from solfer.components.odometry import filter_kernel
from solfer.numerics.blocks import BlockLayout
from solfer.numerics.compilation import cached, part

SLIP = BlockLayout(
    "Slip",
    # all along x and y of the heading frame: velocity of the base by wheels, that of the IMU at the measurement before
    # [m/s], what it has gained more than the accelerometer measured, the error of that [m/s^2], slip, and its path [m]
    speed=(float, 2),
    before=(float, 2),
    gained=(float, 2),
    swing=(float, 2),  # what its rotation has added to the wheels' velocity [m/s]
    bias=(float, 2),
    slip=(float, 2),
    slipped=(float, 2),
    mean=(float, 4),  # of the wheels' velocity and the base's while wheels slip [m/s]
    slope=(float, 2),  # of the plane through the contacts
    usual=(float, 2),  # that of the last second
    probability=(float, 1),  # that wheels roll
    excess=(float, 1),  # of what no slip explains, all together [m/s]
    # for how long they have slipped [s]; below 0 nothing is compared, NaN: there is nothing to compare with yet
    lasts=(float, 1),
)
"""What `follow` keeps."""

ROLLS, BEGINS, LASTS, CONTRADICTS = range(4)
"""What `follow` finds: that wheels roll, begin to slip, slip on, or that no slip explains what is measured."""

_slip_at = SLIP.at
_motion_at = filter_kernel.MOTION.at


@part
def turn(vector, cosine, sine):
    """Turn the axes of a vector by an angle."""
    x = vector[0]
    y = vector[1]
    vector[0] = cosine * x + sine * y
    vector[1] = cosine * y - sine * x


@part
def limit(x, y, u, v):
    """Limit a velocity to one of a robot whose wheels spin at (u, v): slower, and where they go [m/s]."""
    aside = 0.05  # [m/s]
    size = math.hypot(u, v)
    cosine = u / size if size > 1e-3 else 1.0
    sine = v / size if size > 1e-3 else 0.0
    ahead = min(max(x * cosine + y * sine, -aside), max(size, aside))
    left = min(max(y * cosine - x * sine, -aside), aside)
    return ahead * cosine - left * sine, ahead * sine + left * cosine


@part
def mean_speed(motion, inliers, rate, speed):
    """Write the velocity of the base that wheels measure on average, at a yaw rate [rad/s]."""
    total = 0.0
    speed[:] = 0.0
    for i in range(motion.count):
        if inliers[i]:
            weight = motion.weights[i]
            total += weight
            speed[0] += weight * (motion.speeds[i, 0] + rate * motion.mean_arms[i, 1])
            speed[1] += weight * (motion.speeds[i, 1] - rate * motion.mean_arms[i, 0])
    speed[0] /= total
    speed[1] /= total


@part
def forget(block, lasts):
    """Let wheels roll."""
    for numbers in (block.gained, block.slip, block.slipped):
        numbers[:] = 0.0
    block.probability[0] = 1.0
    block.lasts[0] = lasts


@part
def doubt(block):
    """Let wheels roll, and do not compare them for a while: no slip explains what the accelerometer measures."""
    forget(block, -2.0)  # [s]
    return CONTRADICTS


def _follow(start, motion_start, inliers, pushed, heading, place, axes, rotation, tilt):
    """Compare wheels with an accelerometer, see `CommonSlip`; return one of the numbers above.

    Args:
        start: Address of a `SLIP`.
        motion_start: Address of a `MOTION`.
        inliers: Which wheels agree.
        pushed: Change of the IMU's velocity since the measurement before, in the world of the heading [m/s].
        heading: Heading of the base [rad].
        place: From the base's origin to the IMU, in the base [m].
        axes: Rotation from the base to the heading frame.
        rotation: Angular velocity of the base in the heading frame [rad/s], and time since the measurement before [s].
        tilt: Error of the tilt about x and y of the heading frame [rad], and its variance [rad^2].
    """
    comparison_time = 0.4  # [s] over which velocities are compared
    learning_time = 5.0  # [s] in which the accelerometer's error is learned
    noise = 0.012  # [m/s] of what is gained within that time
    gravity = 9.81  # [m/s^2]
    block = _slip_at(start)
    motion = _motion_at(motion_start)
    speed = block.speed
    before = block.before
    gained = block.gained
    bias = block.bias
    slip = block.slip
    slipped = block.slipped
    mean = block.mean
    wx, wy, wz, time = rotation
    mean_speed(motion, inliers, wz, speed)
    # the wheels' velocity is that of the base at the height of the contacts
    x = axes[0, 0] * place[0] + axes[0, 1] * place[1] + axes[0, 2] * place[2]
    y = axes[1, 0] * place[0] + axes[1, 1] * place[1] + axes[1, 2] * place[2]
    z = axes[2, 0] * place[0] + axes[2, 1] * place[1] + axes[2, 2] * place[2] - motion.arm[2]
    swing = wy * z - wz * y, wz * x - wx * z
    swung = math.hypot(swing[0] - block.swing[0], swing[1] - block.swing[1])
    block.swing[0], block.swing[1] = swing
    u = speed[0] + swing[0]
    v = speed[1] + swing[1]
    cosine = math.cos(wz * time)
    sine = math.sin(wz * time)
    for vector in (before, gained, slip, slipped, mean[:2], mean[2:], block.usual):
        turn(vector, cosine, sine)
    cosine = math.cos(heading)
    sine = math.sin(heading)
    gain = (
        u - before[0] - (cosine * pushed[0] + sine * pushed[1]) + (bias[0] + gravity * tilt[1]) * time,
        v - before[1] - (cosine * pushed[1] - sine * pushed[0]) + (bias[1] - gravity * tilt[0]) * time,
    )
    before[0] = u
    before[1] = v
    if not math.isfinite(gain[0] + gain[1] + block.lasts[0]):  # there is nothing to compare with
        forget(block, 0.0)
        return ROLLS
    if block.lasts[0] == 0.0 and swung > 0.03 + 4.0 * time:  # [m/s]: a gyroscope that jumps, or a blow
        return doubt(block)
    rests = math.hypot(speed[0], speed[1]) < 0.02  # [m/s]: wheels that rest do not spin
    turned = 0.0  # the plane, or an IMU that drifts
    for axis in range(2):
        if not block.lasts[0] > 0.0:
            block.usual[axis] += (1.0 - math.exp(-time)) * (block.slope[axis] - block.usual[axis])
        turned += (block.slope[axis] - block.usual[axis]) ** 2
    if block.lasts[0] > 0.0:
        if turned > 0.05 * 0.05:  # [rad]
            return doubt(block)
        x = u - slip[0] - gain[0]
        y = v - slip[1] - gain[1]
        keep = math.exp(-time / (0.1 if rests else 0.25))  # a robot that pushes sways
        for axis, number in enumerate((u, v, x, y)):
            mean[axis] = keep * mean[axis] + (1.0 - keep) * number
        goal = limit(mean[2], mean[3], mean[0], mean[1])
        block.excess[0] += math.hypot(goal[0] - mean[2], goal[1] - mean[3])
        if block.excess[0] > 1.0 or math.hypot(x - goal[0], y - goal[1]) > 0.5:  # [m/s]
            return doubt(block)
        is_slow = math.hypot(goal[0], goal[1]) < max(0.06, 0.5 * math.hypot(mean[0], mean[1]))  # [m/s]
        if is_slow and math.hypot(x - mean[2], y - mean[3]) < 0.15:  # it rests but for that
            goal = math.sqrt(keep) * goal[0], math.sqrt(keep) * goal[1]  # with a damping ratio of 0.7
        x += goal[0] - mean[2]
        y += goal[1] - mean[3]
        mean[2], mean[3] = goal
        if rests:
            x *= math.exp(-time / 0.1)
            y *= math.exp(-time / 0.1)
        slip[0] = u - x
        slip[1] = v - y
        block.lasts[0] += time
        still = math.hypot(mean[0], mean[1]) < 0.02
        if not still and math.hypot(mean[0] - mean[2], mean[1] - mean[3]) > noise:
            return LASTS
        forget(block, 0.0)
        return ROLLS
    if block.lasts[0] < 0.0:
        block.lasts[0] = min(block.lasts[0] + time, 0.0)
        return ROLLS
    keep = math.exp(-time / (0.1 if rests else comparison_time))
    for axis in range(2):
        gained[axis] = keep * gained[axis] + gain[axis]
    variance = noise * noise + (tilt[2] + turned) * (gravity * comparison_time) ** 2
    square = gained[0] * gained[0] + gained[1] * gained[1]
    if square < 4.0 * variance:
        slipped[:] = 0.0
    if square < 4.0 * variance and not rests:
        for axis in range(2):
            bias[axis] -= gained[axis] * time / (comparison_time * learning_time)
    for axis in range(2):
        slipped[axis] += gained[axis] * time
    # one in a thousand intervals is one of slip, of which any velocity to 0.5 m/s is as likely
    ratio = 0.5 * square / variance - math.log(0.999 * 0.5 * 0.5 / (2.0 * 0.001 * variance))
    block.probability[0] = 1.0 / (1.0 + math.exp(min(ratio, 700.0)))
    if ratio < 0.0:
        return ROLLS
    x, y = limit(u - gained[0], v - gained[1], u, v)
    slip[0] = u - x
    slip[1] = v - y
    unexplained = math.hypot(gained[0] - slip[0], gained[1] - slip[1])
    along = (gained[0] * u + gained[1] * v) / (math.hypot(u, v) * math.sqrt(square))
    if unexplained > 0.05 or along < 0.8 or rests:  # [m/s]
        return doubt(block)
    gained[:] = 0.0
    block.excess[0] = 0.0
    block.lasts[0] = time
    mean[0], mean[1], mean[2], mean[3] = u, v, 0.0, 0.0
    return BEGINS


_V = "float64[::1]"
_M = "float64[:, ::1]"
follow = cached(
    f"int64(int64, int64, boolean[::1], {_V}, float64, {_V}, {_M}, UniTuple(float64, 4), UniTuple(float64, 3))",
    _follow,
    sources=[Path(filter_kernel.__file__)],
)
