"""Trajectories of `joint_states`, by its topic and its action, over the memory middleware."""

import numpy as np
import pytest
from support.robots import centauro

from solfer.components.joint_states import JointStates, MoveJoints
from solfer.interfaces.trajectories import (
    FOLLOW,
    GOAL_TOLERANCE_VIOLATED,
    INVALID_GOAL,
    INVALID_JOINTS,
    OLD_HEADER_TIMESTAMP,
    PATH_TOLERANCE_VIOLATED,
    TRAJECTORY,
    FollowFeedback,
    FollowGoal,
    FollowResult,
    JointTolerance,
    JointTrajectory,
    TrajectoryHeader,
    TrajectoryPoint,
)
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.transport import Inbox
from solfer.transport.declared import ActionClient, GoalStatus
from solfer.transport.declared.binding import bind
from solfer.transport.declared.fields import message_of

RATE = 200.0  # [Hz]
NECK = ("neck_yaw", "neck_pitch")


class FollowingClient:
    """The component in a loop, a robot that is where it is commanded, and a client."""

    def __init__(self):
        self.robot, self.bus = centauro("mammal_wide_straight"), Bus()
        self.component = JointStates(self.robot)
        self.component.set_rate(RATE)
        self.component.init()
        self.inbox, node = Inbox(), MemoryMiddleware(self.bus, "node")
        self.component.clock = node.now
        declared = (*self.component.topics(), *self.component.actions())
        self._publications = bind("joint_states", declared, node, self.inbox, rate=RATE)
        outside = MemoryMiddleware(self.bus, "client")
        name = "joint_states/follow_joint_trajectory"
        self.client = ActionClient(outside, name, FOLLOW, FollowGoal, FollowFeedback, result=FollowResult)
        self._topic = outside.writer("joint_states/joint_trajectory", TRAJECTORY)
        self.follows, self.rows = True, []

    def publish(self, trajectory):
        """Publish a trajectory on the topic."""
        self._topic.write(message_of(TRAJECTORY, trajectory))

    def run(self, duration):
        """Cycle so long [s]."""
        command = self.robot.command
        for _ in range(round(duration * RATE)):
            self.bus.run_until(self.bus.time + 1.0 / RATE)
            self.inbox.apply()
            self.component.update()
            self.component.send()
            self._publications.run()
            self.client.poll()
            self.rows.append(command.velocity.copy())
            if self.follows:
                self.robot.state.position[:], self.robot.state.velocity[:] = command.position, command.velocity

    def at(self, *joints):
        """Return where joints are desired."""
        return [float(self.robot.command.position[self.robot.dof(joint)]) for joint in joints]

    def jerkiness(self):
        """Return the largest change of a joint's speed in a cycle [rad/s]."""
        return np.abs(np.diff(self.rows, axis=0)).max()


@pytest.fixture
def scene():
    return FollowingClient()


def through(*points, names=NECK, stamp=0.0):
    """Make a trajectory of (time, positions, velocities)."""
    made = tuple(TrajectoryPoint(positions, velocities, time_from_start=time) for time, positions, velocities in points)
    return JointTrajectory(TrajectoryHeader(stamp), names, made)


NOD = through((1.0, (0.2, 0.1), (0.1, 0.0)), (2.0, (0.3, -0.1), (0.0, 0.0)))
BACK = through((1.0, (0.0, 0.0), (0.0, 0.0)))


def test_a_topic_moves_joints_through_points(scene):
    scene.publish(NOD)
    scene.run(1.0)
    assert scene.at(*NECK) == pytest.approx([0.2, 0.1], abs=1e-9)
    scene.run(1.5)
    assert scene.at(*NECK) == pytest.approx([0.3, -0.1], abs=1e-12)
    assert not scene.rows[-1].any() and scene.jerkiness() < 0.02


def test_a_wrong_trajectory_moves_nothing(scene, caplog):
    before = scene.robot.command.position.copy()
    scene.publish(through((1.0, (0.2, 9.0), (0.0, 0.0))))
    scene.run(0.5)
    assert "neck_pitch" in caplog.text and np.array_equal(scene.robot.command.position, before)


def test_an_empty_trajectory_stops_smoothly(scene):
    scene.publish(through((1.0, (0.4, 0.2), (0.0, 0.0))))
    scene.run(0.5)
    scene.publish(JointTrajectory())
    scene.run(0.5)
    held = scene.at(*NECK)
    assert 0.2 < held[0] < 0.35 and not scene.rows[-1].any() and scene.jerkiness() < 0.04
    scene.run(0.5)
    assert scene.at(*NECK) == held


def test_other_joints_go_on(scene):
    scene.component.trajectory(MoveJoints(joints=("torso_yaw",), positions=(0.5,), speed=0.3))
    scene.run(0.5)
    scene.publish(NOD)
    scene.run(3.0)
    assert scene.at("torso_yaw", *NECK) == pytest.approx([0.5, 0.3, -0.1], abs=1e-9)
    assert scene.jerkiness() < 0.02


def test_another_trajectory_stops_joints_it_lacks(scene):
    scene.publish(NOD)
    scene.run(0.7)
    scene.publish(through((1.0, (0.2,), (0.0,)), names=("torso_yaw",)))
    scene.run(1.5)
    assert scene.at("torso_yaw") == pytest.approx([0.2]) and not scene.rows[-1].any()
    assert scene.jerkiness() < 0.06 and scene.at("neck_yaw")[0] < 0.25


def test_a_service_takes_over_from_a_trajectory(scene):
    goal = scene.client.send(FollowGoal(NOD))
    scene.run(0.5)
    scene.component.trajectory(MoveJoints(joints=("torso_yaw",), positions=(0.2,)))
    scene.run(3.0)
    assert goal.status is GoalStatus.ABORTED and "service" in goal.text
    assert scene.at("torso_yaw", *NECK) == pytest.approx([0.2, 0.3, -0.1], abs=1e-9) and scene.jerkiness() < 0.02


def test_a_goal_ends_with_its_trajectory(scene):
    goal = scene.client.send(FollowGoal(NOD, (), tuple(JointTolerance(name, 1e-3) for name in NECK)))
    scene.run(1.0)
    assert goal.status is GoalStatus.ACTIVE and goal.feedback.joint_names == NECK
    assert goal.feedback.desired.positions == pytest.approx((0.2, 0.1), abs=0.02)
    assert max(map(abs, goal.feedback.error.positions)) < 0.01 and 0.9 < goal.feedback.desired.time_from_start <= 1.0
    scene.run(1.1)
    assert goal.status is GoalStatus.SUCCEEDED and goal.result == FollowResult()


@pytest.mark.parametrize("times", [(0.0,), (0.0, 1e-9)])
def test_a_goal_where_the_robot_already_is_succeeds(scene, times):
    scene.run(0.1)
    at = tuple(scene.at(*NECK))
    goal = scene.client.send(FollowGoal(through(*((time, at, (0.0, 0.0)) for time in times))))
    scene.run(0.1)
    assert goal.status is GoalStatus.SUCCEEDED and goal.result == FollowResult()
    assert scene.at(*NECK) == list(at) and not np.any(scene.rows)


@pytest.mark.parametrize(
    "goal, code, part",
    [
        (FollowGoal(), INVALID_GOAL, "without points"),
        (FollowGoal(through((1.0, (0.1,), ()), names=("nek_yaw",))), INVALID_JOINTS, "neck_yaw"),
        (FollowGoal(through((1.0, (9.0, 0.0), ()))), INVALID_GOAL, "neck_yaw"),
        (FollowGoal(through((1.0, (0.1, 0.0), ()), stamp=0.5)), OLD_HEADER_TIMESTAMP, "ago"),
        (FollowGoal(NOD, (JointTolerance("torso_yaw", 0.1),)), INVALID_JOINTS, "torso_yaw"),
        (FollowGoal(NOD, goal_time_tolerance=-1.0), INVALID_GOAL, "goal_time_tolerance"),
        (FollowGoal(through((1.0, (0.1,), ()), names=("j_wheel_1",))), INVALID_JOINTS, "j_wheel_1"),
    ],
)
def test_a_refused_goal_has_its_code(scene, goal, code, part):
    scene.run(5.0)
    present = scene.client.send(FollowGoal(NOD))
    scene.run(0.1)
    refused = scene.client.send(goal)
    scene.run(0.1)
    assert refused.status is GoalStatus.REJECTED and refused.result.error_code == code
    assert part in refused.text and part in refused.result.error_string
    assert present.status is GoalStatus.ACTIVE


def test_a_joint_that_lags_ends_the_goal(scene):
    scene.follows = False  # the robot stands still
    goal = scene.client.send(FollowGoal(NOD, (JointTolerance("neck_yaw", 0.05),)))
    scene.run(2.0)
    assert goal.status is GoalStatus.ABORTED and goal.result.error_code == PATH_TOLERANCE_VIOLATED
    assert "joint 'neck_yaw'" in goal.text and "on the way" in goal.text
    assert scene.at("neck_yaw")[0] < 0.1 and not scene.rows[-1].any() and scene.jerkiness() < 0.06


def test_a_joint_that_does_not_arrive_ends_it(scene):
    scene.follows = False
    goal = scene.client.send(FollowGoal(NOD, (), (JointTolerance("neck_pitch", 0.05),), 0.5))
    scene.run(2.4)
    assert goal.status is GoalStatus.ACTIVE
    scene.run(0.2)
    assert goal.status is GoalStatus.ABORTED and goal.result.error_code == GOAL_TOLERANCE_VIOLATED
    assert "joint 'neck_pitch'" in goal.text and "at the end" in goal.text


def test_a_cancelled_goal_stops_smoothly(scene):
    goal = scene.client.send(FollowGoal(NOD))
    scene.run(0.7)
    scene.client.cancel(goal)
    scene.run(0.5)
    assert goal.status is GoalStatus.PREEMPTED and not scene.rows[-1].any() and scene.jerkiness() < 0.06
    held = scene.at(*NECK)
    scene.run(1.5)
    assert scene.at(*NECK) == held


def test_a_new_goal_takes_over_in_motion(scene):
    first = scene.client.send(FollowGoal(NOD))
    scene.run(0.7)
    second = scene.client.send(FollowGoal(BACK))
    scene.run(1.2)
    assert first.status is GoalStatus.PREEMPTED and second.status is GoalStatus.SUCCEEDED
    assert scene.at(*NECK) == pytest.approx([0.0, 0.0], abs=1e-12) and scene.jerkiness() < 0.02


def test_a_plugin_that_holds_aborts_its_goal(scene):
    goal = scene.client.send(FollowGoal(NOD))
    scene.run(0.7)
    scene.inbox.refusal = "plugin 'joint_states' has stopped"
    scene.component.stop()
    scene.run(0.1)
    assert goal.status is GoalStatus.ABORTED and goal.text == scene.inbox.refusal and not scene.rows[-1].any()


def test_accelerations_make_a_quintic(scene):
    points = (TrajectoryPoint((0.2, 0.1), (0.0, 0.0), (0.0, 0.0), time_from_start=1.0),)
    scene.publish(JointTrajectory(joint_names=NECK, points=points))
    scene.run(0.25)
    u = 0.25
    share = 10 * u**3 - 15 * u**4 + 6 * u**5
    assert scene.at(*NECK) == pytest.approx([0.2 * share, 0.1 * share], abs=1e-9)


def ahead(scene, trajectory, lead, is_goal):
    """Send a trajectory whose stamp is some time ahead [s], by the topic or as a goal."""
    stamped = JointTrajectory(TrajectoryHeader(scene.bus.time + lead), trajectory.joint_names, trajectory.points)
    return scene.client.send(FollowGoal(stamped)) if is_goal else scene.publish(stamped)


@pytest.mark.parametrize("is_goal", [False, True])
@pytest.mark.parametrize("others", [(), ("torso_yaw",)])
def test_a_trajectory_waits_for_its_stamp(scene, is_goal, others):
    """Until then joints rest, or go on with the present one; it begins in motion, and other joints come to rest."""
    ahead(scene, BACK, 0.5, is_goal)
    scene.run(0.4)
    assert not np.any(scene.rows)
    first = (*NECK, *others)
    nod = tuple(TrajectoryPoint((0.2, 0.1, *(0.3 for _ in others)), (), time_from_start=2.0) for _ in range(1))
    scene.publish(JointTrajectory(joint_names=first, points=nod))
    ahead(scene, BACK, 1.0, is_goal)
    scene.run(1.0)
    assert scene.at(*first) == pytest.approx([0.1, 0.05, *(0.15 for _ in others)], abs=2e-3)
    scene.run(1.1)
    assert scene.at(*NECK) == pytest.approx([0.0, 0.0], abs=1e-9) and not scene.rows[-1].any()


def test_a_stream_that_is_ahead_is_smooth(scene):
    """Each message replaces those that wait only from its stamp on."""
    for index in range(100):
        angle = 0.4 * np.sin(0.03 * index)
        ahead(scene, through((0.1, (angle, 0.0), (0.0, 0.0))), 0.05, False)
        scene.run(0.02)
    assert scene.at("neck_yaw")[0] == pytest.approx(0.4 * np.sin(2.85), abs=0.05) and scene.jerkiness() < 0.05
    assert np.ptp([row[scene.robot.dof("neck_yaw")] for row in scene.rows[20:150]]) > 0.3


def test_a_newer_trajectory_replaces_the_one_that_waits(scene):
    for lead, angle, names in ((1.0, 0.4, NECK), (0.5, 0.2, NECK), (0.8, 0.1, ("torso_yaw",))):
        ahead(scene, through((0.3, (angle, 0.0)[: len(names)], ()), names=names), lead, False)
        scene.run(0.1)
    scene.run(2.0)
    assert scene.at("neck_yaw", "torso_yaw") == pytest.approx([0.0, 0.1], abs=1e-9)


@pytest.mark.parametrize("end", ["cancel", "stop", "service", "topic"])
def test_what_stops_joints_drops_what_waits(scene, end):
    goal = ahead(scene, NOD, 0.5, True)
    scene.run(0.2)
    assert goal.status is GoalStatus.ACTIVE
    if end == "cancel":
        scene.client.cancel(goal)
    elif end == "service":
        scene.component.trajectory(MoveJoints(joints=("torso_yaw",), positions=(0.1,)))
    else:
        scene.publish(BACK if end == "topic" else JointTrajectory())
    scene.run(3.0)
    assert goal.status is (GoalStatus.PREEMPTED if end == "cancel" else GoalStatus.ABORTED)
    assert scene.at(*NECK) == pytest.approx([0.0, 0.0], abs=1e-12)


def test_a_goal_ends_once_when_a_later_trajectory_takes_over(scene):
    """By the topic: it is active until then. By a goal: that one takes over its status, and its motion at the stamp."""
    first = scene.client.send(FollowGoal(NOD))
    scene.run(0.1)
    ahead(scene, BACK, 0.9, False)
    scene.run(0.8)
    assert first.status is GoalStatus.ACTIVE
    scene.run(0.2)
    assert first.status is GoalStatus.ABORTED and "another trajectory" in first.text
    second = scene.client.send(FollowGoal(NOD))
    scene.run(0.1)
    third = ahead(scene, BACK, 0.5, True)
    scene.run(0.1)
    assert second.status is GoalStatus.PREEMPTED and third.status is GoalStatus.ACTIVE and scene.rows[-1].any()
    scene.run(1.6)
    assert third.status is GoalStatus.SUCCEEDED and scene.jerkiness() < 0.05


@pytest.mark.parametrize("lead", [61.0, 7200.0])
def test_a_stamp_of_another_clock_is_refused_with_both_times(scene, lead):
    scene.run(1.0)
    refused = ahead(scene, NOD, lead, True)
    scene.run(0.1)
    assert refused.status is GoalStatus.REJECTED
    assert f"stamped {1.0 + lead:.3f} s, and now it is 1.005 s" in refused.text and "60 s ahead" in refused.text


def test_not_too_many_wait(scene):
    for _ in range(1000):
        ahead(scene, NOD, 50.0, False)
        scene.run(0.01)
    refused = ahead(scene, NOD, 50.0, True)
    scene.run(0.1)
    assert refused.status is GoalStatus.REJECTED and "1000 trajectories wait" in refused.text


def test_a_point_at_the_stamp_is_reached_by_then(scene):
    ahead(scene, through((0.0, (0.2, 0.1), (0.0, 0.0))), 1.0, False)
    scene.run(1.0)
    assert scene.at(*NECK) == pytest.approx([0.2, 0.1], abs=1e-9)
