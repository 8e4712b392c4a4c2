"""Trajectories and requests of continuous joints, whose clients count them in (-pi, pi]."""

import math

import numpy as np
import pytest
from support.unit.joint_pipes import make_robot

from solfer.components.joint_states import JointStates, MoveJoints
from solfer.interfaces.trajectories import (
    GOAL_TOLERANCE_VIOLATED,
    FollowGoal,
    JointTolerance,
    JointTrajectory,
    TrajectoryPoint,
)

RATE = 200.0
JOINTS = ("roll", "shoulder")


class TurnedRobot:
    """The component on a robot that follows, with the continuous joint `roll` at an angle [rad]."""

    def __init__(self, roll, measured_turns=0):
        self.robot, self.turns = make_robot(), math.tau * measured_turns
        self.robot.state.position[self.robot.dof("roll")] = roll
        self.component = JointStates(self.robot)
        self.component.set_rate(RATE)
        self.component.clock = lambda: 100.0
        self.component.init()
        self.rolls = [roll]

    def run(self, duration):
        """Cycle so long [s]."""
        state, command = self.robot.state, self.robot.command
        for _ in range(round(duration * RATE)):
            self.component.update()
            self.component.send()
            self.rolls.append(float(command.position[self.robot.dof("roll")]))
            state.position[:] = command.position
            state.position[self.robot.dof("roll")] += self.turns

    def begin(self, *points, **tolerances):
        """Begin a goal of (time, roll, speed)."""
        made = tuple(TrajectoryPoint((roll, 0.0), (speed, 0.0), time_from_start=time) for time, roll, speed in points)
        return self.component.begin(FollowGoal(JointTrajectory(joint_names=JOINTS, points=made), **tolerances))


@pytest.mark.parametrize("turns", [-3, -1, 0, 1, 40])
def test_a_trajectory_begins_on_the_nearest_turn(turns):
    scene, offset = TurnedRobot(6.9), math.tau * turns
    assert scene.begin((0.0, 6.9 - offset, 0.0), (0.5, 7.0 - offset, 0.3), (1.0, 7.1 - offset, 0.0)) is None
    scene.run(1.1)
    assert scene.rolls[-1] == pytest.approx(7.1, abs=1e-9) and np.ptp(scene.rolls) == pytest.approx(0.2, abs=1e-9)
    assert scene.component.actions()[0].outcome().success


@pytest.mark.parametrize(
    "begin, end, way",
    [(math.pi - 0.05, -math.pi + 0.05, 0.1), (-math.pi + 0.2, math.pi - 0.2, -0.4), (9.0, 3.0, 0.2832)],
)
def test_a_joint_goes_the_short_way(begin, end, way):
    scene = TurnedRobot(begin)
    assert scene.begin((1.0, end, 0.0)) is None
    scene.run(1.1)
    assert scene.rolls[-1] - begin == pytest.approx(way, abs=1e-4) and np.ptp(scene.rolls) == pytest.approx(
        abs(way), abs=1e-4
    )


def test_a_trajectory_is_shifted_as_a_whole():
    scene = TurnedRobot(6.9)
    assert scene.begin((1.0, 0.7, 0.0), (7.0, 0.7 + 1.5 * math.pi, 0.0)) is None
    scene.run(7.1)
    assert scene.rolls[-1] == pytest.approx(0.7 + 3.5 * math.pi, abs=1e-9)


def test_a_joint_with_ends_is_not_shifted():
    scene = TurnedRobot(0.0)
    trajectory = JointTrajectory(
        joint_names=("shoulder",), points=(TrajectoryPoint((math.tau,), (0.0,), time_from_start=10.0),)
    )
    assert "beyond the limits of joint 'shoulder'" in scene.component.begin(FollowGoal(trajectory)).text


@pytest.mark.parametrize("turns", [-2, 0, 3])
@pytest.mark.parametrize("kind", ["path_tolerance", "goal_tolerance"])
def test_tolerances_are_of_the_short_way(turns, kind):
    scene = TurnedRobot(0.3, turns)
    assert scene.begin((1.0, 0.5, 0.0), **{kind: (JointTolerance("roll", 0.05),)}) is None
    scene.run(0.5)
    assert max(map(abs, scene.component.actions()[0].report().error.positions)) < 0.01
    scene.run(0.6)
    assert scene.component.actions()[0].outcome().success


def test_a_joint_that_is_not_there_violates_its_tolerance():
    scene = TurnedRobot(0.3, 0.25)
    assert scene.begin((1.0, 0.5, 0.0), goal_tolerance=(JointTolerance("roll", 0.05),)) is None
    scene.run(1.1)
    outcome = scene.component.actions()[0].outcome()
    assert outcome.result.error_code == GOAL_TOLERANCE_VIOLATED and "is 1.570" in outcome.text


def test_a_goal_that_is_reached_on_another_turn_succeeds():
    scene = TurnedRobot(6.9)
    assert scene.begin((0.0, 6.9 - math.tau, 0.0)) is None
    scene.run(0.1)
    assert scene.component.actions()[0].outcome().success and set(scene.rolls) == {6.9}


@pytest.mark.parametrize("turns", [-1, 0, 5])
def test_a_request_goes_the_short_way(turns):
    scene = TurnedRobot(6.9)
    scene.component.trajectory(MoveJoints(joints=("roll",), positions=(7.2 + math.tau * turns,), speed=1.0))
    scene.run(3.0)
    assert scene.rolls[-1] == pytest.approx(7.2) and np.ptp(scene.rolls) == pytest.approx(0.3)
