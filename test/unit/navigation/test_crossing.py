"""Crossings of steps: heights of a map, plans, and a robot on a bus that carries them out."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from solfer.errors import ComponentError
from solfer.interfaces.declaration import Service
from solfer.interfaces.geometry import Vector
from solfer.interfaces.ground import GROUND, GroundEstimate
from solfer.interfaces.support import LiftReply, StepContact
from solfer.interfaces.task_references import GetReference, ReferenceReply
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.numerics.planar_move import about_z, turned
from solfer.simulation.world.records import WorldRecord
from solfer.transport import BodyMessage, Inbox
from solfer.transport.declared.fields import message_of
from solfer.transport.endpoints import MessageStatus
from solfer_tools.navigation import CrossingCourse, Navigation, Terrain, Waypoint
from solfer_tools.navigation.crossing import CrossingLimits, CrossingPlanner, Roll

NAMES = ("front_left", "front_right", "rear_left", "rear_right")
WHEELS = np.array([(0.546, 0.318), (0.546, -0.318), (-0.546, 0.318), (-0.546, -0.318)])
RADIUS = 0.078  # of a wheel [m]


def terrain(**parts):
    return Terrain(WorldRecord(**parts))


def box(x, length, height, yaw=0.0, **more):
    """Return a box over the whole width, which begins at a place x [m]."""
    middle = x + 0.5 * length
    return {"size": (length, 6.0, height), "position": (middle, 0.0, 0.5 * height), "rpy": (0.0, 0.0, yaw)} | more


def planned(ground, goal=(3.0, 0.0)):
    return CrossingPlanner(ground, NAMES, WHEELS, CrossingLimits()).plan((0.0, 0.0), goal)


def test_heights_are_those_of_planes_boxes_stairs_and_grids():
    places = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 0.3), (2.3, 0.0), (5.0, 5.0)])
    tilted = {"size": (1.0, 1.0, 0.2), "position": (1.0, 0.0, 0.0), "rpy": (0.0, -0.2, 0.0)}
    # the top of a box that is turned by -0.2 rad about y rises along x
    top = 0.1 / math.cos(0.2)
    assert_allclose(terrain(boxes={"a": tilted}).heights(places), (0.0, top, top, 0.0, 0.0), atol=1e-12)
    assert_allclose(terrain(boxes={"a": tilted}).heights(np.array([(1.2, 0.1)])), top + 0.2 * math.tan(0.2), atol=1e-12)
    stairs = {"position": (0.5, 0.0), "count": 2, "rise": 0.1, "tread": 0.4, "width": 0.5}
    assert_allclose(terrain(stairs={"s": stairs}).heights(places), (0.0, 0.2, 0.0, 0.0, 0.0), atol=1e-12)
    grid = {"position": (1.0, 0.0, 0.5), "spacing": 1.0, "heights": ((0.0, 0.0), (0.2, 0.2))}
    # its middle is at x 1 m: heights rise by 0.2 m from 0.5 to 1.5 m
    assert_allclose(terrain(grids={"g": grid}).heights(places[:3]), (0.0, 0.6, 0.6), atol=1e-12)
    hole = terrain(ground={"exists": False}, boxes={"a": box(-1.0, 1.5, 0.1), "b": box(2.0, 1.0, 0.1, mass=1.0)})
    assert_allclose(hole.heights(places[[0, 1, 3]]), (0.1, -math.inf, math.inf))
    assert_allclose(terrain(ground={"slope": 0.1}).heights(places), math.tan(0.1) * places[:, 0])


@pytest.mark.parametrize("seed", range(8))
def test_no_wheel_of_a_plan_rolls_onto_an_edge(seed):
    """Drawn platforms and blocks: each wheel has even ground below it, and stands firmly while others step."""
    random = np.random.default_rng(seed)
    edge, yaw, height = random.uniform((1.0, -0.15, 0.03), (1.5, 0.15, 0.14))
    ground = terrain(boxes={"a": box(edge, 4.0 if seed % 2 else 1.1, height, yaw)})
    goal = 3.0 if seed % 2 else 3.6
    crossing = planned(ground, (goal, 0.0))
    places = np.array([turned(crossing.yaw, *wheel) for wheel in WHEELS.tolist()])
    base, offsets, stepped = 0.0, np.zeros(4), np.zeros(4, dtype=int)
    for move in crossing.moves:
        if isinstance(move, Roll):
            for ratio in np.linspace(0.0, 1.0, 30):
                along = base + ratio * (move.along - base) + offsets + ratio * (np.array(move.offsets) - offsets)
                for wheel in places + np.column_stack((along, np.zeros(4))):
                    below = ground.heights(wheel + np.array([(-RADIUS, 0.0), (0.0, 0.0), (RADIUS, 0.0)]))
                    assert np.ptp(below) < 1e-9
            base, offsets = move.along, np.array(move.offsets)
            continue
        wheel = move.wheel
        assert move.begin == pytest.approx(base + places[wheel, 0] + offsets[wheel])
        beside = wheel ^ 1
        assert abs(offsets[beside]) <= 0.0501 and abs(offsets).max() <= 0.281
        heights = ground.heights(np.array([(move.begin, places[wheel, 1]), (move.end, places[wheel, 1])]))
        assert move.rise == pytest.approx(np.diff(heights)[0])
        offsets[wheel] += move.end - move.begin
        stepped[wheel] += 1
    # behind a block, wheels that have just come down may be ahead
    assert base == pytest.approx(goal) and abs(offsets).max() < (1e-9 if seed % 2 else 0.2)
    assert (stepped == (1 if seed % 2 else 2)).all()


@pytest.mark.parametrize(
    "parts",
    [{}, {"ground": {"slope": 0.2}}, {"boxes": {"a": box(1.2, 1.0, 0.015)}}],
    ids=["floor", "slope", "low"],
)
def test_ground_that_can_be_rolled_over_needs_no_step(parts):
    crossing = planned(terrain(**parts))
    assert crossing.yaw == 0.0 and crossing.moves == (Roll(3.0, (0.0,) * 4),)


@pytest.mark.parametrize(
    ("parts", "words"),
    [
        ({"boxes": {"a": box(1.2, 4.0, 0.3)}}, ("front_left", "x 1.20", "0.30 m up", "0.15 m")),
        (
            {"ground": {"exists": False}, "boxes": {"a": box(-1.0, 2.0, 0.1), "b": box(1.3, 4.0, 0.1)}},
            ("front", "x 1.0", "by 0.5", "0.23 m"),
        ),
        (
            {"stairs": {"s": {"position": (1.2, 0.0), "count": 4, "rise": 0.1, "tread": 0.2, "width": 6.0}}},
            ("front_left", "from its place while 'front_right'", "x 1.39"),
        ),
        ({"boxes": {"a": box(0.5, 4.0, 0.1)}}, ("front_left", "on an edge")),
        ({"boxes": {"a": box(1.2, 0.5, 0.1, mass=1.0)}}, ("front_left", "x 1.20", "0.23 m")),
    ],
    ids=["wall", "gap", "stairs", "edge", "movable"],
)
def test_ground_that_cannot_be_crossed_is_refused_with_wheel_and_place(parts, words):
    with pytest.raises(ComponentError) as caught:
        planned(terrain(**parts))
    assert all(word in f"{caught.value.what} {caught.value.expected}" for word in words), caught.value


class SteppingRobot:
    """A robot on a bus that rolls and steps as is requested, and whose wheels are not quite where they should be."""

    def __init__(self, bus, ground, wrong=0.0):
        self._node, self._inbox = MemoryMiddleware(bus, "robot"), Inbox()
        self._bus, self._ground, self._wrong = bus, ground, wrong
        self._twist = self._node.reader("stepping/cmd_vel", "geometry_msgs/Twist")
        self._support = self._node.reader("stepping/wheels_support", "solfer/WheelsSupport")
        self._odometry = self._node.writer("odometry/odom", "nav_msgs/Odometry")
        self._felt = self._node.writer("odometry/ground", GROUND)
        self.pose, self.vertices = np.zeros(3), np.column_stack((WHEELS, np.zeros(4)))
        self.requests, self.errors, self.reply = [], [], LiftReply()
        self.is_silent = self.is_stuck = False
        services = (
            Service("step", "solfer/StepContact", StepContact, LiftReply, self._step),
            Service("get_reference", "solfer/GetReference", GetReference, ReferenceReply, self._reference),
        )
        self._node.serve("stepping", services, self._inbox.submit)
        bus.every(0.01, self.cycle)

    @property
    def places(self):
        """Where the wheels are, shape (4, 2): 3 cm ahead of where the vertices say, as soon as the base moves [m]."""
        lead = np.array((min(0.03, abs(self.pose[0])), 0.0))
        return (
            np.array([turned(self.pose[2], *each) for each in (self.vertices[:, :2] + lead).tolist()]) + self.pose[:2]
        )

    def cycle(self):
        self._inbox.apply()
        if self._twist.read() and self._twist.age() < 0.5 and not self.is_stuck:
            linear, rate = self._twist.message.fields["linear"], self._twist.message.fields["angular"]["z"]
            self.pose += 0.01 * np.array((*turned(self.pose[2], linear["x"], linear["y"]), rate))
        if self._support.read() is MessageStatus.NEW:
            change = np.reshape(self._support.message.fields["position"], (4, 3)) - self.vertices
            self.vertices += np.clip(change, -2e-3, 2e-3)  # at 0.1 m/s
        if self.is_silent:
            return
        self._odometry.write(
            BodyMessage("odom", "base", np.array((*self.pose[:2], 0.7)), np.array(about_z(self.pose[2])))
        )
        heights = self._ground.heights(self.places)
        heights[0] += self._wrong
        felt = tuple(Vector(x, y, z) for (x, y), z in zip(self.places.tolist(), heights.tolist(), strict=True))
        self._felt.write(message_of(GROUND, GroundEstimate(names=NAMES, places=felt)))

    def _step(self, request):
        index = NAMES.index(request.contact)
        place = self.places[index]
        self.requests.append((request.contact, request.up))
        if self.reply.success:
            self.vertices[index, :2] += (request.ahead, request.left)
            self.vertices[index, 2] += request.up
            self.errors.append((place[0], self.places[index, 0]))
        return self.reply

    def _reference(self, _):
        return ReferenceReply(values=tuple(self.vertices.ravel().tolist()))


@pytest.fixture
def begun():
    """Make a robot before a platform of 10 cm, and its navigation."""

    def begin(goal=3.0, wrong=0.0):
        bus, ground = Bus(), terrain(boxes={"a": box(1.2, 4.0, 0.1)})
        robot = SteppingRobot(bus, ground, wrong)
        node = MemoryMiddleware(bus, "navigation")
        course = CrossingCourse(
            node, Waypoint(goal, 0.0), ground, "stepping", odometry="odometry/odom", ground="odometry/ground"
        )
        return bus, robot, Navigation(node, course, "navigation", 50.0)

    return begin


def go(bus, navigation, until=math.inf):
    """Carry out cycles until the end, at most to a time [s]."""
    while not navigation.done and bus.time < min(until, 200.0):
        navigation.cycle()
        bus.run_until(bus.time + 0.02)


def test_a_robot_steps_wheel_by_wheel_and_arrives(begun):
    """Its wheels are 3 cm ahead of where they should be: each stands before the edge all the same, and lands behind."""
    bus, robot, navigation = begun()
    go(bus, navigation)
    assert navigation.done
    assert robot.requests == [
        (name, pytest.approx(0.1)) for name in ("front_right", "front_left", "rear_right", "rear_left")
    ]
    for before, behind in robot.errors:
        assert 1.2 - before == pytest.approx(0.1, abs=0.02) and behind - 1.2 == pytest.approx(0.09, abs=0.02)
    assert_allclose(robot.pose[:2], (3.0, 0.0), atol=0.015)
    assert_allclose(robot.vertices[:, 2], 0.1)


def test_what_goes_wrong_ends_it_with_the_reason(begun):
    bus, robot, navigation = begun()
    robot.reply = LiftReply(False, "'front_right' stands where it stood: something is in its way")
    with pytest.raises(ComponentError, match="something is in its way"):
        go(bus, navigation)
    bus, robot, navigation = begun(wrong=0.03)
    with pytest.raises(ComponentError, match=r"below 'front_left' is 0\.030 m from that of the map"):
        go(bus, navigation)
    assert abs(robot.pose).max() == 0.0
    bus, robot, navigation = begun()
    go(bus, navigation, until=6.0)
    robot.is_stuck = True
    with pytest.raises(ComponentError, match=r"the base stays \d\.\d+ m and 0\.\d+ rad from where it is to go"):
        go(bus, navigation)
    assert bus.time == pytest.approx(26.0, abs=2.0)


def test_it_rests_without_odometry_and_in_a_pause(begun):
    bus, robot, navigation = begun(goal=0.4)
    go(bus, navigation, until=6.0)
    for stops in (lambda: setattr(robot, "is_silent", True), lambda: setattr(navigation, "paused", True)):
        stops()
        go(bus, navigation, until=bus.time + 2.0)
        place = robot.pose.copy()
        go(bus, navigation, until=bus.time + 2.0)
        assert_allclose(robot.pose, place, atol=1e-6)
        robot.is_silent = navigation.paused = False
    go(bus, navigation)
    assert navigation.done and robot.pose[0] == pytest.approx(0.4, abs=0.015)
