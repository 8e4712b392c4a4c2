"""A whole plugin that follows trajectories, on drivers that count a continuous joint in different ways."""

import math

import numpy as np
import pytest
from support.plugins import fleet
from support.recording.sine import Follower
from support.recording.turning import DRIVERS, FIRST, ROLL, driven

from solfer.interfaces import trajectories as messages
from solfer.interfaces.trajectories import FollowGoal, JointTolerance, JointTrajectory, TrajectoryPoint
from solfer.middleware.memory import MemoryMiddleware
from solfer.transport.declared import GoalStatus
from solfer.transport.declared.action_client import ActionClient
from solfer.transport.declared.fields import message_of

JOINTS, PERIOD = ("roll", "shoulder"), 1.0 / 200.0


GROUPS = """<robot name="cart"><group name="wheels"><joint name="free"/></group>
  <group name="moved"><joint name="shoulder"/><joint name="roll"/></group></robot>"""
"""The continuous joint is none of the wheels."""


def moved(count):
    """Return a follower of the component, which moves both joints."""

    class Moved(driven(count)):
        """See `driven`."""

        @staticmethod
        def tree(folder, component):
            """See `Follower.tree`."""
            changed = Follower.tree(folder, component)
            changed["modules"]["first"]["chain"] = "moved"
            return changed

    return Moved


@pytest.fixture(scope="module", autouse=True)
def groups():
    """Let the robot have these groups."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(fleet, "SRDF", GROUPS)
        yield


class DriverScene:
    """The plugin, its robot, and a client that counts angles in (-pi, pi]."""

    def __init__(self, folder, driver):
        self.robot = moved(DRIVERS[driver])(folder, "solfer.components.joint_states:JointStates")
        self.bus, self.plugin = self.robot.fleet.bus, self.robot.plugin
        self.client = MemoryMiddleware(self.bus, "client")
        name = "first/follow_joint_trajectory"
        types = (messages.FollowGoal, messages.FollowFeedback)
        self.action = ActionClient(self.client, name, messages.FOLLOW, *types, result=messages.FollowResult)
        self.rolls = []
        self.run(0.1)

    def run(self, duration):
        """Cycle so long [s]."""
        for _ in range(round(duration / PERIOD)):
            self.bus.run_until(self.bus.time + PERIOD)
            self.robot.move()
            self.plugin.cycle()
            self.action.poll()
            self.rolls.append(float(self.robot.position[ROLL]))


def trajectory(*rolls):
    """Return a trajectory with a point every 0.4 s; the client counts one turn less than the robot's nearest."""
    points = tuple(
        TrajectoryPoint((roll - math.tau, 0.2), (0.0, 0.0), time_from_start=0.4 * (index + 1))
        for index, roll in enumerate(rolls)
    )
    return JointTrajectory(joint_names=JOINTS, points=points)


@pytest.fixture(scope="module")
def expected(tmp_path_factory, groups):
    """Return what the joint does on a driver that counts on, by the name of a motion."""
    return {
        name: motion(DriverScene(tmp_path_factory.mktemp("counts_on"), "counts on"))
        for name, motion in (("goal", by_goal), ("topic", by_topic), ("stuck", by_a_stuck_joint))
    }


def by_goal(scene):
    """Follow a goal across half a turn and back, with tolerances."""
    tolerances = {"path_tolerance": (JointTolerance("roll", 0.3),), "goal_tolerance": (JointTolerance("roll", 0.02),)}
    goal = scene.action.send(FollowGoal(trajectory(3.3, 3.6, 3.1), **tolerances))
    scene.run(0.6)
    assert goal.feedback is not None, goal.text
    assert abs(goal.feedback.error.positions[0]) < 0.3
    scene.run(1.4)
    assert (goal.status, goal.result.error_code) == (GoalStatus.SUCCEEDED, messages.SUCCESSFUL), goal.text
    return scene.rolls


def by_topic(scene):
    """Follow a trajectory of the topic."""
    scene.client.writer("first/joint_trajectory", messages.TRAJECTORY).write(
        message_of(messages.TRAJECTORY, trajectory(3.3, 3.5))
    )
    scene.run(1.2)
    return scene.rolls


def by_a_stuck_joint(scene):
    """Do not follow: the path tolerance is violated, on any turn."""
    scene.robot.follows = False
    goal = scene.action.send(FollowGoal(trajectory(3.3, 3.6), path_tolerance=(JointTolerance("roll", 0.1),)))
    scene.run(0.8)
    assert (goal.status, goal.result.error_code) == (GoalStatus.ABORTED, messages.PATH_TOLERANCE_VIOLATED), goal.text
    return scene.rolls


@pytest.mark.parametrize("driver", DRIVERS)
@pytest.mark.parametrize(
    "name, motion, end", [("goal", by_goal, 3.1), ("topic", by_topic, 3.5), ("stuck", by_a_stuck_joint, FIRST)]
)
def test_all_drivers_follow_in_the_same_way(tmp_path, expected, driver, name, motion, end):
    rolls = motion(DriverScene(tmp_path, driver))
    np.testing.assert_allclose(rolls, expected[name], atol=1e-9)
    assert rolls[-1] == pytest.approx(end, abs=0.02)
