"""The maximum a posteriori estimate of a whole way, by what wheels and a gyroscope measure of its intervals."""

from typing import NamedTuple

import numpy as np
from scipy import sparse

SCRUB_TIME, SCRUB_SHARE = 8.0, 4.5e-3
"""Time for which wheels scrub alike [s], and the yaw rate of it for the speed at which they roll [rad/m]: by the true
motion of `lap` 1 and `drawn_lap` 9001, of which `odometry` assumes 1 s and 5e-4."""
CAUCHY = 3.0
"""Standard deviations of a wheel's way from which on it counts less."""
ITERATIONS = 8
YAW, WAY, BIAS, SCRUB, STATES = 0, 1, 3, 4, 5
"""Indices of the unknowns of an interval, and their number."""


class Errors(NamedTuple):
    """Deviations that are stated of the sensors.

    Attributes:
        noise: Density of the gyroscope's white noise [rad/s/sqrt(Hz)].
        bias: Of its bias at the start [rad/s].
        walk: Random walk of that [rad/s/sqrt(s)].
        radius: Of the ratio by which each radius is too large; 0: radii are as they are believed.
    """

    noise: float
    bias: float
    walk: float
    radius: float


class Intervals(NamedTuple):
    """What is measured within K intervals, in the heading frame in the middle of each.

    Attributes:
        time: Lengths, shape (K,) [s].
        yaw: Turns by the gyroscope, with its bias, shape (K,) [rad].
        ways: Ways of the base by each wheel, as if it did not turn, shape (K, 4, 2) [m].
        arms: From the base to each contact, shape (K, 4, 2) [m].
        deviations: Of the ways, shape (K, 4) [m]; infinite: the wheel does not count.
        rolled: How far wheels roll or steer, by which they scrub, shape (K,) [m].
        missed: Variances of what the gyroscope misses between its samples, shape (K,) [rad^2].
    """

    time: np.ndarray
    yaw: np.ndarray
    ways: np.ndarray
    arms: np.ndarray
    deviations: np.ndarray
    rolled: np.ndarray
    missed: np.ndarray


class Estimate(NamedTuple):
    """What is estimated.

    Attributes:
        yaw: Turns, shape (K,) [rad].
        ways: Ways, shape (K, 2) [m].
        bias: Bias of the gyroscope, shape (K,) [rad/s].
        radii: Ratios by which radii are too large, shape (4,).
    """

    yaw: np.ndarray
    ways: np.ndarray
    bias: np.ndarray
    radii: np.ndarray

    def poses(self) -> np.ndarray:
        """Return x, y and heading at the ends of all intervals, from zero, shape (K + 1, 3) [m, rad]."""
        heading = np.concatenate(([0.0], np.cumsum(self.yaw)))
        middle = heading[:-1] + 0.5 * self.yaw
        cosine, sine = np.cos(middle), np.sin(middle)
        steps = np.stack((cosine * self.ways[:, 0] - sine * self.ways[:, 1],
                          sine * self.ways[:, 0] + cosine * self.ways[:, 1]), axis=1)  # fmt: skip
        return np.column_stack((np.vstack((np.zeros(2), np.cumsum(steps, axis=0))), heading))


def estimate(measured: Intervals, errors: Errors) -> Estimate:
    """Find turns, ways, biases and radii of the largest probability, given all that is measured.

    In the interval j of the length T the base turns by y and goes by d, and with the bias b, scrubbing c, and the ratio
    e by which the radius of a wheel at r is too large, are measured

        gyroscope     u_j  = y_j + b_j T + n,                            n ~ N(0, noise^2 T + missed_j)
        wheel i       w_ij = (1 - e_i) (d_j + (y_j + c_j T) z x r_ij) + m,   m ~ N(0, deviation_ij^2)

    where b is a random walk, c a Gauss-Markov process in proportion to the speed, and the e_i are constant, each with
    its prior. The negative logarithm of the posterior is half of a sum of squares, which Gauss-Newton minimises: its
    normal equations are a band of five unknowns an interval, bordered by the radii. Wheels that contradict have the
    density of Cauchy: their squares are weighted by 1 / (1 + s / 9), s the square of their normalised residual.

    Position and heading are sums of d and y from a place that is given, and nothing else measures them: the orientation
    of the IMU has its heading from the same gyroscope. The Jacobian of these sums is 1, so that the poses of this
    estimate are those of the largest probability too.

    Source: F. Dellaert and M. Kaess, "Factor Graphs for Robot Perception", Foundations and Trends in Robotics 6, 2017.
    """
    count = len(measured.time)
    unknowns = np.zeros(STATES * count + 4)
    states, radii = unknowns[: STATES * count].reshape(count, STATES), unknowns[-4:]
    states[:, YAW] = measured.yaw
    usable = np.isfinite(measured.deviations)
    states[:, WAY:BIAS] = (usable[..., None] * measured.ways).sum(axis=1) / np.maximum(usable.sum(axis=1), 1)[:, None]
    chains, robust = _chains(measured, errors), np.ones((count, 4))
    for _ in range(ITERATIONS):
        jacobian, residuals = _wheels(measured, states, radii)
        weights = np.where(usable, robust / measured.deviations**2, 0.0)
        weights = np.repeat(weights.ravel(), 2)
        # in units of the deviations of the first step, so that all pivots are alike
        normal = chains.T @ chains + jacobian.T @ sparse.diags_array(weights) @ jacobian
        right = chains.T @ (_measured_by_chains(measured, errors) - chains @ unknowns)
        right += jacobian.T @ (weights * residuals.ravel())
        scale = 1.0 / np.sqrt(normal.diagonal())
        scaling = sparse.diags_array(scale)
        solver = sparse.linalg.splu((scaling @ normal @ scaling).tocsc(), permc_spec="MMD_AT_PLUS_A")
        unknowns += scale * solver.solve(scale * right)
        left = _wheels(measured, states, radii)[1]
        square = np.sum(left**2, axis=2) / measured.deviations**2
        robust = 1.0 / (1.0 + square / CAUCHY**2)
    return Estimate(states[:, YAW], states[:, WAY:BIAS], states[:, BIAS], radii.copy())


def _wheels(measured: Intervals, states: np.ndarray, radii: np.ndarray) -> tuple[sparse.csr_array, np.ndarray]:
    """Return the Jacobian of the ways of all wheels, shape (8K, 5K + 4), and what is left of them, (K, 4, 2) [m]."""
    count = len(measured.time)
    across = np.stack((-measured.arms[..., 1], measured.arms[..., 0]), axis=2)
    turned = states[:, YAW] + measured.time * states[:, SCRUB]
    way = states[:, None, WAY:BIAS] + turned[:, None, None] * across
    grown = (1.0 - radii)[None, :, None]
    rows = np.arange(8 * count).reshape(count, 4, 2)
    first = np.broadcast_to(STATES * np.arange(count)[:, None, None], rows.shape)
    wheel = np.broadcast_to(STATES * count + np.arange(4)[None, :, None], rows.shape)
    ones = np.broadcast_to(grown, rows.shape)
    entries = (
        (first + YAW, grown * across),
        (first + WAY + np.arange(2), ones),
        (first + SCRUB, grown * across * measured.time[:, None, None]),
        (wheel, -way),
    )
    values = np.concatenate([value.ravel() for _, value in entries])
    columns = np.concatenate([column.ravel() for column, _ in entries])
    shape = (8 * count, STATES * count + 4)
    jacobian = sparse.csr_array((values, (np.tile(rows.ravel(), len(entries)), columns)), shape=shape)
    return jacobian, measured.ways - grown * way


def _chains(measured: Intervals, errors: Errors) -> sparse.csr_array:
    """Return the rows of gyroscope, bias, scrubbing and radii, each by its deviation."""
    count = len(measured.time)
    first = STATES * np.arange(count)
    root = np.sqrt(measured.time)
    gyroscope = 1.0 / _gyroscope(measured, errors)
    walk = np.append(1.0 / errors.bias, 1.0 / (errors.walk * root[:-1]))
    keep = np.exp(-measured.time[:-1] / SCRUB_TIME)
    # at rest wheels scrub by a tenth of a millimetre in a minute at most
    deviation = np.maximum(SCRUB_SHARE * measured.rolled / measured.time, 1e-6)
    scrub = 1.0 / (deviation * np.sqrt(1.0 - np.append(0.0, keep) ** 2))
    rows = np.arange(count)
    entries = (
        (rows, first + YAW, gyroscope),
        (rows, first + BIAS, gyroscope * measured.time),
        (count + rows, first + BIAS, walk),
        (count + rows[1:], first[:-1] + BIAS, -walk[1:]),
        (2 * count + rows, first + SCRUB, scrub),
        (2 * count + rows[1:], first[:-1] + SCRUB, -keep * scrub[1:]),
        (3 * count + np.arange(4), STATES * count + np.arange(4), np.full(4, 1.0 / max(errors.radius, 1e-9))),
    )
    row, column, value = (np.concatenate(parts) for parts in zip(*entries, strict=True))
    return sparse.csr_array((value, (row, column)), shape=(3 * count + 4, STATES * count + 4))


def _measured_by_chains(measured: Intervals, errors: Errors) -> np.ndarray:
    """Return what these rows measure: the gyroscope's turns, and zeros."""
    gyroscope = measured.yaw / _gyroscope(measured, errors)
    return np.concatenate((gyroscope, np.zeros(2 * len(gyroscope) + 4)))


def _gyroscope(measured: Intervals, errors: Errors) -> np.ndarray:
    """Return the deviations of the turns that the gyroscope measures, shape (K,) [rad]."""
    return np.sqrt(errors.noise**2 * measured.time + measured.missed)
