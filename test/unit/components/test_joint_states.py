"""The component `joint_states` on CENTAURO, without any transport: requests, refusals and motions."""

import numpy as np
import pytest
from support.robots import centauro

from solfer.components.joint_states import JointStates, MoveJoints
from solfer.components.move_joints import JointStateCmnd
from solfer.errors import ComponentError, NotFinite, SizeMismatch, SolferError, UnknownName

RATE = 200.0  # [Hz]
WHEELS = ("j_wheel_1", "j_wheel_2", "j_wheel_3", "j_wheel_4")


@pytest.fixture
def robot():
    return centauro("mammal_wide_straight")


@pytest.fixture
def component(robot):
    component = JointStates(robot)
    component.set_rate(RATE)
    component.init()
    return component


def run(component, duration):
    """Cycle for `duration` [s]; return the desired positions and velocities of every cycle."""
    command, rows = component.model.command, []
    for _ in range(round(duration * RATE)):
        component.update()
        component.send()
        rows.append((command.position.copy(), command.velocity.copy()))
    return np.array([position for position, _ in rows]), np.array([velocity for _, velocity in rows])


def test_all_joints_reach_a_named_state_together(component, robot):
    reply = component.trajectory(MoveJoints(state="mammal_wide_high", speed=0.4))
    indices, goal = robot.named_state("mammal_wide_high")
    moving = indices[np.abs(goal - robot.state.position[indices]) > 1e-9]
    assert reply.success and reply.duration > 0.0 and len(moving) >= 8
    positions, velocities = run(component, reply.duration + 0.02)
    assert np.abs(positions[-1, indices] - goal).max() < 1e-12
    assert 0.99 * 0.4 < np.abs(velocities).max() <= 0.4 + 1e-9
    assert np.abs(np.diff(positions, axis=0) * RATE).max() <= 0.4 + 1e-6
    half = positions[len(positions) // 2, moving] - robot.state.position[moving]
    share = half / (goal[np.isin(indices, moving)] - robot.state.position[moving])
    assert np.ptp(share) < 1e-9


def test_single_joints_move_and_the_others_stay(component, robot):
    reply = component.trajectory(MoveJoints(joints=("torso_yaw", "neck_yaw"), positions=(0.3, -0.2)))
    positions, _ = run(component, reply.duration + 0.02)
    assert positions[-1, robot.dof("torso_yaw")] == pytest.approx(0.3)
    assert positions[-1, robot.dof("neck_yaw")] == pytest.approx(-0.2)
    others = [dof for dof in robot.actuated if robot.dofs[dof] not in ("torso_yaw", "neck_yaw")]
    assert np.array_equal(positions[-1, others], robot.state.position[others])


def test_a_request_during_motion_causes_no_jump(component, robot):
    component.trajectory(MoveJoints(joints=("torso_yaw", "neck_yaw"), positions=(0.5, 0.4)))
    first, _ = run(component, 0.6)
    reply = component.trajectory(MoveJoints(joints=("torso_yaw",), positions=(-0.5,)))
    second, velocity = run(component, reply.duration + 0.02)
    path = np.vstack((first, second))[:, robot.dof("torso_yaw")]
    assert np.abs(np.diff(path, n=2)).max() * RATE**2 < 6.0
    assert np.abs(velocity).max() <= 0.5 + 1e-9
    assert second[-1, robot.dof("torso_yaw")] == pytest.approx(-0.5)
    assert second[-1, robot.dof("neck_yaw")] == pytest.approx(0.4)


def test_wheels_reach_their_speed_with_the_configured_acceleration(component, robot):
    reply = component.trajectory(MoveJoints(joints=WHEELS, velocities=(1.5, -1.5, 1.5, -1.5)))
    assert reply.duration == pytest.approx(0.5)
    positions, velocities = run(component, 1.0)
    wheels = [robot.dof(wheel) for wheel in WHEELS]
    assert velocities[-1, wheels].tolist() == [1.5, -1.5, 1.5, -1.5]
    assert np.abs(np.diff(velocities[:, wheels], axis=0)).max() <= 3.0 / RATE + 1e-12
    assert np.abs(velocities[:, wheels[0]] - np.minimum(1.5, 3.0 / RATE * np.arange(1, 201))).max() < 1e-9


def test_reset_stays_where_the_robot_is_measured(component, robot):
    component.trajectory(MoveJoints(state="mammal_wide_high"))
    component.trajectory(MoveJoints(joints=WHEELS, velocities=(1.0, -1.0, 1.0, -1.0)))
    positions, _ = run(component, 0.5)
    robot.state.position[:] = positions[-1] + 1e-3
    reply = component.trajectory(MoveJoints(state="reset"))
    positions, velocities = run(component, reply.duration + 0.5)
    joints = [dof for dof in robot.actuated if robot.dofs[dof] not in WHEELS]
    assert np.allclose(positions[-1, joints], robot.state.position[joints], atol=1e-12)
    assert not velocities[-1].any()


def test_stop_brings_everything_to_rest_at_once(component, robot):
    component.trajectory(MoveJoints(state="mammal_wide_high"))
    component.trajectory(MoveJoints(joints=WHEELS, velocities=(1.0, -1.0, 1.0, -1.0)))
    positions, _ = run(component, 0.5)
    component.stop()
    after, velocities = run(component, 0.5)
    assert not velocities.any()
    assert np.array_equal(after[-1], positions[-1])


@pytest.mark.parametrize(
    ("request_", "error", "text"),
    [
        (MoveJoints(), ComponentError, "neither a state nor joints"),
        (MoveJoints(state="mammal_wide_hihg"), UnknownName, "did you mean: mammal_wide_high"),
        (MoveJoints(state="home", joints=("torso_yaw",), positions=(0.0,)), ComponentError, "both state 'home'"),
        (MoveJoints(joints=("torso_jaw",), positions=(0.0,)), UnknownName, "did you mean: torso_yaw"),
        (MoveJoints(joints=("torso_yaw",), positions=(0.1, 0.2)), SizeMismatch, "2 positions for 1 joints"),
        (MoveJoints(joints=("torso_yaw",), positions=(float("nan"),)), NotFinite, "joint 'torso_yaw'"),
        (MoveJoints(joints=("j_wheel_1",), velocities=(float("inf"),)), NotFinite, "joint 'j_wheel_1'"),
        (MoveJoints(joints=("torso_yaw",) * 2, positions=(0.0, 0.1)), ComponentError, "given twice"),
        (MoveJoints(joints=("torso_yaw",), velocities=(0.3,)), ComponentError, "obeys a position"),
        (MoveJoints(joints=("j_wheel_1",), positions=(0.3,)), ComponentError, "obeys a velocity"),
        (MoveJoints(joints=("torso_yaw",), positions=(9.0,)), ComponentError, "beyond the limits of joint 'torso_yaw'"),
        (MoveJoints(joints=("j_wheel_1",), velocities=(99.0,)), ComponentError, "limit of joint 'j_wheel_1'"),
        (MoveJoints(state="upper_back"), ComponentError, "of state 'upper_back' is beyond the limits"),
        (MoveJoints(state="home", speed=-1.0), ComponentError, "speed -1"),
        (MoveJoints(state="home", speed=float("nan")), ComponentError, "speed nan"),
    ],
)
def test_a_wrong_request_is_refused_and_changes_nothing(component, robot, request_, error, text):
    component.trajectory(MoveJoints(joints=WHEELS, velocities=(1.0, -1.0, 1.0, -1.0)))
    run(component, 1.0)
    with pytest.raises(error) as caught:
        component.trajectory(request_)
    assert text in str(caught.value)
    positions, velocities = run(component, 0.2)
    joints = [dof for dof in robot.actuated if robot.dofs[dof] not in WHEELS]
    assert np.array_equal(positions[-1, joints], robot.state.position[joints])
    assert velocities[-1, [robot.dof(wheel) for wheel in WHEELS]].tolist() == [1.0, -1.0, 1.0, -1.0]


def test_joints_outside_limits_let_others_move(component, robot):
    robot.state.position[robot.dof("torso_yaw")] = robot.upper_limits.position[robot.dof("torso_yaw")] + 1e-3
    component.init()
    assert component.trajectory(MoveJoints(joints=("neck_yaw",), positions=(0.1,))).success


def test_a_group_limits_what_may_be_moved(robot):
    component = JointStates(robot, JointStates.Tags(chain="left_arm"))
    component.set_rate(RATE)
    component.init()
    with pytest.raises(UnknownName):
        component.trajectory(MoveJoints(joints=("torso_yaw",), positions=(0.1,)))
    with pytest.raises(ComponentError, match="no joint of group 'left_arm'"):
        component.trajectory(MoveJoints(state="spider_high"))
    reply = component.trajectory(MoveJoints(state="home"))
    positions, _ = run(component, reply.duration + 0.02)
    moved = np.flatnonzero(positions[-1] != robot.state.position)
    assert {robot.dofs[dof][:6] for dof in moved} == {"j_arm1"}


def test_an_unknown_group_gives_nearest_names(robot):
    with pytest.raises(SolferError) as caught:
        JointStates(robot, JointStates.Tags(chain="left_amr"))
    assert "left_arm" in caught.value.names


def test_requests_of_the_original_are_carried_out(component, robot):
    assert component.command(JointStateCmnd("mammal_wide_high", pos_step=0.002)).success
    positions, velocities = run(component, 4.0)
    indices, goal = robot.named_state("mammal_wide_high")
    assert np.abs(positions[-1, indices] - goal).max() < 1e-12
    assert np.abs(velocities).max() == pytest.approx(0.002 * RATE, rel=0.01)
    component.command(JointStateCmnd("torso_yaw", 0.3, 1.0))
    component.command(JointStateCmnd("j_wheel_2", -1.5))
    positions, velocities = run(component, 2.0)
    assert positions[-1, robot.dof("torso_yaw")] == pytest.approx(0.3)
    assert velocities[-1, robot.dof("j_wheel_2")] == pytest.approx(-1.5)
    assert np.abs(velocities[:, robot.dof("torso_yaw")]).max() < 2.0 + 1e-9


@pytest.mark.parametrize(
    "request_, error, part",
    [
        (JointStateCmnd("torso_jaw", 0.1), UnknownName, "torso_yaw"),
        (JointStateCmnd("torso_yaw", float("nan")), NotFinite, "torso_yaw"),
        (JointStateCmnd("torso_yaw", 0.1, -0.1), ComponentError, "-0.1"),
        (JointStateCmnd("torso_yaw", 99.0), ComponentError, "99"),
    ],
)
def test_wrong_requests_of_the_original_are_refused(component, request_, error, part):
    with pytest.raises(error, match=part):
        component.command(request_)
