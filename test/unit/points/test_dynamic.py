"""Accelerations against differentiated velocities; forces against the constrained forward dynamics."""

import inspect

import numpy as np
import pinocchio as pin
import pytest
from numpy.testing import assert_allclose
from support.robots import centauro
from support.unit.random_states import OFFSET, ROBOTS, SLOPE, WHEEL, load, put, states

import solfer.points
from solfer.points import (
    Acceleration,
    AngularAcceleration,
    AngularVelocity,
    ConstraintForce,
    ContactConstraint,
    ContactForces,
    DynamicPoint,
    Force,
    Handler,
    LinearAcceleration,
    LinearPoint,
    LinearVelocity,
    PointContact,
    RollingAcceleration,
    RollingContact,
    SpatialAcceleration,
    SpatialVelocity,
    SupportVertex,
    SupportVertexAcceleration,
    Torque,
    Wrench,
)

STEP = 2e-6
ON_SLOPE = {**WHEEL, "normal": SLOPE}

ACCELERATIONS = {
    LinearAcceleration: (LinearVelocity, {"offset": OFFSET}),
    AngularAcceleration: (AngularVelocity, {}),
    SpatialAcceleration: (SpatialVelocity, {"offset": OFFSET}),
    SupportVertexAcceleration: (SupportVertex, ON_SLOPE),
    RollingAcceleration: (RollingContact, ON_SLOPE),
}
"""Accelerations, the points with the velocities that they are the derivatives of, and their places."""

FORCES = {
    Force: (LinearAcceleration, {"offset": OFFSET}, pin.ContactType.CONTACT_3D),
    Torque: (AngularAcceleration, {}, None),
    Wrench: (SpatialAcceleration, {"offset": OFFSET}, pin.ContactType.CONTACT_6D),
}
"""Forces, the points that they hold, their places, and Pinocchio's name of such a contact."""

OTHERS = {Acceleration, ConstraintForce, ContactConstraint, ContactForces, DynamicPoint}
"""Bases, and points with tests of their own: below, and in test_contact_constraint.py."""


class Height(Acceleration):
    """A point of a user: vertical acceleration of a point."""

    def __init__(self, point):
        super().__init__(1, point.robot)
        self.point = point

    def compute_jacobian(self):
        self.jacobian[0] = self.point.jacobian[2]

    def compute_offset(self):
        self.offset[0] = self.point.offset[2]


@pytest.fixture(scope="module", params=ROBOTS)
def robot_and_links(request):
    return load(request.param)


def velocity_of(point):
    """Multiply the Jacobian of a point with the velocities of the DoFs."""
    point.update()
    return point.jacobian @ point.robot.state.velocity


def close(value, expected):
    """Compare to 1e-6, of the largest number where it is above one."""
    assert_allclose(value, expected, rtol=0.0, atol=1e-6 * max(1.0, np.abs(expected).max()))


def test_no_dynamic_point_is_forgotten():
    exported = [getattr(solfer.points, name) for name in solfer.points.__all__]
    points = {one for one in exported if inspect.isclass(one) and issubclass(one, DynamicPoint)}
    assert points == set(ACCELERATIONS) | set(FORCES) | OTHERS


@pytest.mark.parametrize("alone", [False, True], ids=["in a Handler", "alone"])
@pytest.mark.parametrize("kind", ACCELERATIONS)
def test_accelerations_are_differentiated_velocities(robot_and_links, kind, alone):
    """Central differences of a moving body's velocity are the oracle for J a + dJ v, at random accelerations."""
    robot, (link, _) = robot_and_links
    moving, where = ACCELERATIONS[kind]
    point, body = kind(link, robot, **where), moving(link, robot, **where)
    group = point if alone else Handler([LinearPoint(link, robot), point, Height(LinearAcceleration(link, robot))])
    step = STEP
    for index, (position, velocity) in enumerate(states(robot)):
        acceleration = np.random.default_rng(index).uniform(-3.0, 3.0, robot.size)
        around = []
        for time in (-step, step):
            put(robot, position + time * velocity + 0.5 * time**2 * acceleration, velocity + time * acceleration)
            around.append(velocity_of(body))
        robot.state.acceleration[:] = acceleration
        put(robot, position, velocity)
        group.update()
        expected = (around[1] - around[0]) / (2.0 * step)
        assert_allclose(point.jacobian @ acceleration + point.offset, expected, rtol=0.0, atol=1e-6)
        assert_allclose(point.value, expected, rtol=0.0, atol=1e-6)
        body.update()
        assert_allclose(point.jacobian, body.jacobian, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("kind", ACCELERATIONS)
def test_the_offset_is_jacobian_derivative_times_velocity(robot_and_links, kind):
    # on floating bases above all: the columns of rx, ry and rz turn with each other
    robot, (link, _) = robot_and_links
    point = kind(link, robot, **ACCELERATIONS[kind][1])
    step = STEP
    for position, velocity in states(robot):
        around = []
        for time in (-step, step):
            put(robot, position + time * velocity, velocity)
            point.update()
            around.append(point.jacobian.copy())
        put(robot, position, velocity)
        point.update()
        derivative = (around[1] - around[0]) / (2.0 * step)
        assert_allclose(point.offset, derivative @ velocity, rtol=0.0, atol=1e-6)


def test_the_base_has_its_euler_angles_offset():
    # angular velocity rx' e_x + ry' Rx e_y + rz' Rx Ry e_z, differentiated by hand at rx = 0, ry = b
    robot = load("quadruped")[0]
    b, (rx, ry, rz) = 1.1, (0.7, -0.4, 0.9)
    position, velocity = np.zeros((2, robot.size))
    position[4], velocity[3:6] = b, (rx, ry, rz)
    put(robot, position, velocity)
    point = AngularAcceleration(robot.kinematics.base_link, robot)
    point.update()
    assert_allclose(
        point.offset,
        (ry * rz * np.cos(b), -rx * rz * np.cos(b), rx * ry - ry * rz * np.sin(b)),
        rtol=0.0,
        atol=1e-12,
    )


def test_vertex_accelerations_are_second_differences(robot_and_links):
    robot, (link, _) = robot_and_links
    point, vertex = SupportVertexAcceleration(link, robot, **ON_SLOPE), SupportVertex(link, robot, **ON_SLOPE)
    # five places, errors of the fourth order
    step, weights = 4e-4, (-1.0 / 12.0, 4.0 / 3.0, -2.5, 4.0 / 3.0, -1.0 / 12.0)
    for position, velocity in states(robot):
        expected = np.zeros(3)
        for time, weight in zip(step * np.arange(-2.0, 3.0), weights, strict=True):
            put(robot, position + time * velocity + 0.5 * time**2 * robot.state.acceleration, velocity)
            vertex.update(jacobian=False)
            expected += weight * vertex.value
        put(robot, position, velocity)
        point.update()
        close(point.value, expected / step**2)


def test_a_flat_wheel_moves_like_its_centre(robot):
    axis = robot.kinematics.rotation("wheel_1").T @ (0.0, 0.0, 1.0)
    point, center = (
        kind("wheel_1", robot, *numbers)
        for kind, numbers in ((SupportVertexAcceleration, (0.01, 0.068, axis)), (LinearAcceleration, ()))
    )
    for one in (point, center):
        one.update()
    assert_allclose(point.value, center.value, rtol=0.0, atol=1e-9)


def test_rolling_without_slip_accelerates_like_the_centre(robot):
    """A steady wheel has a closed form: zero for the contact, omega^2 r towards the centre for the material."""
    # the wheel's centre goes straight on with r omega, and so does the place of contact
    robot.state.position[:], robot.state.velocity[:], robot.state.acceleration[:] = np.zeros((3, robot.size))
    robot.update()
    axis = robot.kinematics.rotation("wheel_1").T @ (0.0, 1.0, 0.0)
    point = RollingAcceleration("wheel_1", robot, 0.01, 0.068, axis)
    contact, material = RollingContact("wheel_1", robot, 0.01, 0.068, axis), LinearAcceleration("wheel_1", robot)
    spin, speed = robot.dof("j_wheel_1"), robot.dof("x")
    contact.update()
    robot.state.velocity[spin] = 2.0
    robot.state.velocity[speed] = -contact.jacobian[0, spin] / contact.jacobian[0, speed] * 2.0
    robot.update()
    material.set_world(contact.value)
    point.update()
    material.update()
    assert_allclose(velocity_of(contact), np.zeros(3), rtol=0.0, atol=1e-12)
    assert_allclose(point.value, np.zeros(3), rtol=0.0, atol=1e-12)
    # the particle in contact is pulled to the wheel's centre
    assert_allclose(material.value, (0.0, 0.0, 2.0**2 * 0.078), rtol=0.0, atol=1e-9)


def drift(robot, kind, link, where):
    """Compute the Jacobian of a held point, and its time derivative times the velocity, by Pinocchio's recursion."""
    model = pin.Model(robot.kinematics._model)
    body = model.frames[model.getFrameId(link)]
    place = body.placement * pin.SE3(np.eye(3), np.array(where.get("offset", np.zeros(3))))
    frame = model.addFrame(pin.Frame("held", body.parentJoint, place, pin.FrameType.OP_FRAME), False)
    data, position = model.createData(), robot.state.position
    pin.forwardKinematics(model, data, position, robot.state.velocity, np.zeros(robot.size))
    motion = pin.getFrameClassicalAcceleration(model, data, frame, pin.LOCAL_WORLD_ALIGNED).vector
    jacobian = pin.computeFrameJacobian(model, data, position, frame, pin.LOCAL_WORLD_ALIGNED)
    rows = {LinearAcceleration: slice(0, 3), AngularAcceleration: slice(3, 6), SpatialAcceleration: slice(0, 6)}[kind]
    return jacobian[rows], motion[rows]


def constrained(robot, jacobian, motion, demanded):
    """Solve the whole system of equations for accelerations and forces of the robot with J qdd + motion = demanded."""
    model, rows, size = robot.kinematics._model, len(jacobian), robot.size
    data = model.createData()
    inertia = pin.crba(model, data, robot.state.position)
    inertia = np.triu(inertia) + np.triu(inertia, 1).T
    bias = pin.nonLinearEffects(model, data, robot.state.position, robot.state.velocity)
    system = np.block([[inertia, -jacobian.T], [jacobian, np.zeros((rows, rows))]])
    solution = np.linalg.lstsq(system, np.concatenate([robot.state.torque - bias, demanded - motion]), rcond=1e-13)[0]
    return solution[:size], solution[size:]


@pytest.mark.daily(6)
@pytest.mark.slow
@pytest.mark.parametrize("alone", [False, True], ids=["in a Handler", "alone"])
@pytest.mark.parametrize("kind", FORCES)
def test_forces_are_those_of_the_constrained_forward_dynamics(robot_and_links, kind, alone):
    """A dense solution with demanded accelerations is the oracle, and the point accelerates as demanded."""
    robot, (link, _) = robot_and_links
    held, where, _ = FORCES[kind]
    force = kind(link, robot, **where)
    group = force if alone else Handler([LinearAcceleration(link, robot), force, LinearPoint(link, robot)])
    for index, (position, velocity) in enumerate(states(robot)):
        generator = np.random.default_rng(index)
        robot.state.torque[:] = generator.uniform(-20.0, 20.0, robot.size)
        demanded = generator.uniform(-1.0, 1.0, force.rows)
        put(robot, position, velocity)
        force.demand(demanded)
        group.update()
        acceleration, expected = constrained(robot, *drift(robot, held, link, where), demanded)
        close(force.value, expected)
        close(force.jacobian @ robot.state.torque + force.offset, expected)
        robot.state.acceleration[:] = acceleration
        force.acceleration.update()
        close(force.acceleration.value, demanded)


@pytest.mark.parametrize("kind", [Force, Wrench])
def test_forces_are_those_of_pinocchio(robot_and_links, kind):
    """Pinocchio's constraintDynamics shares no formula with the points: its contact force must be the same."""
    robot, (link, _) = robot_and_links
    _, where, contact = FORCES[kind]
    force, model = kind(link, robot, **where), robot.kinematics._model
    body = model.frames[model.getFrameId(link)]
    place = body.placement * pin.SE3(np.eye(3), np.array(OFFSET))
    constraints, results = pin.StdVec_RigidConstraintModel(), pin.StdVec_RigidConstraintData()
    constraints.append(pin.RigidConstraintModel(contact, model, body.parentJoint, place, pin.LOCAL_WORLD_ALIGNED))
    results.append(constraints[0].createData())
    data = model.createData()
    pin.initConstraintDynamics(model, data, constraints, results)
    for index, (position, velocity) in enumerate(states(robot)):
        put(robot, position, velocity)
        # a held point does not move
        force.update()
        held = force.acceleration.jacobian
        put(robot, position, velocity - np.linalg.pinv(held) @ (held @ velocity))
        robot.state.torque[:] = np.random.default_rng(index).uniform(-20.0, 20.0, robot.size)
        force.update()
        pin.constraintDynamics(model, data, position, robot.state.velocity, robot.state.torque, constraints, results)
        close(force.value, results[0].contact_force.vector[: force.rows])


def contact_motion(contact):
    """Compute a contact's Jacobian, and its time derivative times the velocity by finite differences."""
    robot, around = contact.robot, []
    position, velocity = robot.state.position.copy(), robot.state.velocity.copy()
    for time in (-STEP, STEP):
        put(robot, position + time * velocity, velocity)
        around.append(velocity_of(contact))
    put(robot, position, velocity)
    contact.update()
    return contact.jacobian.copy(), (around[1] - around[0]) / (2.0 * STEP)


@pytest.mark.parametrize("lifted", [None, 1])
def test_contact_forces_hold_all_contacts(robot_and_links, lifted):
    """A lifted contact has no force, and the others carry what the dense constrained dynamics demand."""
    robot, (first, second) = robot_and_links
    contacts = [PointContact(first, robot, OFFSET), RollingContact(second, robot, **ON_SLOPE)]
    forces = ContactForces(contacts)
    # a contact that is moved and lifted later on
    contacts[0].set_fixed((0.0, 0.1, -0.2))
    for index, contact in enumerate(contacts):
        contact.active = index != lifted
    for index, (position, velocity) in enumerate(states(robot)):
        robot.state.torque[:] = np.random.default_rng(index).uniform(-20.0, 20.0, robot.size)
        put(robot, position, velocity)
        parts = [contact_motion(contact) for contact in contacts if contact.active]
        jacobian, motion = np.vstack([part[0] for part in parts]), np.concatenate([part[1] for part in parts])
        expected = np.zeros((2, 3))
        expected[[contact.active for contact in contacts]] = constrained(
            robot, jacobian, motion, np.zeros(len(motion))
        )[1].reshape(-1, 3)
        forces.update()
        close(forces.value, expected.ravel())
        close(forces.jacobian @ robot.state.torque + forces.offset, expected.ravel())


def test_a_contact_that_is_lifted_after_an_update_carries_nothing(robot):
    contacts = [PointContact("arm1_7", robot), RollingContact("wheel_3", robot, **ON_SLOPE)]
    forces, alone = ContactForces(contacts), ContactForces(contacts[1:])
    forces.update()
    both = forces.value.copy()
    assert np.abs(both[:3]).min() > 1e-3
    contacts[0].active = False
    forces.update()
    alone.update()
    assert not forces.value[:3].any() and not forces.jacobian[:3].any()
    close(forces.value[3:], alone.value)
    contacts[0].active = True
    forces.update()
    close(forces.value, both)


def test_the_ground_carries_a_resting_robot():
    robot = centauro()
    wheels = [contact for contact in robot.contacts if isinstance(contact, RollingContact)]
    forces, bias = ContactForces(wheels), robot.dynamics.bias
    jacobian = np.vstack([contact.jacobian for contact in wheels])
    # with these efforts the ground carries the load of the base, and nothing moves
    ground = np.linalg.lstsq(jacobian[:, :6].T, bias[:6], rcond=None)[0]
    robot.state.torque[6:] = (bias - jacobian.T @ ground)[6:]
    forces.update()
    assert_allclose(jacobian.T @ forces.value + robot.state.torque, bias, rtol=0.0, atol=1e-6)
    weight = -robot.kinematics.mass * robot.gravity
    assert_allclose(forces.value.reshape(-1, 3).sum(axis=0), weight, rtol=0.0, atol=1e-6)


def test_dependent_constraints_share_the_smallest_forces(robot):
    alone, twice = Force("arm1_7", robot), ConstraintForce([LinearAcceleration("arm1_7", robot) for _ in range(2)])
    for force in (alone, twice):
        force.update()
    assert_allclose(twice.value, 0.5 * np.tile(alone.value, 2), rtol=1e-6)
    assert_allclose(twice.jacobian, 0.5 * np.tile(alone.jacobian, (2, 1)), rtol=0.0, atol=1e-6)
    # three DoFs move this link: its six accelerations are not independent, and not all of them can be met
    robot_arm, (_, link) = load("kuka")
    wrench = Wrench(link, robot_arm, OFFSET)
    wrench.update()
    assert np.isfinite(wrench.value).all() and np.abs(wrench.value).max() < 1e4
