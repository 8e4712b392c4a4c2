"""Full and projected dynamics: against the original program, PyBullet's robots, and their own equations."""

import json
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.needs import pybullet_robot
from support.robots import centauro, load
from support.unit.chains import chain

from solfer import Robot
from solfer.dynamics import BIAS, INERTIA, INERTIA_INVERSE, DynamicModel, ProjectedDynamics
from solfer.errors import ModelError

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def original():
    content = json.loads((ROOT / "test/data/original_at_one_state.json").read_text())
    return {key: np.array(value) for key, value in content.items()}


def quadruped():
    return load(pybullet_robot("a1/a1.urdf"), floating_base=True)


def arm():
    return load(pybullet_robot("kuka_iiwa/model.urdf"))


ROBOTS = [centauro, quadruped, arm]

MASSLESS = """<robot name="stick">
  <link name="world"/><link name="hand"/>
  <link name="arm"><inertial><origin xyz="0 0 -0.5"/><mass value="2"/>
    <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="shoulder" type="continuous"><parent link="world"/><child link="arm"/><axis xyz="0 1 0"/>
    <limit velocity="10" effort="20"/></joint>
  <joint name="wrist" type="continuous"><parent link="arm"/><child link="hand"/><axis xyz="0 1 0"/>
    <limit velocity="10" effort="20"/></joint>
</robot>"""


def at_random(robot, seed=0):
    random = np.random.default_rng(seed)
    robot.state.position, robot.state.velocity = random.uniform(-1, 1, (2, robot.size))
    return random


def test_dynamics_are_those_of_the_original(original):
    robot = centauro()
    model = DynamicModel(robot)
    robot.state.position, robot.state.velocity = original["q"], original["qd"]
    model.update()
    assert_allclose(model.bias, original["nle"], rtol=0, atol=1e-8)
    assert_allclose(model.inertia, original["M"].reshape(48, 48), rtol=0, atol=1e-8)
    assert_allclose(model.inertia_inverse, original["Minv"].reshape(48, 48), rtol=1e-8, atol=1e-8)


def test_projection_gives_the_originals_gravity_compensation(original):
    robot = centauro()
    projected = ProjectedDynamics(DynamicModel(robot))
    robot.state.position, robot.state.velocity = original["q"], original["qd"]
    projected.constrain(original["Jc"].reshape(12, 48))
    projected.update()
    actuated = projected.projection.copy()
    actuated[:, :6] = 0.0
    torque = np.linalg.pinv(actuated) @ projected.bias
    assert_allclose(torque, original["tau_gc"], rtol=0, atol=1e-6)


@pytest.mark.parametrize("load", ROBOTS)
def test_the_inverse_is_the_inverse(load):
    robot = load()
    model = DynamicModel(robot)
    at_random(robot)
    model.update()
    assert_allclose(model.inertia @ model.inertia_inverse, np.eye(robot.size), atol=1e-9)
    assert_allclose(model.inertia, model.inertia.T)


@pytest.mark.parametrize("size", [29, 30, 120])
def test_a_long_chain_has_its_inverse(size):
    """Beyond some 30 joints in a row LAPACK inverts in place, with the same result to rounding."""
    robot = Robot.load(chain(size))
    at_random(robot)
    model = DynamicModel(robot)
    inverse = model.inertia_inverse
    assert_allclose(inverse, np.linalg.inv(model.inertia), rtol=0, atol=1e-9 * abs(inverse).max())
    assert_allclose(inverse, inverse.T, rtol=0, atol=0)
    at_random(robot, seed=1)
    assert model.inertia_inverse is inverse  # in place, also the second time
    assert_allclose(inverse @ model.inertia, np.eye(size), rtol=0, atol=1e-6)


@pytest.mark.parametrize("load", ROBOTS)
def test_constraint_forces_do_not_pass_the_projection(load):
    """Random constraints of changing size: projected dynamics contain nothing of J^T, and invert each other."""
    robot = load()
    random = at_random(robot)
    model = DynamicModel(robot)
    projected = ProjectedDynamics(model)
    size = robot.size
    for rows in (3, 5, 0, 5):
        jacobian = random.normal(size=(rows, size))
        projected.constrain(jacobian)
        projected.update()
        projection = projected.projection
        assert projected.rank == rows
        assert_allclose(projection @ jacobian.T, 0.0, atol=1e-12)
        assert_allclose(projected.bias, projection @ model.bias, rtol=1e-9, atol=1e-9)
        assert_allclose(projected.inertia, projection @ model.inertia, rtol=1e-9, atol=1e-9)
        assert_allclose(projected.inertia @ projected.inertia_inverse, np.eye(size - rows), atol=1e-9)
        assert_allclose(projected.decompose(model.bias, np.zeros(size)), projected.bias, atol=1e-9)


@pytest.mark.parametrize("load", ROBOTS)
def test_projected_accelerations_are_those_of_the_constrained_robot(load):
    # against the KKT system of M a + h = effort + J^T f, J a = 0
    robot = load()
    random = at_random(robot, 1)
    model, size = DynamicModel(robot), robot.size
    projected = ProjectedDynamics(model)
    jacobian, effort = random.normal(size=(4, size)), random.normal(size=size)
    projected.constrain(jacobian)
    projected.update()
    acceleration = projected.inertia_inverse @ (projected.decompose(effort, np.zeros(size)) - projected.bias)
    system = np.block([[model.inertia, -jacobian.T], [jacobian, np.zeros((4, 4))]])
    solution = np.linalg.solve(system, np.concatenate([effort - model.bias, np.zeros(4)]))
    assert_allclose(acceleration, solution[:size], rtol=1e-7, atol=1e-7 * np.abs(solution[:size]).max())


def test_contacts_that_lift_give_their_directions_back():
    robot = arm()
    random = at_random(robot)
    projected = ProjectedDynamics(DynamicModel(robot))
    jacobian = random.normal(size=(4, robot.size))
    projected.constrain(jacobian)
    before = projected.bias.size
    jacobian[1] = 0.0  # inactive
    projected.constrain(jacobian)
    assert (projected.rank, projected.bias.size) == (3, before + 1)


def test_computations_follow_the_state():
    robot = quadruped()
    model = DynamicModel(robot)
    counts = lambda: [model.manager.computed(name) for name in (BIAS, INERTIA, INERTIA_INVERSE)]  # noqa: E731
    model.subscribe({BIAS: 1, INERTIA: 2})
    at_random(robot)
    model.update()
    assert counts() == [1, 1, 0]
    robot.state.velocity = robot.state.velocity + 1.0  # the inertia does not depend on it
    model.update()
    assert counts() == [2, 1, 0]
    robot.state.position[0] += 0.1  # past `write`
    model.update()
    assert counts() == [3, 2, 0]


def test_an_element_that_nobody_wants_any_more():
    robot = quadruped()
    model = DynamicModel(robot)
    model.subscribe({BIAS: 1, INERTIA: 1})
    model.unsubscribe({BIAS: 1})
    at_random(robot)
    model.update()
    assert [model.manager.computed(name) for name in (BIAS, INERTIA)] == [0, 1]


def test_components_share_computed_elements():
    """Five components, one of which uses what it did not subscribe to: bias and inertia are computed once a cycle."""
    robot = quadruped()
    model = DynamicModel(robot)
    requests = ({BIAS: 1}, {BIAS: 2, INERTIA: 1}, {}, {INERTIA: 1}, {INERTIA_INVERSE: 1})
    uses = ((BIAS,), (BIAS, BIAS, INERTIA), (INERTIA_INVERSE, BIAS), (INERTIA,), (INERTIA_INVERSE,))
    for request in requests:
        model.subscribe(request)
    for cycle in range(1, 4):
        at_random(robot, cycle)
        for used in uses:  # the third of them uses what it did not subscribe
            model.update()
            for name in used:
                value = getattr(model, name)
                assert value.any()
        expected = robot.kinematics.inertia(robot.state.position)
        assert_allclose(model.inertia, expected)
        assert [model.manager.computed(name) for name in (BIAS, INERTIA, INERTIA_INVERSE)] == [cycle] * 3


def test_a_joint_that_moves_no_mass_is_named():
    robot = Robot.load(MASSLESS)
    robot.state.position[:] = 0.3
    model = DynamicModel(robot)
    assert model.inertia[1, 1] == 0.0
    with pytest.raises(ModelError, match="nothing has inertia against a motion of 'wrist'"):
        assert model.inertia_inverse is None


def test_a_massless_end_of_a_chain_is_named():
    text = chain(60).replace("</robot>", "")
    end = '<link name="end"/><joint name="last" type="continuous"><parent link="link_60"/><child link="end"/></joint>'
    with pytest.raises(ModelError, match="against a motion of 'last' of 'chain'"):
        _ = Robot.load(f"{text}{end}</robot>").dynamics.inertia_inverse
