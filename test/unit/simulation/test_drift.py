"""White noise by its density and biases that wander, by their Allan deviation."""

import numpy as np
import pytest

from solfer.simulation.sensors.drift import Drift

RATE, SAMPLES = 500.0, 100_000  # [Hz]


def record(drift, samples=SAMPLES, rate=RATE):
    """Return what a sensor at rest measures, shape (samples, axes)."""
    values = np.zeros((samples, len(drift.bias)))
    for sample in values:
        drift.wander(1.0 / rate)
        drift.add(sample, 1.0 / rate)
    return values


def allan_deviation(values, time, rate=RATE):
    """Compute the overlapping Allan deviation over a time [s], of all axes together."""
    count = round(time * rate)
    sums = np.cumsum(np.vstack((np.zeros(values.shape[1]), values)), axis=0) / rate
    second = sums[2 * count :] - 2.0 * sums[count:-count] + sums[: -2 * count]
    return np.sqrt(0.5 * np.mean(second**2)) / time


@pytest.mark.slow
def test_white_noise_has_its_density():
    values = record(Drift(3, "gyroscope", 2e-4, 0.0, 0.0))
    assert values.std() == pytest.approx(2e-4 * np.sqrt(RATE), rel=0.01)
    for time in (0.02, 0.2, 1.0):
        assert allan_deviation(values, time) == pytest.approx(2e-4 / np.sqrt(time), rel=0.08)


def test_the_density_is_equal_at_all_rates():
    slow = record(Drift(3, "gyroscope", 2e-4, 0.0, 0.0), 20_000, 100.0)
    assert allan_deviation(slow, 1.0, 100.0) == pytest.approx(2e-4, rel=0.1)


def test_a_bias_walks():
    values = record(Drift(4, "gyroscope", 0.0, 0.0, 1e-3, axes=20), 20_000)
    for time in (0.2, 1.0):
        assert allan_deviation(values, time) == pytest.approx(1e-3 * np.sqrt(time / 3.0), rel=0.12)


def test_a_bias_is_there_from_the_start():
    drift = Drift(5, "accelerometer", 0.0, 0.02, 0.0, axes=2000)
    assert drift.bias.std() == pytest.approx(0.02, rel=0.05)
    np.testing.assert_array_equal(record(drift, 2), [drift.bias, drift.bias])


def test_a_restart_repeats_and_seeds_differ():
    drift = Drift(6, "gyroscope", 1e-3, 0.1, 1e-2)
    first = record(drift, 20)
    drift.restart()
    np.testing.assert_array_equal(record(drift, 20), first)
    drift.restart(7)
    assert (record(drift, 20) != first).all()
    np.testing.assert_array_equal(record(Drift(7, "gyroscope", 1e-3, 0.1, 1e-2), 20), _again(drift))
    assert (record(Drift(6, "accelerometer", 1e-3, 0.1, 1e-2), 20) != first).all()


def _again(drift):
    drift.restart(7)
    return record(drift, 20)


def test_nothing_configured_changes_nothing():
    assert not record(Drift(6, "gyroscope", 0.0, 0.0, 0.0), 3).any()
