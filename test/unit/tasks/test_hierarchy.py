"""Hierarchies by null spaces: against NumPy's pseudo-inverses, their priorities, singularities, and memory."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import null_space
from support.allocations import check_that_it_keeps_no_memory
from support.needs import pybullet_robot
from support.robots import centauro, load
from support.unit.stacks import Rows, at_random, largest_change, repeating, stack_of

from solfer.points import CenterOfMass, LinearPoint
from solfer.tasks import Hierarchy, Task

TIGHT = 1e-7
"""Damping without effect on the results."""


@pytest.fixture
def robot():
    return at_random(centauro())


@pytest.fixture
def arm():
    return at_random(load(pybullet_robot("kuka_iiwa/model.urdf")))


def dense(levels):
    """Solve the equations of `Hierarchy` with full matrices."""
    size = levels[0][0].point.cols
    projector, velocity = np.eye(size), np.zeros(size)
    for level in levels:
        roots = np.sqrt(np.concatenate([task.weight for task in level]))
        jacobian = roots[:, None] * np.vstack([task.point.jacobian[task.selected] * task.mask for task in level])
        error = np.concatenate([task.gain * task.error.value[task.selected] + task.velocity for task in level])
        damping = np.concatenate([task.damping for task in level])
        projected = jacobian @ projector
        inverse = projected.T @ np.linalg.inv(projected @ projected.T + np.diag(damping**2))
        velocity = velocity + inverse @ (roots * error - jacobian @ velocity)
        projector = projector - np.linalg.pinv(projected) @ projected
    return velocity


@pytest.mark.parametrize("damping", [0.3, 1e-3])
def test_it_computes_its_equations(robot, damping):
    com, left, right, torso = tasks = stack_of(robot)
    left.weight, right.damping, torso.gain = (1.0, 5.0, 0.2), (damping, 0.1, 1e-4), (1.0, 2.0, 3.0)
    torso.reference.set((0.1, 0.2, 0.3, 0.9))
    for levels in ([[com], [left], [right], [torso]], [[com, torso], [left, right]], [tasks]):
        hierarchy = Hierarchy(levels)
        assert_allclose(hierarchy.update(), dense(levels), atol=1e-9)
        assert hierarchy.velocity is hierarchy.update()


@pytest.mark.parametrize("damping", [0.3, 1e-3])
def test_last_level_takes_what_is_left(arm, damping):
    """A last level with more rows than DoFs left is solved in coordinates of these."""
    random = np.random.default_rng(6)
    posture = Task("posture", Rows(arm, np.eye(7)), velocity=2.0, damping=damping)
    many = Task("many", Rows(arm, random.normal(size=(9, 7))), velocity=random.normal(size=9), damping=damping)
    many.weight = random.uniform(0.2, 5.0, 9)
    for count in (1, 2, 4):
        first = Task("first", Rows(arm, random.normal(size=(count, 7))), velocity=1.0, damping=damping)
        for last in (posture, many):
            assert_allclose(Hierarchy([first, last]).update(), dense([[first], [last]]), atol=1e-9)


def test_compatible_tasks_have_their_configured_gains(robot):
    tasks = stack_of(robot, damping=TIGHT)
    velocity = Hierarchy(tasks).update()
    for task in tasks:
        assert_allclose(task.point.jacobian @ velocity, 2.0 * task.error.value + task.velocity, atol=1e-9)


def test_a_level_changes_nothing_for_those_before_it(robot):
    levels = stack_of(robot, damping=TIGHT)
    # a task that contradicts those before it
    levels.append(Task("again", CenterOfMass(robot), velocity=(-5.0, 3.0, 9.0), damping=TIGHT))
    velocities = [Hierarchy(levels[: index + 1]).update().copy() for index in range(len(levels))]
    for index, task in enumerate(levels):
        for velocity in velocities[index + 1 :]:
            assert_allclose(task.point.jacobian @ (velocity - velocities[index]), 0.0, atol=1e-9)


@pytest.mark.parametrize("damping", [TIGHT, 1e-3, 1.0])
def test_a_repeating_level_does_not_disturb_higher_ones(arm, damping):
    random = np.random.default_rng(1)
    for _ in range(20):
        matrix = random.normal(size=(3, 7))
        high = Task("high", Rows(arm, matrix), velocity=1.0, damping=damping)
        low = Task("low", Rows(arm, [*matrix, random.normal(size=7)]), velocity=-9.0, damping=damping)
        alone = Hierarchy([high]).update()
        both = Hierarchy([high, low]).update()
        assert_allclose(matrix @ both, matrix @ alone, atol=1e-9)
        assert np.abs(both - alone).max() > 0.1


@pytest.mark.daily(4)
@pytest.mark.parametrize("noise", [0.0, 1e-14, 1e-12, 1e-10, 1e-8, 1e-6])
@pytest.mark.parametrize("damping", [1e-5, 1e-3, 1.0])
def test_rows_that_repeat_almost_do_no_harm(arm, noise, damping):
    for seed in range(50):
        assert largest_change(repeating(arm, seed, noise, damping), Hierarchy) < 1e-9


def test_singular_tasks_stay_bounded(arm):
    x, y = np.eye(7)[:2]
    both = [Task("one", Rows(arm, [x, y]), velocity=1.0), Task("two", Rows(arm, [x]), velocity=4.0, weight=2.0)]
    assert_allclose(Hierarchy([both]).update()[:3], (3.0, 1.0, 0.0), rtol=1e-3)
    assert_allclose(Hierarchy(both).update()[:3], (1.0, 1.0, 0.0), rtol=1e-3)
    nothing = Task("nothing", Rows(arm, np.zeros((2, 7))), velocity=1e3)
    assert_allclose(Hierarchy([nothing, both[0]]).update()[:3], (1.0, 1.0, 0.0), rtol=1e-3)


def test_singular_pseudo_inverse_is_that_of_the_original(arm):
    matrix = np.arange(1.0, 10.0).reshape(3, 3)
    expected = [[-0.638889, -0.166667, 0.305556], [-0.055556, 0.0, 0.055556], [0.527778, 0.166667, -0.194444]]
    for column in range(3):
        task = Task("matrix", Rows(arm, matrix), velocity=np.eye(3)[column], damping=1e-4)
        assert_allclose(Hierarchy([task]).update()[:3], np.array(expected)[:, column], atol=2e-6)


def test_singular_values_show_contradictions(robot):
    com, left, right, torso = stack_of(robot)
    hierarchy = Hierarchy([com, [left, right], torso, Task("again", com.point)])
    hierarchy.update()
    values = hierarchy.smallest_singular_values
    jacobians = [com.point.jacobian, np.vstack([left.point.jacobian, right.point.jacobian]), torso.point.jacobian]
    for index, jacobian in enumerate(jacobians):
        above = np.vstack([np.zeros((1, robot.size)), *jacobians[:index]])
        assert_allclose(values[index], np.linalg.svd(jacobian @ null_space(above), compute_uv=False)[-1], rtol=1e-9)
    assert values[3] < 1e-12 < values[2]


def test_more_rows_than_dofs_are_singular(arm):
    hierarchy = Hierarchy([Task("many", Rows(arm, np.random.default_rng(0).normal(size=(9, 7))), velocity=1.0)])
    assert np.isfinite(hierarchy.update()).all()
    assert hierarchy.smallest_singular_values == [0.0]


def test_dofs_that_do_not_count_stay_still(robot):
    hand = LinearPoint("arm1_7", robot)
    dofs = [name for name in robot.dofs if name.startswith("j_arm1")]
    velocity = Hierarchy([Task("hand", hand, velocity=0.1, dofs=dofs, damping=TIGHT)]).update()
    assert_allclose(hand.jacobian @ velocity, 0.1, atol=1e-9)
    assert {robot.dofs[index] for index in np.flatnonzero(velocity)} <= set(dofs)


def test_errors_decay_with_the_gain(robot):
    task = Task("hand", LinearPoint("arm1_7", robot), 2.0, damping=TIGHT)
    task.reference.set(task.point.value + (0.05, -0.02, 0.04))
    hierarchy, period = Hierarchy([task, Task("com", CenterOfMass(robot), damping=TIGHT)]), 1e-3
    start = np.linalg.norm(task.error.value) or np.linalg.norm((0.05, -0.02, 0.04))
    for _ in range(1000):
        robot.state.position += period * hierarchy.update()
        robot.update()
    hierarchy.update()
    assert_allclose(np.linalg.norm(task.error.value) / start, np.exp(-2.0), rtol=5e-3)


def test_nan_inputs_give_nan_velocities(robot):
    com, left, right, torso = stack_of(robot)
    left.velocity[0] = np.nan
    assert np.isnan(Hierarchy([com, left, right, torso]).update()).any()


@pytest.mark.slow
def test_a_cycle_keeps_no_memory(robot):
    hierarchy = Hierarchy(stack_of(robot))

    def cycle():
        robot.state.position += 1e-6
        robot.update()
        hierarchy.update()

    check_that_it_keeps_no_memory(cycle)
