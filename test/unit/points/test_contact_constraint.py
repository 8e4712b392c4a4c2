"""Rows of contacts in their own frames, against finite differences and the constrained forward dynamics."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.allocations import check_that_it_keeps_no_memory
from support.unit.random_states import OFFSET, ROBOTS, SLOPE, WHEEL, accelerate, load, put, states

from solfer.errors import NotFinite, SizeMismatch
from solfer.points import (
    BallContact,
    CenterOfPressure,
    ContactConstraint,
    ContactForces,
    FrameOrientation,
    Handler,
    LinearPoint,
    PointContact,
    RollingContact,
)

STEP = 1e-6
NORMAL = ((0.0, 0.0, 1.0, 0.0, 0.0, 0.0),)
MIXED = ((1.0, 0.0, 0.5, 0.0, 0.0, 0.0), (0.0, 2.0, 0.0, 0.0, 0.3, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 1.0))
ROWS = {"frictionless": NORMAL, "a point": None, "a flat foot": np.eye(6), "screws": MIXED}
CONTACTS = {
    "point": lambda link, robot, rows: PointContact(link, robot, OFFSET, rows),
    "ball": lambda link, robot, rows: BallContact(link, robot, 0.04, OFFSET, SLOPE, constraint=rows),
    "wheel": lambda link, robot, rows: RollingContact(link, robot, **WHEEL, normal=SLOPE, constraint=rows),
}


@pytest.fixture(scope="module", params=ROBOTS)
def robot_and_links(request):
    return load(request.param)


@pytest.fixture
def robot():
    robot = load("centauro")[0]
    accelerate(robot)
    return robot


def differences(robot, contact, position, velocity):
    """Differentiate place and orientation of the link's material at a contact, in the contact's frame there."""
    material, body = LinearPoint(contact.link, robot), FrameOrientation(contact.link, robot)
    put(robot, position, velocity)
    contact.update()
    rotation = contact.rotation.copy()
    material.set_world(contact.value)
    group = Handler([material, body])
    put(robot, position - STEP * velocity, velocity)
    group.update(jacobian=False)
    before = [point.value.copy() for point in group]
    put(robot, position + STEP * velocity, velocity)
    group.update(jacobian=False)
    rates = [point.difference(value) / (2.0 * STEP) for point, value in zip(group, before, strict=True)]
    put(robot, position, velocity)
    return np.concatenate([rate @ rotation for rate in rates])


@pytest.mark.parametrize("rows", ROWS)
@pytest.mark.parametrize("kind", CONTACTS)
def test_rows_are_motions_in_the_frame(robot_and_links, kind, rows):
    robot, (link, _) = robot_and_links
    contact = CONTACTS[kind](link, robot, ROWS[rows])
    constraint = ContactConstraint(contact)
    for position, velocity in list(states(robot))[:10]:
        expected = contact.constraint @ differences(robot, contact, position, velocity)
        contact.update()
        constraint.update()
        assert_allclose(constraint.jacobian @ velocity, expected, atol=1e-6)


@pytest.mark.parametrize("rows", ["frictionless", "screws"])
@pytest.mark.parametrize("kind", CONTACTS)
def test_offsets_differentiate_the_rows(robot_and_links, kind, rows):
    """Central differences of J v along an accelerated motion are the oracle for each kind of contact and rows."""
    robot, (link, _) = robot_and_links
    contact = CONTACTS[kind](link, robot, ROWS[rows])
    constraint = ContactConstraint(contact)
    for index, (position, velocity) in enumerate(list(states(robot))[:10]):
        acceleration = np.random.default_rng(index).uniform(-3.0, 3.0, robot.size)
        around = []
        for time in (-STEP, STEP):
            put(robot, position + time * velocity + 0.5 * time**2 * acceleration, velocity + time * acceleration)
            constraint.update()
            around.append(constraint.jacobian @ robot.state.velocity)
        robot.state.acceleration[:] = acceleration
        put(robot, position, velocity)
        constraint.update()
        expected = (around[1] - around[0]) / (2.0 * STEP)
        assert_allclose(constraint.value, expected, atol=2e-6 * max(1.0, np.abs(expected).max()))


def test_frames_of_contacts_stand_on_the_ground(robot):
    """On a slope z is its normal and a wheel's y is along its axle; degenerate axes still give a rotation."""
    up = np.array(SLOPE) / np.linalg.norm(SLOPE)
    wheel, ball = CONTACTS["wheel"]("wheel_1", robot, None), CONTACTS["ball"]("wheel_1", robot, None)
    axle = robot.kinematics.rotation("wheel_1") @ WHEEL["axis"]
    for contact in (wheel, ball):
        assert_allclose(contact.rotation.T @ contact.rotation, np.eye(3), atol=1e-12)
        assert_allclose(contact.rotation[:, 2], up, atol=1e-12)
        assert np.linalg.det(contact.rotation) > 0.0
    assert wheel.rotation[:, 0] @ axle == pytest.approx(0.0, abs=1e-12) and wheel.rotation[:, 1] @ axle > 0.0
    assert_allclose(BallContact("wheel_1", robot, 0.1).rotation, np.eye(3), atol=1e-12)
    flat = RollingContact("wheel_1", robot, 0.1, 0.0, robot.kinematics.rotation("wheel_1").T @ (0.0, 0.0, 1.0))
    assert_allclose(flat.rotation, np.eye(3), atol=1e-6)
    assert flat.spin(0.0, 0.0, 1.0) == ball.spin(0.1, 0.2, 1.0) == (0.0, 0.0, 0.0)
    centered = BallContact("wheel_1", robot, 0.1)
    centered.update()
    assert_allclose(centered.value, robot.kinematics.position("wheel_1") - (0.0, 0.0, 0.1), atol=1e-12)


def test_a_ball_is_a_wheel_without_ring(robot):
    ball, wheel = BallContact("wheel_2", robot, 0.3, OFFSET), RollingContact("wheel_2", robot, 0.0, 0.3, center=OFFSET)
    for contact in (ball, wheel):
        contact.update()
    assert_allclose(ball.value, wheel.value, atol=1e-12)
    assert_allclose(ball.jacobian, wheel.jacobian, atol=1e-12)


def test_forces_act_along_the_rows_alone(robot_and_links):
    """A dense system of the constrained dynamics is the oracle: no friction where a row does not hold it."""
    robot, (first, second) = robot_and_links
    contacts = [
        PointContact(first, robot, OFFSET, np.eye(6)),
        BallContact(second, robot, 0.05, normal=SLOPE, constraint=NORMAL),
        RollingContact(second, robot, **WHEEL, constraint=((0.0, 1.0, 0.0, 0.0, 0.0, 0.0), *NORMAL)),
    ]
    forces, rows = ContactForces(contacts), Handler(ContactConstraint(contact) for contact in contacts)
    assert forces.size == 12 and rows.rows == 9
    for seed in range(5):
        accelerate(robot, seed)
        for group in (Handler(contacts), rows, forces):
            group.update()
        inertia, bias = robot.dynamics.inertia, robot.dynamics.bias
        system = np.block([[inertia, -rows.jacobian.T], [rows.jacobian, np.zeros((9, 9))]])
        right = np.concatenate([robot.state.torque - bias, -rows.offset])
        held = np.linalg.lstsq(system, right, rcond=1e-13)[0][robot.size :]
        expected = np.zeros(12)
        expected[:3], expected[3:6] = contacts[0].rotation @ held[:3], contacts[0].rotation @ held[3:6]
        expected[6:9] = contacts[1].rotation[:, 2] * held[6]
        expected[9:] = contacts[2].rotation[:, 1:] @ held[7:]
        close = 1e-6 * max(1.0, np.abs(expected).max())
        assert_allclose(forces.value, expected, rtol=0.0, atol=close)
        assert_allclose(forces.jacobian @ forces.x + forces.offset, expected, rtol=0.0, atol=close)
        forces.write_wrenches()
        assert_allclose(contacts[0].wrench, expected[:6], atol=close)
        assert_allclose(contacts[2].wrench, [*expected[9:], 0.0, 0.0, 0.0], atol=close)


def test_a_frame_of_three_forces_changes_nothing(robot):
    turned = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    links = ("wheel_1", "arm1_7")
    plain = ContactForces([PointContact(link, robot) for link in links])
    rows = Handler(ContactConstraint(PointContact(link, robot, constraint=turned @ np.eye(3, 6))) for link in links)
    plain.update()
    rows.update()
    for index in (0, 1):
        block = plain.accelerations.jacobian[3 * index : 3 * index + 3]
        rotation = robot.kinematics.rotation(links[index])
        assert_allclose(rows.jacobian[3 * index : 3 * index + 3], turned @ rotation.T @ block, atol=1e-12)


def test_lifted_contacts_have_rows_of_zeros(robot):
    contact = PointContact("arm1_7", robot, constraint=np.eye(6))
    constraint, forces = ContactConstraint(contact), ContactForces([contact, PointContact("wheel_1", robot)])
    contact.active = False
    for point in (constraint, forces):
        point.update()
    assert not constraint.jacobian.any() and not constraint.offset.any()
    assert not forces.value[:6].any() and forces.value[6:].any()
    contact.active = True
    for point in (constraint, forces):
        point.update()
    assert constraint.jacobian.any(axis=1).all() and forces.value[:6].all()


def test_moments_of_a_flat_foot_move_the_pressure(robot):
    foot, point = PointContact("wheel_1", robot, constraint=np.eye(6)), PointContact("wheel_2", robot)
    group = Handler([foot, point, CenterOfPressure([foot, point])])
    shift, force = np.array((0.05, -0.02, 0.0)), np.array((20.0, -10.0, 300.0))
    foot.wrench[:], point.wrench[:] = [*force, *np.cross(shift, force)], [0.0, 0.0, 100.0, 7.0, 8.0, 9.0]
    group.update()
    expected = (300.0 * (foot.value + shift) + 100.0 * point.value) / 400.0
    assert_allclose(group[2].value, [*expected[:2], 0.0], atol=1e-12)


def test_constraints_that_do_not_fit_are_refused(robot):
    for rows in (np.eye(3), np.zeros((0, 6)), np.ones((7, 6))):
        with pytest.raises(SizeMismatch, match="one to six rows"):
            PointContact("wheel_1", robot, constraint=rows)
    for rows in (np.zeros((1, 6)), np.full((1, 6), np.nan)):
        with pytest.raises(NotFinite, match="not zero"):
            PointContact("wheel_1", robot, constraint=rows)


@pytest.mark.slow
def test_constraints_keep_no_memory(robot):
    contacts = Handler([make("wheel_1", robot, MIXED) for make in CONTACTS.values()])
    forces = ContactForces(contacts)

    def cycle():
        robot.state.position += 1e-5
        robot.dynamics.update()
        contacts.update()
        forces.update()

    check_that_it_keeps_no_memory(cycle)
