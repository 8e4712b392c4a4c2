"""Stacks of tasks in YAML: what they build, and what is said of mistakes in them."""

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.robots import centauro
from support.unit.refusals import place_of

from solfer.config import read
from solfer.config.tasks.stack import StackRecord
from solfer.errors import SolferError, SolferErrors
from solfer.points import Constant, LinearPoint, SpatialPoint
from solfer.tasks import Hierarchy, QpFailed, QpHierarchy, Task, build_stack

REPOSITORY = Path(__file__).parents[3]
CENTAURO = REPOSITORY / "config/robots/centauro"
STACKS = REPOSITORY / "test/data/stacks"
PERIOD = 0.005  # [s]

HANDS = """
stack:
  solver: null_spaces
  tasks:
    com: {point: center_of_mass, rows: [x, y], gain: 2.0}
    left: {point: position, link: arm1_7, relative: torso_2, axes: world, gain: [5, 6, 7]}
    right: {point: position, link: arm2_7, relative: torso_2, axes: world, gain: 5, weight: 2, without: [torso]}
  levels: [[com], [left, right]]
"""


@pytest.fixture
def robot():
    return centauro("home")


@pytest.fixture
def build(robot, tmp_path):
    """Build the stack of a text."""

    def build(text, points=None):
        file = tmp_path / "stack.yaml"
        file.write_text(text)
        return build_stack(read(file, StackRecord, ("stack",)), robot, points)

    return build


def test_yaml_is_the_same_stack_as_python(robot, build):
    stack = build(HANDS)
    torso = LinearPoint("torso_2", robot)
    free = np.setdiff1d(np.arange(robot.size), robot.selectors["torso"].indices)
    tasks = [
        Task("com", stack.tasks["com"].point, 2.0, rows=(0, 1)),
        Task("left", LinearPoint("arm1_7", robot) - torso, (5.0, 6.0, 7.0)),
        Task("right", LinearPoint("arm2_7", robot) - torso, 5.0, weight=2.0, dofs=free.tolist()),
    ]
    for task in tasks:
        task.reference.set(task.reference.value + 0.05)
        stack.references[task.name].set(task.reference.value)
    velocity = stack.solver(PERIOD).update()
    assert np.abs(velocity).max() > 0.1
    assert_allclose(velocity, Hierarchy([tasks[0], tasks[1:]]).update(), atol=1e-12)


def test_start_holds_what_has_no_reference(robot, build):
    stack = build(HANDS.replace("weight: 2", "reference: [0.5, -0.4, 0.1]"))
    robot.state.position[:] += 0.05
    robot.update()
    stack.start()
    assert_allclose(stack.references["left"].value, stack.tasks["left"].point.value)
    assert_allclose(stack.references["right"].value, (0.5, -0.4, 0.1))


def test_groups_are_one_task_a_link(build):
    stack = build("stack: {tasks: {w: {point: position, link: wheels}, p: {point: posture}}, levels: [[w], [p]]}")
    assert [task.name for task in stack.levels[0]] == [f"w/wheel_{number}" for number in (1, 2, 3, 4)]
    assert len(stack.tasks["p"].point.dofs) == 42


def test_postures_follow_named_states(robot, build):
    text = "stack: {tasks: {arm: {point: posture, dofs: [left_arm], reference: home_upper}}, levels: [[arm]]}"
    stack = build(text)
    dofs, values = robot.named_state("home_upper")
    expected = dict(zip(dofs.tolist(), values, strict=True))
    point = stack.tasks["arm"].point
    assert_allclose(stack.references["arm"].value, [expected[dof] for dof in point.dofs.tolist()])


def test_points_of_a_component_have_names(robot, build):
    """YAML uses a component's points as point, reference, frame and target, the objects themselves and no copies."""
    points = {"foot": LinearPoint("wheel_1", robot), "goal": Constant((0.5, 0.4, 0.1)), "hand": None}
    points["hand"] = SpatialPoint("arm1_7", robot)
    for point in points.values():
        point.update()
    text = """
stack:
  tasks:
    foot: {point: foot, reference: goal}
    other: {point: position, link: arm2_7, relative: hand}
    look: {point: look_at, link: neck_pitch, target: foot}
  levels: [[foot, other, look]]
"""
    stack = build(text.replace("neck_pitch", "torso_2"), points)
    assert stack.tasks["foot"].point is points["foot"] and stack.references["foot"] is points["goal"]
    assert stack.tasks["other"].point.frame is points["hand"]
    assert stack.tasks["look"].point.target is points["foot"]


def test_the_laboratorys_stack_keeps_its_levels(robot):
    """The shipped stack on CENTAURO: the upper levels reach exactly the velocities that their gains demand."""
    stack = build_stack(read(STACKS / "centauro.yaml", StackRecord, ("stack",)), robot)
    solver = stack.solver(PERIOD)
    robot.state.position[6:] += np.random.default_rng(4).uniform(-0.03, 0.03, robot.size - 6)
    robot.update()
    stack.start()
    stack.tasks["base"].velocity[:] = 0.1, 0.05, 0.1
    robot.state.position[6:] += 0.002
    robot.update()
    velocity = solver.update()
    assert [solution.is_solved for solution in solver.solutions] == [True] * 3
    base, steering = stack.tasks["base"], stack.tasks["steering/wheel_1"]
    for task in (base, steering, *(stack.tasks[f"wheels/wheel_{number}"] for number in (1, 2, 3, 4))):
        rate = task.mask * task.point.jacobian[task.selected] @ velocity
        task.error.update(jacobian=False)
        assert_allclose(rate, task.gain * task.error.value[task.selected] + task.velocity, atol=1e-5)


@pytest.mark.parametrize(
    ("before", "after", "place", "message"),
    [
        ("arm1_7", "arm1_77", "arm1_77", "unknown link or frame 'arm1_77'.*arm1_7"),
        ("torso_2, axes: world, gain: [5", "torso_3, gain: [5", "torso_3", "unknown link or frame 'torso_3'"),
        ("center_of_mass", "center_of_mas", "center_of_mas,", "unknown point 'center_of_mas'.*center_of_mass"),
        ("[x, y]", "[x, rx]", "rx", "unknown row 'rx'"),
        ("[x, y]", "[1, 3]", "[1, 3]", "row 3"),
        ("[5, 6, 7]", "[5, 6]", "[5, 6]", "a gain of shape .2,. for 3 rows"),
        ("[5, 6, 7]", "[5, -6, 7]", "-6", "a number of at least 0"),
        ("without: [torso]", "without: [torsos]", "torsos", "unknown DoF or group 'torsos'.*torso"),
        ("without: [torso]", "dofs: [x], without: [x]", "[x]}", "no DoF is left"),
        ("[left, right]", "[left, rihgt]", "rihgt", "unknown task 'rihgt'.*right"),
        ("[left, right]", "[left]", "right:", "task 'right' is in no level"),
        ("[left, right]", "[left, right, left]", "left]]", "task 'left' is listed twice"),
        ("weight: 2", "reference: [1, 2]", "[1, 2]", "3 numbers are needed"),
        ("weight: 2", "reference: somewhere", "somewhere", "unknown point of the component 'somewhere'"),
        ("rows: [x, y]", "target: arm1_7", "{point: center_of_mass, t", "has no 'target'"),
        (
            "relative: torso_2, axes: world, gain: 5, w",
            "axes: world, w",
            "{point: position, link: arm2",
            "'axes' without",
        ),
        ("link: arm1_7, ", "", "{point: position, relative", "needs the key 'link'"),
        ("solver: null_spaces", "policy: hold\n  solver: null_spaces", "policy", "null spaces have no 'policy'"),
        ("  levels", "  limits: {workspace: {w: {link: arm1_7}}}\n  levels", "{link: arm1_7}}}", "without a distance"),
        (
            "  solver: null_spaces",
            "  limits: {workspace: {w: {link: arm1_9, farthest: 1}}}\n ",
            "arm1_9",
            "unknown link or frame 'arm1_9'",
        ),
        (
            "  levels",
            "  limits: {workspace: {w: {link: arm1_7, nearest: 0.5, farthest: 0.4}}}\n  levels",
            "{link: arm1_7, n",
            "'nearest' 0.5 is above 'farthest' 0.4",
        ),
        (
            "  levels",
            "  limits: {collisions: {distance: 0.1}}\n  levels",
            "{distance",
            "'influence' 0.1 is not above 'distance' 0.1",
        ),
        ("  solver: null_spaces", "  policy: relax\n  relax: [torques]\n", "torques", "unknown limit 'torques'"),
        ("weight: 2", "damping: 0", "0, without", "above 0"),
        ("  solver: null_spaces", "  relax: [torques]\n", "relax", "'relax' with the policy 'hold'"),
        (
            "  levels",
            "  limits: {collisions: {distance: 0.05}}\n  levels",
            "solver: null_spaces",
            "null spaces know no 'collisions'",
        ),
        (
            "  levels",
            "  frames: {hand: {type: ground, link: arm1_7, offset: [0, 0, 1]}}\n  levels",
            "{type: ground",
            "the type 'ground' has no 'offset'",
        ),
        (
            "  levels",
            "  frames: {hand: {link: arm1_7, height: 0.2}}\n  levels",
            "{link: arm1_7, h",
            "the type 'link' has no 'height'",
        ),
    ],
)
def test_mistakes_are_reported_at_their_place(build, tmp_path, before, after, place, message):
    assert HANDS.count(before) == 1
    text = HANDS.replace(before, after)
    with pytest.raises(SolferError, match=f"(?s){message}") as error:
        build(text)
    begin = place_of(text, place, tmp_path / "stack.yaml")
    assert str(error.value).startswith(f"{begin}: stack")


def test_all_mistakes_are_reported_together(build):
    with pytest.raises(SolferErrors) as error:
        build(HANDS.replace("arm1_7", "arm1_77").replace("[torso]", "[torsos]").replace("[com]", "[c]"))
    assert len(error.value.errors) >= 3


def test_limits_are_kept(robot, build):
    """References far outside and inside the workspace: the hand ends at its bounds, with scaled speeds."""
    text = """
stack:
  policy: stop
  tasks: {hand: {point: position, link: arm1_7, relative: torso_2, gain: 20}}
  levels: [[hand]]
  limits: {speed_scale: 0.1, workspace: {reach: {link: arm1_7, relative: torso_2, nearest: 0.3, farthest: 0.8}}}
"""
    stack = build(text)
    solver, bounds = stack.solver(PERIOD), stack.bounds(PERIOD)
    point, reference = stack.tasks["hand"].point, stack.references["hand"]
    assert_allclose(bounds.upper[6:].max(), 0.1 * robot.kinematics.velocity_limit[6:].max())
    for goal, end in ((2.0 * point.value, 0.8), (0.1 * point.value, 0.3)):
        reference.set(goal)
        for _ in range(400):
            robot.state.position[:] += PERIOD * solver.update()
            robot.update()
        point.frame.update()
        point.parts[0].update()
        point.update()
        assert np.linalg.norm(point.value) == pytest.approx(end, abs=2e-3)
    assert isinstance(solver, QpHierarchy)


def test_torque_limits_act_and_fail_by_policy(robot, build):
    """The inverse dynamics of the solution touch the limits and keep them; an impossible state raises at once."""
    text = """
stack:
  policy: stop
  tasks: {arm: {point: posture, dofs: [left_arm], gain: 100}}
  levels: [[arm]]
  limits: {torques: {scale: 0.5}}
"""
    stack = build(text)
    stack.references["arm"].set(stack.references["arm"].value + 0.5)
    effort = robot.dynamics.inertia @ stack.solver(PERIOD).update() / PERIOD + robot.dynamics.bias
    limit = 0.5 * robot.kinematics.effort_limit
    assert (np.abs(effort) <= limit + 1e-6).all() and (np.abs(effort) > limit - 1e-6).any()
    robot.state.velocity[robot.dof("j_arm1_1")] = 1000.0
    robot.update()
    with pytest.raises(QpFailed, match="infeasible"):
        stack.solver(PERIOD).update()
