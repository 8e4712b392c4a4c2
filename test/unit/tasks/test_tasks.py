"""Tasks and stacks: errors, gains, selections, and refusals."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation
from support.robots import centauro
from support.unit.stacks import at_random

from solfer.errors import NotFinite, SizeMismatch, TaskError
from solfer.points import CenterOfMass, FrameOrientation, LinearPoint, Norm, Point
from solfer.tasks import Stack, Task


@pytest.fixture
def robot():
    return at_random(centauro())


def rows_of(*levels):
    stack = Stack(levels)
    stack.update()
    return stack


def test_a_new_task_holds_its_point(robot):
    task = Task("hand", LinearPoint("arm1_7", robot), 3.0)
    stack = rows_of(task)
    assert_allclose(stack.velocity, 0.0, atol=1e-14)
    assert_allclose(stack.jacobian, robot.kinematics.jacobian("arm1_7")[:3], atol=1e-12)
    robot.state.position += 0.1
    robot.update()
    before = task.reference.value.copy()
    stack.update()
    assert_allclose(stack.velocity, 3.0 * (before - robot.kinematics.position("arm1_7")), atol=1e-12)
    task.hold()
    stack.update()
    assert_allclose(stack.velocity, 0.0, atol=1e-14)


def test_the_rate_is_gain_and_feed_forward(robot):
    center = CenterOfMass(robot)
    task = Task("com", center, (1.0, 2.0, 0.0), reference=(0.5, -0.5, 1.0), velocity=(0.0, 0.1, 0.2))
    stack = rows_of(task)
    error = (0.5, -0.5, 1.0) - robot.kinematics.center_of_mass
    assert_allclose(stack.velocity, (error[0], 2.0 * error[1] + 0.1, 0.2), atol=1e-12)
    task.velocity[:] = 1.0
    task.gain = 4.0
    stack.update()
    assert_allclose(stack.velocity, 4.0 * error + 1.0, atol=1e-12)


def test_a_correction_is_bounded_beside_the_feed_forward(robot):
    error = (0.5, -0.5, 1.0) - robot.kinematics.center_of_mass
    task = Task("com", CenterOfMass(robot), 10.0, reference=(0.5, -0.5, 1.0), correction=(0.1, 0.2, np.inf))
    task.velocity = (0.3, 0.0, 0.3)
    stack = rows_of(task)
    assert_allclose(stack.velocity, (0.4, -0.2, 10.0 * error[2] + 0.3), atol=1e-12)
    with pytest.raises(TaskError, match="a correction of 0.0"):
        task.correction = 0.0


def test_orientation_errors_are_in_world_axes(robot):
    point = FrameOrientation("arm1_7", robot)
    turn = np.array((0.2, -0.1, 0.4))
    now = Rotation.from_matrix(robot.kinematics.rotation("arm1_7"))
    goal = (Rotation.from_rotvec(turn) * now).as_quat()
    stack = rows_of(Task("wrist", point, 2.0, reference=goal))
    assert_allclose(stack.velocity, 2.0 * turn, atol=1e-9)
    assert_allclose(stack.jacobian, robot.kinematics.jacobian("arm1_7")[3:], atol=1e-12)


def test_rows_and_dofs_are_selected(robot):
    task = Task("com", CenterOfMass(robot), reference=(1.0, 2.0, 3.0), rows=(2, 0), dofs=("torso_yaw", "x", 2))
    stack = rows_of(task)
    center, jacobian = robot.kinematics.center_of_mass, robot.kinematics.center_of_mass_jacobian
    assert_allclose(stack.velocity, (3.0 - center[2], 1.0 - center[0]), atol=1e-12)
    kept = [robot.dof("torso_yaw"), 0, 2]
    expected = np.zeros((2, robot.size))
    expected[:, kept] = jacobian[[2, 0]][:, kept]
    assert_allclose(stack.jacobian, expected, atol=1e-12)


def test_rows_are_scaled_with_roots_of_weights(robot):
    task = Task("com", CenterOfMass(robot), reference=(1.0, 2.0, 3.0), weight=(1.0, 4.0, 0.25))
    stack = rows_of(task)
    roots = np.array((1.0, 2.0, 0.5))
    assert_allclose(stack.jacobian, roots[:, None] * robot.kinematics.center_of_mass_jacobian, atol=1e-12)
    assert_allclose(stack.velocity, roots * ((1.0, 2.0, 3.0) - robot.kinematics.center_of_mass), atol=1e-12)


def test_operands_are_updated_with_their_point(robot):
    torso = LinearPoint("torso_2", robot)
    distance = Norm(LinearPoint("arm1_7", robot) - torso)
    stack = rows_of(Task("distance", distance, reference=(0.5,)), Task("torso", torso))
    robot.state.position -= 0.2
    robot.update()
    stack.update()
    kinematics = robot.kinematics
    expected = np.linalg.norm(kinematics.position("arm1_7") - kinematics.position("torso_2"))
    assert_allclose(stack.velocity[0], 0.5 - expected, atol=1e-12)
    assert_allclose(stack.jacobian[1:], kinematics.jacobian("torso_2")[:3], atol=1e-12)


def test_references_may_be_points_that_move_by_themselves(robot):
    """A reference is updated without its Jacobian, and a task cannot hold where it does not own it."""

    class Clock(Point):
        def __init__(self):
            super().__init__(3)

        def compute(self):
            self.value[:] += 1.0

        def compute_jacobian(self):
            raise AssertionError("a reference needs no Jacobian")

    clock = Clock()
    task = Task("hand", LinearPoint("arm1_7", robot), reference=clock)
    stack = rows_of(task)
    stack.update()
    assert_allclose(stack.velocity, 2.0 - robot.kinematics.position("arm1_7"), atol=1e-12)
    with pytest.raises(TaskError, match="task 'hand': its reference is Clock"):
        task.hold()


def test_a_task_may_be_in_several_stacks(robot):
    hand = Task("hand", LinearPoint("arm1_7", robot), reference=(1.0, 0.0, 0.0))
    stacks = [rows_of(hand), rows_of(Task("com", CenterOfMass(robot)), hand)]
    robot.state.position += 0.05
    robot.update()
    for stack in reversed(stacks):
        stack.update()
        assert_allclose(stack.velocity[-3:], (1.0, 0.0, 0.0) - robot.kinematics.position("arm1_7"), atol=1e-12)
        assert_allclose(stack.jacobian[-3:], robot.kinematics.jacobian("arm1_7")[:3], atol=1e-12)


def test_a_refused_number_changes_nothing(robot):
    task = Task("hand", LinearPoint("arm1_7", robot), 2.0)
    for name, values in (("gain", -1.0), ("weight", 0.0), ("velocity", np.nan), ("damping", (1.0, 1.0))):
        before = task.numbers.copy()
        with pytest.raises((TaskError, NotFinite, SizeMismatch)):
            setattr(task, name, values)
        assert_allclose(task.numbers, before)
