"""Compiled steps of `Majority`, where arrays are described."""

import math

from solfer.numerics.compilation import cached, part

LIKELY = 4.0
"""Variances of what a gyroscope tells by which wheels may contradict it: two deviations."""

STEPS = 3
"""Steps to the estimator next to a motion of two wheels."""


@part
def _fit_motion(told, arms, shares, gyroscope, share):
    """Return velocity and turn that explain best what wheels tell of x and y by their shares, and the gyroscope."""
    total = x0 = y0 = u0 = v0 = across = spread = 0.0
    for i in range(len(told)):
        total += shares[i]
        x0 += shares[i] * arms[i, 0]
        y0 += shares[i] * arms[i, 1]
        u0 += shares[i] * told[i, 0]
        v0 += shares[i] * told[i, 1]
    x0, y0, u0, v0 = x0 / total, y0 / total, u0 / total, v0 / total
    for i in range(len(told)):
        x, y = arms[i, 0] - x0, arms[i, 1] - y0
        across += shares[i] * (x * (told[i, 1] - v0) - y * (told[i, 0] - u0))
        spread += shares[i] * (x * x + y * y)
    turn = (across + share * gyroscope) / (spread + share)
    return u0 + turn * y0, v0 - turn * x0, turn


@part
def _distances(told, arms, x, y, turn, far):
    """Write the squared distances of what wheels tell from a motion [m^2/s^2]."""
    for i in range(len(told)):
        far[i] = (told[i, 0] - x + turn * arms[i, 1]) ** 2 + (told[i, 1] - y - turn * arms[i, 0]) ** 2


def _disagree(speeds, arms, counted, gyroscope, unsure, keep, tolerance, steady, far, shares):
    """Write the squared distances of wheels from what most of them tell of x and y [m^2/s^2].

    What each tells goes through a low-pass filter that keeps a share of what it has, and so does what the gyroscope
    tells of the turn, in the last row. Of all pairs of wheels, the motion of that one is taken which leaves the least
    sum of logarithms of distances in proportion to a tolerance [m^2/s^2], and of how far the gyroscope is from it in
    proportion to how unsure it is [rad^2/s^2]; then three steps to the Cauchy estimator next to it. Returns by how much
    the turn of the wheels alone contradicts the gyroscope beyond that [rad^2/s^2].
    """
    count, least, best_x, best_y, best_turn = len(far), math.inf, 0.0, 0.0, 0.0
    for i in range(count):
        steady[i, 0] = keep * steady[i, 0] + (1.0 - keep) * speeds[i, 0]
        steady[i, 1] = keep * steady[i, 1] + (1.0 - keep) * speeds[i, 1]
    steady[count, 0] = keep * steady[count, 0] + (1.0 - keep) * gyroscope
    told, gyroscope = steady[:count], steady[count, 0]
    for one in range(count):
        for other in range(one):
            if counted[one] and counted[other]:
                for i in range(count):
                    shares[i] = 1.0 * (i == one or i == other) / tolerance
                x, y, turn = _fit_motion(told, arms, shares, gyroscope, 1.0 / unsure)
                _distances(told, arms, x, y, turn, far)
                cost = math.log(1.0 + (turn - gyroscope) ** 2 / unsure)
                for i in range(count):
                    cost += counted[i] * math.log(1.0 + far[i] / tolerance)
                if cost < least:
                    least, best_x, best_y, best_turn = cost, x, y, turn
    if least == math.inf:
        far[:] = 0.0
        return 0.0
    for _ in range(STEPS):
        _distances(told, arms, best_x, best_y, best_turn, far)
        for i in range(count):
            shares[i] = counted[i] / (tolerance + far[i])
        share = 1.0 / (unsure + (best_turn - gyroscope) ** 2)
        best_x, best_y, best_turn = _fit_motion(told, arms, shares, gyroscope, share)
    _distances(told, arms, best_x, best_y, best_turn, far)
    total = 0.0
    for i in range(count):
        total += shares[i]
    spread_x, spread_y, spread = 0.0, 0.0, 0.0
    for i in range(count):
        shares[i] /= total
        spread_x += shares[i] * arms[i, 0]
        spread_y += shares[i] * arms[i, 1]
        spread += shares[i] * (arms[i, 0] ** 2 + arms[i, 1] ** 2)
    if spread - spread_x**2 - spread_y**2 < 1e-6:
        return 0.0
    return max(0.0, (_fit_motion(told, arms, shares, gyroscope, 0.0)[2] - gyroscope) ** 2 - LIKELY * unsure)


_F, _V, _M, _B = "float64", "float64[::1]", "float64[:, ::1]", "boolean[::1]"

disagree = cached(f"float64({_M}, {_M}, {_B}, {_F}, {_F}, {_F}, {_F}, {_M}, {_V}, {_V})", _disagree)
