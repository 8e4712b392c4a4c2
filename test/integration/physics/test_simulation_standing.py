"""CENTAURO stands for four seconds on the gains of its bundle."""

import numpy as np
import pytest
from support.integration.world import perfect

from solfer.simulation import Simulation

STEPS = 4000
WHEELS = ("wheel_1", "wheel_2", "wheel_3", "wheel_4")


@pytest.fixture(scope="module")
def stand():
    """Return (base at each step, contact links at each step, forces at the end, simulation), after four seconds."""
    simulation = Simulation.from_file(perfect())
    base, links = np.zeros((STEPS + 1, 6)), []
    base[0] = simulation.kinematics.base.from_pose(simulation.body.position, simulation.body.orientation, np.zeros(6))
    for step in range(STEPS):
        simulation.step()
        base[step + 1] = simulation.q[:6]
        links.append(simulation.contact_links())
    yield base, links, simulation.contacts(), simulation
    simulation.close()


def test_it_starts_upright_on_its_wheels(stand):
    base, _, _, simulation = stand
    # 0.6307 m is where forward kinematics put the pelvis over wheels of 78 mm; the floating joint lies at 0.93445 m
    np.testing.assert_allclose(base[0], [0.0, 0.0, 0.6307 - 0.93445, 0.0, 0.0, 0.0], atol=1e-5)


def test_it_does_not_move_after_the_first_second(stand):
    base, _, _, simulation = stand
    moved = np.abs(base[1000:] - base[1000]).max(axis=0)
    assert moved[:3].max() < 0.05e-3
    assert np.degrees(moved[3:]).max() < 0.005
    assert simulation.time == pytest.approx(4.0)


def test_only_the_wheels_touch_the_ground(stand):
    _, links, _, _ = stand
    assert set(links) == {WHEELS}


def test_the_ground_carries_the_weight(stand):
    _, _, forces, _ = stand
    assert sum(force[2] for force in forces.values()) == pytest.approx(94.96909 * 9.81, rel=1e-5)
    assert sum(force[:2] for force in forces.values()) == pytest.approx(np.zeros(2), abs=0.5)


def test_the_wheels_carry_what_was_measured_before(stand):
    _, _, forces, _ = stand
    loads = [forces[wheel][2] for wheel in WHEELS]
    np.testing.assert_allclose(loads, [281.1, 277.4, 188.4, 184.8], rtol=0.02)  # [N], a separate program


def test_its_messages_are_its_motion(stand):
    _, _, _, simulation = stand
    joints, base = (simulation.sensors[name].measure() for name in ("joints", "base"))
    assert joints.names == simulation.kinematics.dofs[6:]
    np.testing.assert_array_equal(joints.position, simulation.q[6:])
    np.testing.assert_array_equal(joints.effort, simulation.torque[6:])
    assert (base.frame, base.child, base.stamp) == ("world", "pelvis", simulation.time)
    np.testing.assert_allclose(base.position[:2], 0.0, atol=0.01)


def test_torques_and_contact_forces_balance_gravity(stand):
    _, _, forces, simulation = stand
    kinematics = simulation.kinematics
    kinematics.update(simulation.q)
    balance = kinematics.bias(simulation.q, simulation.v) - simulation.torque
    for wheel, force in forces.items():
        lowest = np.array([0.0, 0.0, -0.078])  # contact point as seen from the centre of the wheel [m]
        balance -= kinematics.jacobian(wheel).T @ np.concatenate((force, np.cross(lowest, force)))
    np.testing.assert_allclose(balance, 0.0, atol=0.5)  # [N, Nm], of 932 N
