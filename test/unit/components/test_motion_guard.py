"""What holds motions of `wheeled_motion`, whatever they are: the support polygon, tilted wheels, straight legs."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.testing import assert_allclose

from solfer.components.wheeled_motion.support import MotionGuard, SupportPolygon, TaskRates

PERIOD, LEAST = 0.005, 0.04  # [s], [m]
WHEELS = ("wheel_1", "wheel_2", "wheel_3", "wheel_4")
CORNERS = np.array([(0.4, 0.3), (0.4, -0.3), (-0.4, 0.3), (-0.4, -0.3)])
ROUND = (0, 2, 3, 1)  # counterclockwise
ROWS = {"BASE": slice(0, 6), "CONTACT_POINTS": slice(6, 18), "CAMBER": slice(18, 22), "CASTER": slice(22, 26)}
LEGS, TURNING = {"hip": 10, "knee": 11}, np.array([12])
LIMITS = [
    ("vertex of '{}'", 0.02, " m off", 6),
    ("camber of '{}'", 0.5, " rad off", 18),
    ("caster of '{}'", 0.5, " rad off", 22),
]

places = arrays(float, (5, 2), elements=st.floats(-0.06, 0.06))
motions = arrays(float, 10, elements=st.floats(-0.08, 0.08))
ways = arrays(float, 26, elements=st.floats(-1.0, 1.0)).filter(lambda way: np.linalg.norm(way) > 0.1)


class GuardedPlaces:
    """A guard of places that move freely in the plane: four vertices and the centre of mass, then three joints."""

    def __init__(self, shifts=0.0, center=(0.0, 0.0)):
        self.places = np.vstack((CORNERS, center)) + shifts
        self.velocity, self.lifted = np.zeros(13), np.zeros(4, dtype=bool)
        self.rates = TaskRates(ROWS, np.zeros((26, 13)), *np.zeros((4, 26)))
        self._points = [SimpleNamespace(value=np.zeros(3), jacobian=np.zeros((3, 13))) for _ in range(5)]
        for index, point in enumerate(self._points):
            point.jacobian[(0, 1), (2 * index, 2 * index + 1)] = 1.0
        self.polygon = SupportPolygon(self._points[:4], self._points[4], LEAST)
        self.guard = MotionGuard(
            self.polygon, self.lifted, WHEELS, self.rates, LEGS, turning=TURNING, velocity=self.velocity
        )

    def update(self, pace=1.0, is_bound=False):
        for point, place in zip(self._points, self.places, strict=True):
            point.value[:2] = place
        return self.guard.update(pace, is_bound, PERIOD)


def margins(places, lifted=()):
    """Return the distances of the last place from the edges of the polygon of the others, to the inside."""
    order = [index for index in ROUND if index not in lifted]
    edges = zip(order, [*order[1:], order[0]], strict=True)
    return np.array([inside(places[-1] - places[a], places[b] - places[a]) for a, b in edges])


def inside(way, edge):
    """Return how far a way leads to the left of an edge."""
    return (edge[0] * way[1] - edge[1] * way[0]) / math.hypot(*edge)


@pytest.mark.slow
@given(places, motions, arrays(float, 2, elements=st.floats(-0.35, 0.35)), st.sampled_from([(), (0,), (3,)]))
def test_velocities_leave_the_margin(shifts, motion, center, lifted):
    """Velocities are shortened to what uses up the margin in 0.25 s; rates are differences of the distances."""
    bench, tiny = GuardedPlaces(shifts, center), 1e-7
    bench.lifted[list(lifted)] = True
    bench.velocity[:10] = motion
    bench.update()
    before = margins(bench.places, lifted)
    rates = (margins(bench.places + tiny * motion.reshape(5, 2), lifted) - before) / tiny
    assert bench.guard.margin == pytest.approx(before.min(), abs=1e-12)
    left, is_near = before - LEAST, before - LEAST < 0.1
    assume(not ((left < 1e-4) & (abs(rates) < 1e-5)).any())  # along an edge beyond which the margin is used up
    used = np.where(is_near & (rates < -1e-5), -0.25 * rates, 0.0)  # of each edge, if nothing is shortened
    expected = min([1.0, *(max(space, 0.0) / way for space, way in zip(left, used, strict=True) if way > 0.0)])
    assert_allclose(bench.velocity[:10], expected * motion, atol=1e-6)


@pytest.mark.slow
@given(places, motions)
def test_no_commanded_motion_uses_up_the_margin(shifts, motion):
    bench = GuardedPlaces(shifts)
    bench.rates.forward[:] = 1.0
    for _ in range(600):
        bench.velocity[:10] = np.concatenate((0.3 * motion[:8], 2.5 * motion[8:]))
        is_held = bench.update()
        bench.places += PERIOD * bench.velocity[:10].reshape(5, 2)
        if is_held:
            assert "m inside the support polygon" in bench.guard.why
    assert margins(bench.places).min() >= LEAST - 1e-4


@pytest.mark.slow
@given(st.sampled_from(LIMITS), st.integers(0, 3), st.floats(0.5, 2.0), st.sampled_from([-1.0, 1.0]), ways)
def test_an_error_beyond_its_bound_is_named(limit, wheel, share, sign, forward):
    name, most, unit, row = limit
    bench = GuardedPlaces()
    bench.rates.forward[:] = forward
    bench.rates.error[row + wheel] = sign * share * most
    is_held = bench.update()
    assert is_held == (share > 1.0)
    assert bench.guard.why == (f"{name.format(WHEELS[wheel])} is {share * most:.2f}{unit}" if is_held else "")


forwards = st.just(0.0) | st.floats(1e-3, 0.1)


@given(
    st.floats(0.0, 3.0),
    st.floats(0.0, 8.0),
    st.floats(0.0, 1.0),
    forwards,
    st.floats(0.0, 0.1),
    st.sampled_from([-1.0, 1.0]),
)
def test_legs_that_are_nearly_straight_are_named(speed, turning, pace, forward, away, sign):
    """Errors that go away move joints, too: after a stall they are large, and no leg is straight."""
    bench = GuardedPlaces()
    bench.rates.forward[0] = forward
    bench.rates.away[1] = away
    bench.velocity[10:] = 0.5 * speed, sign * speed, -sign * turning
    is_straight = speed > max(0.5, 25.0 * math.hypot(pace * forward, away), 0.25 * turning)
    assert bench.update(pace) == (is_straight and forward > 0.0)
    assert bench.guard.why == ("joint 'knee' is near a singularity" if is_straight and forward > 0.0 else "")


@pytest.mark.slow
@given(ways, ways)
def test_other_ways_are_free(held, other):
    """What is held one way goes on along others, more than 60 degrees away, unless these are worse by a tenth."""
    cosine = held @ other / np.linalg.norm(held) / np.linalg.norm(other)
    for share, is_worse in ((1.05, False), (1.15, True)):
        bench = GuardedPlaces()
        bench.rates.forward[:] = held
        bench.rates.error[18] = 0.5 * 1.2
        assert bench.update()
        bench.rates.error[18] = 0.0
        bench.rates.error[19] = 0.5 * 1.2 * share
        bench.rates.forward[:] = other
        assert bench.update() == (is_worse or cosine >= 0.5)


@pytest.mark.slow
@given(ways, st.integers(1, 150))
def test_a_motion_is_tried_again(forward, gone):
    """It is held for 1 s after its reason has gone, and as long as the reason is there."""
    bench = GuardedPlaces()
    bench.rates.forward[:] = forward
    bench.rates.error[22] = 0.6
    assert all(bench.update() for _ in range(gone + 200))
    bench.rates.error[22] = 0.0
    held = [bench.update() for _ in range(210)]
    assert all(held[:199]) and not any(held[202:])
    assert bench.guard.why == ""


@pytest.mark.slow
@given(
    arrays(float, 18, elements=st.floats(-1.0, 1.0)),
    arrays(float, 18, elements=st.floats(-2e-3, 2e-3)),
    arrays(float, (18, 13), elements=st.floats(-1.0, 1.0)),
)
def test_joints_at_their_bounds_hold_what_they_slow_down(forward, short, jacobian):
    """A motion is held where joints at bounds move it by more than 1 mm/s slower than desired; errors alone do not."""
    forward[abs(forward) < 1e-3] = 0.0
    bench = GuardedPlaces()
    bench.velocity[10:] = 0.02, -0.03, 0.01
    bench.rates.forward[:18], bench.rates.away[:18], bench.rates.jacobian[:18] = forward, 0.01 * forward, jacobian
    bench.rates.rates[:18] = short + jacobian @ bench.velocity
    slower = short @ forward / max(np.linalg.norm(forward), 1e-9)
    assume(abs(slower - 1e-3) > 1e-9)
    assert not bench.update(is_bound=False)
    assert bench.update(is_bound=True) == (slower > 1e-3)
