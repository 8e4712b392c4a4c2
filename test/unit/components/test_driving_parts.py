"""Parts of `wheeled_motion`, each on its own."""

import cmath
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from solfer.components.wheeled_motion.joints import CommandedJoints
from solfer.components.wheeled_motion.original.resteering import Resteering
from solfer.components.wheeled_motion.pace.delay import ROLLING_TIMEOUT, ClockDelay
from solfer.components.wheeled_motion.references import KeptVelocities, References
from solfer.components.wheeled_motion.support.weight import SHIFT_ACCELERATION, SHIFT_SPEED, WeightShift
from solfer.numerics.planar_move import seen_from, turned

PERIOD = 0.005  # [s]


@pytest.mark.parametrize("heading", [0.0, 0.7, -2.0, 3.1])
def test_headings_turn_as_complex_numbers_do(heading):
    vector = complex(0.3, -0.8)
    there = complex(*turned(heading, vector.real, vector.imag))
    assert there == pytest.approx(vector * cmath.rect(1.0, heading))
    assert complex(*seen_from(heading, there.real, there.imag)) == pytest.approx(vector)


def test_wheels_roll_on_through_a_gap():
    delay = ClockDelay()
    assert delay.advance(0.05, passed=0.2, lost=0.0) == pytest.approx(0.15)
    assert delay.ratio == 1.0


@pytest.mark.parametrize(("passed", "lost"), [(ROLLING_TIMEOUT + 0.1, 0.0), (PERIOD, 0.1)])
def test_the_share_makes_up_for_what_is_lost(passed, lost):
    delay = ClockDelay()
    delay.advance(PERIOD, passed, lost)
    made_up = (1.0 - delay.ratio) * (passed + lost)
    assert delay.ratio < 1.0
    for _ in range(2000):
        assert delay.advance(PERIOD, PERIOD, 0.0) == 0.0
        made_up += (1.0 - delay.ratio) * PERIOD
    assert made_up == pytest.approx(0.1, abs=1e-6) and delay.ratio == pytest.approx(1.0)


def test_kept_velocities_are_desired_again():
    references = References(4)
    references.velocity[:], references.angular[2], references.vertex_velocity[:] = (0.1, 0.2, 0.3), 0.4, 0.5
    kept = KeptVelocities(4)
    kept.keep(references)
    references.velocity[:], references.angular[2], references.vertex_velocity[:] = 0.0, 0.0, 0.0
    kept.restore(references)
    assert_allclose(references.velocity, (0.1, 0.2, 0.3))
    assert references.angular[2] == 0.4 and (references.vertex_velocity == 0.5).all()


def test_only_moved_joints_are_commanded():
    joints = CommandedJoints(np.array([1, 2]), 4, np.array([2]), None)
    joints.start(np.full(4, 0.5))
    joints.integrate(np.array([1.0, 2.0, -3.0, 4.0]), 0.1, np.zeros(4))
    command = SimpleNamespace(position=np.zeros(4), velocity=np.zeros(4))
    joints.send(command.position, command.velocity)
    assert_allclose(command.position, (0.0, 0.7, 0.2, 0.0))
    assert_allclose(command.velocity, (0.0, 2.0, -3.0, 0.0))
    joints.stop(command)
    assert not command.velocity.any() and not joints.is_first


def test_a_wheel_that_is_steered_turns_back():
    measured = np.array([0.0, 0.0, 2.0])
    joints = CommandedJoints(np.arange(3), 3, np.array([2]), Resteering(np.array([-2.0]), np.array([2.0])))
    joints.start(measured)
    for _ in range(20):
        joints.integrate(np.array([0.0, 0.0, 4.0]), PERIOD, measured)
    assert joints.position[2] < 1.95 and joints.position[0] == 0.0


def test_the_weight_goes_there_and_back():
    """The base goes to its goal below its largest speed and acceleration, and back to where it was."""
    references = References(4)
    references.heading = 0.4
    wheels = SimpleNamespace(pose=SimpleNamespace(jacobian=np.eye(3)))
    joints = SimpleNamespace(velocity=np.zeros(3))
    shift = WeightShift(references, wheels, joints)
    for begin, goal in ((lambda: shift.begin(0.05, -0.02), (0.05, -0.02)), (shift.begin_back, (0.0, 0.0))):
        begin()
        last = 0.0
        for _ in range(2000):
            shift.keep_places(PERIOD)
            if shift.go(PERIOD):
                break
            joints.velocity[:] = references.velocity
            speed = float(np.linalg.norm(references.velocity))
            assert speed <= SHIFT_SPEED + 1e-12 and speed - last <= SHIFT_ACCELERATION * PERIOD + 1e-12
            last = speed
            references.step(PERIOD)
        joints.velocity[:] = 0.0
        references.velocity[:] = 0.0
        assert_allclose(references.position[:2], goal, atol=1e-5)
