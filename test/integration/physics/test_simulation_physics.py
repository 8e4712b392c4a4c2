"""The simulated CENTAURO against Pinocchio and against its own motion."""

import dataclasses

import numpy as np
import pinocchio as pin
import pytest
from support.bullet import raw_bullet
from support.controllers import accept

from solfer.model import Description, Kinematics
from solfer.numerics.rotations import rotation_from_quaternion
from solfer.simulation import Simulation
from solfer.simulation.bundle import load_bundle
from solfer.simulation.world.records import Friction
from solfer.transport.messages import JointMessage

DT = 0.001  # [s]


@pytest.fixture(scope="module")
def flight(repository):
    """CENTAURO tumbling without ground, torques in its joints: (simulation, q, v, torque at each step, poses)."""
    bundle = load_bundle(repository / "config/robots/centauro/robot.yaml")
    simulation = Simulation(dataclasses.replace(bundle, friction=Friction(ground=None)))
    bullet = raw_bullet(simulation)
    bullet.module.resetBaseVelocity(bullet.body, [0.3, -0.2, 0.5], [0.8, -1.1, 1.4], bullet.client)
    simulation._read()
    controller = simulation.lower_level.controller("position_controller")
    effort = np.random.default_rng(5).uniform(-0.2, 0.2, len(controller.joints)) * controller.limits.effort
    zeros = np.zeros(len(controller.joints))
    accept(controller, JointMessage(controller.joints, effort=effort, stiffness=zeros, damping=zeros + 0.5))
    history = []
    for _ in range(50):
        before = simulation.q.copy(), simulation.v.copy()
        simulation.step()
        body = simulation.body
        history.append(
            (
                *before,
                simulation.torque.copy(),
                simulation.v.copy(),
                body.position.copy(),
                body.orientation.copy(),
                body.linear.copy(),
                body.angular.copy(),
            )
        )
    yield simulation, history
    simulation.close()


@pytest.fixture(scope="module")
def pinocchio(repository):
    """Pinocchio's own free-flyer model of the robot without the floating joint of the URDF."""
    text = (repository / "config/robots/centauro/centauro.urdf").read_text()
    return pin.buildModelFromXML(text)


def test_the_mass_is_that_of_the_robot(flight):
    simulation, _ = flight
    assert simulation.body.mass() == pytest.approx(94.96909, abs=1e-5)


def test_a_free_flight_step_agrees_with_pinocchio(flight, pinocchio):
    simulation, history = flight
    model, data = pinocchio, pinocchio.createData()
    names = simulation.kinematics.dofs
    for q, v, torque, v_next, *_ in history:
        position, velocity = to_free_flyer(model, simulation, q, v)
        effort = np.zeros(model.nv)
        for name, value in zip(names[6:], torque[6:], strict=True):
            effort[model.joints[model.getJointId(name)].idx_v] = value
        acceleration = pin.aba(model, data, position, velocity, effort)
        for index, name in enumerate(names[6:], start=6):
            expected = acceleration[model.joints[model.getJointId(name)].idx_v]
            assert (v_next[index] - v[index]) / DT == pytest.approx(expected, rel=1e-6, abs=1e-4)


def to_free_flyer(model, simulation, q, v):
    """Position and velocity of a free-flyer model (cosines and sines for joints without limits) of ours."""
    kinematics = simulation.kinematics
    position, velocity = pin.neutral(model), np.zeros(model.nv)
    place, orientation = kinematics.base.to_pose(q[:6])
    linear, angular = kinematics.base.twist_from_rates(q[:6], v[:6])
    rotation = rotation_from_quaternion(orientation)
    position[:3] = place - kinematics.base.position  # the free flyer of the URDF sits at the floating joint's origin
    position[3:7] = orientation
    velocity[:6] = np.concatenate((rotation.T @ linear, rotation.T @ angular))
    for name, angle, rate in zip(kinematics.dofs[6:], q[6:], v[6:], strict=True):
        joint = model.joints[model.getJointId(name)]
        position[joint.idx_q : joint.idx_q + joint.nq] = [angle] if joint.nq == 1 else [np.cos(angle), np.sin(angle)]
        velocity[joint.idx_v] = rate
    return position, velocity


def test_the_twist_is_of_the_links_origin(flight):
    _, history = flight
    for before, after in zip(history[:-1], history[1:], strict=True):
        place, orientation, linear, _ = before[4:]
        next_place, next_orientation, next_linear, next_angular = after[4:]
        np.testing.assert_allclose((next_place - place) / DT, (linear + next_linear) / 2.0, atol=0.01)
        turn = pin.log3(rotation_from_quaternion(next_orientation) @ rotation_from_quaternion(orientation).T) / DT
        np.testing.assert_allclose(turn, next_angular, atol=1e-3)


def test_the_base_rates_are_those_of_the_twist(flight):
    simulation, history = flight
    for q, v, *_ in history:
        kinematics = simulation.kinematics
        kinematics.update(q, v)
        linear, angular = kinematics.base.twist_from_rates(q[:6], v[:6])
        np.testing.assert_allclose(kinematics.velocity("pelvis"), [*linear, *angular], atol=1e-12)


def test_links_are_where_pinocchio_sees_them(flight):
    simulation, _ = flight
    kinematics, bullet = simulation.kinematics, raw_bullet(simulation)
    kinematics.update(simulation.q)
    for index, link in enumerate(simulation.body.links[:-1]):
        state = bullet.module.getLinkState(
            bullet.body, index, computeForwardKinematics=1, physicsClientId=bullet.client
        )
        np.testing.assert_allclose(state[4], kinematics.position(link), atol=1e-6)
        np.testing.assert_allclose(rotation_from_quaternion(state[5]), kinematics.rotation(link), atol=1e-6)


def test_lumped_links_keep_the_dynamics(flight, repository):
    """PyBullet's mass matrix of the lumped robot against Pinocchio's of the whole one, joints only."""
    simulation, _ = flight
    bullet = raw_bullet(simulation)
    matrix = np.array(
        bullet.module.calculateMassMatrix(
            bullet.body, simulation.q[6:][np.argsort(bullet.joints)].tolist(), physicsClientId=bullet.client
        )
    )
    order = 6 + np.argsort(np.argsort(bullet.joints))
    description = Description.from_file(repository / "config/robots/centauro/centauro.urdf")
    expected = Kinematics(description).inertia(simulation.q)[6:, 6:]
    np.testing.assert_allclose(matrix[np.ix_(order, order)], expected, atol=1e-6)
