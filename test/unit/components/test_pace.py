"""How motions of `wheeled_motion` go on, whatever is desired: pace, references, and velocities of others."""

import cmath
import math
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from solfer.components.wheeled_motion.drive import Drive
from solfer.components.wheeled_motion.pace.path import PathPace
from solfer.components.wheeled_motion.references import References
from solfer.errors import ComponentError
from solfer.interfaces.geometry import Twist, Vector

PERIOD, ACCELERATION = 0.005, 0.3  # [s], [m/s2]
BASE_SPEED, TURN_SPEED, VERTEX_SPEED = 0.5, 0.4, 0.1
STEP = ACCELERATION * PERIOD  # [m/s]
FURTHEST = 0.3  # [m]

velocities = arrays(float, 3, elements=st.floats(-2.0, 2.0))
of_vertices = arrays(float, (4, 3), elements=st.floats(-0.5, 0.5))
angles = st.floats(-math.pi, math.pi)
of_wheels = arrays(float, 4, elements=angles)
speeds = arrays(float, 4, elements=st.floats(0.01, 0.2))


class PacedWheels:
    """References, and a pace of four wheels that point to where they aim."""

    def __init__(self):
        self.references, self.wheels = References(4), np.zeros((4, 4))
        self.offsets = SimpleNamespace(base=np.zeros(3), reference=np.zeros((4, 3)))
        self.error = np.zeros(6)
        self.pace = PathPace(self.references, SimpleNamespace(steered=self.wheels), self.offsets, self.error)
        self.pace.limit((BASE_SPEED, TURN_SPEED, VERTEX_SPEED), ACCELERATION, FURTHEST)

    def point(self, speeds, away=0.0, heading=0.0):
        """Let wheels be as far from where they aim; aims are seen from the heading."""
        self.offsets.base[0] = heading
        self.wheels[1], self.wheels[2], self.wheels[3] = 0.3, speeds, 0.3 + heading + away

    def cycle(self, is_held=False, is_first=False, most=1.0):
        self.pace.advance(True, is_first, is_held, most, PERIOD)
        return self.pace.value


@pytest.mark.slow
@given(velocities, st.floats(-2.0, 2.0), of_vertices)
def test_no_velocity_is_above_its_bound(velocity, turn, vertices):
    course = PacedWheels()
    references = course.references
    references.velocity[:], references.angular[2], references.vertex_velocity[:] = velocity, turn, vertices
    pace, fastest = course.cycle(is_first=True), np.linalg.norm(vertices, axis=1).max()
    shares = np.linalg.norm(velocity) / BASE_SPEED, abs(turn) / TURN_SPEED, fastest / VERTEX_SPEED
    assert references.pace == references.limits == pace
    assert_allclose(pace, 1.0 / max(1.0, *shares))


@pytest.mark.slow
@given(velocities, velocities, of_vertices, angles, angles)
def test_references_integrate_velocities_at_the_pace(velocity, turn, vertices, tilt, heading):
    course = PacedWheels()
    references, base = course.references, Rotation.from_euler("ZX", (heading, 0.3 * tilt))
    references.start(np.ones(3), heading, base.as_quat())
    references.velocity[:], references.angular[:], references.vertex_velocity[:] = velocity, turn, vertices
    references.vertices[:] = 0.5
    way = PERIOD * course.cycle(is_first=True)
    assert_allclose(references.position, 1.0 + way * velocity, rtol=1e-12)
    assert_allclose(references.vertices, 0.5 + way * vertices, rtol=1e-12)
    assert_allclose(course.offsets.reference, references.vertices, atol=0.0)
    assert abs(references.heading) <= math.pi * (1.0 + 1e-15)
    assert_allclose(math.remainder(references.heading - heading - way * turn[2], 2.0 * math.pi), 0.0, atol=1e-12)
    tilted = Rotation.from_euler("XY", way * turn[:2]) * Rotation.from_euler("X", 0.3 * tilt)
    expected = Rotation.from_euler("Z", heading + way * turn[2]) * tilted
    assert_allclose(Rotation.from_quat(references.orientation).as_matrix(), expected.as_matrix(), atol=1e-12)


@given(st.integers(0, 40), st.integers(1, 300), velocities)
def test_a_held_motion_rests_and_goes_on(held, free, velocity):
    """The pace falls by 8 and rises by 1 a second, and references of a motion that rests stay where they are."""
    course = PacedWheels()
    course.references.velocity[:] = velocity
    full = course.cycle(is_first=True)
    for _ in range(held):
        pace = course.cycle(is_held=True)
    left = max(0.0, 1.0 - 8.0 * PERIOD * held)
    assert_allclose(pace if held else full, full * left, atol=1e-12)
    place = course.references.position.copy()
    course.cycle(is_held=True)
    assert held < 25 or (course.references.position == place).all()
    left = max(0.0, left - 8.0 * PERIOD)
    for _ in range(free):
        pace = course.cycle()
    assert_allclose(pace, full * min(1.0, left + PERIOD * free), atol=1e-12)


@given(st.floats(0.0, 0.6), angles, st.floats(-1.0, 1.0))
def test_references_wait_for_a_base_that_does_not_follow(distance, direction, turn):
    """They slow down from 0.1 m or 0.15 rad on, and rest at twice that; a base that sinks does not count."""
    course = PacedWheels()
    course.references.velocity[:] = 0.2, 0.0, 0.0
    course.error[2] = math.sin(turn / 2.0)
    course.error[3:] = distance * math.cos(direction), distance * math.sin(direction), 0.5
    assert course.cycle(is_first=True) == 1.0  # nothing is known of errors yet
    place = course.references.position.copy()
    pace = course.cycle()
    assert_allclose(
        pace, np.clip(2.0 - max(distance / 0.1, 2.0 * math.sin(abs(turn) / 2.0) / 0.15), 0.0, 1.0), atol=1e-12
    )
    assert pace or (course.references.position == place).all()


@pytest.mark.slow
@given(speeds, of_wheels, angles)
def test_no_vertex_leaves_its_way_faster(speeds, away, heading):
    course = PacedWheels()
    course.point(speeds, away, heading)
    for _ in range(200):
        pace = course.cycle()
    across = max(speeds * abs(np.sin(away)))
    assert_allclose(pace, 1.0 if across <= 4e-3 else 4e-3 / across, rtol=1e-6)


@pytest.mark.slow
@given(st.lists(st.tuples(speeds, of_wheels, st.integers(1, 30), st.booleans()), min_size=1, max_size=6))
def test_accelerations_of_vertices_are_bounded(parts):
    """The fastest vertex rises by 2, starts by 3, and brakes by 4 times the acceleration, the pace within [0, 1]."""
    course, before, share = PacedWheels(), 0.0, 1.0
    for speeds, away, count, is_held in parts:
        course.point(speeds, away)
        for index in range(count):
            pace, fastest = course.cycle(is_held), max(speeds)
            speed = pace * fastest
            assert 0.0 <= pace <= 1.0
            assert speed <= before + (2.0 if index > 1 else 3.0) * STEP + 1e-12
            assert speed >= min(before, share * fastest) - 4.0 * STEP - 1e-12
            before, share = speed, pace


def test_accelerations_are_reached():
    course, paces = PacedWheels(), []
    for away in (0.0,) * 100 + (math.pi / 2.0,) * 2 + (0.0,) * 2:
        course.point(0.1, away)
        paces.append(course.cycle())
    changes = 0.1 * np.diff([0.0, *paces]) / STEP
    assert_allclose(changes[:4], (3.0, 2.0, 2.0, 2.0))
    assert paces[99] == 1.0
    assert_allclose(changes[100:], (-4.0, -4.0, 2.0, 2.0))


def test_a_largest_pace_counts_whatever_else_does():
    """It is reached within what vertices may brake, kept, and left as slowly as after any other stop."""
    course = PacedWheels()
    course.point(0.1)
    paces = [course.cycle(most=most) for most in [1.0] * 400 + [0.3] * 400 + [0.0] * 400 + [1.0] * 400]
    assert paces[399] == 1.0 and paces[799] == 0.3 and paces[1199] == 0.0 and paces[1599] == 1.0
    assert min(np.diff(paces)) >= -1.01 * 8.0 * PERIOD and max(np.diff(paces[1199:])) <= 1.01 * PERIOD


def test_a_pace_of_others_stays():
    course = PacedWheels()
    course.references.pace, course.references.velocity[:] = 0.25, (1.0, 0.0, 0.0)
    course.pace.advance(False, False, True, 1.0, PERIOD)
    assert course.references.pace == 0.25
    assert_allclose(course.references.position, (0.25 * PERIOD, 0.0, 0.0))


def seen(velocity, heading):
    """Return a velocity in the plane as seen from a heading."""
    return complex(*velocity[:2]) * cmath.exp(-1j * heading)


@pytest.mark.slow
@settings(max_examples=30)
@given(velocities, velocities, angles, st.floats(-0.05, 0.05), st.floats(5e-3, 0.02))
def test_velocities_follow_messages_within_accelerations(before, desired, heading, rate, passed):
    """Seen from the heading a velocity changes no faster than it may until it is the one that was sent, bounded.

    What it was at the first message counts, whatever the heading is: no earlier heading is known then.
    """
    drive, references = Drive(BASE_SPEED, TURN_SPEED, 0.3, 0.5), References(4)
    references.velocity[:2] = 0.1 * before[:2]
    last, turn = seen(references.velocity, heading), 0.0
    share = min(1.0, BASE_SPEED / max(math.hypot(*desired[:2]), 1e-9), TURN_SPEED / max(abs(desired[2]), 1e-9))
    for _ in range(math.ceil(2.6 / passed)):
        drive.receive(Twist(Vector(*desired[:2]), Vector(0.0, 0.0, desired[2])))
        assert drive.ratio == pytest.approx(share)
        drive.update(references, heading, drive.ratio, passed)
        velocity = seen(references.velocity, heading)
        assert abs(velocity - last) <= 0.3 * passed + 1e-12
        assert abs(references.angular[2] - turn) <= 0.5 * passed + 1e-12
        last, turn, heading = velocity, references.angular[2], heading + rate
    assert_allclose((last.real, last.imag, turn), share * desired, atol=1e-9)


@pytest.mark.parametrize("spike", [Twist(Vector(1e3)), Twist(Vector(), Vector(0.0, 0.0, -60.0))])
def test_a_spike_of_a_velocity_is_refused(spike):
    """The velocity before goes on; ten times what the base may do is a stick set up wrongly, and is followed."""
    drive, references = Drive(BASE_SPEED, TURN_SPEED, 0.3, 0.5), References(4)
    drive.receive(Twist(Vector(0.1)))
    with pytest.raises(ComponentError, match="times what the base may do"):
        drive.receive(spike)
    assert drive.ratio == 1.0
    drive.update(references, 0.0, 1.0, 0.4)
    assert_allclose(references.velocity, [0.1, 0.0, 0.0])
    drive.receive(Twist(Vector(10.0 * BASE_SPEED)))
    assert drive.ratio == pytest.approx(0.1)


@given(st.floats(2e-3, 0.02), st.floats(0.1, 0.5))
def test_silence_ends_a_motion(passed, speed):
    drive, references = Drive(BASE_SPEED, TURN_SPEED, 0.3, 0.5), References(4)
    references.velocity[0] = speed
    drive.receive(Twist(Vector(speed)))
    speeds = []
    while drive.is_active and len(speeds) < 2000:
        drive.update(references, 0.0, 1.0, passed)
        speeds.append(references.velocity[0])
    changes = -np.diff([speed, *speeds])
    age = passed * np.arange(1, len(speeds) + 1)
    assert not changes[age < 0.55 - 1e-9].any()
    assert_allclose(changes[age > 0.55 + 1e-9][:-2], 0.3 * passed, rtol=1e-9)
    assert speeds[-1] == 0.0
