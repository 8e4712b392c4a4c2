"""The points that a stack of tasks names are those that Python makes, and what cannot be one is reported."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from solfer import Robot
from solfer.config import read
from solfer.config.tasks.stack import StackRecord
from solfer.errors import SolferError
from solfer.points import (
    AngularMomentum,
    CenterOfMass,
    Constant,
    FrameOrientation,
    GroundFrame,
    LinearPoint,
    LookAt,
    RelativePoint,
    SpatialPoint,
    WheelFrame,
)
from solfer.tasks import build_stack
from solfer.tasks.task import updated_in_order

CENTAURO = Path(__file__).parents[3] / "config/robots/centauro"
TURN = Rotation.from_euler("xyz", (0.4, -0.3, 0.9))
OFFSET = (0.1, -0.2, 0.3)
QUATERNION = TURN.as_quat().tolist()
FRAMES = f"""
  frames:
    tool: {{link: arm1_7, offset: {list(OFFSET)}, orientation: {QUATERNION}}}
    floor: {{type: ground, link: pelvis, height: 0.2, axis: [0, 1, 0]}}
    rim: {{type: wheel, link: wheel_1}}
"""


@cache
def load() -> Robot:
    robot = Robot.load(CENTAURO / "centauro.urdf", CENTAURO / "centauro.srdf", contacts=CENTAURO / "contacts.yaml")
    robot.state.position[:] = np.random.default_rng(9).uniform(-0.6, 0.6, robot.size)
    robot.state.velocity[:] = np.random.default_rng(10).uniform(-0.6, 0.6, robot.size)
    robot.update()
    return robot


@pytest.fixture
def robot():
    return load()


@pytest.fixture
def build(robot, tmp_path):
    """Build a stack of one task, with a point of a component."""

    def build(task):
        file = tmp_path / "stack.yaml"
        file.write_text(f"stack:{FRAMES}  tasks: {{task: {{{task}}}}}\n  levels: [[task]]\n")
        points = {"goal": Constant((0.5, 0.4, 0.1)), "hand": SpatialPoint("arm1_7", robot)}
        points["elbow"] = LinearPoint("arm1_4", robot)
        return build_stack(read(file, StackRecord, ("stack",)), robot, points)

    return build


def numbers(point):
    """Value and Jacobian of a point at the state of the robot."""
    for part in updated_in_order(point):
        part.update()
    return point.value.copy(), point.jacobian.copy()


def axle(robot, wheel="wheel_1"):
    """Return the pose at the centre of a wheel, and its axle."""
    record = next(record for record in robot.contact_records if record.end_frame == wheel)
    return SpatialPoint(wheel, robot, record.position), (*(getattr(record.reference_axis, one) for one in "xyz"),)


MORE = tuple((np.array(OFFSET) + TURN.apply((1.0, 2.0, 3.0))).tolist())
MADE = {
    "point: position, link: tool": lambda r: LinearPoint("arm1_7", r, OFFSET),
    "point: position, link: tool, offset: [1, 2, 3]": lambda r: LinearPoint("arm1_7", r, MORE),
    "point: position, link: arm2_7, offset: [1, 2, 3]": lambda r: LinearPoint("arm2_7", r, (1.0, 2.0, 3.0)),
    "point: position, link: arm2_7, relative: world": lambda r: LinearPoint("arm2_7", r),
    "point: position, link: arm2_7, relative: tool": lambda r: RelativePoint(
        LinearPoint("arm2_7", r), SpatialPoint("arm1_7", r, OFFSET, QUATERNION)
    ),
    "point: position, link: arm2_7, relative: tool, axes: world": lambda r: LinearPoint("arm2_7", r)
    - LinearPoint("arm1_7", r, OFFSET),
    "point: orientation, link: arm1_7": lambda r: FrameOrientation("arm1_7", r),
    "point: orientation, link: tool": lambda r: FrameOrientation("arm1_7", r, QUATERNION),
    "point: pose, link: arm1_7": lambda r: SpatialPoint("arm1_7", r),
    "point: pose, link: tool": lambda r: SpatialPoint("arm1_7", r, OFFSET, QUATERNION),
    "point: pose, link: arm1_7, offset: [1, 2, 3]": lambda r: SpatialPoint("arm1_7", r, (1.0, 2.0, 3.0)),
    "point: pose, link: tool, offset: [1, 2, 3]": lambda r: SpatialPoint("arm1_7", r, MORE, QUATERNION),
    "point: pose, link: floor": lambda r: GroundFrame(SpatialPoint("pelvis", r), 0.2, (0.0, 1.0, 0.0)),
    "point: pose, link: rim": lambda r: WheelFrame(*axle(r)),
    "point: steering, link: wheel_1, relative: floor": lambda r: RelativePoint(
        WheelFrame(*axle(r)), GroundFrame(SpatialPoint("pelvis", r), 0.2, (0.0, 1.0, 0.0))
    ),
    "point: center_of_mass, relative: arm1_7": lambda r: RelativePoint(CenterOfMass(r), SpatialPoint("arm1_7", r)),
    "point: angular_momentum": lambda r: AngularMomentum(r),
    "point: look_at, link: tool, target: arm2_7": lambda r: LookAt(
        SpatialPoint("arm1_7", r, OFFSET, QUATERNION), LinearPoint("arm2_7", r)
    ),
    "point: look_at, link: arm1_7, target: [1, 2, 3]": lambda r: LookAt(SpatialPoint("arm1_7", r), (1.0, 2.0, 3.0)),
    "point: look_at, link: arm1_7, target: goal": lambda r: LookAt(SpatialPoint("arm1_7", r), (0.5, 0.4, 0.1)),
}


@pytest.mark.parametrize(("task", "made"), MADE.items(), ids=MADE)
def test_a_task_moves_what_it_names(robot, build, task, made):
    stack = build(task)
    value, jacobian = numbers(stack.tasks["task"].point)
    expected, rows = numbers(made(robot))
    assert_allclose(value, expected, atol=1e-12)
    assert_allclose(jacobian, rows, atol=1e-12)
    assert type(stack.tasks["task"].point) is type(made(robot))
    assert stack.tasks["task"].selected.tolist() == ([5] if "steering" in task else list(range(len(rows))))


@pytest.mark.parametrize("axis", ["", ", axis: [0, 0, 2]"])
def test_a_look_begins_straight_ahead(robot, build, axis):
    stack = build(f"point: look_at, link: tool{axis}")
    ahead = (0.0, 0.0, 1.0) if axis else (1.0, 0.0, 0.0)
    value, _ = numbers(stack.tasks["task"].point)
    assert_allclose(value, ahead, atol=1e-12)
    assert_allclose(stack.tasks["task"].reference.value, ahead, atol=1e-12)
    tool = Rotation.from_matrix(robot.kinematics.rotation("arm1_7"))
    origin = robot.kinematics.position("arm1_7") + tool.apply(OFFSET)
    assert_allclose(stack.references["task"].value, origin + (tool * TURN).apply(ahead), atol=1e-12)


REFUSED = {
    "point: position, link: floor": "'floor', which is not fixed to a link, has no position of its own",
    "point: orientation, link: rim": "'rim', which is not fixed to a link, has no orientation of its own",
    "point: pose, link: hand, offset: [1, 2, 3]": "'hand', which is not fixed to a link, has no offset of its own",
    "point: pose, link: elbow": "the component's point 'elbow' is LinearPoint of 'arm1_4'",
    "point: steering, link: arm1_7": "unknown wheel among the robot's contacts 'arm1_7'",
    "point: look_at, link: tool, target: arm2_7, axis: [1, 0, 0], reference: [1, 0, 0]": "'look_at' has no reference",
    "point: rolling, link: wheel_1, gain: 2": "a gain of a task on 'rolling', whose error says nothing",
    "point: center_of_mass, dofs: [x], without: [x]": "no DoF is left",
    "point: position, link: arm1_7, reference: gaol": "unknown point of the component 'gaol'",
}


@pytest.mark.parametrize(("task", "words"), REFUSED.items(), ids=REFUSED)
def test_what_is_no_point_is_refused(build, task, words):
    with pytest.raises(SolferError, match=words):
        build(task)


@pytest.mark.parametrize(
    ("task", "rows", "numbers"),
    [
        ("point: orientation, link: arm1_7", "rx, rz", [0, 2]),
        ("point: angular_momentum", "ry, rx", [1, 0]),
        ("point: pose, link: arm1_7", "x, ry, rx, z, rz, y", [0, 4, 3, 2, 5, 1]),
        ("point: position, link: arm1_7", "z, x, y", [2, 0, 1]),
        ("point: posture", "3, 0", [3, 0]),
    ],
)
def test_rows_have_names(build, task, rows, numbers):
    assert build(f"{task}, rows: [{rows}]").tasks["task"].selected.tolist() == numbers


@pytest.mark.parametrize(
    "task", ["position, link: ''", "position, link: [a, '']", "'', link: a", "look_at, target: ''"]
)
def test_names_are_not_empty(build, task):
    with pytest.raises(SolferError, match="expected a text of at least 1 letters"):
        build(f"point: {task}")


def test_rolling_and_momentum_have_no_gain(build):
    for task, gain in (
        ("point: rolling, link: wheel_1", 0.0),
        ("point: angular_momentum", 0.0),
        ("point: center_of_mass", 1.0),
        (
            "point: center_of_mass, gain: [1, 2, 3], velocity: 0.5, weight: 2, damping: 0.1, correction: 0.3",
            (1.0, 2.0, 3.0),
        ),
    ):
        stack = build(task)
        made = stack.tasks["task"]
        assert_allclose(made.gain, np.broadcast_to(gain, made.rows))
    assert_allclose(made.numbers[:, 1:], [[0.5, 2.0, 0.1, 0.3]] * 3)
