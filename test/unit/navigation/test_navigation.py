"""The navigation in memory, with a base that integrates its commands."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from support.unit.correction import Correction
from support.unit.scenarios import made

from solfer.errors import ComponentError, MiddlewareError, SolferError
from solfer.interfaces.declaration import Service
from solfer.interfaces.support import LiftContacts, LiftReply
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.transport import BodyMessage, Inbox
from solfer.transport.messages import FieldsMessage
from solfer_tools.navigation import (
    DriveLimits,
    Navigation,
    ScenarioCourse,
    Waypoint,
    WaypointCourse,
    WaypointFollower,
)
from solfer_tools.navigation.course import CORRECTION_TIME, MeasuredPose
from solfer_tools.scenarios import Player, read_scenario

RATE = 100.0  # [Hz]
PERIOD = 0.005  # [s]
PATIENCE = 0.55
"""Time after the last `cmd_vel` when it stops [s]."""
LEGS = ("front_left_leg", "front_right_leg", "rear_left_leg", "rear_right_leg")
STAY = {"x_cp": 0, "y_cp": 0, "z_cp": 0}


class DrivenBase:
    """A base on a bus, with wheels whose vertices move.

    Args:
        bus: Where it is.
        heading: At the beginning [rad].
        lifts: Whether it offers the service that lifts contacts.
        delay: Cycles until a contact is lifted.

    Attributes:
        pace: Returns the ratio of its velocities with which it goes on, which it publishes; None: whole, and silent.
    """

    def __init__(self, bus: Bus, heading: float = 0.0, lifts: bool = True, delay: int = 10):
        self._node, self._inbox = MemoryMiddleware(bus, "robot"), Inbox()
        self._twist = self._node.reader("wheeled_motion/cmd_vel", "geometry_msgs/Twist")
        self._state = self._node.reader("wheeled_motion/wheels_state", "solfer/WheelsState")
        self._support = self._node.reader("wheeled_motion/wheels_support", "solfer/WheelsSupport")
        self._odometry = self._node.writer("odometry/odom", "nav_msgs/Odometry")
        self._pace = self._node.writer("wheeled_motion/pace", "std_msgs/Float64")
        self.pace: Callable[[], float | None] = lambda: None
        self.pose, self.z, self.vertices = np.array((0.5, -0.3, heading)), 0.0, np.zeros((4, 3))
        self.is_silent, self.velocity, self.camber = False, np.zeros(3), ()
        self.lifted: list[tuple[float, tuple[str, ...], bool]] = []
        self.moved = 0.0
        self._delay, self._count, self._bus, self.refusal = delay, 0, bus, ""
        if lifts:
            service = Service("lift", "solfer/LiftContacts", LiftContacts, LiftReply, self._lift)
            self._node.serve("wheeled_motion", (service,), self._inbox.submit)
        bus.every(PERIOD, self.cycle)

    def cycle(self) -> None:
        """Integrate by one period."""
        self._count += 1
        if self._count % self._delay == 0:
            self._inbox.apply()
        self.velocity[:] = 0.0
        if self._twist.read() and self._twist.age() <= PATIENCE:
            linear, angular = self._twist.message.fields["linear"], self._twist.message.fields["angular"]
            cos, sin = math.cos(self.pose[2]), math.sin(self.pose[2])
            self.velocity += (
                cos * linear["x"] - sin * linear["y"], sin * linear["x"] + cos * linear["y"], angular["z"],
            )  # fmt: skip
        pace = self.pace()
        ratio = 1.0 if pace is None else pace if math.isfinite(pace) else 0.0
        if pace is not None:
            self._pace.write(FieldsMessage({"data": pace}))
        if self._state.read():
            fields = self._state.message.fields
            self.velocity += ratio * np.array((fields["x"], fields["y"], fields["rz"]))
            self.z, self.camber = self.z + ratio * fields["z"] * PERIOD, fields["cs"]
        if self._support.read():
            self.vertices += ratio * np.reshape(self._support.message.fields["velocity"], (4, 3)) * PERIOD
        self.pose += self.velocity * PERIOD
        self.moved += float(np.abs(self.velocity).sum()) * PERIOD
        if not self.is_silent:
            half = self.pose[2] / 2.0
            orientation = np.array((0.0, 0.0, math.sin(half), math.cos(half)))
            self._odometry.write(BodyMessage("odom", "base", np.array((*self.pose[:2], 0.9)), orientation))

    def _lift(self, request: LiftContacts) -> LiftReply:
        if self.refusal:
            return LiftReply(False, self.refusal)
        self.lifted.append((self._bus.time, tuple(request.contacts), request.lifted))
        return LiftReply()


@pytest.fixture
def bus():
    return Bus()


@pytest.fixture
def go(bus):
    """Make a navigation to way-points."""

    def go(*waypoints, **limits):
        middleware = MemoryMiddleware(bus, "navigation")
        follower = WaypointFollower([Waypoint(*each) for each in waypoints], DriveLimits(**limits))
        return Navigation(
            middleware, WaypointCourse(middleware, follower, "wheeled_motion", "odometry/odom"), "navigation", RATE
        )

    return go


@pytest.fixture
def play(bus):
    """Make a navigation that plays a scenario."""

    def play(scenario, contacts=LEGS, rate=RATE):
        middleware = MemoryMiddleware(bus, "navigation")
        player = Player(scenario, 1.0 / rate)
        course = ScenarioCourse(middleware, player, "wheeled_motion", "odometry/odom", contacts)
        return Navigation(middleware, course, "navigation", rate)

    return play


class ProgressMessages:
    """The messages of progress."""

    def __init__(self, bus):
        self._queue = MemoryMiddleware(bus, "listener").queue(
            "navigation/progress", "solfer/NavigationProgress", size=100_000
        )

    def messages(self):
        return [message.fields for message in self._queue.drain()]


def test_it_goes_to_way_points_and_ends_at_rest(bus, go):
    base, recorded = DrivenBase(bus, heading=0.7), ProgressMessages(bus)
    assert go((1.0, 0.5), (1.5, -0.5, -1.0)).run() == 0
    assert math.dist(base.pose[:2], (1.5, -0.5)) < 0.02 and abs(base.pose[2] + 1.0) < 0.02
    messages = recorded.messages()
    assert [message["number"] for message in messages][-1] == 2 and messages[-1]["done"]
    before = base.pose.copy()
    bus.run_until(bus.time + 1.0)
    np.testing.assert_allclose(base.pose, before, atol=1e-3)
    lefts = [message["left"] for message in messages if not message["waits"]]
    assert lefts[0] > 5.0 and lefts[-1] == 0.0 and np.all(np.diff(lefts) < 0.3)


class LaggingBase(DrivenBase):
    """A base that follows its velocities with a time constant of a second, as one whose commands blend in."""

    rolled = np.zeros(3)

    def cycle(self):
        before = self.pose.copy()
        super().cycle()
        self.rolled = self.rolled + PERIOD * (self.pose - before - self.rolled)
        self.pose[:] = before + self.rolled


def test_a_base_that_lags_behind_is_at_rest_at_the_way_point(bus, go):
    base = LaggingBase(bus)
    assert go((1.5, -0.3)).run() == 0
    assert math.dist(base.pose[:2], (1.5, -0.3)) < 0.02
    assert np.abs(base.rolled).max() < 0.02 * PERIOD


@pytest.mark.slow
@pytest.mark.parametrize("name", ["shape_side", pytest.param("circular", marks=pytest.mark.soak), "hw_full"])
def test_it_plays_a_scenario_along_the_heading_of_the_beginning(bus, play, repository, name):
    scenario = read_scenario(repository / f"config/scenarios/{name}.yaml")
    own = Player(scenario)
    while own.step():
        pass
    base, recorded = DrivenBase(bus, heading=0.7), ProgressMessages(bus)
    start = base.pose.copy()
    assert play(scenario).run() == 0
    x, y, z, heading = own.base - scenario.base
    cos, sin = math.cos(0.7), math.sin(0.7)
    expected = (cos * x - sin * y, sin * x + cos * y, heading)
    np.testing.assert_allclose(base.pose - start, expected, atol=0.01)
    np.testing.assert_allclose(base.vertices, own.vertices - scenario.vertices, atol=0.01)
    assert abs(base.z - z) < 0.01 and base.camber == tuple(own.camber)
    assert recorded.messages()[-1]["done"] and not base.velocity.any()


def test_it_pauses_at_rest_and_goes_on(bus, play, tmp_path):
    """Two seconds of pause: the base rests, the progress reports it, and the whole way is completed all the same."""
    pattern = [{"type": "move", **STAY, "base": 0}]
    base = DrivenBase(bus)
    start, recorded = base.pose[0], ProgressMessages(bus)
    navigation = play(made(tmp_path, pattern, vel=0.2, base_ref=[[1.0, 0.0, 0.0, 0.0]]))
    seen = []
    bus.every(1e9, lambda: bus.call("navigation/pause", data=True), start=3.0)
    bus.every(1e9, lambda: seen.append(base.moved), start=4.0)
    bus.every(1e9, lambda: seen.append((base.moved, bus.call("navigation/pause", data=False))), start=6.0)
    assert navigation.run() == 0
    assert seen[1][0] == seen[0] > 0.1 and seen[1][1].result().success
    assert base.pose[0] - start == pytest.approx(0.995, abs=0.01)
    messages = recorded.messages()
    assert any(message["paused"] for message in messages) and not messages[-1]["paused"]
    assert messages[-1]["elapsed"] == pytest.approx(4.975, abs=0.05)
    assert bus.time == pytest.approx(0.5 + 1.0 + 4.975 + 3.25, abs=0.1)  # connections, start and end, way, pause


def test_a_pause_slows_down_with_the_same_way(bus, play, tmp_path):
    """Base and vertices keep to the path of the file, whatever the pace."""
    pattern = [{"type": "speed", "motions": [[3, 3, 0.5]]},
               {"type": "circle", **STAY, "angle": 3.0, "radius": 1.0, "x_sign": 1, "y_sign": 1}]  # fmt: skip
    base = DrivenBase(bus)
    start = base.pose.copy()
    places = []
    bus.every(0.05, lambda: places.append(base.pose[:2] - start[:2]))
    for index in range(5):
        bus.every(1e9, lambda: bus.call("navigation/pause", data=True), start=2.0 + 2.0 * index)
        bus.every(1e9, lambda: bus.call("navigation/pause", data=False), start=3.0 + 2.0 * index)
    assert play(made(tmp_path, pattern)).run() == 0
    np.testing.assert_allclose(np.linalg.norm(np.array(places) - (0.0, 1.0), axis=1), 1.0, atol=0.02)


def test_contacts_are_lifted_before_what_comes_behind(bus, play, tmp_path):
    pattern = [
        {"type": "wait", "steps": 20},
        {"type": "claim", "leg": 3},
        {"type": "move", **STAY, "z_cp": 1, "base": 0},
        {"type": "release", "leg": 3},
        {"type": "wait", "steps": 20},
    ]
    tables = {"z_cp_ref": [[0.0] * 4, [0.0, 0.0, 0.0, 0.1]], "vel": 0.1}
    base, first = DrivenBase(bus, delay=100), []
    bus.every(0.005, lambda: first.append(bus.time) if base.vertices.any() and not first else None)
    assert play(made(tmp_path, pattern, **tables)).run() == 0
    assert [(names, lifted) for _, names, lifted in base.lifted] == [((LEGS[3],), True), ((LEGS[3],), False)]
    assert first[0] >= base.lifted[0][0]
    assert base.vertices[3, 2] == pytest.approx(0.1, abs=0.006) and not base.vertices[:3].any()


def test_a_contact_that_is_refused_ends_it_at_rest(bus, play, tmp_path):
    base = DrivenBase(bus)
    base.refusal = "it carries too much"
    pattern = [{"type": "claim", "leg": 0}, {"type": "wait", "steps": 10}]
    with pytest.raises(ComponentError, match="wheeled_motion/lift refuses: it carries too much"):
        play(made(tmp_path, pattern, base_const_vel=[0.1, 0.0, 0.0, 0.0])).run()
    bus.run_until(bus.time + 0.1)
    assert not base.velocity.any()


def test_without_the_service_nothing_is_lifted(bus, play, tmp_path):
    DrivenBase(bus, lifts=False)
    pattern = [{"type": "claim", "leg": 0}, {"type": "wait", "steps": 10}]
    with pytest.raises(MiddlewareError, match="wheeled_motion/lift"):
        play(made(tmp_path, pattern)).run()


def test_legs_that_are_lifted_need_names_of_contacts(bus, play, tmp_path):
    scenario = made(tmp_path, [{"type": "claim", "leg": 0}])
    with pytest.raises(SolferError, match="scenario.yaml:.*pattern.1: .*'claim' needs the names of the contacts"):
        play(scenario, contacts=())
    with pytest.raises(SolferError, match="2 contacts"):
        play(scenario, contacts=LEGS[:2])


def test_without_odometry_it_stops_and_goes_on_later(bus, go):
    base, recorded = DrivenBase(bus), ProgressMessages(bus)

    def silence(silent):
        base.is_silent = silent

    bus.every(1e9, lambda: silence(True), start=3.0)
    bus.every(1e9, lambda: silence(False), start=6.0)
    moved = []
    bus.every(1.0, lambda: moved.append(base.moved))
    assert go((2.0, 0.0)).run() == 0
    assert moved[6] == moved[5] > moved[3]  # it stops half a second after the last message
    assert "odometry on odometry/odom" in {message["waits"] for message in recorded.messages()}
    assert math.dist(base.pose[:2], (2.0, 0.0)) < 0.02


def test_nan_in_odometry_stops_it(bus, go):
    base = DrivenBase(bus)
    navigation = go((2.0, 0.0))
    bus.every(1e9, lambda: base.pose.__setitem__(0, math.nan), start=3.0)
    bus.every(1e9, lambda: setattr(bus, "ended", True), start=5.0)
    assert navigation.run() == 1
    assert "finite numbers" in navigation.waits and not base.velocity.any()


def test_an_end_from_outside_leaves_it_at_rest(bus, go, play, tmp_path):
    base = DrivenBase(bus)
    bus.every(1e9, lambda: setattr(bus, "ended", True), start=3.0)
    moving = [{"type": "wait", "steps": 1000}]
    assert play(made(tmp_path, moving, base_const_vel=[0.1, 0.0, 0.0, 0.1])).run() == 1
    assert base.velocity.any()
    base.cycle()
    assert not base.velocity.any()


def test_nothing_is_played_to_nobody(bus, play, tmp_path):
    navigation = play(made(tmp_path, [{"type": "wait", "steps": 10}]))
    with pytest.raises(MiddlewareError, match="no subscriber on wheeled_motion/wheels_support"):
        navigation.run()
    assert navigation.elapsed == 0.0 and bus.time > 20.0


def test_it_begins_when_a_subscriber_comes(bus, play, tmp_path):
    bases = []
    bus.every(1e9, lambda: bases.append(DrivenBase(bus)), start=5.0)
    scenario = made(tmp_path, [{"type": "move", **STAY, "base": 0}], base_ref=[[0.2, 0.0, 0.0, 0.0]])
    assert play(scenario).run() == 0
    assert bases[0].pose[0] - 0.5 == pytest.approx(0.195, abs=0.005)


def test_a_scenario_follows_the_pace(bus, play, tmp_path):
    """A robot that waits, and is slower than commanded, ends where the file ends."""
    circle = {"type": "circle", **STAY, "y_cp": 1, "angle": 1.5, "radius": 0.5, "x_sign": 1, "y_sign": 1}
    pattern = [{"type": "speed", "motions": [[3, 3, 0.4]]}, circle, {"type": "wait", "steps": 20}]
    scenario = made(tmp_path, pattern, vel=0.02, y_cp_ref=[[0.0] * 4, [0.05, -0.05, 0.05, -0.05]])
    own = Player(scenario)
    while own.step():
        pass
    base, recorded = DrivenBase(bus), ProgressMessages(bus)
    start = base.pose.copy()
    base.pace = lambda: 0.0 if bus.time < 3.0 else 0.5 + 0.5 * math.sin(bus.time)
    assert play(scenario).run() == 0
    np.testing.assert_allclose(base.pose - start, (own.base - scenario.base)[[0, 1, 3]], atol=0.02)
    np.testing.assert_allclose(base.vertices, own.vertices - scenario.vertices, atol=0.01)
    messages = recorded.messages()
    paces = [message["pace"] for message in messages if not message["waits"]]
    assert min(paces[:20]) == 0.0 and max(paces) > 0.9
    assert messages[-1]["elapsed"] == pytest.approx(scenario.duration, abs=0.1) and bus.time > 1.5 * scenario.duration


@pytest.mark.parametrize("wrong", [None, math.nan])
def test_a_target_whose_pace_ends_is_waited_for(bus, play, tmp_path, wrong):
    base, seen = DrivenBase(bus), []
    base.pace = lambda: wrong if 3.0 < bus.time < 6.0 else 1.0
    navigation = play(made(tmp_path, [{"type": "move", **STAY, "base": 0}], base_ref=[[1.0, 0.0, 0.0, 0.0]], vel=0.2))
    bus.every(1e9, lambda: seen.append((navigation.waits, base.velocity[0], navigation.elapsed)), start=5.0)
    bus.every(1e9, lambda: seen.append((navigation.waits, base.velocity[0], navigation.elapsed)), start=5.9)
    begin = base.pose[0]
    assert navigation.run() == 0
    waits, speed, elapsed = seen[0]
    assert "wheeled_motion/pace" in waits and seen[1] == (waits, speed, elapsed) and speed == 0.0
    assert base.pose[0] - begin == pytest.approx(0.995, abs=0.01)


@pytest.mark.slow
def test_a_robot_that_is_stuck_is_reported(bus, play, tmp_path):
    base = DrivenBase(bus)
    base.pace = lambda: 0.0
    with pytest.raises(ComponentError, match="has not gone on for 60 s: its pace is 0.00"):
        play(made(tmp_path, [{"type": "wait", "steps": 1000}], base_const_vel=[0.1, 0.0, 0.0, 0.0])).run()
    assert 60.0 < bus.time < 62.0


@pytest.mark.slow
def test_velocities_jump_at_rest_only(bus, play, repository):
    """What a robot follows is steady up to a tenth: it need not leave the path."""
    base, rows = DrivenBase(bus), []
    bus.every(0.01, lambda: rows.append(base.velocity.copy()))
    scenario = read_scenario(repository / "config/figures/course.yaml")
    assert play(scenario).run() == 0
    speeds = np.array(rows)
    assert np.linalg.norm(speeds, axis=1).max() > 0.4
    assert np.linalg.norm(np.diff(speeds, axis=0), axis=1).max() < 0.1 * 0.5


@pytest.mark.parametrize("seed", range(3))
def test_way_points_in_a_map_are_met_while_the_localisation_corrects(bus, seed):
    """The last way-point is met within 2 cm by the mean of the localisation; speeds change as slowly as ever."""
    base, limits = DrivenBase(bus, heading=0.7), DriveLimits()
    correction, node, velocities = Correction(bus, seed), MemoryMiddleware(bus, "navigation"), []
    follower = WaypointFollower([Waypoint(2.0, 0.5), Waypoint(3.5, 2.5, 1.0)], limits)
    course = WaypointCourse(node, follower, "wheeled_motion", "odometry/odom", correction)
    bus.every(1.0 / RATE, lambda: velocities.append(base.velocity.copy()))
    assert Navigation(node, course, "navigation", RATE).run() == 0
    x, y, heading = correction.mean_pose(base.pose)
    assert math.dist((x, y), (3.5, 2.5)) < 0.02 and abs(heading - 1.0) < 0.02
    speeds = np.array(velocities)
    assert np.linalg.norm(speeds[:, :2], axis=1).max() <= limits.speed + 1e-9
    assert np.abs(speeds[:, 2]).max() <= limits.turn_speed + 1e-9
    assert np.abs(np.diff(speeds[:, 2])).max() <= 2.1 * limits.turn_acceleration / RATE


def test_the_first_corrections_are_averaged_whatever_the_clock_shows(bus):
    """The first one is taken, and after ten seconds of noise the mean counts: the clock began long ago."""
    bus.run_until(1000.0)
    base, node, correction = DrivenBase(bus), MemoryMiddleware(bus, "navigation"), Correction(bus, 1)
    pose = MeasuredPose(node, "odometry/odom", correction)
    correction.drawn = np.tile(correction.drawn, (2, 1))
    correction.drawn[1000:] = 0.0
    correction.drawn[1000, :2] = 0.1
    bus.run_until(1000.5)
    assert pose.awaits() == ""
    assert (pose.x, pose.y) == pytest.approx(correction.pose(base.pose, bus.time)[:2])
    for _ in range(250):
        bus.run_until(bus.time + 0.01)
        pose.awaits()
    # half a second of 0.1 m, then two of zero
    assert np.subtract((pose.x, pose.y), correction.pose(base.pose, bus.time)[:2]) == pytest.approx(0.02, abs=0.003)


def test_a_base_that_is_located_elsewhere_goes_on_from_there(bus):
    """A jump by a metre counts at once, one of 10 cm at the last way-point is driven after."""
    base, node = DrivenBase(bus), MemoryMiddleware(bus, "navigation")
    correction = Correction(bus, 1)
    correction.drawn[:] = 0.0
    correction.drawn[4:, 1] = 1.0
    follower = WaypointFollower([Waypoint(4.0, 3.0, 0.0)], DriveLimits(speed=0.25))
    arrived = []

    def look():
        if follower.index == 1 and not arrived:
            arrived.append(bus.time)
            correction.drawn[int(bus.time) + 2 :, 0] = 0.1

    bus.every(0.1, look)
    assert (
        Navigation(
            node, WaypointCourse(node, follower, "wheeled_motion", "odometry/odom", correction), "navigation", RATE
        ).run()
        == 0
    )
    x, y, heading = correction.pose(base.pose, bus.time)
    assert math.dist((x, y), (4.0, 3.0)) < 0.03 and abs(heading) < 0.02
    assert arrived[0] + 2.0 * CORRECTION_TIME <= bus.time < arrived[0] + 6.0 * CORRECTION_TIME


def test_without_a_localisation_it_stops_and_says_what_is_missing(bus):
    base, recorded = DrivenBase(bus), ProgressMessages(bus)
    correction, node = Correction(bus, 1), MemoryMiddleware(bus, "navigation")
    follower = WaypointFollower([Waypoint(3.0, 2.0)], DriveLimits())
    course = WaypointCourse(node, follower, "wheeled_motion", "odometry/odom", correction)
    bus.every(1e9, lambda: setattr(correction, "missing", "a transform from 'map' to 'odom'"), start=3.0)
    bus.every(1e9, lambda: setattr(correction, "missing", ""), start=6.0)
    moved = []
    bus.every(1.0, lambda: moved.append(base.moved))
    assert Navigation(node, course, "navigation", RATE).run() == 0
    assert moved[6] == moved[5] > 0.0 and moved[-1] > moved[6]
    assert "a transform from 'map' to 'odom'" in {message["waits"] for message in recorded.messages()}
