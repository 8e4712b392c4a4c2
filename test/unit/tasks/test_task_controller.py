"""Stacks that change while the robot moves: no jump of velocities, and common levels are served all the time."""

import gc
from functools import partial

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.robots import centauro
from support.unit.stacks import at_random, stack_of

from solfer.errors import TaskError
from solfer.points import Handler, LinearPoint
from solfer.tasks import Hierarchy, QpHierarchy, Task, TaskController, joint_bounds

PERIOD, DURATION = 0.002, 0.1  # [s]
STEEPEST = 1.875
"""Largest slope of the weight over the progress."""


@pytest.fixture
def robot():
    return at_random(centauro())


@pytest.fixture
def tasks(robot):
    return dict(zip(("com", "left", "right", "torso"), stack_of(robot), strict=True))


def run(controller, cycles=60):
    """Collect the velocities of that many cycles, shape (cycles + 1, n); the first one is from before."""
    return np.array([controller.velocity.copy(), *(controller.update().copy() for _ in range(cycles))])


def largest_step(controller, cycles=60):
    """Return the largest change of a velocity in a cycle, and the whole change."""
    velocities = run(controller, cycles)
    return np.abs(np.diff(velocities, axis=0)).max(), np.abs(velocities[-1] - velocities[0]).max()


def test_the_first_tasks_come_in_smoothly(robot, tasks):
    controller = TaskController(robot, PERIOD)
    assert not controller.update().any() and not controller.is_changing
    controller.change([tasks["com"], tasks["left"]], DURATION)
    assert controller.is_changing
    step, whole = largest_step(controller)
    assert 0.0 < step <= 1.01 * STEEPEST * PERIOD / DURATION * whole
    assert not controller.is_changing
    assert_allclose(controller.velocity, Hierarchy([tasks["com"], tasks["left"]]).update(), atol=1e-12)


CHANGES = {
    "insert behind": (
        lambda controller, tasks: controller.insert(tasks["right"], duration=DURATION),
        [["com"], ["left"], ["right"]],
    ),
    "insert first": (
        lambda controller, tasks: controller.insert(tasks["right"], 0, DURATION),
        [["right"], ["com"], ["left"]],
    ),
    "insert a group": (
        lambda controller, tasks: controller.insert([tasks["right"], tasks["torso"]], 1, DURATION),
        [["com"], ["right", "torso"], ["left"]],
    ),
    "remove": (lambda controller, tasks: controller.remove(tasks["com"], DURATION), [["left"]]),
    "exchange": (
        lambda controller, tasks: controller.exchange(tasks["left"], tasks["right"], DURATION),
        [["com"], ["right"]],
    ),
    "all": (lambda controller, tasks: controller.change([tasks["torso"]], DURATION), [["torso"]]),
    "none": (lambda controller, tasks: controller.change([], DURATION), []),
}


@pytest.mark.parametrize("name", CHANGES)
@pytest.mark.parametrize("kind", ["null space", "qp"])
def test_no_change_makes_velocities_jump(robot, tasks, name, kind):
    change, expected = CHANGES[name]
    make = Hierarchy if kind == "null space" else partial(QpHierarchy, bounds=joint_bounds(robot, 0.5))
    controller = TaskController(robot, PERIOD, make)
    controller.change([tasks["com"], tasks["left"]], PERIOD)
    run(controller, 3)
    change(controller, tasks)
    step, whole = largest_step(controller)
    assert 0.0 < step <= 1.01 * STEEPEST * PERIOD / DURATION * whole
    assert [[task.name for task in level] for level in controller.levels] == expected
    levels = [[tasks[name] for name in level] for level in expected]
    goal = make(levels).update() if levels else np.zeros(robot.size)
    assert_allclose(controller.velocity, goal, atol=1e-9)


def test_accelerations_are_continuous_at_both_ends_of_a_change(robot, tasks):
    controller = TaskController(robot, PERIOD)
    controller.change([tasks["com"]], PERIOD)
    run(controller, 3)
    controller.insert(tasks["left"], duration=DURATION)
    velocities = run(controller)
    steps = np.abs(np.diff(velocities, axis=0)).max(axis=1) / np.abs(velocities[-1] - velocities[0]).max()
    (moving,) = np.nonzero(steps > 1e-9)
    assert moving[0] == 0 and moving[-1] == round(DURATION / PERIOD) - 1
    # 10 u^3 at the ends; half as steep as a cubic already is would be 1e-3
    assert steps[moving[[0, -1]]] == pytest.approx(10.0 * (PERIOD / DURATION) ** 3, rel=0.05)


def test_a_common_level_is_always_served(robot, tasks):
    com = tasks["com"]
    com.damping = 1e-6
    controller = TaskController(robot, PERIOD)
    controller.change([com, tasks["left"]], PERIOD)
    run(controller, 3)
    controller.exchange(tasks["left"], tasks["right"], DURATION)
    for velocity in run(controller)[1:]:
        assert_allclose(com.point.jacobian @ velocity, com.velocity, atol=1e-8)


def test_changes_may_overlap_but_not_without_end(robot, tasks):
    """Three blends at a time keep the steps of velocities bounded; a fourth is refused and changes no level."""
    controller = TaskController(robot, PERIOD)
    controller.change([tasks["com"]], DURATION)
    steps = [largest_step(controller, 20)[0]]
    controller.insert(tasks["left"], duration=DURATION)
    steps.append(largest_step(controller, 5)[0])
    controller.insert(tasks["right"], duration=DURATION)
    steps.append(largest_step(controller, 5)[0])
    before = controller.levels
    with pytest.raises(TaskError, match="3 changes are under way"):
        controller.remove(tasks["com"], DURATION)
    assert controller.levels == before
    steps.append(largest_step(controller, 60)[0])
    largest = max(np.abs(Hierarchy(list(tasks.values())[:count]).update()).max() for count in (1, 2, 3))
    assert max(steps) <= 2.0 * 1.01 * STEEPEST * PERIOD / DURATION * 2.0 * largest
    assert not controller.is_changing
    assert_allclose(controller.velocity, Hierarchy([*(level[0] for level in before)]).update(), atol=1e-12)


def test_changes_between_two_updates_are_one(robot, tasks):
    controller = TaskController(robot, PERIOD)
    for task in tasks.values():
        controller.insert(task, 0, 5.0)
    controller.remove(tasks["left"], DURATION)
    step, whole = largest_step(controller, round(DURATION / PERIOD) + 1)
    assert step <= 1.01 * STEEPEST * PERIOD / DURATION * whole
    assert not controller.is_changing
    assert_allclose(controller.velocity, Hierarchy([tasks[name] for name in ("torso", "right", "com")]).update())


def test_what_cannot_be_is_refused_and_changes_nothing(robot, tasks):
    """A robot that moves must keep its stack when a change is wrong, whatever kind of mistake it is."""
    controller = TaskController(robot, PERIOD)
    controller.change([tasks["com"]], DURATION)
    other = Task("other", LinearPoint("arm1_7", centauro()))
    for change, text in (
        (lambda: controller.remove(tasks["left"]), "task 'left': it is not among the tasks\n  expected: one of com"),
        (lambda: controller.exchange(tasks["left"], tasks["right"]), "task 'left': it is not among"),
        (lambda: controller.insert(tasks["left"], 2), "task 'left': level 2\n  expected: 0 to 1"),
        (lambda: controller.insert(tasks["com"]), "task 'com': a stack has two tasks of this name"),
        (lambda: controller.insert(other), "task 'other': it belongs to another Robot"),
        (lambda: controller.insert("com"), "a level consists of tasks, got str"),
        (lambda: controller.change([tasks["left"]], 0.0), "a change within 0 s"),
        (lambda: controller.change([tasks["left"]], np.nan), "a change within nan s"),
    ):
        with pytest.raises(TaskError, match=text):
            change()
        assert controller.levels == ((tasks["com"],),)


def test_stacks_that_have_gone_are_given_back(robot, tasks):
    controller = TaskController(robot, PERIOD)
    controller.change([tasks["com"], tasks["left"]], PERIOD)

    def kept(changes):
        """Count the Handlers left after some changes: those of the last stack, and at most one that owns each point."""
        for index in range(changes):
            old, new = ("left", "right") if index % 2 == 0 else ("right", "left")
            controller.exchange(tasks[old], tasks[new], 2.0 * PERIOD)
            run(controller, 4)
        gc.collect()
        return sum(type(one) is Handler for one in gc.get_objects())

    assert kept(40) <= kept(4)
    assert not controller.is_changing
