"""References that `inverse_kinematics` generates: a circle is drawn, others take over, mistakes have their place."""

import math
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.robots import upper_body

from solfer import Robot
from solfer.components.inverse_kinematics import InverseKinematics
from solfer.config import read
from solfer.errors import ComponentError, ConfigError, SolferErrors, UnknownName
from solfer.interfaces.task_references import GetReference, SetReference
from solfer.numerics.planar_move import PlanarMove
from solfer.numerics.rotations import quaternion_from_rotation, rotation_from_quaternion

RATE, PERIOD = 200.0, 0.005  # [Hz], [s]
RADIUS, TURN = 0.05, 2.0  # [m], [s]
CIRCLE = f"{{circle: {{radius: {RADIUS}, period: {TURN}, plane: zy}}}}"
SWING = "{sine: {amplitude: {torso_yaw: 0.1}, period: 2.0, turns: 1}}"
HANDS = f"""
hands:
  stack:
    tasks:
      left: {{point: position, link: arm1_7, relative: torso_2, gain: 10, reference: {CIRCLE}}}
      right: {{point: pose, link: arm2_7, relative: torso_2, gain: 10}}
      posture: {{point: posture, gain: 0.5, weight: 0.0001}}
    levels: [[left, right, posture]]
"""
ARM = f"""
arm:
  stack:
    tasks:
      hand: {{point: pose, link: panda_link7, gain: 10, reference: {CIRCLE}}}
      posture: {{point: posture, gain: 0.5, weight: 0.0001}}
    levels: [[hand, posture]]
"""


@pytest.fixture
def upper(repository):
    return upper_body()


@pytest.fixture
def panda():
    data = pytest.importorskip("pybullet_data")
    robot = Robot.load(Path(data.getDataPath(), "franka_panda/panda.urdf"), floating_base=False)
    robot.state.position[:7] = 0.0, -0.4, 0.0, -2.0, 0.0, 1.6, 0.8
    robot.update()
    return robot


@pytest.fixture
def make(tmp_path):
    """Make a component of a text, at its start."""

    def make(robot, text):
        file = tmp_path / "tasks.yaml"
        file.write_text(text)
        component = InverseKinematics(robot, read(file, InverseKinematics.Tags, (text.split(":")[0].strip(),)), "arm")
        component.set_rate(RATE)
        component.init()
        return component

    return make


def run(component, duration, link="", relative=""):
    """Cycle for some time [s]; return where a link is in each cycle, of the commanded robot."""
    model, places = component.model.twin(), []
    for _ in range(round(duration * RATE)):
        component.update()
        component.send()
        if link:
            model.state.position[:] = component.model.command.position
            model.update()
            place = model.kinematics.position(link).copy()
            if relative:
                away = place - model.kinematics.position(relative)
                place = model.kinematics.rotation(relative).T @ away
            places.append(place)
    return np.array(places)


def circle(start, times):
    """Return the circle of the tests from the time on when it has its speed, shape (k, 3): z is its first axis."""
    phase = 2.0 * np.pi / TURN * (np.asarray(times) - 0.125 * TURN)
    zeros = np.zeros_like(phase)
    return start + RADIUS * np.column_stack([zeros, np.sin(phase), np.cos(phase) - 1.0])


@pytest.mark.slow
@pytest.mark.parametrize(("name", "link", "relative"), [("upper", "arm1_7", "torso_2"), ("panda", "panda_link7", "")])
def test_a_hand_draws_a_circle(request, make, name, link, relative):
    """Within 3 mm of the formula of a circle from half a second on; nothing steps at the beginning."""
    robot = request.getfixturevalue(name)
    component = make(robot, HANDS if name == "upper" else ARM)
    start = np.array(component.references.targets["left" if name == "upper" else "hand"].desired[:3])
    places = run(component, 5.0, link, relative)
    times = PERIOD * (1.0 + np.arange(len(places)))
    moving = times > 0.5
    away = np.linalg.norm(places - circle(start, times), axis=1)[moving]
    assert away.max() < 3e-3
    assert np.linalg.norm(places[0] - start) < 1e-4
    speeds = np.linalg.norm(np.diff(places, axis=0), axis=1) / PERIOD
    assert speeds.max() < 1.05 * 2.0 * np.pi * RADIUS / TURN and np.abs(np.diff(speeds)).max() < 0.02


def test_a_reference_from_outside_takes_over_from_where_it_is(upper, make):
    component = make(upper, HANDS)
    run(component, 0.8)
    left = component.references.targets["left"]
    before = np.array(component.references.interface.get_reference(GetReference("left")).values)
    component.references.interface.set_reference(SetReference("left", (0.0, 0.0, 0.0), relative=True))
    values = [np.array(left.reference)]
    for _ in range(100):
        run(component, PERIOD)
        values.append(np.array(left.reference))
    steps = np.linalg.norm(np.diff(values, axis=0), axis=1)
    assert steps.max() < 1.1 * 2.0 * np.pi * RADIUS / TURN * PERIOD
    assert_allclose(values[-1], before, atol=1e-9)
    assert component.references.interface.get_reference(GetReference("left")).values == tuple(before)


@pytest.mark.parametrize("way", ["port", "halt"])
def test_ports_and_cancels_end_it_too(upper, make, way):
    component = make(upper, HANDS)
    run(component, 0.5)
    left = component.references.targets["left"]
    if way == "halt":
        left.halt()
        rest = left.desired
    else:
        rest = tuple(np.array(left.desired) + 0.01)
        left.port.value[:], left.port.fresh = rest, True
        run(component, PERIOD)
        left.port.fresh = False
    run(component, 0.3)
    assert left.desired == pytest.approx(rest, abs=1e-12)


def test_it_ends_at_its_last_value_and_begins_again(upper, make):
    line = "{line: {to: [0.0, 0.03, 0.02], duration: 0.3}}"
    component = make(upper, HANDS.replace(CIRCLE, line))
    left = component.references.targets["left"]
    start = np.array(left.desired)
    run(component, 0.6)
    assert_allclose(left.desired, start + (0.0, 0.03, 0.02), atol=1e-12)
    assert left.is_still
    component.init()
    run(component, 0.6)
    assert_allclose(left.desired, start + (0.0, 0.03, 0.02), atol=1e-3)


OTHERS = """
others:
  stack:
    tasks:
      com: {point: center_of_mass, gain: 10, reference: {line: {to: [0.01, 0.0, 0.0], duration: 0.8}}}
      turn:
        point: orientation
        link: arm1_7
        gain: 10
        reference: {waypoints: [{time: 0.8, orientation: [0.0, 0.0, 0.19866933, 0.98006658]}]}
      pose: {point: pose, link: arm2_7, gain: 10, reference: {file: pose.csv, absolute: true}}
    levels: [[com], [turn, pose]]
"""


def test_centre_of_mass_orientation_and_pose_follow_theirs(upper, make, tmp_path):
    """They are where their references end, by the kinematics of the robot; the pose by a table of places."""
    kinematics = upper.kinematics
    center, place = kinematics.center_of_mass.copy(), kinematics.position("arm2_7") + (0.0, 0.02, 0.03)
    before, held = (kinematics.rotation(link).copy() for link in ("arm1_7", "arm2_7"))
    numbers = ",".join(map(repr, (*place.tolist(), *quaternion_from_rotation(held).tolist())))
    (tmp_path / "pose.csv").write_text(f"0.8,{numbers}\n")
    run(make(upper, OTHERS), 1.6)
    upper.state.position[:] = upper.command.position
    upper.update()
    assert_allclose(kinematics.center_of_mass - center, (0.01, 0.0, 0.0), atol=1e-3)
    turn = rotation_from_quaternion((0.0, 0.0, 0.19866933, 0.98006658))
    assert_allclose(kinematics.rotation("arm1_7"), turn @ before, atol=1e-3)
    assert_allclose(kinematics.position("arm2_7"), place, atol=1e-3)
    assert_allclose(kinematics.rotation("arm2_7"), held, atol=1e-3)


def test_it_slows_down_with_the_pace(upper, make):
    component = make(upper, HANDS.replace(CIRCLE, "{line: {to: [0.0, 0.03, 0.02], duration: 0.4}}"))
    left = component.references.targets["left"]
    start = np.array(left.desired)
    component.pace = 0.5
    run(component, 0.4)
    assert_allclose(left.desired, start + (0.0, 0.015, 0.01), atol=1e-9)
    component.pace = 0.0
    run(component, 0.4)
    assert_allclose(left.desired, start + (0.0, 0.015, 0.01), atol=1e-9)


def test_it_moves_in_the_world_with_a_base_that_jumps(panda, make):
    component, other = make(panda, ARM), make(panda, ARM)
    for each in (component, other):
        run(each, 0.4)
    move = PlanarMove(np.zeros(3), np.array((0.3, -0.1, 0.0)), 0.5)
    component.references.targets["hand"].displace(move)
    for each in (component, other):
        run(each, 0.2)
    expected = np.array(other.references.targets["hand"].desired)
    move.move(expected[:3])
    move.rotate_orientation(expected[3:])
    assert_allclose(component.references.targets["hand"].desired, expected, atol=1e-12)


@pytest.mark.slow
def test_a_posture_follows_its_joints(upper, make):
    text = HANDS.replace(CIRCLE, "[0.5, 0.3, 0.2]").replace("gain: 0.5, weight: 0.0001", f"gain: 5, reference: {SWING}")
    text = text.replace("levels: [[left, right, posture]]", "levels: [[posture], [left, right]]")
    component, joint = make(upper, text), upper.dof("torso_yaw")
    start = upper.state.position[joint]
    yaw = []
    for _ in range(round(2.6 * RATE)):
        run(component, PERIOD)
        yaw.append(upper.command.position[joint] - start)
    assert max(yaw) == pytest.approx(0.1, abs=2e-3) and min(yaw) == pytest.approx(-0.1, abs=2e-3)
    assert yaw[-1] == pytest.approx(0.0, abs=5e-4)
    assert np.abs(np.diff(yaw)).max() < 1.02 * 0.1 * math.pi * PERIOD


@pytest.mark.parametrize(
    ("wrong", "place", "error"),
    [
        ("{circle: {radius: 0.5, period: 1, plane: xz}}", "circle: a speed of 3.142 m/s", ComponentError),
        ("{line: {to: [0, 0, 1], duration: 1}}", "line: a speed of 1.875 m/s", ComponentError),
        ("{waypoints: [{time: 0.1, position: [0.2, 0, 0]}]}", "waypoints: a speed of 3 m/s", ComponentError),
        ("{file: none.csv}", "file: there is no file", ConfigError),
        ("{circel: {radius: 0.5}}", "unknown key 'circel'", UnknownName),
    ],
)
def test_what_cannot_be_followed_is_one_error_with_its_place(upper, make, wrong, place, error):
    with pytest.raises(error) as caught:
        make(upper, HANDS.replace(CIRCLE, wrong))
    assert not isinstance(caught.value, SolferErrors)
    assert "tasks.yaml:5:" in caught.value.where and place in str(caught.value)


def test_a_place_that_is_too_far_for_its_time_is_refused_at_the_start(upper, make):
    near = "{waypoints: [{time: 1.0, position: [0.9, 0.3, 0.2]}], absolute: true}"
    left = make(upper, HANDS.replace(CIRCLE, near)).references.targets["left"]
    assert left.desired[0] < 0.8
    with pytest.raises(ComponentError, match=r"tasks.yaml:5:\d+.*waypoints: a speed of"):
        make(upper, HANDS.replace(CIRCLE, near.replace("1.0", "0.2")))


def test_what_has_no_such_reference_is_refused(upper, make):
    with pytest.raises(ConfigError, match="a reference that moves, of 'look_at'"):
        make(upper, HANDS.replace("point: position, link: arm1_7, relative: torso_2", "point: look_at, link: arm1_7"))
    fast = SWING.replace("0.1", "9.0")
    with pytest.raises(ComponentError, match="rad/s of joint 'torso_yaw'"):
        make(upper, HANDS.replace("gain: 0.5", f"reference: {fast}"))
    with pytest.raises(UnknownName, match="unknown joint 'torso_jaw'"):
        make(upper, HANDS.replace("gain: 0.5", f"reference: {SWING.replace('yaw', 'jaw')}"))
