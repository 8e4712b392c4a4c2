"""The low-pass filter of pipes, against SciPy's signal processing."""

import math
import tracemalloc

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import signal

from solfer.errors import ConfigError
from solfer.numerics.filters import LowPass

CASES = [(1.0, 1.0, 200.0), (20.0, 0.7, 200.0), (99.9, 1.0, 200.0), (200.0, 4.0, 500.0), (0.01, 0.5, 1000.0)]
"""Cut-off [Hz], damping ratio, rate [Hz]; one just below half of the rate, where nothing may ring or blow up."""


def reference(frequency, damping, rate):
    """Compute coefficients by SciPy: the continuous filter at the bent frequency, made discrete."""
    bent = 2.0 * rate * math.tan(math.pi * frequency / rate)
    return signal.bilinear([bent**2], [1.0, 2.0 * damping * bent, bent**2], rate)


@pytest.mark.parametrize("case", CASES)
def test_coefficients_are_those_of_scipy(case):
    low_pass = LowPass(1, *case)
    numerator, denominator = reference(*case)
    assert_allclose(low_pass.numerator, numerator, rtol=1e-9)
    assert_allclose(low_pass.denominator, denominator, rtol=1e-9)


@pytest.mark.parametrize("case", CASES)
def test_output_is_that_of_scipy(case):
    inputs = np.random.default_rng(5).standard_normal((300, 3)) + (0.0, 10.0, -3.0)
    numerator, denominator = reference(*case)
    start = signal.lfilter_zi(numerator, denominator)[:, None] * inputs[0]
    expected, _ = signal.lfilter(numerator, denominator, inputs, axis=0, zi=start)
    low_pass, filtered = LowPass(3, *case), inputs.copy()
    for row in filtered:
        low_pass.step(row)
    assert_allclose(filtered, expected, atol=1e-8)


@pytest.mark.parametrize(("frequency", "damping", "rate"), CASES)
def test_gain_is_that_of_the_continuous_filter(frequency, damping, rate):
    low_pass = LowPass(1, frequency, damping, rate)
    _, response = signal.freqz(low_pass.numerator, low_pass.denominator, worN=[0.0, frequency], fs=rate)
    assert_allclose(abs(response), (1.0, 0.5 / damping), rtol=1e-6)


def test_a_reset_filter_passes_the_next_value():
    low_pass, values = LowPass(2, 5.0, 1.0, 200.0), np.array([1.0, -1.0])
    low_pass.step(values)
    assert_allclose(values, (1.0, -1.0), atol=1e-15)
    low_pass.reset()
    values[:] = (7.0, 8.0)
    low_pass.step(values)
    assert_allclose(values, (7.0, 8.0), atol=1e-14)


def test_what_is_not_finite_passes_and_poisons_nothing():
    low_pass, values = LowPass(2, 5.0, 1.0, 200.0), np.array([1.0, math.nan])
    low_pass.step(values)
    assert values[0] == 1.0 and math.isnan(values[1])
    values[:] = (3.0, 4.0)
    low_pass.step(values)
    assert_allclose(values, (3.0, 4.0), atol=1e-14)


@pytest.mark.parametrize("frequency", [100.0, 500.0, 0.0, -1.0, math.nan])
def test_a_cut_off_beyond_half_rate_is_refused(frequency):
    with pytest.raises(ConfigError, match="below half of the rate, 100 Hz") as caught:
        LowPass(1, frequency, 1.0, 200.0, "main.yaml:3:5")
    assert caught.value.where == "main.yaml:3:5"


def test_a_filter_without_damping_is_refused():
    with pytest.raises(ConfigError, match="a damping ratio of 0"):
        LowPass(1, 10.0, 0.0, 200.0)


def test_steps_keep_no_memory():
    low_pass, values = LowPass(48, 20.0, 1.0, 200.0), np.ones(48)
    low_pass.step(values)
    tracemalloc.start()
    try:
        before = tracemalloc.get_traced_memory()[0]
        tracemalloc.reset_peak()
        for _ in range(200):
            low_pass.step(values)
        after, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert after - before < 512 and peak - before < 2048


@pytest.mark.parametrize("ratio", [0.0, 0.3, 0.7, 1.0])
def test_means_of_two_filters_are_stable_with_unit_gain(ratio):
    """Poles within the unit circle, and the gain at zero frequency, as SciPy sees them."""
    slow, fast = LowPass(1, 2.0, 0.3, 200.0), LowPass(1, 80.0, 5.0, 200.0)
    mixed = LowPass(1, 2.0, 0.3, 200.0)
    mixed.factors[:] = (1.0 - ratio) * slow.factors + ratio * fast.factors
    numerator, denominator = mixed.factors[:3], (1.0, *mixed.factors[3:])
    assert np.abs(np.roots(denominator)).max() < 1.0
    assert np.sum(numerator) / np.sum(denominator) == pytest.approx(1.0, abs=1e-12)
