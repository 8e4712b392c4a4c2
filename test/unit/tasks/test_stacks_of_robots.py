"""The grammar of stacks on other robots: configurations only, which reach their references within their limits."""

from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from solfer import Robot
from solfer.config import read
from solfer.config.tasks.stack import StackRecord
from solfer.tasks import build_stack

STACKS = Path(__file__).parents[2] / "data/stacks"
ROBOTS = "cmeel.prefix/share/example-robot-data/robots/"
PERIOD = 0.005  # [s]


def load(urdf, srdf, state, floating_base):
    try:
        files = [Path(str(distribution("example-robot-data").locate_file(ROBOTS + file))) for file in (urdf, srdf)]
    except PackageNotFoundError:
        pytest.skip("needs pip install -r requirements-examples.txt")
    robot = Robot.load(*files, floating_base=floating_base)
    dofs, values = robot.named_state(state)
    robot.state.position[dofs] = values
    robot.update()
    return robot


def run(robot, name, moves, cycles=600):
    """Build the stack, move references by some lengths, and let the robot follow; return stack and solver."""
    stack = build_stack(read(STACKS / f"{name}.yaml", StackRecord, ("stack",)), robot)
    stack.start()
    solver, speed = stack.solver(PERIOD), stack.bounds(PERIOD).upper.copy()
    for task, move in moves.items():
        reference = stack.references[task]
        reference.set(reference.value + np.pad(move, (0, len(reference.value) - 3)))
    for _ in range(cycles):
        velocity = solver.update()
        assert (np.abs(velocity) <= speed + 1e-12).all()
        robot.state.position[:] += PERIOD * velocity
        robot.state.velocity[:] = velocity
        robot.update()
        kinematics, position = robot.kinematics, robot.state.position
        assert (position >= kinematics.lower_position - 1e-9).all()
        assert (position <= kinematics.upper_position + 1e-9).all()
    solver.update()
    return stack, solver


def error_of(stack, name):
    task = stack.tasks[name]
    task.error.update(jacobian=False)
    return np.abs(task.error.value[task.selected]).max()


@pytest.mark.slow
def test_talos_moves_a_hand_on_its_feet():
    robot = load(
        "talos_data/robots/talos_reduced.urdf", "talos_data/srdf/talos.srdf", "half_sitting", floating_base=True
    )
    hand = "hands/gripper_left_base_link"
    stack, solver = run(robot, "talos", {hand: (0.05, 0.03, 0.05)})
    for name in ("left_foot", "right_foot", "com", hand):
        assert error_of(stack, name) < 2e-3
    assert all(solution.is_solved for solution in solver.solutions)


@pytest.mark.slow
def test_panda_keeps_its_hand_upright():
    robot = load(
        "panda_description/urdf/panda.urdf", "panda_description/srdf/panda.srdf", "default", floating_base=None
    )
    stack, _ = run(robot, "panda", {"hand": (0.05, 0.1, -0.1)})
    assert error_of(stack, "hand") < 1e-3 and error_of(stack, "upright") < 2e-3
    stack.references["hand"].set((2.0, 0.0, 0.3))
    _, solver = stack, stack.solver(PERIOD)
    for _ in range(600):
        robot.state.position[:] += PERIOD * solver.update()
        robot.update()
    tool = stack.tasks["hand"].point
    tool.update()
    assert_allclose(np.linalg.norm(tool.value), 0.8, atol=5e-3)
