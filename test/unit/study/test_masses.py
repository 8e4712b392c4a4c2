"""Masses of a simulated robot that its controllers do not know, against Pinocchio."""

import numpy as np
import pinocchio
import pytest
from support.unit.studies import CONFIG

from solfer.errors import UnknownName
from solfer_tools.study.records import SimulationRecord
from solfer_tools.study.robot import with_masses

URDF = (CONFIG / "robots/centauro/centauro.urdf").read_text()


def mass_and_center(text):
    model = pinocchio.buildModelFromXML(text, pinocchio.JointModelFreeFlyer())
    data = model.createData()
    center = pinocchio.centerOfMass(model, data, pinocchio.neutral(model))
    return data.mass[0], np.array(center), pinocchio.crba(model, data, pinocchio.neutral(model))


def test_without_changes_the_text_stays():
    assert with_masses(URDF, SimulationRecord()) == URDF


@pytest.mark.slow
def test_a_factor_scales_masses_and_inertias():
    mass, center, inertia = mass_and_center(URDF)
    changed = mass_and_center(with_masses(URDF, SimulationRecord(mass=1.3)))
    assert changed[0] == pytest.approx(1.3 * mass)
    np.testing.assert_allclose(changed[1], center, atol=1e-9)
    np.testing.assert_allclose(changed[2], 1.3 * inertia, atol=1e-9)


@pytest.mark.slow
def test_a_payload_is_a_point_on_its_link():
    mass, center, _ = mass_and_center(URDF)
    payload = {"link": "pelvis", "mass": 10.0, "center": (0.1, 0.2, 0.3)}
    changed = mass_and_center(with_masses(URDF, SimulationRecord(payload=payload)))
    model = pinocchio.buildModelFromXML(URDF, pinocchio.JointModelFreeFlyer())
    data = model.createData()
    pinocchio.framesForwardKinematics(model, data, pinocchio.neutral(model))
    place = data.oMf[model.getFrameId("pelvis")].act(np.array((0.1, 0.2, 0.3)))
    assert changed[0] == pytest.approx(mass + 10.0)
    np.testing.assert_allclose(changed[1], (mass * center + 10.0 * place) / (mass + 10.0), atol=1e-9)


def test_centres_of_mass_move_in_their_links():
    text = '<robot name="r"><link name="a"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" '
    text += 'ixz="0" iyz="0"/></inertial></link></robot>'
    changed = with_masses(text, SimulationRecord(center=(0.0, 0.0, 0.02)))
    assert '<origin xyz="0.0 0.0 0.02"' in changed


def test_a_payload_on_a_link_that_the_robot_lacks_is_an_error():
    with pytest.raises(UnknownName, match="did you mean: pelvis"):
        with_masses(URDF, SimulationRecord(payload={"link": "pelvs", "mass": 1.0}))
