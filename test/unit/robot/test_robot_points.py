"""Points that every Robot has: centre of mass, contacts, centre of pressure."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.robots import centauro

from solfer import Robot
from solfer.errors import PointError, SolferErrors
from solfer.model import Description
from solfer.model.urdf.cut import cut
from solfer.points import Handler, PointContact, RollingContact

CENTAURO = Path(__file__).parents[3] / "config/robots/centauro"
CONTACTS = CENTAURO / "contacts.yaml"


@pytest.fixture
def robot():
    robot = centauro()
    robot.update()
    return robot


def test_the_centre_of_mass_follows_every_update(robot):
    center = robot.center_of_mass
    height = center.value[2]
    assert_allclose(center.value, robot.kinematics.center_of_mass, atol=1e-12)
    robot.state.position[2] += 0.25
    assert center.value[2] == height
    robot.update()
    assert robot.center_of_mass is center
    assert center.value[2] == pytest.approx(height + 0.25)
    assert_allclose(center.jacobian, robot.kinematics.center_of_mass_jacobian, atol=1e-12)


def test_handlers_accept_the_centre_of_mass(robot):
    handlers = [Handler([robot.center_of_mass]), Handler([robot.center_of_mass])]
    robot.state.position[0] = 1.0
    robot.update()
    for handler in handlers:
        handler.update()
        assert_allclose(handler.value, robot.kinematics.center_of_mass, atol=1e-12)


def test_contacts_are_those_of_the_file(robot):
    assert [contact.link for contact in robot.contacts][:4] == ["wheel_1", "wheel_2", "wheel_3", "wheel_4"]
    assert all(isinstance(contact, RollingContact) for contact in list(robot.contacts)[:4])
    assert all(isinstance(contact, PointContact) for contact in list(robot.contacts)[4:])
    lowest = [contact.value[2] for contact in robot.contacts][:4]
    centers = [robot.kinematics.position(contact.link)[2] for contact in robot.contacts][:4]
    assert_allclose(lowest, np.array(centers) - 0.078, atol=1e-3)


def test_the_centre_of_pressure_follows_the_forces(robot):
    for contact in list(robot.contacts)[:2]:
        contact.force[2] = 400.0
    middle = 0.5 * (robot.contacts[0].value + robot.contacts[1].value)
    assert_allclose(robot.center_of_pressure.value[:2], middle[:2], atol=1e-12)
    robot.contacts[0].force[2] = 0.0
    robot.state.position[0] += 1.0
    robot.update()
    assert_allclose(robot.center_of_pressure.value[:2], robot.contacts[1].value[:2], atol=1e-12)


def test_no_contacts_means_no_centre_of_pressure():
    robot = centauro(contacts=False)
    assert len(robot.contacts) == 0
    with pytest.raises(PointError, match="of no contact"):
        robot.center_of_pressure.update()


def test_contacts_of_other_parts_are_left_out():
    whole = CENTAURO / "centauro.urdf"
    upper = cut(Description.from_file(whole), "torso_2", "upper")
    robot = Robot.load(upper, name="centauro", others=[whole], contacts=CONTACTS)
    assert all(contact.link.startswith("arm") for contact in robot.contacts)
    with pytest.raises(SolferErrors, match=r"contacts.yaml:6:18.*unknown link 'wheel_1'"):
        Robot.load(upper, name="centauro", contacts=CONTACTS)


@pytest.mark.slow
def test_a_robot_is_loaded_without_the_compiled_kernel():
    script = (
        "import sys, solfer\n"
        f"solfer.Robot.load({str(CENTAURO / 'centauro.urdf')!r}).update()\n"
        "sys.exit('numba' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", script], check=False, timeout=60).returncode == 0
