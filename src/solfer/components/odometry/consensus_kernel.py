"""Compiled steps of `WheelConsensus`, where arrays are described."""

import math

from solfer.numerics.blocks import BlockLayout
from solfer.numerics.compilation import cached, part

CONSENSUS = BlockLayout(
    "Consensus",
    count=int,  # number of wheels
    inliers=(bool, "count"),
    distances=(float, "count"),
    # smoothed velocities of the wheels, and the yaw rate below them: to reject wheels, and to compare them
    recent=(float, "count + 1", 3),
    speeds=(float, "count + 1", 2),
    weights=(float, "count"),
    mean=(float, 3),
)
"""What `reject` and `estimate` keep."""

_consensus_at = CONSENSUS.at


@part
def fit_twist(speeds, arms, weights, rate, weight):
    """Return velocity and yaw rate of the weighted least squares of wheels (x and y) and of a measured rate."""
    total = x0 = y0 = u0 = v0 = across = spread = 0.0
    for i in range(len(speeds)):
        total += weights[i]
        x0 += weights[i] * arms[i, 0]
        y0 += weights[i] * arms[i, 1]
        u0 += weights[i] * speeds[i, 0]
        v0 += weights[i] * speeds[i, 1]
    x0 = x0 / total
    y0 = y0 / total
    u0 = u0 / total
    v0 = v0 / total
    for i in range(len(speeds)):
        x = arms[i, 0] - x0
        y = arms[i, 1] - y0
        across += weights[i] * (x * (speeds[i, 1] - v0) - y * (speeds[i, 0] - u0))
        spread += weights[i] * (x * x + y * y)
    yaw_rate = (across + weight * rate) / max(spread + weight, 1e-12)
    return u0 + yaw_rate * y0, v0 - yaw_rate * x0, yaw_rate, spread / total


@part
def write_distances(speeds, arms, twist, distances):
    """Write the squared distance of each wheel from a twist [m^2/s^2]."""
    x = twist[0]
    y = twist[1]
    yaw_rate = twist[2]
    for i in range(len(speeds)):
        u = speeds[i, 0] - x + yaw_rate * arms[i, 1]
        v = speeds[i, 1] - y - yaw_rate * arms[i, 0]
        distances[i] = u * u + v * v


@part
def best_pair(speeds, arms, inliers, rate, variance, tolerance, distances, weights):
    """Return the twist of the pair of wheels with the least Cauchy cost over all, and that cost."""
    count = len(distances)
    lowest_cost = math.inf
    best = (0.0, 0.0, 0.0, 0.0)
    for one in range(count):
        for other in range(one):
            if not (inliers[one] and inliers[other]):
                continue
            for i in range(count):
                weights[i] = 1.0 / tolerance if i == one or i == other else 0.0
            twist = fit_twist(speeds, arms, weights, rate, 1.0 / variance)
            write_distances(speeds, arms, twist, distances)
            cost = math.log(1.0 + (twist[2] - rate) ** 2 / variance)
            for i in range(count):
                if inliers[i]:
                    cost += math.log(1.0 + distances[i] / tolerance)
            if cost < lowest_cost:
                lowest_cost = cost
                best = twist
    return lowest_cost, best


def _estimate(start, speeds, arms, rate, variance, keep, tolerance, variances):
    """Smooth speeds and rate, and write distances and weights of the Cauchy estimate; see `WheelConsensus.compare`."""
    block = _consensus_at(start)
    inliers = block.inliers
    distances = block.distances
    weights = block.weights
    smoothed = block.speeds
    count = block.count
    for i in range(count):
        for axis in range(2):
            smoothed[i, axis] = keep * smoothed[i, axis] + (1.0 - keep) * speeds[i, axis]
    smoothed[count, 0] = keep * smoothed[count, 0] + (1.0 - keep) * rate
    wheels = smoothed[:count]
    rate = smoothed[count, 0]
    cost, twist = best_pair(wheels, arms, inliers, rate, variance, tolerance, distances, weights)
    if cost == math.inf:
        distances[:] = 0.0
        return 0.0
    for _ in range(3):  # reweighting
        write_distances(wheels, arms, twist, distances)
        for i in range(count):
            weights[i] = inliers[i] / (tolerance + distances[i])
        twist = fit_twist(wheels, arms, weights, rate, 1.0 / (variance + (twist[2] - rate) ** 2))
    write_distances(wheels, arms, twist, distances)
    for i in range(count):
        # bounded: where all wheels slide, they still are all that measures the base's displacement
        variances[i] *= min((1.0 + distances[i] / tolerance) ** 2, 1e4)
    alone = fit_twist(wheels, arms, weights, rate, 0.0)
    if alone[3] < 1e-6:  # wheels above each other measure no yaw rate
        return 0.0
    return max(0.0, (alone[2] - rate) ** 2 - 4.0 * variance)  # two standard deviations are likely


@part
def mean_speed(speeds, arms, rate, weights, inliers, mean):
    """Write the weighted mean of what inliers measure of the base's velocity; return the sum of their weights."""
    total = 0.0
    mean[:] = 0.0
    for i in range(len(arms)):
        if inliers[i]:
            total += weights[i]
            mean[0] += weights[i] * (speeds[i, 0] + rate * arms[i, 1])
            mean[1] += weights[i] * (speeds[i, 1] - rate * arms[i, 0])
            mean[2] += weights[i] * speeds[i, 2]
    for axis in range(3):
        mean[axis] /= total
    return total


def _reject(start, speeds, arms, rate, weights, tolerance, keep):
    """Smooth speeds and rate, and leave out the worst wheel while it is too far from the others; two stay."""
    block = _consensus_at(start)
    inliers = block.inliers
    mean = block.mean
    smoothed = block.recent
    left = 0
    count = block.count
    smoothed[count, 0] = keep * smoothed[count, 0] + (1.0 - keep) * rate
    rate = smoothed[count, 0]
    for i in range(count):
        for axis in range(3):
            smoothed[i, axis] = keep * smoothed[i, axis] + (1.0 - keep) * speeds[i, axis]
        inliers[i] = weights[i] > 0.0
        left += inliers[i]
    total = mean_speed(smoothed, arms, rate, weights, inliers, mean)
    while left > 2:
        worst = -1
        largest = tolerance * tolerance
        for i in range(count):
            if not inliers[i]:
                continue
            x = smoothed[i, 0] + rate * arms[i, 1] - mean[0]
            y = smoothed[i, 1] - rate * arms[i, 0] - mean[1]
            z = smoothed[i, 2] - mean[2]
            others = total / max(total - weights[i], 1e-12)  # the wheel itself is in the mean
            square = (x * x + y * y + z * z) * others * others
            if square > largest:
                worst = i
                largest = square
        if worst < 0:
            break
        inliers[worst] = False
        left -= 1
        total = mean_speed(smoothed, arms, rate, weights, inliers, mean)


def _yaw(displacements, arms, weights):
    """Return the yaw that wheels measure [rad], and the mean square of their distances from their middle [m^2]."""
    _, _, yaw, spread = fit_twist(displacements, arms, weights, 0.0, 0.0)
    return yaw, spread


_F = "float64"
_V = "float64[::1]"
_M = "float64[:, ::1]"

estimate = cached(f"float64(int64, {_M}, {_M}, {_F}, {_F}, {_F}, {_F}, {_V})", _estimate)
reject = cached(f"void(int64, {_M}, {_M}, {_F}, {_V}, {_F}, {_F})", _reject)
yaw = cached(f"UniTuple(float64, 2)({_M}, {_M}, {_V})", _yaw)
