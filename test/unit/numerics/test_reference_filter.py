"""References that follow targets: limits, arrival, streams, wrong numbers."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from solfer.numerics.reference_filter import NOT_A_ROTATION, NOT_FINITE, TAKEN, ReferenceFilter

PERIOD = 0.005  # [s]
LIMITS = (0.5, 2.0, 1.0, 4.0)
GOAL = np.array((0.3, -0.4, 0.1, 0.0, 0.0, math.sin(0.6), math.cos(0.6)))


@pytest.fixture
def references():
    references = ReferenceFilter(2, PERIOD)
    references.limits[:] = LIMITS
    return references


def run(references, cycles):
    values, rates = [], []
    for _ in range(cycles):
        references.update()
        values.append(references.value[0].copy())
        rates.append(references.rate[0].copy())
    return np.array(values), np.array(rates)


def test_it_arrives_within_its_limits(references):
    assert references.aim(0, GOAL, 0) == TAKEN and not references.is_still(0)
    values, rates = run(references, 400)
    assert_allclose(values[-1], GOAL, atol=1e-9)
    assert references.is_still(0)
    for part, speed, acceleration in ((slice(0, 3), 0.5, 2.0), (slice(3, 6), 1.0, 4.0)):
        assert np.linalg.norm(rates[:, part], axis=1).max() == pytest.approx(speed)
        changes = np.linalg.norm(np.diff(rates[:, part], axis=0, prepend=0.0), axis=1) / PERIOD
        assert changes.max() <= acceleration * (1.0 + 1e-9)
    assert (np.diff(np.linalg.norm(values[:, :3] - GOAL[:3], axis=1)) <= 1e-12).all()
    assert_allclose(references.value[1], (0.0,) * 6 + (1.0,))


def test_without_acceleration_it_goes_in_steps(references):
    references.limits[0] = (2.0, np.inf, np.inf, np.inf)
    references.aim(0, np.array((0.0, -0.05, 0.1)), 0)
    values, _ = run(references, 12)
    steps = np.linalg.norm(np.diff(values[:, :3], axis=0, prepend=0.0), axis=1)
    assert_allclose(steps[:11], 0.01)
    assert_allclose(values[-1, :3], (0.0, -0.05, 0.1), atol=1e-15)


@pytest.mark.parametrize("every", [1, 2, 5])
def test_a_stream_is_followed_without_lag(references, every):
    distances = []
    for cycle in range(600):
        if cycle % every == 0:
            references.aim(0, place(cycle * PERIOD), 0, True)
        references.update()
        distances.append(np.linalg.norm(references.value[0, :3] - place((cycle + 1) * PERIOD)))
    assert max(distances[300:]) < 2e-4 * every
    end = place(599 // every * every * PERIOD)
    run(references, 400)
    assert_allclose(references.value[0, :3], end, atol=1e-9)


def place(time):
    return 0.1 * np.array((math.cos(time), math.sin(time), 0.0))


@pytest.mark.parametrize("stream_speed", [0.1, 0.3])
def test_after_a_start_it_goes_slowly_to_a_stream_until_they_meet(references, stream_speed):
    """Again after each start; a fast stream is met later, and what jumps once it was met is followed at full speed."""

    def follow(jump, cycles):
        speeds = []
        for _ in range(cycles):
            way[0] += stream_speed * PERIOD
            references.aim(0, np.array((way[0], jump, 0.0)), 0, True)
            references.update()
            speeds.append(np.linalg.norm(references.rate[0, :3]))
        return np.array(speeds), np.linalg.norm(references.value[0, :3] - (way[0] + stream_speed * PERIOD, jump, 0.0))

    for _ in range(2):
        way = [0.2]
        references.start(0, np.array((0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)))
        speeds, _ = follow(0.0, 100)
        assert speeds.max() < 0.16
        _, distance = follow(0.0, 2500)
        assert distance < 1e-3
    speeds, distance = follow(0.3, 1000)
    assert speeds.max() > 0.49 and distance < 1e-3


def test_slow_targets_are_no_stream(references):
    for target in ((0.1, 0.0, 0.0), (0.2, 0.0, 0.0)):
        references.aim(0, np.array(target), 0, True)
        values, _ = run(references, 100)
    assert values[:, 0].max() <= 0.2 + 1e-5


def test_it_halts_where_it_can(references):
    references.aim(0, GOAL, 0)
    run(references, 60)
    references.halt(0)
    _, rates = run(references, 200)
    assert np.linalg.norm(np.diff(rates[:, :3], axis=0), axis=1).max() <= 2.0 * PERIOD * (1.0 + 1e-9)
    assert references.is_still(0) and 0.01 < references.value[0, 0] < 0.25


@pytest.mark.parametrize(
    ("numbers", "first", "outcome"),
    [((np.nan, 0.0, 0.0), 0, NOT_FINITE), ((0.0,) * 4, 3, NOT_A_ROTATION), ((0.0,) * 6 + (2.0,), 0, NOT_A_ROTATION)],
)
def test_wrong_numbers_change_nothing(references, numbers, first, outcome):
    before = references.target.copy()
    assert references.aim(0, np.array(numbers), first) == outcome
    assert_allclose(references.target, before)
