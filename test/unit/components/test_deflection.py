"""What joints give way, and where the base is, taken over slowly."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from solfer.components.inverse_kinematics.deflection import Deflection


@pytest.fixture
def deflection():
    return Deflection(8, 6, 0.99, 0.05)


def test_joints_are_taken_over_up_to_a_bound(deflection):
    measured, commanded = np.zeros(8), np.array((0.0,) * 6 + (-0.01, 1.0))
    for _ in range(100):
        deflection.update(measured, commanded, 0.01)
    assert deflection.value[6] == pytest.approx(0.01 * (1.0 - math.exp(-1.0)), rel=0.01)
    assert deflection.value[7] == -0.05 and not deflection.value[:6].any()
    assert_allclose(commanded[6:], (-0.01, 1.0))
    deflection.start(measured, np.array((0.3,) * 6 + (-0.02, 0.06)))
    assert deflection.value.tolist() == [0.0] * 6 + [0.02, -0.05]


def test_the_base_goes_to_what_is_measured(deflection):
    measured, commanded = np.arange(8.0), np.zeros(8)
    for _ in range(100):
        deflection.update(measured, commanded, 0.01)
    assert_allclose(commanded[:6], measured[:6] * (1.0 - 0.99**100))
    assert not commanded[6:].any()
