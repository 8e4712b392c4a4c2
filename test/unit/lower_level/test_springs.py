"""Which springs have two masses, by how fast they swing for a step."""

import numpy as np
import pytest
from support.unit.cart import GAINS, GROUPS, URDF

from solfer.lower_level import JointControllerRecord, build_lower_level
from solfer.lower_level.laws.springs import resolved, springs_of
from solfer.model import Description, Kinematics
from solfer.model.actuators import Actuators, SeriesElastic

DT = 0.001
LINK, ROTOR = 0.5, 0.25  # [kg m^2]
BOUND = 0.6 / (DT**2 * (1.0 / LINK + 1.0 / ROTOR))
"""Stiffness of the joint that a step just resolves [Nm/rad]."""


@pytest.mark.parametrize(("stiffness", "two_mass"), [(0.0, False), (0.999 * BOUND, True), (1.001 * BOUND, False)])
def test_a_step_resolves_springs_up_to_a_stiffness(stiffness, two_mass):
    (chosen,) = resolved(np.diag([LINK]), np.array([stiffness]), np.array([ROTOR]), DT)
    assert chosen == two_mass


def test_a_rotor_without_inertia_has_no_motion():
    assert not resolved(np.diag([LINK]), np.array([100.0]), np.array([0.0]), DT).any()


def test_the_fastest_of_a_whole_is_left_out():
    """Links that all shake one light body swing faster together than each of them alone."""
    mobility = 0.05 * np.eye(8) + 0.45
    stiffness = 1e6 * np.linspace(1.0, 1.1, 8)
    chosen = resolved(np.linalg.inv(mobility), stiffness, np.full(8, 1e9), DT)
    softest = int(chosen.sum())
    assert 1 < softest < 8 and chosen[:softest].all()
    fastest = [
        np.linalg.eigvalsh(np.sqrt(np.outer(kept, kept)) * mobility[: len(kept), : len(kept)])[-1]
        for kept in (stiffness[:softest] * DT**2, stiffness[: softest + 1] * DT**2)
    ]
    assert fastest[0] <= 2.0 < fastest[1]


def drives(stiffness):
    """Make the drives of a cart with springs at its arm and at its wheel, which has a speed."""
    kinematics = Kinematics(Description.from_text(URDF))
    spring = SeriesElastic(stiffness, 1.0, 0.5, 0.1, 50.0)
    actuators = Actuators(kinematics.dofs[6:], {"shoulder": spring, "roll": spring})
    wheel = JointControllerRecord(type="velocity", group="wheels")
    arm = JointControllerRecord(type="impedance", **{"except": "wheels"})
    lower_level = build_lower_level(kinematics, {"arm": arm, "wheel": wheel}, GROUPS, GAINS, actuators=actuators)
    return lower_level.drives, kinematics.dofs.index("roll")


def test_a_wheel_with_two_masses_is_driven_by_torque():
    soft, roll = drives(10.0)
    assert roll in soft.torque_dofs and not len(soft.speed_dofs)


def test_a_stiff_wheel_is_driven_by_its_speed():
    stiff, roll = drives(1e5)
    assert stiff.speed_dofs.tolist() == [roll] and roll not in stiff.torque_dofs
    v = np.zeros(8)
    v[roll] = 2.0
    for _ in range(10):
        stiff.update(np.zeros(8), v, DT, 1.0)
    assert -1.0 <= stiff.torque[roll] < 0.0  # friction of the motor, and nothing else


def test_a_robot_without_springs_has_none():
    kinematics = Kinematics(Description.from_text(URDF))
    assert springs_of(kinematics, None, None, DT) is None
    assert springs_of(kinematics, Actuators(kinematics.dofs), None, DT) is None
