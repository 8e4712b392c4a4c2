"""References that a navigation publishes to components in memory: progress, pause, end, silence, mistakes."""

import json

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.robots import upper_body

from solfer.components.inverse_kinematics import InverseKinematics
from solfer.components.joint_states import JointStates
from solfer.config import read
from solfer.errors import ConfigError, MiddlewareError, UnknownName
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.transport import Inbox, JointMessage
from solfer.transport.declared import bind
from solfer_tools.navigation import Navigation, ReferenceCourse, read_references

RATE, PERIOD = 100.0, 0.01  # [Hz], [s]
HANDS = """
hands:
  stack:
    tasks:
      left: {point: position, link: arm1_7, relative: torso_2, gain: 10}
      right: {point: pose, link: arm2_7, relative: torso_2, gain: 10}
      posture: {point: posture, gain: 0.5, weight: 0.0001}
    levels: [[left, right, posture]]
"""
LINE = {"line": {"to": [0.0, 0.03, 0.02], "duration": 1.0}}


class Working:
    """A component on a bus: it gets what it declares, and publishes where its joints are."""

    def __init__(self, bus, name, component):
        node, self.component, self.inbox = MemoryMiddleware(bus, name), component, Inbox()
        component.set_rate(RATE)
        component.init()
        bind(name, (*component.services(), *component.topics()), node, self.inbox, rate=RATE)
        self._states = node.writer("joint_states", "sensor_msgs/JointState")
        bus.every(PERIOD, self.cycle)

    def cycle(self):
        self.inbox.apply()
        self.component.update()
        self.component.send()
        robot = self.component.model
        self._states.write(JointMessage(tuple(robot.dofs), position=robot.command.position.copy()))


@pytest.fixture
def bus():
    return Bus()


@pytest.fixture
def upper(repository):
    return upper_body()


@pytest.fixture
def hands(bus, upper, tmp_path):
    """Make the component `hands` on the bus."""
    file = tmp_path / "hands.yaml"
    file.write_text(HANDS)
    return Working(bus, "hands", InverseKinematics(upper, read(file, InverseKinematics.Tags, ("hands",)), "hands"))


@pytest.fixture
def play(bus, tmp_path):
    """Make a navigation of references."""

    def play(**content):
        file = tmp_path / "references.yaml"
        file.write_text(json.dumps(content))
        node = MemoryMiddleware(bus, "navigation")
        return Navigation(node, ReferenceCourse(node, read_references(file), "hands"), "navigation", 50.0)

    return play


def desired(hands, task="left"):
    return np.array(hands.component.references.targets[task].desired)


@pytest.mark.slow
def test_references_go_to_their_ends(bus, hands, play):
    """A position and a pose together; progress counts them, and a navigation that has ended leaves them there."""
    start, pose = desired(hands), desired(hands, "right")
    turned = {"waypoints": [{"time": 1.5, "position": [0.02, 0.0, 0.0], "orientation": [0.0, 0.0, 0.1, 0.99498744]}]}
    progress = MemoryMiddleware(bus, "listener").queue("navigation/progress", "solfer/NavigationProgress", size=10_000)
    assert play(positions={"left": LINE}, poses={"right": turned}).run() == 0
    bus.run_until(bus.time + 1.0)
    assert_allclose(desired(hands), start + (0.0, 0.03, 0.02), atol=1e-9)
    assert_allclose(desired(hands, "right")[:3], pose[:3] + (0.02, 0.0, 0.0), atol=1e-9)
    messages = [message.fields for message in progress.drain()]
    assert messages[-1]["done"] and messages[-1]["count"] == 2 and messages[-1]["left"] == 0.0
    assert {message["name"] for message in messages if not message["waits"]} >= {"left, right", "right"}
    lefts = [message["left"] for message in messages if not message["waits"]]
    assert np.all(np.diff(lefts) <= 1e-9)
    assert all(target.is_still for target in hands.component.references.targets.values())


@pytest.mark.slow
def test_a_pause_stays_on_the_way(bus, hands, play):
    start, places = desired(hands), []
    navigation = play(positions={"left": {"line": {"to": [0.0, 0.06, 0.0], "duration": 2.0}}})
    bus.every(1e9, lambda: bus.call("navigation/pause", data=True), start=1.8)
    bus.every(1e9, lambda: bus.call("navigation/pause", data=False), start=4.0)
    bus.every(0.02, lambda: places.append(desired(hands) - start))
    assert navigation.run() == 0
    bus.run_until(bus.time + 0.5)
    places = np.array(places)
    assert_allclose(places[-1], (0.0, 0.06, 0.0), atol=1e-9)
    paused = places[round(2.8 / 0.02) : round(3.8 / 0.02)]
    assert np.ptp(paused, axis=0).max() < 1e-12 and 0.001 < paused[0, 1] < 0.059
    assert np.abs(places[:, [0, 2]]).max() < 1e-12 and np.diff(places[:, 1]).min() > -1e-12


@pytest.mark.slow
@pytest.mark.parametrize("way", ["killed", "ended"])
def test_silence_leaves_the_target_at_its_last_reference(bus, hands, play, way):
    """Killed in the middle of a circle: the reference comes to rest at what was published last."""
    navigation = play(positions={"left": {"circle": {"radius": 0.05, "period": 3.0, "plane": "zy"}}})
    last = []
    queue = MemoryMiddleware(bus, "listener").queue("hands/left/reference", "geometry_msgs/PointStamped", size=10_000)

    def end():
        if way == "ended":
            bus.ended = True
        else:
            raise KeyboardInterrupt

    if way == "killed":
        navigation._course.rest = lambda: None  # a killed process publishes nothing more
    bus.every(1e9, end, start=3.0)
    if way == "killed":
        with pytest.raises(KeyboardInterrupt):
            navigation.run()
    else:
        assert navigation.run() == 1
    last = [message.values.copy() for message in queue.drain()]
    for _ in range(100):
        hands.cycle()
    assert len(last) > 50 and np.linalg.norm(last[-1] - last[0]) > 0.01
    assert_allclose(desired(hands), last[-1], atol=1e-12)
    assert_allclose(hands.component.references.targets["left"].reference, last[-1], atol=1e-6)
    assert hands.component.references.targets["left"].is_still


@pytest.mark.slow
def test_joints_follow_by_trajectories(bus, upper, play):
    """Joints draw a sine: its amplitude and, against the formula once it has its speed, its whole course."""
    moving = Working(bus, "joint_states", JointStates(upper))
    joint = upper.dof("torso_yaw")
    start, yaw = upper.command.position[joint], []
    bus.every(0.02, lambda: yaw.append(upper.command.position[joint] - start))
    sine = {"sine": {"amplitude": {"torso_yaw": 0.1}, "period": 2.0, "turns": 1}}
    assert play(joints=sine).run() == 0
    for _ in range(50):
        moving.cycle()
    assert max(yaw) == pytest.approx(0.1, abs=2e-3) and min(yaw) == pytest.approx(-0.1, abs=2e-3)
    assert upper.command.position[joint] == pytest.approx(start, abs=1e-4)
    assert not upper.command.velocity[joint]
    turn = np.array(yaw[yaw.index(max(yaw)) : yaw.index(min(yaw))])
    # the sample next to its peak may be half a period away from it
    assert_allclose(turn, 0.1 * np.cos(np.pi * 0.02 * np.arange(len(turn))), atol=4e-3)


@pytest.mark.slow
def test_joints_of_a_killed_navigation_rest_at_its_last_message(bus, upper, play):
    """Without the last message of an ordered end, joints stop within their limits instead of going on."""
    moving = Working(bus, "joint_states", JointStates(upper))
    joint = upper.dof("torso_yaw")
    navigation = play(joints={"sine": {"amplitude": {"torso_yaw": 0.3}, "period": 2.0}})
    navigation._course.rest = lambda: None  # a killed process publishes nothing more
    topic = ("joint_states/joint_trajectory", "trajectory_msgs/JointTrajectory")
    queue = MemoryMiddleware(bus, "listener").queue(*topic, size=10_000)

    def kill():
        raise KeyboardInterrupt

    bus.every(1e9, kill, start=2.1)
    with pytest.raises(KeyboardInterrupt):
        navigation.run()
    speeds = []
    for _ in range(50):
        moving.cycle()
        speeds.append(abs(upper.command.velocity[joint]))
    last = queue.drain()[-1].fields["points"][-1]
    assert upper.command.position[joint] == pytest.approx(last["positions"][0], abs=1e-9)
    assert speeds[0] > 0.3 and not speeds[-1] and max(speeds) < 0.3 * np.pi * 1.01


def test_a_target_that_has_not_started_is_waited_for(bus, hands, play):
    course = play(positions={"left": LINE})._course
    interface = hands.component.references.interface
    seen = []
    for known in ({}, interface._targets):
        interface._targets = known
        for _ in range(4):
            seen.append(course.awaits())
            bus.run_until(bus.time + 0.02)
    assert any("hands/get_reference, which refuses: " in each for each in seen[:4])
    assert all(seen[:4]) and not seen[-1]
    assert_allclose(course._references[0].generator.origin, desired(hands))


@pytest.mark.slow
def test_an_unknown_task_ends_it(bus, hands, play):
    with pytest.raises(MiddlewareError, match="hands/lift/reference"):
        play(positions={"lift": LINE}).run()


def test_an_unknown_joint_is_an_error_with_its_place(bus, hands, play):
    course = play(joints={"sine": {"amplitude": {"torso_jaw": 0.1}, "period": 2.0}})._course
    bus.run_until(bus.time + 0.1)
    with pytest.raises(UnknownName, match=r"references.yaml:1:\d+.*unknown joint 'torso_jaw'"):
        course.awaits()


def test_a_task_of_another_quantity_is_refused(hands, play):
    with pytest.raises(MiddlewareError, match="hands/left/reference"):
        play(poses={"left": LINE})


def test_a_file_without_references_is_refused(play):
    with pytest.raises(ConfigError, match="there is no reference"):
        play()
