"""Bounds of joint accelerations, with the way that braking takes."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from solfer.numerics.bounds.acceleration import AccelerationBounds

PERIOD, END, FASTEST, BRAKING = 0.005, 1.0, 3.0, 20.0


def bounds(horizon=2.0 * PERIOD):
    one = np.ones(1)
    return AccelerationBounds(-END * one, END * one, FASTEST * one, braking=BRAKING, horizon=horizon)


@given(st.floats(-2.0, 2.0), st.floats(-10.0, 10.0))
def test_bounds_never_contradict_each_other(position, velocity):
    limits = bounds()
    limits.update(np.array([position]), np.array([velocity]))
    assert limits.lower[0] <= limits.upper[0]


@given(st.floats(-0.9, 0.9), st.sampled_from([1.0, -1.0]))
def test_a_joint_that_accelerates_as_it_may_stops_at_the_end(position, sign):
    limits, q, v, fastest = bounds(), np.array([position]), np.zeros(1), 0.0
    for _ in range(400):
        limits.update(q, v)
        a = limits.upper if sign > 0.0 else limits.lower
        q += v * PERIOD + 0.5 * a * PERIOD**2
        v += a * PERIOD
        fastest = max(fastest, abs(float(v[0])))
        assert abs(q[0]) < END + 2e-3
    assert fastest < FASTEST + 1e-9 and abs(sign * END - q[0]) < 1e-2


def test_a_joint_beyond_its_range_need_not_come_back():
    limits = bounds()
    limits.update(np.array([END + 0.1]), np.zeros(1))
    assert limits.upper[0] == 0.0 and limits.lower[0] < 0.0


def test_a_joint_that_is_too_fast_brakes_as_it_can():
    limits = bounds()
    limits.update(np.array([0.99]), np.array([2.9]))
    assert limits.upper[0] == -BRAKING


def test_what_has_no_limit_has_no_bound():
    free = np.full(2, np.inf)
    limits = AccelerationBounds(-free, free, free, braking=BRAKING, horizon=0.1)
    limits.update(np.array([1e3, 0.0]), np.array([5.0, -5.0]))
    assert (limits.lower == -np.inf).all() and (limits.upper == np.inf).all()
