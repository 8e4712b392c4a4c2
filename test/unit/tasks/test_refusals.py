"""What tasks, stacks, limits, integrators and controllers refuse."""

from types import SimpleNamespace

import numpy as np
import pytest
from support.unit.random_states import load
from support.unit.refusals import check_refusal
from support.unit.stacks import Rows

from solfer.errors import NotFinite, SizeMismatch, TaskError, UnknownName
from solfer.numerics.bounds.velocity import VelocityBounds
from solfer.points import Constant, FrameOrientation, LinearPoint
from solfer.tasks import (
    Constraint,
    QpHierarchy,
    ReferenceIntegrator,
    Stack,
    Task,
    TaskController,
    TorqueLimits,
    joint_bounds,
)
from solfer.tasks.collisions import CollisionLimit
from solfer.tasks.constraints import WorkspaceLimit, require_positive


@pytest.fixture(scope="module")
def given():
    """Make two robots CENTAURO, an arm, and tasks."""
    robot = load("centauro")[0]
    arm = load("kuka")[0]
    point = LinearPoint("arm1_7", robot)
    return SimpleNamespace(
        robot=robot,
        arm=arm,
        point=point,
        hand=Task("hand", point),
        turn=FrameOrientation("arm1_7", robot),
        other=LinearPoint("arm2_7", robot),
        foreign=Task("foreign", LinearPoint("arm2_7", load("centauro")[0])),
        joints=Task("joints", Rows(arm, np.eye(7))),
        controller=TaskController(robot, 0.01),
    )


TAGS = [
    ({"gain": -1.0}, TaskError, "a gain of -1.0 (expected: numbers that are not negative)"),
    ({"gain": (1.0, 2.0)}, SizeMismatch, "a gain of shape (2,) for 3 rows"),
    ({"gain": np.nan}, NotFinite, "a gain of nan"),
    ({"gain": "fast"}, TaskError, "a gain of 'fast' (expected: numbers)"),
    ({"velocity": (0.0, np.inf, 0.0)}, NotFinite, "a velocity of"),
    ({"weight": 0.0}, TaskError, "a weight of 0.0 (expected: positive"),
    ({"weight": -2.0}, TaskError, "a weight of -2"),
    ({"weight": ((1.0,), 2.0)}, TaskError, "a weight of"),
    ({"damping": 0.0}, TaskError, "a damping of 0"),
    ({"reference": (1.0, 2.0)}, SizeMismatch, "3 numbers are needed"),
    ({"reference": (1.0, 2.0, np.nan)}, NotFinite, "nan"),
    ({"reference": "here"}, TaskError, "a reference of 'here'"),
    ({"rows": (0, 3)}, TaskError, "row 3 (expected: 0 to 2"),
    ({"rows": (1, 1)}, TaskError, "rows [1, 1]"),
    ({"rows": ()}, TaskError, "at least one row"),
    ({"rows": (True, False, True)}, TaskError, "row True"),
    ({"rows": "x"}, UnknownName, "unknown row 'x' (expected: a number of a row"),
    ({"dofs": ("torso_yow",)}, UnknownName, "unknown DoF 'torso_yow' (did you mean torso_yaw"),
    ({"dofs": "torso_yow"}, UnknownName, "unknown DoF 'torso_yow'"),
    ({"dofs": (48,)}, TaskError, "DoF 48 (expected: 0 to 47"),
    ({"dofs": (1.5,)}, TaskError, "DoF 1.5"),
]
CONSTRAINTS = [
    ((np.ones((2, 7)), 0.0, (1.0, -1.0)), TaskError, "row 1 has the lower bound 0 above the upper one"),
    ((np.ones((2, 7)), (0.0,), 1.0), SizeMismatch, "bounds of shape (1,)"),
    ((np.ones(7), 0.0, 1.0), SizeMismatch, "a matrix of shape (7,)"),
    ((np.full((1, 7), np.nan), 0.0, 1.0), NotFinite, "a matrix that is not finite, or a bound"),
    ((np.ones((1, 7)), np.nan, 1.0), NotFinite, "a matrix that is not finite, or a bound"),
    ((np.ones((1, 7)), 0.0, 1.0, 0.0), TaskError, "a weight of 0"),
    ((np.ones((1, 7)), 0.0, 1.0, -1.0), TaskError, "a weight of -1 (expected: a positive number, or None"),
    (("wall", 0.0, 1.0), TaskError, "a matrix of 'wall'"),
]
INTEGRATORS = [
    ({"period": 0.0}, TaskError, "a period of 0 s"),
    ({"period": np.nan}, TaskError, "a period of nan s"),
    ({"lead": 0.0}, TaskError, "a lead of 0.0"),
    ({"lead": np.nan}, TaskError, "a lead of nan"),
    ({"lead": "near"}, TaskError, "a lead of 'near'"),
    ({"lead": np.ones(6)}, SizeMismatch, "a lead of shape (6,) for 7 DoFs"),
]
LEVELS = [VelocityBounds(("a",), [0.0], [1.0], [1.0], 1.0)]
JOINT = "joint 'lbr_iiwa_joint_1'"
REFUSED = [
    (lambda g: Task("still", Constant(3)), TaskError, "task 'still'", "moves with no robot"),
    (lambda g: Task("text", "hand"), TaskError, "task 'text'", "hand moves with no robot"),
    (lambda g: Task("pair", g.point, reference=g.other), TaskError, "task 'pair'", "the reference LinearPoint"),
    (lambda g: Task("turn", g.turn, reference=Constant(3)), SizeMismatch, "task 'turn'", "numbers"),
    (lambda g: Stack([]), TaskError, "", "a stack without a task"),
    (lambda g: Stack([g.hand, []]), TaskError, "", "a level without a task"),
    (lambda g: Stack([[g.point]]), TaskError, "", "a level consists of tasks, got LinearPoint"),
    (lambda g: Stack([g.hand, [g.hand]]), TaskError, "task 'hand'", "a stack has two tasks of this name"),
    (lambda g: Stack([g.hand, g.foreign]), TaskError, "task 'foreign'", "another Robot ('centauro') than task 'hand'"),
    (lambda g: TaskController(g.robot, np.inf), TaskError, "", "a period of inf s"),
    (lambda g: TaskController(g.robot, -1.0), TaskError, "", "a period of -1 s"),
    (lambda g: g.controller.change([g.foreign]), TaskError, "task 'foreign'", "another Robot ('centauro') (expected:"),
    (lambda g: g.controller.remove(g.hand), TaskError, "task 'hand'", "(expected: there is no task)"),
    (lambda g: QpHierarchy([g.joints], policy="hald"), UnknownName, "", "unknown policy 'hald' (did you mean hold"),
    (
        lambda g: QpHierarchy([g.joints], joint_bounds(g.robot, 0.01)),
        SizeMismatch,
        "",
        "bounds of shape (48,) for 7 DoFs",
    ),
    (lambda g: QpHierarchy([g.joints], position=np.zeros(3)), SizeMismatch, "", "positions of shape (3,) for 7 DoFs"),
    (
        lambda g: QpHierarchy([g.joints], constraints=[Constraint("wide", np.ones((1, 8)), 0.0, 1.0)]),
        SizeMismatch,
        "constraint 'wide'",
        "a matrix of 8 columns for 7 DoFs",
    ),
    (lambda g: QpHierarchy([g.joints], constraints=LEVELS), TaskError, "", "has constraints, got VelocityBounds"),
    (lambda g: TorqueLimits(g.arm.dynamics, 0.01, np.zeros(7)), TaskError, JOINT, "a torque limit of 0"),
    (lambda g: TorqueLimits(g.arm.dynamics, 0.0), TaskError, "", "a period of 0 s"),
    (lambda g: TorqueLimits(g.arm.dynamics, 0.01, (1.0, 2.0)), SizeMismatch, "", "shape (2,) for 7 DoFs"),
    (lambda g: TorqueLimits(g.arm.dynamics, 0.01, np.full(7, np.inf)), TaskError, "", "has a torque limit"),
    (lambda g: WorkspaceLimit("reach", g.turn, 0.0, 1.0), TaskError, "constraint 'reach'", "a vector that moves"),
    (lambda g: WorkspaceLimit("reach", Constant(3), 0.0, 1.0), TaskError, "constraint 'reach'", "a vector that moves"),
    (lambda g: WorkspaceLimit("reach", g.point, 0.5, 0.4), TaskError, "constraint 'reach'", "from 0.5 to 0.4 m"),
    (lambda g: require_positive(np.inf, "a horizon", "here"), TaskError, "here", "a horizon of inf s"),
    (
        lambda g: ReferenceIntegrator(g.arm, 0.01, joint_bounds(g.robot, 0.01)),
        SizeMismatch,
        "reference integrator of 'lbr_iiwa'",
        "bounds of shape (48,) for 7 DoFs",
    ),
    *((lambda g, tags=tags: Task("hand", g.point, **tags), error, "task 'hand'", words) for tags, error, words in TAGS),
    *(
        (lambda g, values=values: Constraint("c", *values), error, "constraint 'c'", words)
        for values, error, words in CONSTRAINTS
    ),
    *(
        (
            lambda g, tags=tags: ReferenceIntegrator(g.arm, **{"period": 0.01} | tags),
            error,
            "reference integrator of 'lbr_iiwa'",
            words,
        )
        for tags, error, words in INTEGRATORS
    ),
    *(
        (
            lambda g, least=least: CollisionLimit(SimpleNamespace(distance=np.zeros(1)), g.robot, least),
            TaskError,
            "",
            f"a least distance of {least:g} m",
        )
        for least in (-0.01, np.inf, np.nan)
    ),
]


@pytest.mark.parametrize(("call", "error", "place", "words"), REFUSED, ids=[words for *_, words in REFUSED])
def test_what_makes_no_sense_is_refused(given, call, error, place, words):
    check_refusal(lambda: call(given), error, place, words)


def test_least_and_largest_distance_may_be_equal(given):
    assert WorkspaceLimit("reach", given.point, 0.5, 0.5).rows == 1


def test_tasks_and_stacks_show_what_they_are(given):
    assert repr(given.hand) == f"Task('hand': {given.point}, 3 rows)"
    levels = [[given.hand, Task("turn", given.turn)], Task("com", given.other)]
    assert repr(Stack(levels)) == "Stack(hand + turn > com)"
