"""What tasks, stacks, limits and controllers refuse, word for word."""

from types import SimpleNamespace

import numpy as np
import pytest
from support.unit.random_states import load

from solfer.errors import SolferError
from solfer.points import Constant, FrameOrientation, LinearPoint
from solfer.tasks import QpHierarchy, ReferenceIntegrator, Stack, Task, TaskController
from solfer.tasks.collisions import CollisionLimit
from solfer.tasks.constraints import Constraint, TorqueLimits, WorkspaceLimit, require_positive

POSITIVE = "a positive number"


@pytest.fixture(scope="module")
def robot():
    return load("centauro")[0]


@pytest.fixture
def hand(robot):
    return Task("hand", LinearPoint("arm1_7", robot))


def refusal(call):
    with pytest.raises(SolferError) as error:
        call()
    return error.value.where, error.value.what, error.value.expected


def test_a_task_says_what_it_refuses(robot, hand):
    """Wrong gains, weights and references: each text has the task, the fault and what is expected instead."""
    point = hand.point
    assert refusal(lambda: setattr(hand, "gain", (1.0, 2.0))) == (
        "task 'hand'",
        "a gain of shape (2,) for 3 rows",
        "one number, or one a row",
    )
    assert refusal(lambda: setattr(hand, "weight", 0.0)) == ("task 'hand'", "a weight of 0.0", "positive numbers")
    assert refusal(lambda: setattr(hand, "damping", -1.0)) == ("task 'hand'", "a damping of -1.0", "positive numbers")
    assert refusal(lambda: setattr(hand, "gain", -1.0)) == (
        "task 'hand'",
        "a gain of -1.0",
        "numbers that are not negative",
    )
    assert refusal(lambda: setattr(hand, "velocity", np.inf)) == ("task 'hand'", "a velocity of inf", "")
    assert refusal(lambda: setattr(hand, "gain", "fast")) == ("task 'hand'", "a gain of 'fast'", "numbers")
    moving = LinearPoint("arm2_7", robot)
    assert refusal(lambda: Task("two", point, reference=moving))[1:] == (
        f"the reference {moving} moves with a robot",
        "a point that does not; a task of `point - other` keeps two points together",
    )
    followed = Constant(3) + (1.0, 0.0, 0.0)
    follows = Task("hand", point, reference=followed)
    assert refusal(follows.hold) == ("task 'hand'", f"its reference is {followed}", "a Constant")
    assert repr(hand) == f"Task('hand': {point}, 3 rows)"


def test_stacks_say_what_they_refuse(robot, hand):
    """Empty levels, doubled names and tasks of two Robots: the text names the task that does not fit."""
    foreign = Task("foreign", LinearPoint("arm2_7", load("centauro")[0]))
    least = "at least one task"
    assert refusal(lambda: Stack([])) == ("", "a stack without a task", least)
    assert refusal(lambda: Stack([hand, []])) == ("", "a level without a task", least)
    assert refusal(lambda: Stack([[hand.point]])) == ("", "a level consists of tasks, got LinearPoint", "a Task")
    assert refusal(lambda: Stack([hand, [hand]])) == (
        "task 'hand'",
        "a stack has two tasks of this name",
        "a name of its own for each task",
    )
    assert refusal(lambda: Stack([hand, foreign])) == (
        "task 'foreign'",
        f"it belongs to another Robot ('{robot.name}') than task 'hand' ('{robot.name}')",
        "tasks of one Robot object",
    )
    turn = Task("turn", FrameOrientation("arm1_7", robot))
    assert repr(Stack([[hand, turn], Task("com", LinearPoint("arm2_7", robot))])) == "Stack(hand + turn > com)"


def test_a_controller_says_what_it_refuses(robot, hand):
    """Changes of a running stack: a refusal states the task, and what is there to choose from."""
    foreign = Task("foreign", LinearPoint("arm2_7", load("centauro")[0]))
    controller = TaskController(robot, 0.01)
    assert refusal(lambda: TaskController(robot, np.inf)) == ("", "a period of inf s", POSITIVE)
    assert refusal(lambda: controller.change([hand], 0.0)) == ("", "a change within 0 s", POSITIVE)
    assert refusal(lambda: controller.change([foreign])) == (
        "task 'foreign'",
        f"it belongs to another Robot ('{robot.name}')",
        "tasks of the controller's Robot object",
    )
    missing = "it is not among the tasks"
    assert refusal(lambda: controller.remove(hand)) == ("task 'hand'", missing, "there is no task")
    assert refusal(lambda: controller.insert(hand, at=1)) == ("task 'hand'", "level 1", "0 to 0")
    controller.insert(hand)
    assert refusal(lambda: controller.exchange(foreign, hand)) == ("task 'foreign'", missing, "one of hand")
    turn = Task("turn", FrameOrientation("arm1_7", robot))
    for change in (controller.insert, controller.remove):
        controller.update()
        change(turn)
    assert refusal(lambda: (controller.update(), controller.remove(hand))) == (
        "",
        "3 changes are under way",
        "another one when the first has ended",
    )


def test_limits_say_what_they_refuse(robot, hand):
    """Torques, workspaces, constraints and the integrator: each wrong number is refused before a QP sees it."""
    size, limits = robot.size, robot.kinematics.effort_limit.copy()
    model = robot.dynamics
    assert refusal(lambda: TorqueLimits(model, 0.0)) == ("", "torque limits with a period of 0 s", POSITIVE)
    assert refusal(lambda: TorqueLimits(model, 0.01, np.ones(2))) == (
        "",
        f"torque limits of shape (2,) for {size} DoFs",
        "",
    )
    limits[7] = -1.0
    assert refusal(lambda: TorqueLimits(model, 0.01, limits)) == (
        f"joint '{robot.kinematics.dofs[7]}'",
        "a torque limit of -1",
        POSITIVE,
    )
    vector = "a vector that moves with a robot"
    turn = FrameOrientation("arm1_7", robot)
    assert refusal(lambda: WorkspaceLimit("reach", turn, 0.0, 1.0)) == ("constraint 'reach'", str(turn), vector)
    assert refusal(lambda: WorkspaceLimit("reach", Constant(3), 0.0, 1.0))[2] == vector
    assert refusal(lambda: WorkspaceLimit("reach", hand.point, 0.5, 0.4)) == (
        "constraint 'reach'",
        "a distance from 0.5 to 0.4 m",
        "0 <= r <= R",
    )
    assert WorkspaceLimit("reach", hand.point, 0.5, 0.5).rows == 1
    assert refusal(lambda: require_positive(np.inf, "a horizon", "here")) == ("here", "a horizon of inf s", POSITIVE)
    assert refusal(lambda: QpHierarchy([hand], constraints=["reach"])) == (
        "",
        "a QP has constraints, got str",
        "a Constraint",
    )
    assert refusal(lambda: Constraint("c", np.ones((1, size)), 0.0, 1.0, -1.0))[::2] == (
        "constraint 'c'",
        "a positive number, or None",
    )
    assert refusal(lambda: Constraint("c", np.ones((1, size)), 1.0, 0.5)) == (
        "constraint 'c'",
        "row 0 has the lower bound 1 above the upper one 0.5",
        "a lower bound that is not above the upper one",
    )
    assert refusal(lambda: Constraint("c", np.ones(size), 0.0, 1.0))[::2] == (
        "constraint 'c'",
        "a matrix (rows, n), and one number or one a row",
    )
    where = f"reference integrator of '{robot.name}'"
    assert refusal(lambda: ReferenceIntegrator(robot, 0.0)) == (where, "a period of 0 s", POSITIVE)
    assert refusal(lambda: ReferenceIntegrator(robot, 0.1, lead=0.0)) == (where, "a lead of 0.0", "positive numbers")


@pytest.mark.parametrize("least", [-0.01, np.inf, np.nan])
def test_distances_have_to_be_lengths(robot, least):
    distances = SimpleNamespace(distance=np.zeros(1))
    assert refusal(lambda: CollisionLimit(distances, robot, least)) == (
        "",
        f"a least distance of {least:g} m",
        "a number that is not negative",
    )
