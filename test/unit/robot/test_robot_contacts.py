"""Contacts of a Robot: names, groups, reaction forces, and contacts that come and go."""

import json
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from support.allocations import check_that_it_keeps_no_memory
from support.robots import centauro

from solfer import Robot
from solfer.dynamics import ProjectedDynamics
from solfer.errors import ConfigError, PointError, UnknownName
from solfer.points import CenterOfPressure, Handler, LinearPoint, PointContact

CENTAURO = Path(__file__).parents[3] / "config/robots/centauro"
NAMES = ("front_left_leg", "front_right_leg", "rear_left_leg", "rear_right_leg", "left_arm", "right_arm")


@pytest.fixture
def robot():
    robot = centauro()
    robot.state.position[:] = np.random.default_rng(5).uniform(-0.3, 0.3, robot.size)
    robot.update()
    return robot


def test_contacts_are_found_by_name_and_by_group(robot):
    contacts = robot.contacts
    assert contacts.names == NAMES
    assert contacts["rear_left_leg"] is contacts[2] and contacts["rear_left_leg"].link == "wheel_3"
    assert contacts.group("wheels") == tuple(contacts)[:4]
    assert contacts.group("right_arm") == (contacts["right_arm"],)
    assert contacts.group("all") == tuple(contacts) and contacts.group("torso") == ()


def test_point_contacts_are_at_their_links(robot):
    assert robot.contacts.positions.shape == (6, 3)
    assert_allclose(robot.contacts.positions[4], robot.kinematics.position("arm1_7"), atol=1e-12)
    assert_allclose(robot.contacts.positions[5], robot.kinematics.position("arm2_7"), atol=1e-12)
    robot.state.position[0] += 1.0
    robot.update()
    assert_allclose(robot.contacts.positions[4], robot.kinematics.position("arm1_7"), atol=1e-12)


def test_contacts_share_one_array_of_forces(robot):
    contacts = robot.contacts
    contacts["front_left_leg"].force[:] = (1.0, 2.0, 300.0)
    contacts.wrenches[5] = np.arange(6.0)
    assert_array_equal(contacts.forces[0], (1.0, 2.0, 300.0))
    assert_array_equal(contacts["right_arm"].wrench, np.arange(6.0))
    assert_array_equal(contacts.forces[5], (0.0, 1.0, 2.0))


def test_a_group_is_lifted_and_put_down(robot):
    contacts = robot.contacts
    contacts.activate("arms", active=False)
    contacts.update()
    assert [contact.active for contact in contacts] == [True] * 4 + [False] * 2
    assert not contacts.jacobian[12:].any() and contacts.jacobian[:12].any(axis=1).all()
    contacts.activate()
    contacts.update()
    assert contacts.jacobian.any(axis=1).all()


def test_contacts_come_and_go_with_their_forces(robot):
    """Forces belong to contacts, not to rows: they survive removals, and the centre of pressure follows."""
    contacts, center = robot.contacts, robot.center_of_pressure
    pelvis = contacts.add(PointContact("pelvis", robot), "belly")
    assert contacts.names == (*NAMES, "belly") and contacts["belly"] is pelvis
    assert_allclose(pelvis.value, robot.kinematics.position("pelvis"), atol=1e-12)
    pelvis.force[2] = 200.0
    contacts["left_arm"].force[2] = 200.0
    assert robot.center_of_pressure is center
    expected = 0.5 * (robot.kinematics.position("pelvis") + robot.kinematics.position("arm1_7"))
    assert_allclose(center.value[:2], expected[:2], atol=1e-12)
    assert contacts.remove("belly") is pelvis
    assert contacts.names == NAMES and contacts.forces.shape == (6, 3)
    assert_array_equal(pelvis.force, (0.0, 0.0, 200.0))
    assert_allclose(robot.center_of_pressure.value[:2], robot.kinematics.position("arm1_7")[:2], atol=1e-12)
    assert contacts.remove(contacts[0]).link == "wheel_1" and contacts.remove(-1).link == "arm2_7"
    assert contacts.names == NAMES[1:5]
    assert contacts.forces[3, 2] == 200.0


def test_the_centre_of_pressure_forgets_removed_contacts(robot):
    contacts, center = robot.contacts, robot.center_of_pressure
    hand = contacts["right_arm"]
    hand.force[2] = contacts["left_arm"].force[2] = 100.0
    elbow = robot.dof("j_arm2_4")
    assert robot.center_of_pressure.jacobian[:, elbow].any()
    contacts.remove(hand)
    assert not robot.center_of_pressure.jacobian[:, elbow].any()
    assert_allclose(center.jacobian[:2], contacts["left_arm"].jacobian[:2], atol=1e-12)


def test_without_force_the_centre_of_pressure_is_guarded(robot):
    assert_array_equal(robot.center_of_pressure.value, np.zeros(3))
    assert not robot.center_of_pressure.jacobian.any()


ROWS = {"force_1": [0, 0, 0, 1, 0, 0], "force_2": [0, 0, 0, 0, 1, 0], "force_3": [0, 0, 0, 0, 0, 1]}
TURNS = {"momentum_1": [1, 0, 0, 0, 0, 0], "momentum_2": [0, 1, 0, 0, 0, 0], "momentum_3": [0, 0, 1, 0, 0, 0]}


def write(folder, **tags):
    """Write the file of one contact: a foot below a wheel of CENTAURO."""
    contact = {"name": "foot", "end_frame": "wheel_1", "type": "contact_point", "position": [0.0, 0.02, 0.0]}
    contact |= {"constraint_matrix": ROWS} | tags
    file = folder / "contacts.yaml"
    file.write_text(json.dumps({"centauro": {"contacts": {"contact0": contact}}}))
    return Robot.load(CENTAURO / "centauro.urdf", name="centauro", contacts=file)


@pytest.mark.parametrize(
    "rows, count",
    [
        ({"force_3": ROWS["force_3"]}, 1),
        (ROWS, 3),
        (ROWS | {"momentum_1": [0] * 6, "momentum_3": TURNS["momentum_3"]}, 4),
        (ROWS | TURNS, 6),
    ],
    ids=["frictionless", "point", "no turning on the spot", "flat foot"],
)
def test_the_file_names_the_constrained_rows(tmp_path, rows, count):
    robot = write(tmp_path, constraint_matrix=rows)
    robot.state.position[:] = np.random.default_rng(5).uniform(-0.3, 0.3, robot.size)
    robot.update()
    rotation, body = robot.kinematics.rotation("wheel_1").T, robot.kinematics.jacobian("wheel_1")
    place = LinearPoint("wheel_1", robot, (0.0, 0.02, 0.0))
    place.update()
    motion = np.vstack([rotation @ place.jacobian, rotation @ body[3:]])
    picked = {"force": 0, "momentum": 3}
    expected = [motion[picked[row[:-2]] + int(row[-1]) - 1] for row, values in rows.items() if any(values)]
    assert robot.contacts.constraints.rows == count
    assert_allclose(robot.contacts.constraints.jacobian, expected, atol=1e-12)


def test_the_offset_puts_a_contact_below(tmp_path):
    robot = write(tmp_path, offset=[0.0, 0.0, -0.05])
    robot.state.position[3:] = np.random.default_rng(5).uniform(-0.3, 0.3, robot.size - 3)
    robot.update()
    foot, center = robot.contacts["foot"], LinearPoint("wheel_1", robot, (0.0, 0.02, 0.0))
    center.update()
    assert_allclose(foot.value, center.value - (0.0, 0.0, 0.05), atol=1e-12)
    material = LinearPoint("wheel_1", robot)
    material.set_world(foot.value)
    material.update()
    assert_allclose(robot.contacts.constraints.jacobian, material.jacobian, atol=1e-12)


def test_the_offset_of_a_wheel_is_the_normal(tmp_path):
    tags = {"type": "wheel", "minor_axis": 0.03, "major_axis": 0.05, "reference_axis": {"x": 0, "y": 1, "z": 0}}
    robot = write(tmp_path, **tags, offset=[0.0, 0.048, -0.064])
    assert_allclose(robot.contacts["foot"].normal, (0.0, -0.6, 0.8), atol=1e-12)
    with pytest.raises(ConfigError, match=r"an 'offset' of 0.08 m .* its radii, 0.09 m"):
        write(tmp_path, **tags | {"minor_axis": 0.04}, offset=[0.0, 0.048, -0.064])


def test_a_contact_that_constrains_nothing_is_refused(tmp_path):
    with pytest.raises(ConfigError, match=r"contacts.yaml:1:\d+.*at least one row that is not zero"):
        write(tmp_path, constraint_matrix={"force_1": [0] * 6})


def test_constraints_follow_the_contacts(robot):
    """The rows in the contacts' own frames span the same space, and a contact with six rows adds all of them."""
    contacts, projected = robot.contacts, ProjectedDynamics(robot.dynamics)
    assert_allclose(
        contacts.constraints.jacobian[12:15],
        contacts["left_arm"].rotation.T @ contacts["left_arm"].jacobian,
        atol=1e-12,
    )
    projected.constrain(contacts.constraints.jacobian)
    free = projected.projection.copy()
    projected.constrain(contacts.jacobian)
    assert_allclose(free.T @ free, projected.projection.T @ projected.projection, atol=1e-9)
    contacts.add(PointContact("pelvis", robot, constraint=np.eye(6)), "belly")
    robot.state.position[6:] += 0.1
    robot.update()
    assert robot.contacts.constraints.rows == 24
    assert_allclose(contacts.constraints.jacobian[18:, 6:], 0.0, atol=1e-12)
    contacts.remove("belly")
    assert contacts.constraints.rows == 18


def test_contacts_of_a_group_fit_a_handler(robot):
    wheels = Handler(robot.contacts.group("wheels"))
    wheels.update()
    assert_allclose(wheels.jacobian, robot.contacts.jacobian[:12], atol=1e-12)


@pytest.mark.parametrize(
    "wrong, error, what",
    [
        (lambda robot: robot.contacts["front_left_lag"], UnknownName, "unknown contact 'front_left_lag'"),
        (lambda robot: robot.contacts.group("wheel"), UnknownName, "unknown group 'wheel'"),
        (lambda robot: robot.contacts.remove(7), PointError, "there is no point 7"),
        (lambda robot: robot.contacts.remove(PointContact("pelvis", robot)), PointError, "is not in this Handler"),
        (
            lambda robot: robot.contacts.add(PointContact("pelvis", robot), "left_arm"),
            PointError,
            "a contact 'left_arm'",
        ),
        (lambda robot: robot.contacts.add(LinearPoint("pelvis", robot)), PointError, "is not a contact"),
        (
            lambda robot: robot.contacts.add(PointContact("pelvis", centauro())),
            PointError,
            "another Robot",
        ),
    ],
    ids=["name", "group", "index", "stranger", "taken", "no contact", "other robot"],
)
def test_mistakes_are_named_and_change_nothing(robot, wrong, error, what):
    with pytest.raises(error, match=what):
        wrong(robot)
    assert robot.contacts.names == NAMES and len(robot.contacts) == 6 and len(robot.contacts.forces) == 6


def test_a_centre_of_pressure_needs_contacts(robot):
    center = CenterOfPressure(robot.contacts)
    for name in NAMES:
        robot.contacts.remove(name)
    with pytest.raises(PointError, match="of no contact"):
        center.update()


@pytest.mark.slow
def test_reading_the_robots_points_keeps_no_memory(robot):
    robot.contacts.forces[:] = (1.0, 2.0, 300.0)

    def cycle():
        robot.state.position += 1e-6
        robot.update()
        return robot.center_of_mass.value[0] + robot.center_of_pressure.value[0] + robot.contacts.positions[0, 0]

    check_that_it_keeps_no_memory(cycle)
