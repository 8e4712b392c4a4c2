"""Joints with springs: two masses against their theory, without a simulator."""

import math

import numpy as np
import pytest
from support.unit.two_mass import DT, LINK, NO_LIMIT, ROTOR, Link, fit, joint, response_errors, springs, swing

from solfer.lower_level import ImplicitImpedance
from solfer.lower_level.laws.two_mass import TwoMassImpedance


@pytest.mark.parametrize("stiffness", [6000.0, 20000.0, 80000.0])
@pytest.mark.parametrize("ratio", [0.002, 0.02, 0.2])
def test_a_step_response_is_that_of_theory(stiffness, ratio):
    frequency, damping = response_errors(stiffness, ratio)
    assert frequency <= 0.01 and damping <= 0.05


def test_motor_friction_damps_as_in_theory():
    stiffness, friction = 20000.0, 5.0
    deflection = swing(*joint(stiffness, friction=friction), 200)
    system = np.array(  # of speeds and deflection: motor, link, spring
        [[-friction / ROTOR, 0.0, -stiffness / ROTOR], [0.0, 0.0, stiffness / LINK], [1.0, -1.0, 0.0]]
    )
    pole = max(np.linalg.eigvals(system), key=lambda one: one.imag)
    frequency, damping = fit(deflection)
    assert frequency == pytest.approx(abs(pole), rel=0.01)
    assert damping == pytest.approx(-pole.real / abs(pole), rel=0.05)


def energy(body, law, stiffness, before):
    """Return the energy of both masses and the spring [J], speeds taken between two steps."""
    motor, link = 0.5 * (law.motor_velocity[0] + before[0]), 0.5 * (body.v[0] + before[1])
    stretch = before[2] - before[3]
    return 0.5 * (ROTOR * motor**2 + LINK * link**2 + stiffness * stretch**2)


@pytest.mark.parametrize("damping", [0.0, 20.0])
def test_energy_is_what_the_drive_gave(damping):
    """What the drive puts in is in masses and spring, or went into the damper."""
    stiffness, given, lost, work, loss = 20000.0, 0.0, 0.0, 0.0, 0.0
    body, law = joint(stiffness, damping)
    for step in range(1000):
        before = law.motor_velocity[0], body.v[0], law.motor_position[0], body.q[0]
        law.effort[:] = 60.0 * math.sin(0.01 * step)
        body.step(law)
        motor, link = 0.5 * (law.motor_velocity[0] + before[0]), 0.5 * (body.v[0] + before[1])
        work, loss = DT * law.effort[0] * motor, DT * damping * (motor - link) ** 2
        given, lost = given + work, lost + loss
    given, lost = given - 0.5 * work, lost - 0.5 * loss  # positions are those in the middle of the last step
    assert given > 1.0
    assert energy(body, law, stiffness, before) + lost == pytest.approx(given, rel=2e-3)


def test_link_and_motor_feel_opposite_torques():
    body, law = joint(20000.0, 5.0)
    law.motor_position[:] = 0.01
    for step in range(300):
        body.outside[:] = 30.0 * math.sin(0.3 * step)  # a contact that the law cannot know
        before = body.v[0] * LINK + law.motor_velocity[0] * ROTOR
        body.step(law)
        after = body.v[0] * LINK + law.motor_velocity[0] * ROTOR
        assert after == pytest.approx(before + DT * body.outside[0], abs=1e-12)


@pytest.mark.parametrize("rotor", [0.0, 1e-4, 1.3])
@pytest.mark.parametrize("stiffness", [1.0, 1e5])
@pytest.mark.parametrize("damping", [0.0, 1e5])
def test_no_values_of_the_file_diverge(rotor, stiffness, damping):
    body, law = joint(stiffness, damping, rotor=rotor, link=1e-3, limit=np.array([30.0]))
    law.stiffness[:], law.damping[:], law.position[:] = 1e4, 100.0, 0.1
    for _ in range(1000):
        body.step(law)
    assert abs(body.q[0]) < 0.3 and abs(law.motor_position[0]) < 0.3


def test_a_drive_at_its_limit_stays_there():
    body, law = joint(20000.0, 20.0, limit=np.array([5.0]))
    law.stiffness[:], law.position[:] = 1000.0, 1.0
    for _ in range(100):
        body.step(law)
        assert law.drive[0] == 5.0
    assert (body.v[0] * LINK + law.motor_velocity[0] * ROTOR) == pytest.approx(100 * DT * 5.0, rel=1e-9)


def test_a_held_link_stretches_its_spring():
    body, law = joint(6000.0, 5.0)
    law.stiffness[:], law.damping[:], law.position[:] = 500.0, 50.0, 0.02
    for _ in range(5000):
        body.outside[:] = -1e5 * body.q - 1e3 * body.v  # a hard stop
        body.step(law)
    deflection = law.motor_position[0] - body.q[0]
    assert law.torque[0] == pytest.approx(6000.0 * deflection, rel=1e-3)
    assert law.torque[0] == pytest.approx(500.0 * (0.02 - law.motor_position[0]), rel=1e-3)


def test_joints_without_springs_keep_their_law():
    """Beside a joint with a spring, coupled with it by nothing, the other one has the torques of a rigid one."""
    both, alone = Link(LINK, 2.0), Link(2.0)
    unlimited = np.full(2, np.inf)
    swinging = springs(both, [6000.0, 0.0], [1.0, 0.0], [ROTOR, 0.0], [0.0, 0.0])
    law = TwoMassImpedance(both, (unlimited, unlimited), swinging, np.zeros(2), DT)
    rigid = ImplicitImpedance(alone, NO_LIMIT, NO_LIMIT)
    law.position[:], law.stiffness[:], law.damping[:] = 0.3, 400.0, 30.0
    rigid.position[:], rigid.stiffness[:], rigid.damping[:] = 0.3, 400.0, 30.0
    for _ in range(500):
        both.step(law)
        alone.step(rigid)
    assert both.q[1] == pytest.approx(alone.q[0], rel=1e-6)
    assert alone.q[0] > 0.1


STIFF = 80000.0


def stiff(**given):
    """Make a link that is so light that a step does not resolve how it swings on its spring."""
    return joint(STIFF, link=0.02, **given)


def test_a_stiff_spring_gives_way_at_rest():
    body, law = stiff()
    law.stiffness[:], law.damping[:], law.position[:], body.weight[:] = 4000.0, 5.0, 0.02, 30.0
    for _ in range(3000):
        body.step(law)
    ((_,), _, _, (compliance,)) = law.motor_side
    assert compliance == 1.0 / STIFF
    assert law.torque[0] == pytest.approx(30.0, rel=1e-9)
    motor = body.q[0] + compliance * law.torque[0]
    assert motor == pytest.approx(0.02 - 30.0 / 4000.0, rel=1e-9)


def test_a_stiff_spring_passes_torques_on():
    body, law = stiff(friction=2.0)
    law.effort[:] = 3.0
    for _ in range(400):
        body.step(law)
    assert body.v[0] == pytest.approx(3.0 / 2.0, rel=1e-6)
    assert law.torque[0] == pytest.approx(0.0, abs=1e-6) and law.drive[0] == 3.0


@pytest.mark.parametrize("friction", [0.0, 2.0])
def test_a_stiff_spring_obeys_the_drives_limit(friction):
    body, law = stiff(friction=friction, limit=np.array([5.0]))
    law.stiffness[:], law.position[:] = 4000.0, 1.0
    for _ in range(19):
        body.step(law)
        assert law.drive[0] == 5.0
        assert law.torque[0] == pytest.approx(5.0 - friction * body.v[0], rel=1e-9)
    if not friction:
        assert body.v[0] == pytest.approx(19 * DT * 5.0 / 0.02)


def test_a_stiff_spring_gains_no_energy():
    """Pushed at random for a while, it then only comes to rest, whatever the gains."""
    random = np.random.default_rng(2)
    body, law = stiff()
    law.stiffness[:], law.damping[:] = 2e4, 1.0
    for _ in range(200):
        body.outside[:] = random.normal(0.0, 50.0)
        body.step(law)
    body.outside[:] = 0.0
    together = STIFF * 2e4 / (STIFF + 2e4)
    energies = []
    for _ in range(500):
        before = body.v[0]
        body.step(law)
        middle = body.q[0] - DT * body.v[0]  # where both speeds are taken around
        energies.append(0.5 * 0.02 * before * body.v[0] + 0.5 * together * middle**2)
    peaks = np.reshape(energies, (-1, 20)).max(axis=1)
    assert peaks[0] > 1e-3 and np.all(peaks[1:] <= 0.5 * peaks[:-1])
