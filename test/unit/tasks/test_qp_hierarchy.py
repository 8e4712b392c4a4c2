"""Hierarchies by QPs: agreement with null spaces, limits, slacks, and failures of a QP."""

from functools import partial

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.optimize import linprog
from support.allocations import check_that_it_keeps_no_memory
from support.needs import pybullet_robot
from support.robots import centauro, load
from support.unit.optimality import imbalance
from support.unit.stacks import Rows, at_random, largest_change, repeating, stack_of

from solfer.numerics.bounds.velocity import VelocityBounds
from solfer.numerics.solvers.qp import QpSolver, QpStatus
from solfer.points import LinearPoint
from solfer.tasks import (
    Constraint,
    Hierarchy,
    QpFailed,
    QpHierarchy,
    QpPolicy,
    Stack,
    Task,
    TorqueLimits,
    joint_bounds,
)
from solfer.tasks.qp_level import Inequalities, QpLevel

PERIOD = 0.002  # [s]


@pytest.fixture
def robot():
    return at_random(centauro())


@pytest.fixture
def arm():
    return at_random(load(pybullet_robot("kuka_iiwa/model.urdf")))


@pytest.mark.parametrize("damping", [1e-1, 1e-2, 1e-3])
def test_without_limits_it_agrees_with_the_null_spaces(robot, damping):
    com, left, right, torso = tasks = stack_of(robot, damping=damping)
    left.weight, right.damping, torso.damping = (1.0, 5.0, 0.2), 2.0 * damping, (damping, 2.0 * damping, damping)
    torso.reference.set((0.1, 0.2, 0.3, 0.9))
    for levels in (tasks, [[com, torso], [left, right]], [tasks], [*tasks, Task("again", com.point, velocity=9.0)]):
        hierarchy = QpHierarchy(levels)
        assert_allclose(hierarchy.update(), Hierarchy(levels).update(), atol=1e-6)
        assert [solution.status for solution in hierarchy.solutions] == [QpStatus.SOLVED] * len(levels)
        assert (hierarchy.smallest_singular_values[:-1] > 1e-3).all()


@pytest.mark.parametrize("scale", [1.0, 1e9])
def test_levels_without_limits_need_no_qp(robot, scale):
    """The slope that is left counts as a ratio of its largest term, also where some joints stand still."""
    tasks = stack_of(robot, dofs=robot.actuated.tolist(), damping=1e-2)
    for task in tasks:
        task.velocity *= scale
    hierarchy = QpHierarchy(tasks)
    assert np.abs(hierarchy.update()).max() > scale
    assert [solution.problem for solution in hierarchy.solutions] == [None] * len(tasks)


def test_the_configured_gain_acts(robot):
    task = Task("hand", LinearPoint("arm1_7", robot), 3.0, reference=(0.5, 0.5, 1.0), damping=1e-3)
    for solver in (Hierarchy([task]), QpHierarchy([task]), QpHierarchy([task], joint_bounds(robot, 10 * PERIOD))):
        rate = task.point.jacobian @ solver.update()
        assert_allclose(rate, 3.0 * ((0.5, 0.5, 1.0) - task.point.value), rtol=1e-4)


def test_velocities_stay_in_their_bounds(robot):
    """Random postures: bounds hold exactly, and a lower level never changes what an upper one reaches."""
    tasks = stack_of(robot)
    bounds = joint_bounds(robot, PERIOD)
    random, start = np.random.default_rng(2), robot.state.position.copy()
    for _ in range(20):
        robot.state.position[:] = start + random.uniform(-0.3, 0.3, robot.size)
        robot.update()
        reached = []
        for count in range(1, len(tasks) + 1):
            hierarchy = QpHierarchy(tasks[:count], bounds)
            velocity = hierarchy.update()
            assert all(solution.is_solved for solution in hierarchy.solutions)
            assert (velocity >= bounds.lower).all() and (velocity <= bounds.upper).all()
            reached.append([task.point.jacobian @ velocity for task in tasks[:count]])
        for before, after in zip(reached, reached[1:], strict=False):
            assert_allclose(np.concatenate(after[: len(before)]), np.concatenate(before), atol=1e-5)


def test_levels_are_optimal_under_active_limits(robot):
    tasks, bounds = stack_of(robot, dofs=robot.actuated.tolist()), joint_bounds(robot, PERIOD)
    for task in tasks:
        task.velocity *= 20.0
    hierarchy = QpHierarchy(tasks, bounds)
    velocity = hierarchy.update()
    at_limits = np.minimum(velocity - bounds.lower, bounds.upper - velocity) < 1e-8
    assert np.count_nonzero(at_limits) > 15
    for solution in hierarchy.solutions:
        assert solution.is_solved
        assert imbalance(solution.problem, solution.x) < 1e-6


def test_a_second_level_departs_as_little_as_it_can_from_a_first_one_at_a_bound(arm):
    speed = np.full(7, 10.0)
    speed[0] = 0.2
    bounds = VelocityBounds(arm.dofs, np.full(7, -np.inf), np.full(7, np.inf), speed, PERIOD)
    row = np.array([[1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0]])
    first, second = (
        Task("sum", Rows(arm, row), velocity=3.0, damping=1e-4),
        Task("one", Rows(arm, np.eye(7)[1:2]), velocity=2.0, damping=1e-4),
    )
    alone, both = QpHierarchy([first], bounds).update(), QpHierarchy([first, second], bounds).update()
    assert_allclose(alone, (0.2, 1.4, 1.4, 0.0, 0.0, 0.0, 0.0), atol=1e-6)
    # what is left of the sum, 1.0, as near to 0.2 and 1.4 as it can be
    assert_allclose(both, (-0.1, 2.0, 1.1, 0.0, 0.0, 0.0, 0.0), atol=1e-6)


@pytest.mark.daily(4)
@pytest.mark.parametrize("noise", [0.0, 1e-14, 1e-12, 1e-10, 1e-8, 1e-6])
@pytest.mark.parametrize("damping", [1e-5, 1e-3, 1.0])
def test_rows_that_repeat_almost_do_no_harm(arm, noise, damping):
    bounds = VelocityBounds(arm.dofs, np.full(7, -np.inf), np.full(7, np.inf), np.full(7, 3.0), PERIOD)
    # `stop` raises where a QP is not solved
    make = partial(QpHierarchy, bounds=bounds, policy="stop")
    for seed in range(20):
        assert largest_change(repeating(arm, seed, noise, damping), make) < 1e-9


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_level_takes_what_the_one_before_it_left_beyond_limits(arm, sign):
    bounds = VelocityBounds(arm.dofs, np.full(7, -np.inf), np.full(7, np.inf), np.ones(7), PERIOD)
    wall = Inequalities([Constraint("wall", np.eye(7)[1:2], -0.5, 0.5)], 7)
    wall.update()
    stack = Stack([Task("first", Rows(arm, np.eye(7)[2:3])), Task("second", Rows(arm, np.eye(7)[3:4]), velocity=0.3)])
    stack.update()
    before = sign * np.array((1.0 + 1e-5, 0.5 + 1e-5, 0.1, 0.0, 0.0, 0.0, 0.0))
    solution = QpLevel(stack, 1, bounds, wall, np.full(1, np.inf), basis=np.zeros((2, 7))).solve(before)
    assert solution.is_solved
    assert_allclose(solution.x, before + 0.3 * np.eye(7)[3], rtol=0.0, atol=1e-6)


def test_a_joint_outside_its_range_comes_back(arm):
    upper = arm.upper_limits.position
    arm.state.position[3] = upper[3] + 0.1
    arm.update()
    bounds = joint_bounds(arm, PERIOD)
    row = np.eye(7)[3:4]
    out, back = (Task("joint", Rows(arm, row), velocity=sign * 0.5) for sign in (1.0, -1.0))
    assert QpHierarchy([out], bounds, policy="stop").update()[3] == 0.0
    assert_allclose(QpHierarchy([back], bounds, policy="stop").update()[3], -0.5, rtol=1e-3)


def test_positions_of_the_bounds_may_be_commanded_ones(arm):
    command = arm.upper_limits.position.copy()
    task = Task("joint", Rows(arm, np.eye(7)[:1]), velocity=1.0)
    assert QpHierarchy([task], joint_bounds(arm, PERIOD), position=command).update()[0] == 0.0
    assert QpHierarchy([task], joint_bounds(arm, PERIOD)).update()[0] > 0.5


def test_constraints_bound_what_tasks_reach(arm):
    hand = LinearPoint("lbr_iiwa_link_7", arm)
    task = Task("hand", hand, velocity=(1.0, 0.0, 0.0))
    wall = Constraint("wall", arm.kinematics.jacobian("lbr_iiwa_link_7")[:1], -np.inf, 0.2)
    velocity = QpHierarchy([task, Task("rest", Rows(arm, np.eye(7)))], constraints=[wall]).update()
    assert_allclose(hand.jacobian[0] @ velocity, 0.2, atol=1e-6)


def test_constraints_bound_later_levels_too(arm):
    first = Task("joint", Rows(arm, np.eye(7)[:1]), velocity=0.1)
    second = Task("others", Rows(arm, np.eye(7)[1:4]), velocity=1.0)
    sum_of_all = np.ones((1, 7))
    wall = Constraint("wall", sum_of_all, -np.inf, 0.4)
    free, bound = QpHierarchy([first, second]).update(), QpHierarchy([first, second], constraints=[wall]).update()
    assert sum_of_all @ free > 2.0
    assert sum_of_all @ bound == pytest.approx(0.4, abs=1e-6) and bound[0] == pytest.approx(0.1, abs=1e-4)


def test_a_slack_weighs_its_violation_against_the_tasks(arm):
    task = Task("joint", Rows(arm, np.eye(7)[:1]), velocity=1.0, weight=3.0)
    soft = Constraint("soft", np.eye(7)[:1], -np.inf, 0.0, weight=1.0)
    hierarchy = QpHierarchy([task, Task("more", Rows(arm, np.eye(7)[:2]), velocity=5.0)], constraints=[soft])
    # the least of 3 (v - 1)^2 + v^2; the second level does not enlarge the violation
    assert_allclose(hierarchy.update()[:2], (0.75, 5.0), rtol=1e-3)


def test_torque_limits_bound_required_torques(arm):
    arm.state.velocity[:] = np.random.default_rng(5).uniform(-0.1, 0.1, 7)
    arm.update()
    limit = np.abs(arm.dynamics.bias) + 20.0
    torque = TorqueLimits(arm.dynamics, PERIOD, limit)
    torque.force[:] = 3.0
    task = Task("all", Rows(arm, np.eye(7)), velocity=np.resize((2.0, -2.0), 7), damping=1e-2)
    velocity = QpHierarchy([task], constraints=[torque], policy="stop").update()
    acceleration = (velocity - arm.state.velocity) / PERIOD
    asked = arm.dynamics.inertia @ acceleration + arm.dynamics.bias - 3.0
    assert (np.abs(asked) <= limit * (1.0 + 1e-5)).all()
    assert (np.abs(asked) > limit * (1.0 - 1e-5)).any()


def contradictory(arm, seed):
    """Make two walls that leave no space between them, in addition to the joints' own bounds."""
    random = np.random.default_rng(seed)
    row, gap = random.normal(size=(1, 7)), random.uniform(0.05, 0.2)
    return [
        Constraint("above", row, gap, np.inf),
        Constraint("below", -row, gap, np.inf),
        Constraint("other", random.normal(size=(1, 7)), -0.1, 0.1),
    ]


@pytest.mark.slow
@pytest.mark.parametrize("policy", ["hold", "stop", "relax"])
def test_infeasible_levels_end_in_the_stated_policy(arm, policy):
    """SciPy's linprog confirms each contradiction; the QP must notice it in few iterations, and act as configured."""
    bounds = joint_bounds(arm, PERIOD)
    tasks = [Task("joints", Rows(arm, np.eye(7)), velocity=0.1), Task("more", Rows(arm, np.ones((1, 7))))]
    for seed in range(200):
        constraints = contradictory(arm, seed)
        matrix = np.vstack([constraint.matrix for constraint in constraints[:2]])
        assert linprog(np.zeros(7), -matrix, -np.full(2, constraints[0].lower[0]), bounds=(None, None)).status == 2
        hierarchy = QpHierarchy(tasks, bounds, constraints, policy)
        if policy == "stop":
            with pytest.raises(QpFailed, match=r"level 0 \(joints\): the QP is infeasible") as caught:
                hierarchy.update()
            assert caught.value.solution is hierarchy.solutions[0]
        else:
            velocity = hierarchy.update()
        failed = hierarchy.solutions[0]
        assert failed.status is QpStatus.INFEASIBLE and failed.problem is not None and failed.iterations <= 8 * (7 + 3)
        if policy == "relax":
            assert hierarchy.relaxed.is_solved and hierarchy.solutions[1].is_solved
            # both walls are violated alike: their costs cancel out
            assert abs((constraints[0].matrix @ velocity).item()) < 1e-3
            assert (velocity >= bounds.lower).all() and (velocity <= bounds.upper).all() and velocity.any()
        else:
            assert hierarchy.relaxed is None and hierarchy.solutions[1] is None
            assert_array_equal(hierarchy.velocity, 0.0)


@pytest.mark.parametrize("policy", ["hold", "stop", "relax"])
def test_inaccurate_levels_end_in_the_stated_policy(arm, policy, monkeypatch, caplog):
    # no solution is as exact as that
    monkeypatch.setattr("solfer.tasks.qp_level.QpSolver", partial(QpSolver, tolerance=1e-18))
    walls = [Constraint("wall", np.random.default_rng(1).normal(size=(2, 7)), -0.01, 0.01)]
    tasks = [Task("joints", Rows(arm, np.eye(7)), velocity=np.linspace(0.1, 0.3, 7))]
    hierarchy = QpHierarchy(tasks, joint_bounds(arm, PERIOD), walls, policy)
    if policy == "stop":
        with pytest.raises(QpFailed, match=r"level 0 \(joints\): the QP is inaccurate"):
            hierarchy.update()
    else:
        hierarchy.update()
        assert "the QP is inaccurate" in caplog.text and "add nothing" in caplog.text
    assert hierarchy.solutions[0].status is QpStatus.INACCURATE
    assert (hierarchy.relaxed is not None) == (policy == "relax")
    assert_array_equal(hierarchy.velocity, 0.0)


def test_infeasible_levels_are_logged_once(arm, caplog):
    hierarchy = QpHierarchy([Task("joints", Rows(arm, np.eye(7)))], None, contradictory(arm, 0))
    for _ in range(5):
        hierarchy.update()
    assert len(caplog.messages) == 1
    assert "level 0 (joints): the QP is infeasible" in caplog.text and "add nothing" in caplog.text
    assert "left of their rates: joints 0" in caplog.text


def test_it_goes_on_as_soon_as_it_can(arm):
    constraints = contradictory(arm, 3)
    hierarchy = QpHierarchy([Task("joints", Rows(arm, np.eye(7)), velocity=0.1)], None, constraints)
    assert not hierarchy.update().any()
    for constraint in constraints:
        constraint.lower[:] = -np.inf
    assert_allclose(
        hierarchy.update(),
        QpHierarchy([Task("joints", Rows(arm, np.eye(7)), velocity=0.1)], None, constraints).update(),
    )
    assert hierarchy.velocity.any() and hierarchy.solutions[0].is_solved


def test_a_nan_task_is_a_failure(arm):
    first, second = (Task(name, Rows(arm, np.eye(7)[:2]), velocity=0.1) for name in ("first", "second"))
    second.velocity[0] = np.nan
    hierarchy = QpHierarchy([first, second])
    velocity = hierarchy.update()
    assert hierarchy.solutions[1].status is QpStatus.NOT_FINITE
    assert_allclose(velocity, Hierarchy([first]).update(), atol=1e-6)


def test_a_policy_may_be_a_member(arm):
    task = Task("joints", Rows(arm, np.eye(7)))
    assert QpHierarchy([task], policy=QpPolicy.STOP).policy is QpPolicy("stop")


@pytest.mark.slow
def test_a_cycle_keeps_no_memory(robot):
    com, left = stack_of(robot)[:2]
    left.velocity = 1e3  # beyond the limits: no level is solved by null spaces in some cycles alone
    hierarchy = QpHierarchy([com, left], joint_bounds(robot, PERIOD))

    def cycle():
        robot.state.position += 1e-6
        robot.update()
        hierarchy.update()

    check_that_it_keeps_no_memory(cycle)
    assert all(solution.is_solved for solution in hierarchy.solutions)


@pytest.mark.slow
def test_nor_does_one_with_torque_limits(arm):
    hierarchy = QpHierarchy(
        [Task("hand", LinearPoint("lbr_iiwa_link_7", arm), velocity=0.1), Task("rest", Rows(arm, np.eye(7)))],
        joint_bounds(arm, PERIOD),
        [TorqueLimits(arm.dynamics, PERIOD, weight=1.0)],
    )

    def cycle():
        arm.state.position += 1e-6
        arm.update()
        hierarchy.update()

    check_that_it_keeps_no_memory(cycle)
    assert all(solution.is_solved for solution in hierarchy.solutions)
