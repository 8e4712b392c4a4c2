"""The component `inverse_kinematics`, without any transport: the original's motion, references, limits, mistakes."""

import json
import logging

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.robots import centauro, upper_body
from support.unit.declarations import named

from solfer import Robot
from solfer.components.inverse_kinematics import InverseKinematics
from solfer.config import load, read
from solfer.errors import NotFinite, SizeMismatch, UnknownName
from solfer.interfaces.geometry import Pose, Turn, Vector
from solfer.interfaces.task_references import GetReference, MovePoint, ReachGoal, SetReference
from solfer.numerics.planar_move import PlanarMove
from solfer.plugins.generation.registry import Registry

RATE, PERIOD = 200.0, 0.005  # [Hz], [s]

POSES = """
poses:
  chain: left_arm
  tolerance: 0.0001
  stack:
    tasks:
      pose: {point: pose, link: arm1_7, relative: torso_2, gain: 10}
      turn: {point: orientation, link: arm2_7, gain: 10}
    levels: [[pose], [turn]]
"""


@pytest.fixture
def robot():
    return centauro("mammal_wide_straight")


@pytest.fixture
def upper():
    return upper_body()


@pytest.fixture
def make(repository):
    """Make a component of the shipped configuration `name`, at its start."""

    def make(robot, name):
        configuration = load(repository / "config/centauro.yaml", name)
        return started(InverseKinematics(robot, configuration.tags(InverseKinematics.Tags), name))

    return make


@pytest.fixture
def arm(robot, tmp_path):
    """Make the component with a pose and an orientation, of which the second cannot move."""
    file = tmp_path / "poses.yaml"
    file.write_text(POSES)
    return started(InverseKinematics(robot, read(file, InverseKinematics.Tags, ("poses",)), "arm"))


def started(component):
    component.set_rate(RATE)
    component.init()
    return component


def run(component, duration):
    """Cycle for `duration` [s]; return the desired positions of every cycle."""
    rows = []
    for _ in range(round(duration * RATE)):
        component.update()
        component.send()
        rows.append(component.model.command.position.copy())
    return np.array(rows)


def test_the_originals_hands_move_as_there(upper, make, repository):
    """The C++ program's recorded positions and QP solutions are the oracle, to 1e-10 over the whole motion."""
    golden = json.loads((repository / "test/data/original_hands.json").read_text())
    joints = [upper.dof(name) for name in golden["dofs"]]
    upper.state.position[joints] = golden["start"]
    upper.update()
    component = make(upper, "upper_body_ik")
    for number in (0, 1):
        component.references.interface.move_point(MovePoint(0.0, -0.05, 0.1, number))
    positions, velocities = [], []
    for _ in range(golden["cycles"][-1] + 1):
        upper.update()
        component.update()
        component.send()
        positions.append(upper.command.position[joints])
        velocities.append(upper.command.velocity[joints])
        upper.state.position[:], upper.state.velocity[:] = upper.command.position, upper.command.velocity
    at = golden["cycles"]
    assert_allclose(np.array(positions)[at], golden["position"], rtol=0.0, atol=1e-10)
    for qp in golden["qp"]:
        assert_allclose(velocities[qp["cycle"]], qp["x"], rtol=0.0, atol=1e-10)
    assert np.abs(positions[-1] - np.array(golden["start"])).max() > 0.25


@pytest.mark.slow
def test_hands_follow_circles_and_the_robot_stands(robot, make):
    """A millimetre bounds both the hands' errors on their circles and the shift of the centre of mass."""
    component, rest = make(robot, "inverse_kinematics"), robot.state.position.copy()
    hands = [component.references.targets[name] for name in ("left", "right")]
    center = robot.kinematics.center_of_mass.copy()
    starts = [robot.kinematics.position(link).copy() for link in ("arm1_7", "arm2_7")]
    errors, shifts = [], []
    model = Robot.twin(robot)
    for cycle in range(1000):
        for hand, start in zip(hands, starts, strict=True):
            hand.port.value[:], hand.port.fresh = start + circle(cycle * PERIOD), True
        component.update()
        component.send()
        model.state.position[:] = robot.state.position[:] = robot.command.position
        model.update()
        ahead = circle((cycle + 1) * PERIOD)
        for link, start in zip(("arm1_7", "arm2_7"), starts, strict=True):
            errors.append(np.linalg.norm(model.kinematics.position(link) - start - ahead))
        shifts.append(np.linalg.norm(model.kinematics.center_of_mass - center))
    assert np.sqrt(np.mean(np.square(errors))) < 1e-3 and max(errors[600:]) < 2e-4
    assert max(shifts) < 1e-3
    assert np.ptp(robot.command.position - rest) > 0.02


@pytest.fixture
def giving_way(robot, tmp_path):
    """Make the component with a pose whose joints may give way."""
    file = tmp_path / "soft.yaml"
    file.write_text(POSES.replace("tolerance: 0.0001", "deflection: {time_constant: 0.1, most: 0.02}"))
    return started(InverseKinematics(robot, read(file, InverseKinematics.Tags, ("poses",)), "soft"))


def test_what_gives_way_is_made_up_for(giving_way, robot):
    pose, model, sag, errors = giving_way.references.targets["pose"], robot.twin(), np.zeros(robot.size), []
    sag[robot.actuated] = np.random.default_rng(3).uniform(-0.01, 0.01, len(robot.actuated))
    pose.request((0.05, 0.02, -0.05, 0.0, 0.0, 0.0, 1.0), relative=True)
    for _ in range(round(2.0 * RATE)):
        run(giving_way, PERIOD)
        robot.state.position[:] = robot.command.position + sag
        model.state.position[:] = robot.state.position
        model.update()
        apart = model.kinematics.position("arm1_7") - model.kinematics.position("torso_2")
        seen = model.kinematics.rotation("torso_2").T @ apart
        errors.append(np.linalg.norm(seen - np.array(pose.desired[:3])))
    assert max(errors[:20]) > 2e-3 and max(errors[-20:]) < 1e-5


def test_a_held_joint_is_pushed_no_farther(giving_way, robot):
    giving_way.references.interface.set_reference(
        SetReference("pose", (0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 1.0), relative=True)
    )
    commanded = run(giving_way, 3.0)[-1]  # and nothing moves
    model = giving_way.references.targets["pose"].task.point.robot.state.position
    assert np.abs(commanded - robot.state.position).max() > 0.1
    assert np.abs(model - commanded).max() == pytest.approx(0.02, abs=1e-4)


def circle(time):
    """Return a circle of the radius 0.1 m in 5 s, across x."""
    angle = 2.0 * np.pi * time / 5.0
    return 0.1 * np.array((0.0, np.sin(angle), 1.0 - np.cos(angle)))


@pytest.mark.parametrize("way", [(1.5, 0.0, 0.0), (0.8, 0.8, -0.8)])
def test_what_is_out_of_reach_is_approached_calmly(upper, make, caplog, way):
    """The hand stops at the nearest place, without chatter or too much speed, and one warning has the residual."""
    component = make(upper, "manipulation")
    left = component.references.targets["left"]
    component.references.interface.set_reference(SetReference("left", way, relative=True))
    positions = run(component, 4.0)
    speeds = np.abs(np.diff(positions, axis=0)) / PERIOD
    assert (speeds <= upper.kinematics.velocity_limit + 1e-9).all()
    model, places = upper.twin(), []
    for position in positions[598:]:
        model.state.position[:] = position
        model.update()
        places.append(model.kinematics.position("arm1_7").copy())
    assert np.linalg.norm(np.diff(places, axis=0), axis=1).max() < 1e-4 * PERIOD and left.residual[0] > 0.5
    (message,) = [record.getMessage() for record in caplog.records if record.levelno >= logging.WARNING]
    assert "task 'left' cannot be reached" in message
    assert float(message.split("it stays ")[1].split()[0]) == pytest.approx(left.residual[0], abs=1e-3)
    # no nearer: the way to the reference is across all motions of the hand
    hand = left.task
    assert np.linalg.norm(hand.point.jacobian.T @ hand.error.value) < 0.02 * left.residual[0]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("way", "limited", "text"),
    [((1.5, 0.0, 0.0), False, "near a singularity"), ((-1.2, 0.0, 0.3), True, "limit")],
)
def test_what_cannot_be_reached_has_its_reason(upper, make, caplog, way, limited, text):
    """The joints that the reason names, and no others, are at the end of a range that the URDF has."""
    component = make(upper, "manipulation")
    component.references.interface.set_reference(SetReference("left", way, relative=True))
    run(component, 4.0)
    reply = component.references.interface.get_reference(GetReference("left"))
    (said,) = [message for message in caplog.messages if "task 'left'" in message]
    assert reply.success and said.endswith(reply.message) and text in reply.message and "; try " in reply.message
    named = [name for name in upper.dofs if f"{name} is at its" in reply.message]
    assert bool(named) == limited
    for name in named:
        joint, position = upper.description.joints[name], upper.command.position[upper.dof(name)]
        assert min(abs(position - joint.lower), abs(position - joint.upper)) < 6e-3
    component.references.interface.set_reference(SetReference("left", tuple(-np.array(way)), relative=True))
    assert component.references.interface.get_reference(GetReference("left")).message == ""


SIDES = ("left", "arm1_7"), ("right", "arm2_7")
LEFT_ARM, RIGHT_ARM = [f"j_arm1_{joint}" for joint in range(1, 8)], [f"j_arm2_{joint}" for joint in range(1, 8)]


@pytest.mark.parametrize(
    ("yaw", "left", "right", "expected"),
    [
        (
            -0.12,
            (0.76, 0.22, -0.2, -1.64, 0.08, -0.63, 0.09),
            (0.47, -0.75, -0.52, -1.8, 0.49, -0.33, 0.54),
            {"left": (-0.15, 1.93, 0.93), "right": (-1.61, -0.27, 0.23)},
        ),
        (
            -0.3,
            (1.04, 0.22, -0.08, -1.8, -0.32, -0.6, -0.46),
            (0.98, -0.21, -0.9, -1.8, -0.47, -1.09, -0.1),
            {"left": (-0.08, 0.1, 2.22)},
        ),
    ],
)
def test_arms_that_swing_round_rest_in_time(upper, make, yaw, left, right, expected):
    """References that come to rest late, and arms that still gain by swinging on then."""
    names = ["torso_yaw", *LEFT_ARM, *RIGHT_ARM]
    upper.state.position[[upper.dof(name) for name in names]] = (yaw, *left, *right)
    upper.update()
    component, model, places = make(upper, "manipulation"), upper.twin(), []
    for name, place in expected.items():
        component.references.targets[name].request(place)
    for position in run(component, 3.5)[round(3.0 * RATE) :]:
        model.state.position[:] = position
        model.update()
        places.append([model.kinematics.position(link).copy() for name, link in SIDES if name in expected])
    assert np.linalg.norm(np.diff(places, axis=0), axis=2).max() < 1e-4 * PERIOD
    assert all(component.references.targets[name].is_unreachable for name in expected)


def test_a_hand_that_gave_up_goes_on(upper, make):
    component = make(upper, "manipulation")
    left, right = (component.references.targets[name] for name in ("left", "right"))
    start = left.task.point.value.copy()
    left.request((0.0, 0.0, 1.5), relative=True)
    run(component, 3.0)
    assert left.is_unreachable and left.residual[0] > 0.5
    assert np.ptp(run(component, 0.2), axis=0).max() < 5e-3  # the posture goes on
    right.request((0.0, 0.05, 0.0), relative=True)
    run(component, 0.2)
    assert not left.is_unreachable and left.remaining()[0] == pytest.approx(left.residual[0], abs=0.01)
    left.request(start)
    run(component, 3.0)
    # an elbow that bends to the other side ends at its limit
    assert left.remaining()[0] < 1e-3 and upper.command.position[upper.dof("j_arm1_4")] < -1.5


@pytest.mark.parametrize("seed", [0, 4])
def test_both_hands_rest_far_from_references(upper, make, caplog, seed):
    component, rng = make(upper, "manipulation"), np.random.default_rng(seed)
    for target in component.references.targets.values():
        way = rng.normal(size=3)
        target.request(1.6 * way / np.linalg.norm(way), relative=True)
    run(component, 2.95)
    assert all(target.is_held for target in component.references.targets.values())
    model, places = upper.twin(), []
    for position in run(component, 0.3):
        model.state.position[:] = position
        model.update()
        places.append([model.kinematics.position(link).copy() for link in ("arm1_7", "arm2_7")])
    assert np.linalg.norm(np.diff(places, axis=0), axis=2).max() < 3e-5 * PERIOD
    said = [record.getMessage() for record in caplog.records if record.levelno >= logging.WARNING]
    assert sorted("'left'" in message for message in said) == [False, True]


@pytest.mark.parametrize("seed", range(2))
def test_no_limit_is_left_on_the_way(upper, make, seed):
    """Random references, often out of reach: positions, speeds and the distance of the hands keep their limits."""
    component, rng = make(upper, "manipulation"), np.random.default_rng(seed)
    limits, model = upper.kinematics, upper.twin()
    last, nearest = upper.command.position.copy(), np.inf
    for _ in range(4):
        for name, side in (("left", 0.2), ("right", -0.2)):
            component.references.targets[name].request((0.3, side, 0.2) + rng.uniform(-0.8, 0.8, 3))
        for position in run(component, 1.0):
            assert ((limits.lower_position <= position) & (position <= limits.upper_position)).all()
            assert (np.abs(position - last) <= limits.velocity_limit * PERIOD * (1.0 + 1e-9)).all()
            last = position
            model.state.position[:] = position
            model.update()
            nearest = min(
                nearest, np.linalg.norm(model.kinematics.position("arm1_7") - model.kinematics.position("arm2_7"))
            )
    assert nearest > 0.05


def test_a_pose_is_reached_with_feedback(arm):
    action, pose = arm.actions()[0], arm.references.targets["pose"]
    start = pose.task.point.value.copy()
    turn = (*start[3:],)
    goal = ReachGoal(("pose",), (Pose(Vector(*(start[:3] + (0.0, 0.05, 0.05))), Turn(*turn)),))
    assert action.begin(goal) is None and action.outcome() is None
    run(arm, 0.1)
    before = action.report()
    assert 0.01 < before.distances[0] < 0.08
    run(arm, 1.5)
    assert action.outcome().success and action.report().distances[0] < 1e-3
    action.begin(ReachGoal(("turn",), (Pose(orientation=Turn(0.6, 0.0, 0.0, 0.8)),)))
    run(arm, 3.0)
    outcome = action.outcome()
    assert not outcome.success and "turn" in outcome.text and outcome.result.angles[0] > 0.1


def test_a_measurement_that_jumps_moves_no_hand_faster_than_its_reference(robot, tmp_path):
    """A loop that is closed on measurements answers a jump with the speed of its `motion` at most."""
    file = tmp_path / "poses.yaml"
    file.write_text(
        POSES.replace("chain:", "closed_on: measurement\n  motion: {speed: 0.1, turn_speed: 0.2}\n  chain:")
    )
    arm = started(InverseKinematics(robot, read(file, InverseKinematics.Tags, ("poses",)), "arm"))
    task = arm.references.targets["pose"].task
    robot.state.position[robot.selectors["left_arm"].indices] += 0.3
    for _ in range(20):
        robot.update()
        arm.update()
        arm.send()
        rates = task.point.jacobian @ arm.model.command.velocity
        assert np.abs(rates[:3]).max() < 0.105
        assert np.abs(rates[3:]).max() < 0.21
    assert np.abs(rates).max() > 0.05


def test_a_cancelled_goal_comes_to_rest(arm):
    action, start = arm.actions()[0], arm.references.targets["pose"].task.point.value.copy()
    action.begin(ReachGoal(("pose",), (Pose(Vector(*(start[:3] + 0.1)), Turn(*start[3:])),)))
    run(arm, 0.1)
    action.cancel()
    position = run(arm, 1.5)[-1]
    moved = arm.references.targets["pose"].task.point.value[:3] - start[:3]
    assert 0.001 < np.linalg.norm(moved) < 0.15
    assert_allclose(run(arm, 0.2)[-1], position, rtol=0.0, atol=1e-5)


def test_joints_outside_of_the_chain_stay(arm, robot):
    arm.references.interface.set_reference(SetReference("pose", (0.1, 0.1, 0.1, 0.0, 0.0, 0.0, 1.0), relative=True))
    moved = np.ptp(run(arm, 1.0), axis=0) > 1e-6
    assert set(np.flatnonzero(moved)) <= set(robot.selectors["left_arm"].indices) and moved.any()


@pytest.mark.parametrize("asked", ["left", "held"])
def test_a_jump_of_the_base_moves_no_joint(tmp_path, asked):
    """References in the world move with the base, in the middle of a motion, and where a hand stays away from one."""
    file, rows = tmp_path / "poses.yaml", []
    file.write_text(POSES.replace(", relative: torso_2", ""))
    way = (0.05, 0.02, 0.1) if asked == "left" else (1.5, 1.0, 0.0)
    for jumps in (False, True):
        robot = centauro("mammal_wide_straight")
        hand = started(InverseKinematics(robot, read(file, InverseKinematics.Tags, ("poses",)), "arm"))
        hand.references.interface.set_reference(SetReference("pose", (*way, 0.0, 0.0, 0.3, 0.95393920), relative=True))
        run(hand, 0.2 if asked == "left" else 6.0)
        assert hand.references.targets["pose"].is_held == (asked == "held")
        if jumps:
            before = robot.state.position[:3].copy()
            robot.state.position[:3] += (4.0, -2.0, 0.1)
            robot.state.position[5] += 2.5
            robot.update()
            hand.move_world(PlanarMove(before, robot.state.position[:3], 2.5))
        rows.append(run(hand, 1.0)[:, 6:])
    assert_allclose(rows[1], rows[0], rtol=0.0, atol=1e-6)


@pytest.mark.parametrize(
    ("request_", "error", "text"),
    [
        (SetReference("post", (0.0,) * 7), UnknownName, "pose"),
        (SetReference("pose", (0.0,) * 3), SizeMismatch, "the 7 of its pose"),
        (SetReference("pose", (float("nan"), *(0.0,) * 5, 1.0)), NotFinite, "task 'pose'"),
        (SetReference("pose", (0.0,) * 7), NotFinite, "a quaternion of length 1"),
        (SetReference("pose", (0.0, 1e308, 0.0, 0.0, 0.0, 0.0, 1.0)), NotFinite, "coordinates of up to 10000 m"),
        (SetReference("pose", (1e20, *(0.0,) * 5, 1.0), relative=True), NotFinite, "task 'pose'"),
        (SetReference("turn", (0.0, 0.0, 0.0, 2.0), relative=True), NotFinite, "a quaternion of length 1"),
    ],
)
def test_wrong_requests_change_nothing(arm, request_, error, text):
    with pytest.raises(error) as caught:
        arm.references.interface.set_reference(request_)
    assert text in f"{caught.value}\n{caught.value.expected}"
    assert np.ptp(run(arm, 0.1), axis=0).max() < 1e-6


def test_wrong_numbers_of_a_pipe_are_held(arm, caplog):
    port = arm.references.targets["pose"].port
    for wrong in (np.nan, 0.0, (1e20, *(0.0,) * 5, 1.0)):
        port.value[:], port.fresh = wrong, True
        positions = run(arm, 0.05)
        assert np.isfinite(positions).all() and np.ptp(positions, axis=0).max() < 1e-6
    assert "arm: task 'pose'" in caplog.text


def test_messages_of_other_frames_are_refused(arm):
    topic = named(arm.topics(), "pose/reference")
    start = arm.references.targets["pose"].task.point.value
    pose = Pose(Vector(*start[:3]), Turn(*start[3:]))
    header = type(topic.message().header)
    topic.handler(topic.message(header(2.0, "torso_2"), pose))
    assert topic.ordered
    with pytest.raises(UnknownName) as caught:
        topic.handler(topic.message(header(3.0, "torso_3"), pose))
    assert "torso_2" in str(caught.value)
    topic.handler(topic.message(header(3.0, "/torso_2"), pose))


def test_tags_that_contradict_each_other_are_refused(tmp_path):
    for right, wrong, text in (
        ("tolerance: 0.0001", "IK: [qp::ARMS]", "beside 'stack'"),
        ("tolerance: 0.0001", "lead: 0.1", "has no effect on a model"),
        (POSES[POSES.index("  stack:") :], "", "neither 'stack' nor 'IK'"),
    ):
        file = tmp_path / "wrong.yaml"
        file.write_text(POSES.replace(right, wrong))
        with pytest.raises(Exception, match=text):
            read(file, InverseKinematics.Tags, ("poses",))


def test_the_papers_name_is_an_alias():
    registry = Registry()
    assert registry.configuration("UpperBodyIK") == "upper_body_ik"
    assert registry.find("UpperBodyIK").component is InverseKinematics
