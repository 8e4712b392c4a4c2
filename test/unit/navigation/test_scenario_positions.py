"""Courses as positions, for a base that goes there: it ends where it is sent, whatever the machine does."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from support.unit.scenarios import made

from solfer.errors import MiddlewareError, SolferError
from solfer.interfaces.declaration import Service
from solfer.interfaces.task_references import GetReference, ReferenceReply
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
from solfer_tools.scenarios import Player

RATE = 50.0  # [Hz]

STAY = {"x_cp": 0, "y_cp": 0, "z_cp": 0}

PATTERN = (
    {"type": "speed", "motions": [[3, 0, 0.2], [3, 1, 0.2], [3, 3, 0.4]]},
    {"type": "move", "x_cp": 0, "y_cp": 1, "z_cp": 0, "base": 1},
    {"type": "circle", **STAY, "radius": 0.4, "angle": 3.0, "x_sign": 1, "y_sign": 1},
)

TABLES = {
    "vel": 0.02,
    "y_cp_ref": [[0.0, 0.0, 0.0, 0.0], [-0.05, 0.05, -0.05, 0.05]],
    "base_ref": [[0.0, 0.0, 0.0, 0.0], [0.3, 0.1, 0.0, 0.0]],
}

PERIOD = 0.005  # [s]
AHEAD = 0.5
"""Time by whose way positions are ahead [s]."""


class GuidedBase:
    """A base on a bus that goes to positions with a share of the speed error / AHEAD, as the documentation has it.

    Args:
        bus: Where it is.
        heading: At the beginning [rad].
        count: Number of its vertices.
        topic: Where it receives positions of the base.

    Attributes:
        pace: Returns that share, which it publishes.
        pose: x, y, z, heading [m, rad].
        vertices: Shape (count, 3) [m].
        refusal: Why it does not say where it is; empty: it does.
        received: Whether it has received positions.
    """

    def __init__(self, bus: Bus, heading: float = 0.0, count: int = 4, topic: str = "locomotion/base"):
        self._node, self._inbox = MemoryMiddleware(bus, "robot"), Inbox()
        self._base = self._node.reader(topic, "geometry_msgs/PoseStamped")
        self._vertices = self._node.reader("locomotion/vertices", "solfer/RobotPoints")
        self._odometry = self._node.writer("odometry/odom", "nav_msgs/Odometry")
        self._pace = self._node.writer("locomotion/pace", "std_msgs/Float64")
        self.pace: Callable[[], float] = lambda: 1.0
        self.pose, self.vertices = np.array((0.5, -0.3, 0.9, heading)), np.full((count, 3), 0.4)
        self.refusal, self.received, self.is_silent = "", False, False
        service = Service("get_reference", "solfer/GetReference", GetReference, ReferenceReply, self._reference)
        self._node.serve("locomotion", (service,), self._inbox.submit)
        bus.every(PERIOD, self.cycle)

    def cycle(self) -> None:
        """Go on by one period."""
        self._inbox.apply()
        share = self.pace() * PERIOD / AHEAD
        self._pace.write(FieldsMessage({"data": self.pace()}))
        if self._base.read():
            x, y, z, _, _, sin, cos = self._base.message.values
            left = np.array((x, y, z, 2.0 * math.atan2(sin, cos))) - self.pose
            left[3] = math.remainder(left[3], math.tau)
            self.pose += share * left
            self.received = True
        if self._vertices.read():
            self.vertices += share * (self._vertices.message.values - self.vertices)
        if not self.is_silent:
            half = self.pose[3] / 2.0
            turn = np.array((0.0, 0.0, math.sin(half), math.cos(half)))
            self._odometry.write(BodyMessage("odom", "base", self.pose[:3].copy(), turn))

    def _reference(self, request: GetReference) -> ReferenceReply:
        if self.refusal:
            return ReferenceReply(False, self.refusal)
        half = self.pose[3] / 2.0
        base = (*self.pose[:3].tolist(), 0.0, 0.0, math.sin(half), math.cos(half))
        return ReferenceReply(values={"base": base, "vertices": tuple(self.vertices.ravel().tolist())}[request.task])


@pytest.fixture
def bus():
    return Bus()


def play(bus, scenario, odometry="odometry/odom"):
    middleware = MemoryMiddleware(bus, "navigation")
    course = ScenarioCourse(middleware, Player(scenario, 1.0 / RATE), "locomotion", odometry, positions=True)
    return Navigation(middleware, course, "navigation", RATE)


def end_of(scenario, heading):
    """Return x, y, heading of the base and the vertices at the end of a file, as seen from where it begins."""
    player = Player(scenario)
    while player.step():
        pass
    cos, sin = math.cos(heading), math.sin(heading)
    x, y, _, turn = player.base - scenario.record.base_now
    return np.array((cos * x - sin * y, sin * x + cos * y, 0.0, turn)), player.vertices.copy()


def drive(bus, navigation, skip=0.0, each=lambda: None, longest=200.0):
    """Carry out a navigation of whose cycles a share is left out."""
    random, skipped = np.random.default_rng(5), 0
    while not navigation.done and bus.time < longest:
        bus.run_until(bus.time + 1.0 / RATE)
        each()
        if random.uniform() < skip:
            skipped += 1
            continue
        navigation.cycle(skipped)
        skipped = 0
    assert navigation.done


@pytest.mark.parametrize("skip", [0.0, 0.2])
@pytest.mark.parametrize("paced", [False, True])
def test_it_ends_where_the_file_says(bus, tmp_path, skip, paced):
    scenario, base = made(tmp_path, PATTERN, **TABLES), GuidedBase(bus, heading=0.7)
    if paced:  # it stands for a second in every three
        base.pace = lambda: 0.0 if bus.time % 3.0 < 1.0 else 0.8
    begin, vertices = base.pose.copy(), base.vertices.copy()
    drive(bus, play(bus, scenario), skip)
    end, moved = end_of(scenario, 0.7)
    np.testing.assert_allclose(base.pose - begin, end, atol=3e-3)
    np.testing.assert_allclose(base.vertices - vertices, moved, atol=3e-3)


def test_it_stays_on_the_way_of_the_file(bus, tmp_path):
    """Places ahead of the motion cut no corners: a circle keeps its radius."""
    scenario, base, rows = made(tmp_path, PATTERN, **TABLES), GuidedBase(bus), []
    navigation = play(bus, scenario)
    drive(bus, navigation, each=lambda: rows.append((navigation._course.number, *base.pose)))
    x, y = np.array([row[1:3] for row in rows if row[0] == 3]).T
    a = np.stack((x, y, np.ones_like(x)), axis=1)
    cx, cy, c = np.linalg.lstsq(a, x**2 + y**2, rcond=None)[0]
    assert math.sqrt(c + cx**2 / 4.0 + cy**2 / 4.0) == pytest.approx(0.4, abs=6e-3)


def test_the_course_moves_with_an_odometry_that_jumps(bus, tmp_path):
    """A jump of the estimated base must not be driven back: the rest of the course turns and shifts with it."""
    scenario, base = made(tmp_path, PATTERN, **TABLES), GuidedBase(bus)
    begin, at = base.pose.copy(), {}

    def jump():
        if not at and bus.time > 3.0:
            at["before"] = base.pose.copy()
            base.pose += (3.0, -2.0, 0.1, 1.0)
            at["after"] = base.pose.copy()
        if at and bus.time < 3.1:
            base.pose[:] = at["after"]  # it refuses places of before

    drive(bus, play(bus, scenario), each=jump)
    end, _ = end_of(scenario, 0.0)
    x, y = (begin + end - at["before"])[:2]
    cos, sin = math.cos(1.0), math.sin(1.0)
    expected = at["after"] + (cos * x - sin * y, sin * x + cos * y, -0.0, (begin + end - at["before"])[3])
    np.testing.assert_allclose(base.pose, expected, atol=5e-3)


def test_without_odometry_it_stands(bus, tmp_path):
    base = GuidedBase(bus)
    navigation, seen = play(bus, made(tmp_path, PATTERN, **TABLES)), []

    def silence():
        base.is_silent = 3.0 < bus.time < 6.0
        if 5.0 < bus.time < 6.0:
            seen.append((navigation.waits, *base.pose))

    drive(bus, navigation, each=silence)
    assert {row[0] for row in seen} == {"odometry on odometry/odom"}
    assert np.ptp([row[1:] for row in seen], axis=0).max() < 5e-3


def test_it_begins_when_the_target_says_where_it_is(bus, tmp_path):
    base = GuidedBase(bus)
    base.refusal = "it has not started"
    navigation = play(bus, made(tmp_path, PATTERN, **TABLES))
    waits = set()
    for _ in range(150):
        bus.run_until(bus.time + 1.0 / RATE)
        navigation.cycle()
        waits.add(navigation.waits)
    assert "locomotion/get_reference, which refuses: it has not started" in waits and "" not in waits
    assert not base.received


def test_what_positions_cannot_do_is_named(bus, tmp_path):
    with pytest.raises(SolferError, match="positions without odometry"):
        play(bus, made(tmp_path, PATTERN, **TABLES), odometry="")
    camber = {"type": "move", **STAY, "base": 0, "cs": 0}
    with pytest.raises(SolferError, match="positions carry no camber"):
        play(Bus(), made(tmp_path, [camber], cs_ref=[[0.1, 0.0, 0.0, 0.0]]))
    GuidedBase(bus, count=3)
    with pytest.raises(SolferError, match="3 vertices of locomotion/get_reference"):
        drive(bus, play(bus, made(tmp_path, PATTERN, **TABLES)))


def go(bus, *waypoints, **options):
    middleware = MemoryMiddleware(bus, "navigation")
    follower = WaypointFollower([Waypoint(*each) for each in waypoints], DriveLimits())
    course = WaypointCourse(middleware, follower, "locomotion", "odometry/odom", **options)
    return Navigation(middleware, course, "navigation", RATE)


@pytest.mark.parametrize("options", [{}, {"positions": True}])
@pytest.mark.parametrize("topic", ["locomotion/base", "locomotion/base/reference"])
def test_way_points_are_positions_where_these_are_received(bus, topic, options):
    """From the target's own reference on: a base that has a heading, and one of a task, go where they are sent."""
    velocities = MemoryMiddleware(bus, "driver").reader("locomotion/cmd_vel", "geometry_msgs/Twist")
    base = GuidedBase(bus, heading=0.7, topic=topic)
    drive(bus, go(bus, (1.5, 0.4), (1.2, 0.9, -0.5), **options))
    assert base.received and not velocities.read()
    np.testing.assert_allclose(base.pose, (1.2, 0.9, 0.9, -0.5), atol=0.012)


def test_way_points_wait_for_wheels_that_turn_first(bus):
    """At a pace of zero the place stays; it is ahead by what shows the direction, and not past the goal later."""
    base = GuidedBase(bus)
    base.pace = lambda: 0.0 if bus.time < 6.0 else 1.0
    furthest = 0.0

    def watch():
        nonlocal furthest
        furthest = max(furthest, base.pose[0])

    bus.every(PERIOD, watch)
    drive(bus, go(bus, (1.0, 0.0)))
    assert furthest < 1.012
    np.testing.assert_allclose(base.pose, (1.0, 0.0, 0.9, 0.0), atol=0.012)


@pytest.mark.parametrize("first", ["positions", "velocities"])
def test_velocities_are_for_a_target_without_positions(bus, first):
    """Topics of a target begin one after the other: which comes first does not matter, what is asked for does."""
    options = {"positions": False} if first == "positions" else {}
    base = GuidedBase(bus, topic="locomotion/base" if first == "positions" else "elsewhere")
    navigation = go(bus, (2.0, 0.0), **options)
    velocities = None
    for count in range(int(4 * RATE)):
        if count == (int(2 * RATE) if first == "positions" else 0):
            velocities = MemoryMiddleware(bus, "driver").reader("locomotion/cmd_vel", "geometry_msgs/Twist")
        bus.run_until(bus.time + 1.0 / RATE)
        navigation.cycle()
    assert velocities.read() and velocities.message.fields["linear"]["x"] > 0.1 and not base.received


def test_positions_that_come_after_velocities_are_preferred(bus):
    MemoryMiddleware(bus, "driver").reader("locomotion/cmd_vel", "geometry_msgs/Twist")
    navigation = go(bus, (1.0, 0.0))
    base = None
    for count in range(int(3 * RATE)):
        if count == int(0.4 * RATE):
            base = GuidedBase(bus)
        bus.run_until(bus.time + 1.0 / RATE)
        navigation.cycle()
    assert base.received


def test_a_target_of_neither_is_one_error(bus):
    GuidedBase(bus, topic="elsewhere")
    navigation = go(bus, (2.0, 0.0), positions=True)
    with pytest.raises(MiddlewareError) as error:
        drive(bus, navigation)
    assert error.value.what == "no subscriber on locomotion/base; no subscriber on locomotion/base/reference"
    assert error.value.expected == "a subscriber of geometry_msgs/PoseStamped"
    assert bus.time == pytest.approx(30.0, abs=1.0)
