"""Angular momentum against Pinocchio and against moving bodies, postures, and tasks on both."""

import numpy as np
import pinocchio as pin
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation
from support.allocations import check_that_it_keeps_no_memory
from support.unit.random_states import ROBOTS, load, put, states

from solfer.errors import PointError, SizeMismatch, UnknownName
from solfer.points import AngularMomentum, CenterOfMass, Handler, LinearPoint, Posture
from solfer.tasks import Hierarchy, QpHierarchy, Task

STEP = 1e-6


@pytest.fixture(scope="module", params=ROBOTS)
def robot_and_links(request):
    return load(request.param)


@pytest.fixture(scope="module")
def quadruped():
    return load("quadruped")


def test_angular_momentum_is_that_of_pinocchio(robot_and_links):
    """Pinocchio's centroidal map is the oracle for matrix and momentum, alone and in a Handler."""
    robot, links = robot_and_links
    model = robot.kinematics._model
    data = model.createData()
    alone, point = AngularMomentum(robot), AngularMomentum(robot)
    handler = Handler([LinearPoint(links[0], robot), point, CenterOfMass(robot)])
    for position, velocity in states(robot):
        put(robot, position, velocity)
        alone.update()
        handler.update()
        # rows: linear, then angular
        matrix = pin.computeCentroidalMap(model, data, position)
        momentum = pin.ccrba(model, data, position, velocity)
        assert_allclose(alone.jacobian, data.Ag[3:], atol=1e-9)
        assert_allclose(alone.value, data.hg.angular, atol=1e-9)
        assert_array_equal(handler.jacobian[3:6], alone.jacobian)
        assert_array_equal(handler.value[3:6], alone.value)
        assert_allclose(robot.kinematics.mass * handler.jacobian[6:], data.Ag[:3], atol=1e-9)
        assert matrix is not None and momentum is not None


def bodies(robot):
    """Return masses, centres of mass and rotations of all bodies at the last update."""
    tree = robot.kinematics.tree
    rotations = tree.placements[:, :9].reshape(-1, 3, 3).transpose(0, 2, 1).copy()
    return tree.masses, tree.placements[:, 9:] + np.einsum("bij,bj->bi", rotations, tree.levers), rotations


def test_angular_momentum_is_that_of_moving_bodies(robot_and_links):
    """The sum over bodies, moved by finite differences, uses neither Jacobians nor Pinocchio's momentum."""
    robot, _ = robot_and_links
    point = AngularMomentum(robot)
    for position, velocity in states(robot):
        put(robot, position - STEP * velocity, velocity)
        masses, before, turned = bodies(robot)
        put(robot, position + STEP * velocity, velocity)
        _, after, turned_after = bodies(robot)
        put(robot, position, velocity)
        _, centers, rotations = bodies(robot)
        spins = Rotation.from_matrix(turned_after @ turned.transpose(0, 2, 1)).as_rotvec() / (2.0 * STEP)
        levers = centers - masses @ centers / masses.sum()
        inertias = rotations @ robot.kinematics.tree.inertias @ rotations.transpose(0, 2, 1)
        orbital = np.cross(levers, masses[:, None] * (after - before) / (2.0 * STEP)).sum(axis=0)
        point.update(jacobian=False)
        assert_allclose(point.value, orbital + np.einsum("bij,bj->i", inertias, spins), atol=1e-5)


def test_angular_momentum_does_not_depend_on_the_place(quadruped):
    robot, _ = quadruped
    near, far = AngularMomentum(robot), AngularMomentum(robot)
    position, velocity = next(states(robot))
    put(robot, position, velocity)
    near.update()
    position[:3] += 1e3, -1e3, 1e3
    put(robot, position, velocity)
    far.update()
    assert_allclose(far.value, near.value, atol=1e-8)
    assert_allclose(far.jacobian, near.jacobian, atol=1e-8)


@pytest.mark.parametrize("make", [Hierarchy, QpHierarchy])
def test_a_task_keeps_the_angular_momentum(quadruped, make):
    robot, links = quadruped
    put(robot, *next(states(robot)))
    momentum, foot = AngularMomentum(robot), LinearPoint(links[0], robot)
    first = Task("momentum", momentum, gain=0.0, velocity=(0.0, 0.2, -0.1), damping=1e-5)
    velocity = make([first, Task("foot", foot, velocity=(0.1, 0.0, 0.3), damping=1e-5)]).update()
    robot.state.velocity[:] = velocity
    robot.update()
    momentum.update()
    assert_allclose(momentum.value, (0.0, 0.2, -0.1), atol=1e-6)
    assert_allclose(foot.jacobian @ velocity, (0.1, 0.0, 0.3), atol=1e-6)


def test_postures_have_the_order_of_their_dofs(robot_and_links):
    """Names and indices may be mixed, in any order: values and rows keep it, also after an assignment."""
    robot, _ = robot_and_links
    chosen = [robot.dofs[4], 0, robot.dofs[2]]
    posture, everything = Posture(robot, chosen), Posture(robot)
    assert posture.dofs.tolist() == [4, 0, 2] and posture.columns.tolist() == [0, 2, 4]
    position, velocity = next(states(robot))
    put(robot, position, velocity)
    handler = Handler([everything, posture])
    handler.update()
    assert_array_equal(handler.value, [*position, *position[[4, 0, 2]]])
    assert_array_equal(handler.jacobian, np.vstack((np.eye(robot.size), np.eye(robot.size)[[4, 0, 2]])))
    # numbers that were written over are cleared by the next update
    posture += (1.0, 1.0, 1.0)
    posture.assign(Posture(robot, [1, 2, 3]))
    posture.update()
    assert_array_equal(posture.jacobian, np.eye(robot.size)[[4, 0, 2]])


@pytest.mark.parametrize("make", [Hierarchy, QpHierarchy])
def test_a_task_pulls_joints_to_a_posture(quadruped, make):
    robot, _ = quadruped
    put(robot, *next(states(robot)))
    task = Task("posture", Posture(robot, [8, 7]), gain=2.0)
    task.reference.set(task.point.value + (0.1, -0.2))
    velocity = make([task]).update()
    assert_allclose(velocity[[8, 7]], (0.2, -0.4), rtol=1e-5)
    assert np.count_nonzero(np.abs(velocity) > 1e-12) == 2


@pytest.mark.parametrize(
    ("dofs", "error", "text"),
    [
        (
            ["FR_hip_joind"],
            UnknownName,
            "posture of 'a1_description': unknown DoF 'FR_hip_joind'\n  did you mean: FR_hip_joint",
        ),
        ([99], PointError, "posture of 'a1_description': DoF 99\n  expected: 0 to 17"),
        ([1, 1], PointError, r"posture of 'a1_description': DoFs \[1, 1\]\n  expected: at least one DoF, each once"),
        ([], PointError, r"posture of 'a1_description': DoFs \[\]"),
        ([1.5], PointError, "posture of 'a1_description': DoF 1.5"),
    ],
)
def test_dofs_that_do_not_fit_are_refused(quadruped, dofs, error, text):
    with pytest.raises(error, match=text):
        Posture(quadruped[0], dofs)


def test_a_reference_of_another_size_is_refused(quadruped):
    with pytest.raises(SizeMismatch, match="task 'posture'"):
        Task("posture", Posture(quadruped[0], [6, 7]), reference=(0.0, 0.0, 0.0))


@pytest.mark.slow
def test_a_cycle_keeps_no_memory(quadruped):
    robot, _ = quadruped
    handler = Handler([AngularMomentum(robot), Posture(robot)])

    def cycle():
        robot.state.position += 1e-6
        robot.update()
        handler.update()

    check_that_it_keeps_no_memory(cycle)
