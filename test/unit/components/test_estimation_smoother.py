"""The batch smoother of `benchmark/estimation.py`, and its normalised errors, against closed formulas."""

import numpy as np
import pytest
from support.estimation import part

batch, figures = part("estimation_cases.batch"), part("estimation_cases.figures")
ARMS = np.array(((0.5, 0.3), (0.5, -0.3), (-0.5, 0.3), (-0.5, -0.3)))
ERRORS = batch.Errors(1e-4, 5e-3, 1e-6, 2e-3)
PERIOD = 0.05


def driven(bias, radii, ratio=0.0, random=None):
    """Return the yaw rates of a drive of 40 s, straight on and on circles, its speeds, and what is measured of it."""
    random, deviation = random or np.random.default_rng(1), 1e-4
    rates, speeds = np.repeat((0.0, 0.0, 0.5, -0.4), 200), np.repeat((0.0, 0.3, 0.3, 0.2), 200)
    count = len(rates)
    across = np.stack((-ARMS[:, 1], ARMS[:, 0]), axis=1)
    ways = (rates[:, None, None] * across + np.stack((speeds, np.zeros(count)), axis=1)[:, None]) * PERIOD
    ways = (1.0 - radii)[None, :, None] * ways + ratio * deviation * random.standard_normal(ways.shape)
    white = ratio * ERRORS.noise * np.sqrt(PERIOD) * random.standard_normal(count)
    arms = np.broadcast_to(ARMS, (count, 4, 2))
    yaw = (rates + bias) * PERIOD + white
    deviations, still = np.full((count, 4), deviation), np.zeros(count)
    measured = batch.Intervals(
        np.full(count, PERIOD), yaw, ways, arms, deviations, rolled=speeds * PERIOD, missed=still
    )
    return rates, speeds, measured


def test_the_smoother_finds_an_analytic_way():
    """Arcs have closed formulas: with exact wheels, bias and radii that differ the end is found within 2 mm, 2 mrad."""
    radii = np.array((1e-3, -1e-3, 5e-4, -5e-4))
    rates, speeds, measured = driven(2e-3, radii)
    found = batch.estimate(measured, ERRORS)
    x, y, heading = 0.0, 0.0, 0.0
    for speed, rate in zip(speeds[::200], rates[::200], strict=True):
        turn = 200 * PERIOD * rate
        if rate:
            x += speed / rate * (np.sin(heading + turn) - np.sin(heading))
            y -= speed / rate * (np.cos(heading + turn) - np.cos(heading))
        else:
            x += speed * 200 * PERIOD * np.cos(heading)
            y += speed * 200 * PERIOD * np.sin(heading)
        heading += turn
    np.testing.assert_allclose(found.poses()[-1], (x, y, heading), atol=2e-3)
    np.testing.assert_allclose(found.bias, 2e-3, atol=2e-5)
    np.testing.assert_allclose(found.radii, radii, atol=1e-4)


def test_a_wheel_that_spins_hardly_counts():
    rates, _, measured = driven(0.0, np.zeros(4))
    measured.ways[300:320, 1, 0] += 0.03
    found = batch.estimate(measured, ERRORS)
    assert found.poses()[-1, 2] == pytest.approx(PERIOD * rates.sum(), abs=1e-3)


def test_normalised_errors_are_one_on_average():
    random = np.random.default_rng(5)
    factor = np.array(((2.0, 0.0, 0.0), (0.5, 0.1, 0.0), (-1.0, 0.3, 3.0)))
    drawn = [figures.normalised(factor @ random.standard_normal(3), factor @ factor.T) for _ in range(4000)]
    assert np.mean(drawn) == pytest.approx(1.0, abs=0.05)  # four standard deviations of the mean
