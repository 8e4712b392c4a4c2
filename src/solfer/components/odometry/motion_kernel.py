"""Compiled steps of odometry on wheels. Arrays are described in `Wheels`, `Consensus` and `RollingOdometry`."""

import math

from solfer.numerics.compilation import cached, part


def _turn_back(places, origin, jacobian, cosine, sine, arms, turned):
    """Write arms and Jacobians in axes that are turned about the vertical, without the six columns of a base."""
    for i in range(len(places)):
        x, y = places[i, 0] - origin[0], places[i, 1] - origin[1]
        arms[i, 0], arms[i, 1], arms[i, 2] = cosine * x + sine * y, cosine * y - sine * x, places[i, 2] - origin[2]
        for k in range(turned.shape[1]):
            x, y = jacobian[3 * i, 6 + k], jacobian[3 * i + 1, 6 + k]
            turned[3 * i, k], turned[3 * i + 1, k] = cosine * x + sine * y, cosine * y - sine * x
            turned[3 * i + 2, k] = jacobian[3 * i + 2, 6 + k]


def _right(arms, jacobian, x, y):
    """Turn arms and Jacobians back by a small turn about the axes x and y [rad]."""
    for i in range(len(arms)):
        a, b, c = arms[i]
        arms[i, 0], arms[i, 1], arms[i, 2] = a - y * c, b + x * c, c + y * a - x * b
        for k in range(jacobian.shape[1]):
            a, b, c = jacobian[3 * i, k], jacobian[3 * i + 1, k], jacobian[3 * i + 2, k]
            jacobian[3 * i, k], jacobian[3 * i + 1, k], jacobian[3 * i + 2, k] = a - y * c, b + x * c, c + y * a - x * b


def _tell(jacobian, before, arms, arms_before, step, turned, told, mean):
    """Write the ways that wheels tell, and their arms, by means of Jacobians and arms of this and of the last cycle."""
    px, py = turned[0], turned[1]
    for i in range(len(arms)):
        for axis in range(3):
            mean[i, axis] = 0.5 * (arms[i, axis] + arms_before[i, axis])
            total, row = 0.0, 3 * i + axis
            for k in range(len(step)):
                total += (jacobian[row, k] + before[row, k]) * step[k]
            told[i, axis] = -0.5 * total
        told[i, 0] -= py * mean[i, 2]
        told[i, 1] += px * mean[i, 2]
        told[i, 2] -= px * mean[i, 1] - py * mean[i, 0]


@part
def _average(told, arms, turn, weights, believed, motion, rest):
    """Write the motion that believed wheels tell, and what is left of each; return the sum of their weights."""
    total = 0.0
    motion[:] = 0.0
    for i in range(len(told)):
        rest[i, 0] = told[i, 0] + turn * arms[i, 1]
        rest[i, 1] = told[i, 1] - turn * arms[i, 0]
        rest[i, 2] = told[i, 2]
        weight = weights[i] * believed[i]
        total += weight
        for axis in range(3):
            motion[axis] += weight * rest[i, axis]
    for axis in range(3):
        motion[axis] /= total
        for i in range(len(told)):
            rest[i, axis] -= motion[axis]
    return total


def _mean(told, arms, turn, weights, believed, motion, rest):
    """See `_average`."""
    _average(told, arms, turn, weights, believed, motion, rest)


def _agree(told, arms, turn, weights, tolerance, believed, motion, rest):
    """Leave out the worst wheel as long as it is further than a tolerance from what the others tell; two are left."""
    left = 0
    for i in range(len(told)):
        believed[i] = weights[i] > 0.0
        left += believed[i]
    total = _average(told, arms, turn, weights, believed, motion, rest)
    while left > 2:
        worst, largest = -1, tolerance * tolerance
        for i in range(len(told)):
            # the wheel itself pulls the mean: without it, it would be further away
            share = total / max(total - weights[i] * believed[i], 1e-12)
            square = (rest[i, 0] ** 2 + rest[i, 1] ** 2 + rest[i, 2] ** 2) * share * share
            if believed[i] and square > largest:
                worst, largest = i, square
        if worst < 0:
            break
        believed[worst] = False
        left -= 1
        total = _average(told, arms, turn, weights, believed, motion, rest)


def _contradict(told, lean, time, share, least, rests, deviations, speeds):
    """Write the velocities that wheels tell within a time [s], without the tilting, and their deviations [m/s]."""
    for i in range(len(told)):
        square = 0.0
        for axis in range(3):
            speeds[i, axis] = (told[i, axis] + lean[axis]) / time
            square += speeds[i, axis] ** 2
        deviations[i] = max(share * math.sqrt(square) + least, math.sqrt(rests[i]))


def _learn(speeds, velocity, turned, arms, believed, keep, rests):
    """Learn how far wheels are from what all tell, a low-pass filter that keeps a share of what it has."""
    count = 0
    for i in range(len(rests)):
        count += believed[i]
    # what a wheel tells moves the mean, too
    factor = (1.0 - keep) * max(2, count) / (3.0 * (max(2, count) - 1.0))
    for i in range(len(rests)):
        x = speeds[i, 0] - velocity[0] + turned * arms[i, 1]
        y = speeds[i, 1] - velocity[1] - turned * arms[i, 0]
        z = speeds[i, 2] - velocity[2]
        rests[i] = keep * rests[i] + factor * (x * x + y * y + z * z)


def _part_ways(rest, shares, way, apart, trust):
    """Add how far each wheel gets from what all tell by their shares [m], and these shares times the way [m]."""
    x = y = 0.0
    for i in range(len(rest)):
        x += shares[i] * rest[i, 0]
        y += shares[i] * rest[i, 1]
    for i in range(len(rest)):
        apart[i, 0] += rest[i, 0] - x
        apart[i, 1] += rest[i, 1] - y
        trust[i] += shares[i] * way


def _slid(apart, trust, together, variance):
    """Write the variance of the mean of ways, along each of x and y, by how far wheels got from it [m^2].

    Returns whether there are two wheels or more that rolled all the way.
    """
    count, total, square = 0, 0.0, 0.0
    for i in range(len(apart)):
        if together[i]:
            count += 1
            total += trust[i]
            square += 0.5 * trust[i] * trust[i] * (apart[i, 0] ** 2 + apart[i, 1] ** 2)
    if count < 2 or total <= 0.0:
        return False
    variance[0] = square * count / (total * total * (count - 1.0))
    return True


@part
def _fit(weights, arms, without, slope):
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
    x0, y0, z0 = x0 / total, y0 / total, z0 / total
    for i in range(len(arms)):
        if weights[i] > 0.0 and i != without:
            x, y, z = arms[i, 0] - x0, arms[i, 1] - y0, arms[i, 2] - z0
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
    return _fit(weights, arms, -1, slope)[0]


@part
def _above(weights, arms, normal, i, slope):
    """Return how far a wheel is above the plane through the others [m]; where two are left its normal is known."""
    found, x, y, z = _fit(weights, arms, i, slope)
    if not found:
        slope[0], slope[1] = -normal[0] / normal[2], -normal[1] / normal[2]
    return arms[i, 2] - z - slope[0] * (arms[i, 0] - x) - slope[1] * (arms[i, 1] - y)


@part
def _tilted(arms, i, px, py, x, y, z):
    """Return how far a wheel goes along a normal x, y, z by the turns px and py of the base [m]."""
    return py * arms[i, 2] * x - px * arms[i, 2] * y + (px * arms[i, 1] - py * arms[i, 0]) * z


def _rises(rest, arms, turned, weights, trusted, normal, clearance, forget, slope, rise, lifted):
    """Note how far legs have lifted wheels above the others [m], and which are lifted.

    A wheel that climbs rises too, but then it is the base that turns and not the leg that moves: of both ways the
    smaller one counts. How high a wheel is that was lifted is seen by where it is: no sum of ways would stay right.
    """
    px, py = turned[0], turned[1]
    x, y, z = normal[0], normal[1], normal[2]
    mean = total = 0.0
    for i in range(len(rise)):
        total += trusted[i]
        mean += trusted[i] * _tilted(arms, i, px, py, x, y, z)
    mean /= total
    for i in range(len(rise)):
        # a wheel that goes up tells that the base goes down
        up = -(rest[i, 0] * x + rest[i, 1] * y + rest[i, 2] * z)
        by_leg = up - (_tilted(arms, i, px, py, x, y, z) - mean)
        if up * by_leg > 0.0:
            rise[i] += up if abs(up) < abs(by_leg) else by_leg
        if lifted[i] or rise[i] > clearance:
            above = _above(weights, arms, normal, i, slope)
            lifted[i] = above > (0.5 * clearance if lifted[i] else clearance)
            rise[i] = above if lifted[i] else min(rise[i], clearance)
        if not lifted[i]:
            rise[i] *= forget


def _move(jacobian, rates, angular, arms, weights, velocity):
    """Write the velocity of the base by which the material of wheels rests on average [m/s]."""
    wx, wy, wz = angular
    total = 0.0
    velocity[:] = 0.0
    for i in range(len(arms)):
        x, y, z = arms[i]
        turned = (wy * z - wz * y, wz * x - wx * z, wx * y - wy * x)
        total += weights[i]
        for axis in range(3):
            speed = turned[axis]
            for k in range(len(rates)):
                speed += jacobian[3 * i + axis, k] * rates[k]
            velocity[axis] -= weights[i] * speed
    for axis in range(3):
        velocity[axis] /= total


def _turned(rotation, known, heading, out):
    """Write the turn from a rotation that was known to another one as a vector [rad], in axes of a heading [rad].

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
    a, b = factor * math.cos(heading), factor * math.sin(heading)
    out[0], out[1], out[2] = a * x + b * y, a * y - b * x, factor * z
    return True


def _turn_rotation(rotation, angle, out):
    """Write a rotation that is turned about the vertical by an angle [rad]."""
    cosine, sine = math.cos(angle), math.sin(angle)
    for k in range(3):
        x, y = rotation[0, k], rotation[1, k]
        out[0, k], out[1, k], out[2, k] = cosine * x - sine * y, sine * x + cosine * y, rotation[2, k]


def _write_covariances(errors, heading, arm, white, bias, pose, twist):
    """Write the covariances of a pose and of a twist; see `FilteredOdometry.write_covariance`.

    The errors are those of `ContactKalman`. The arm is that of the base, and `bias` the variance of the gyroscope's
    bias about z. The angular velocity errs by the gyroscope's variance `white` and by its biases.
    """
    cosine, sine = math.cos(heading), math.sin(heading)
    tilt = len(errors) - 4
    pose[:], twist[:] = 0.0, 0.0
    for i in range(4):
        a = i if i < 3 else 5
        for j in range(4):
            pose[a, j if j < 3 else 5] = errors[i, j]
        # what the tilt says too much is taken away
        x, y = -errors[i, tilt], -errors[i, tilt + 1]
        pose[a, 3], pose[a, 4] = cosine * x - sine * y, sine * x + cosine * y
        pose[3, a], pose[4, a] = pose[a, 3], pose[a, 4]
    xx, xy, yy = errors[tilt, tilt], errors[tilt, tilt + 1], errors[tilt + 1, tilt + 1]
    pose[3, 3] = cosine * cosine * xx - 2.0 * cosine * sine * xy + sine * sine * yy
    pose[4, 4] = sine * sine * xx + 2.0 * cosine * sine * xy + cosine * cosine * yy
    pose[3, 4] = cosine * sine * (xx - yy) + (cosine * cosine - sine * sine) * xy
    pose[4, 3] = pose[3, 4]
    xx, xy, yy = errors[tilt - 4, tilt - 4] + white, errors[tilt - 4, tilt - 3], errors[tilt - 3, tilt - 3] + white
    twist[3, 3], twist[3, 4], twist[4, 3], twist[4, 4], twist[5, 5] = xx, xy, xy, yy, bias + white
    for i in range(3):
        a, b = (0.0, -arm[2]) if i == 0 else (arm[2], 0.0) if i == 1 else (-arm[1], arm[0])
        for j in range(3):
            c, d = (0.0, -arm[2]) if j == 0 else (arm[2], 0.0) if j == 1 else (-arm[1], arm[0])
            twist[i, j] = errors[4 + i, 4 + j] + a * (xx * c + xy * d) + b * (xy * c + yy * d)


_F, _V, _M, _B = "float64", "float64[::1]", "float64[:, ::1]", "boolean[::1]"

turn_back = cached(f"void({_M}, {_V}, {_M}, {_F}, {_F}, {_M}, {_M})", _turn_back)
right = cached(f"void({_M}, {_M}, {_F}, {_F})", _right)
tell = cached(f"void({_M}, {_M}, {_M}, {_M}, {_V}, {_V}, {_M}, {_M})", _tell)
mean = cached(f"void({_M}, {_M}, {_F}, {_V}, {_B}, {_V}, {_M})", _mean)
agree = cached(f"void({_M}, {_M}, {_F}, {_V}, {_F}, {_B}, {_V}, {_M})", _agree)
contradict = cached(f"void({_M}, {_V}, {_F}, {_F}, {_F}, {_V}, {_V}, {_M})", _contradict)
learn = cached(f"void({_M}, {_V}, {_F}, {_M}, {_B}, {_F}, {_V})", _learn)
part_ways = cached(f"void({_M}, {_V}, {_F}, {_M}, {_V})", _part_ways)
slid = cached(f"boolean({_M}, {_V}, {_B}, {_V})", _slid)
plane = cached(f"boolean({_V}, {_M}, {_V})", _plane)
rises = cached(f"void({_M}, {_M}, {_V}, {_V}, {_V}, {_V}, {_F}, {_F}, {_V}, {_V}, {_B})", _rises)
move = cached(f"void({_M}, {_V}, {_V}, {_M}, {_V}, {_V})", _move)
turned = cached(f"boolean({_M}, {_M}, {_F}, {_V})", _turned)
turn_rotation = cached(f"void({_M}, {_F}, {_M})", _turn_rotation)
write_covariances = cached(f"void({_M}, {_F}, {_V}, {_F}, {_F}, {_M}, {_M})", _write_covariances)
