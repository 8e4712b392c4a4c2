"""Carries a crossing out: rolls base and wheels, and lets wheels step."""

import logging
import math
from concurrent.futures import Future

import numpy as np

from solfer.errors import ComponentError
from solfer.interfaces.ground import GROUND, GroundEstimate
from solfer.interfaces.support import VERTICES_PORT, LiftReply, StepContact
from solfer.numerics.planar_move import seen_from, turned
from solfer.transport import Middleware, Writer
from solfer.transport.declared.fields import value_of
from solfer.transport.messages import FieldsMessage
from solfer_tools.navigation.course import STALE_AGE, Course, MeasuredPose, twist
from solfer_tools.navigation.crossing import CrossingLimits, CrossingPlanner, Roll, StepOver
from solfer_tools.navigation.reference_course import BegunReference
from solfer_tools.navigation.terrain import Terrain
from solfer_tools.navigation.waypoints import DriveLimits, Waypoint, WaypointFollower

logger = logging.getLogger(__name__)

SPEED = 0.1
"""Speed of the base, and of wheels as seen from it [m/s]."""

SHORT = 0.06
"""How far before its place the base stops first: vertices are seen from a centre of mass, which moves with legs [m]."""

WRONG_HEIGHT = 0.02
"""Difference of the felt height below a wheel from the map's that is too large [m]."""

STALL_TIME = 20.0
"""Longest time without getting nearer to the end of a move [s]."""


class _Rolling:
    """A move on the ground: of the base to a waypoint, and of the wheels along with it.

    Args:
        goal: Where the base goes.
        vertices: Where the vertices are, shape (n, 3) [m].
        change: By how much they move, shape (n, 3) [m].
        place: Where the base is, x and y [m].

    Attributes:
        follower: Drives the base.
    """

    def __init__(self, goal: Waypoint, vertices: np.ndarray, change: np.ndarray, place: tuple[float, float]):
        self.follower = WaypointFollower((goal,), DriveLimits(speed=SPEED, turn_speed=0.2))
        self._goal = goal
        self._vertices = vertices
        self._change = change
        self._length = math.dist(place, (goal.x, goal.y))
        self._duration = float(np.abs(change).max()) / SPEED
        self._done = self._passed = self._rested = self._stalled = 0.0
        self._least = math.inf

    def vertices(self, place: tuple[float, float], period: float) -> np.ndarray:
        """Return where the vertices are to be after a period [s], with the base at a place; shape (n, 3) [m]."""
        self._passed += period
        left = math.dist(place, (self._goal.x, self._goal.y))
        self._done = min(1.0, self._passed / self._duration) if self._duration > 0.0 else 1.0
        if self._length > 0.05:  # [m]
            self._done = min(self._done, max(0.0, 1.0 - max(0.0, left - 0.01) / self._length))
        return self._vertices + self._done * self._change

    def require_progress(self, place: tuple[float, float], heading: float, period: float) -> None:
        """Check that base or wheels get nearer to their ends.

        Raises:
            ComponentError: They have not for `STALL_TIME`.
        """
        apart = math.dist(place, (self._goal.x, self._goal.y))
        yaw = abs(math.remainder((self._goal.heading or 0.0) - heading, math.tau))
        left = apart + yaw + 1.0 - self._done
        self._stalled = 0.0 if left < self._least - 0.005 else self._stalled + period
        if not self._stalled:
            self._least = left
        if self._stalled > STALL_TIME:
            raise ComponentError(
                f"the base stays {apart:.3f} m and {yaw:.2f} rad from where it is to go, for {STALL_TIME:g} s",
                expected="a robot that follows `cmd_vel`; its health in /diagnostics has the reason",
            )

    def is_over(self, moves: bool, still: float, period: float) -> bool:
        """Return whether base and wheels have come to rest."""
        self._rested = 0.0 if moves or self._done < 1.0 else self._rested + period
        return self._rested > 1.0 and still >= 0.3  # [s]


class _FeltGround:
    """The ground as odometry feels it.

    Args:
        middleware: Carries it.
        topic: Its topic.

    Attributes:
        names: Names of the contacts.
        places: Where the ground is at them, shape (n, 3) [m].
    """

    def __init__(self, middleware: Middleware, topic: str):
        self._reader = middleware.reader(topic, GROUND)
        self.names: tuple[str, ...] = ()
        self.places = np.zeros((0, 3))

    def awaits(self) -> str:
        """Read the newest message; return what is missing."""
        self._reader.read()
        if self._reader.age() > STALE_AGE:
            return f"the felt ground on {self._reader.topic}"
        felt = value_of(GroundEstimate, self._reader.message)
        self.names = felt.names
        self.places = np.array([(place.x, place.y, place.z) for place in felt.places])
        return "" if len(self.names) and np.isfinite(self.places).all() else f"finite places on {self._reader.topic}"

    def require(self, terrain: Terrain) -> None:
        """Check that the ground is that of a map.

        Raises:
            ComponentError: It is another one below a wheel.
        """
        apart = self.places[:, 2] - terrain.heights(self.places[:, :2])
        apart = np.abs(apart - np.median(apart))
        if not apart.max() <= WRONG_HEIGHT:
            index = int(np.argmax(apart))
            raise ComponentError(
                f"the ground below '{self.names[index]}' is {apart[index]:.3f} m from that of the map, as others are",
                expected=f"a map of this place, right to {WRONG_HEIGHT:g} m",
            )


class _SteppingTarget:
    """What moves the robot: velocities of the base, places of the vertices, steps.

    Args:
        middleware: Carries all of it.
        target: Namespace of topics and services.

    Attributes:
        writers: Where velocities and places are published.
        vertices: Where the vertices are, shape (n, 3) [m]; None: it is not known.
    """

    def __init__(self, middleware: Middleware, target: str):
        name = f"{target}/" if target else ""
        self._middleware = middleware
        self._service = f"{name}step"
        self._begun = BegunReference(middleware, f"{name}get_reference")
        self.writers: tuple[Writer, Writer] = (
            middleware.writer(f"{name}cmd_vel", "geometry_msgs/Twist"),
            middleware.writer(f"{name}wheels_support", "solfer/WheelsSupport"),
        )
        self._answer: Future[LiftReply] | None = None
        self.vertices: np.ndarray | None = None

    def awaits(self) -> str:
        """Return what is missing: the end of a step, or where the vertices are then.

        Raises:
            ComponentError: The wheel did not step.
        """
        if self._answer is not None:
            if not self._answer.done():
                return f"an answer of {self._service}"
            reply = self._answer.result()
            self._answer = None
            if not reply.success:
                raise ComponentError(f"{self._service} refuses: {reply.message}", expected="a wheel that can step")
            if reply.message:
                logger.warning("%s, where the map has another height", reply.message)
        if self.vertices is None:
            values = self._begun.values(VERTICES_PORT)
            if isinstance(values, str):
                return values
            self.vertices = values.reshape(-1, 3)
        return ""

    def step(self, request: StepContact) -> None:
        """Request a step."""
        self.vertices = None
        self._answer = self._middleware.request(
            self._service, "solfer/StepContact", request, reply=LiftReply, timeout=120.0
        )

    def move(self, velocity: tuple[float, float, float], vertices: np.ndarray | None) -> None:
        """Publish a velocity of the base, seen from its heading [m/s, rad/s], and places of vertices, shape (n, 3)."""
        self.writers[0].write(twist(*velocity))
        if vertices is not None:
            self.writers[1].write(FieldsMessage({"position": vertices.ravel().tolist(), "velocity": []}))


class CrossingCourse(Course):
    """Goes straight to a place, over steps and gaps of a ground that is known in advance.

    The plan is made at the beginning, from where the wheels are on the ground that odometry feels, and logged. The base
    is driven by velocities on `cmd_vel`, wheels by positions on `wheels_support`; they step by the service `step`.

    Args:
        middleware: Carries all of it.
        goal: Where the base goes.
        terrain: The ground, in the frame of the odometry.
        target: Namespace of topics and services.
        odometry: Topic of the odometry.
        ground: Topic of the felt ground.
        limits: What wheels can do; None: the defaults.

    Attributes:
        heading: Heading of the base on its way [rad].
    """

    has_dialogue = True

    def __init__(
        self,
        middleware: Middleware,
        goal: Waypoint,
        terrain: Terrain,
        target: str,
        *,
        odometry: str,
        ground: str,
        limits: CrossingLimits | None = None,
    ):
        self._goal = goal
        self._terrain = terrain
        self._limits = CrossingLimits() if limits is None else limits
        self._pose = MeasuredPose(middleware, odometry)
        self._ground = _FeltGround(middleware, ground)
        self._target = _SteppingTarget(middleware, target)
        self.writers = self._target.writers
        self._moves: tuple[Roll | StepOver, ...] = ()
        self._line = np.zeros((2, 2))
        self.heading = 0.0
        self._offsets = np.zeros(0)
        self._index = -1
        self._corrections = 0
        self._rolling: _Rolling | None = None

    def awaits(self) -> str:
        """See `Course.awaits`.

        Raises:
            ComponentError: There is no way to the goal, or a wheel cannot step.
        """
        missing = self._pose.awaits() or self._ground.awaits() or self._target.awaits()
        if missing:
            if self._rolling is not None:
                self._rolling.follower.stop()
        elif not self._moves:
            self._plan()
        return missing

    def step(self, period: float, pace: float) -> bool:
        """See `Course.step`."""
        if self._rolling is None and not self._begin_move():
            return False
        rolling = self._rolling
        if rolling is None:
            self.rest()
            return True
        pose = self._pose
        place = pose.x, pose.y
        moves = rolling.follower.step((*place, pose.heading), period, pace)
        x, y, rate = rolling.follower.velocity
        vertices = rolling.vertices(place, period * pace)
        self._target.move((*seen_from(pose.heading, x, y), rate), vertices)
        rolling.require_progress(place, pose.heading, period)
        if rolling.is_over(moves, pose.still, period):
            self._target.vertices = vertices
            self._rolling = None
        return True

    def rest(self) -> None:
        """See `Course.rest`."""
        if self._rolling is not None:
            self._rolling.follower.stop()
        self._target.move((0.0, 0.0, 0.0), None)

    @property
    def number(self) -> int:
        """See `Course.number`."""
        return min(self._index + 1, self.count)

    @property
    def name(self) -> str:
        """See `Course.name`."""
        return self._describe(self._moves[self.number - 1]) if self.number else ""

    @property
    def left(self) -> float:
        """See `Course.left`; a step takes about 15 s."""
        steps = sum(isinstance(each, StepOver) for each in self._moves[max(self._index, 0) :])
        distance = math.dist((self._pose.x, self._pose.y), (self._goal.x, self._goal.y))
        return 15.0 * steps + distance / SPEED

    @property
    def steps(self) -> int:
        """How many steps were made."""
        return sum(isinstance(each, StepOver) for each in self._moves[: max(self._index, 0)])

    def _plan(self) -> None:
        """Plan the path from where the robot stands.

        Raises:
            ComponentError: There is none, or the ground is another one.
        """
        pose = self._pose
        ground = self._ground
        ground.require(self._terrain)
        wheels = [seen_from(pose.heading, x - pose.x, y - pose.y) for x, y, _ in ground.places.tolist()]
        planner = CrossingPlanner(self._terrain, ground.names, np.array(wheels), self._limits)
        begin = pose.x, pose.y
        goal = self._goal.x, self._goal.y
        crossing = planner.plan(begin, goal, pose.heading)
        direction = math.atan2(goal[1] - begin[1], goal[0] - begin[0])
        self._line[:] = begin, turned(direction, 1.0, 0.0)
        self.heading = direction + crossing.yaw
        self._offsets = np.zeros(len(wheels))
        self._moves = Roll(0.0, (0.0,) * len(wheels)), *crossing.moves
        self.count = len(self._moves)
        logger.info("%d moves with a heading of %.2f rad", self.count, self.heading)
        for number, move in enumerate(self._moves, 1):
            logger.info("%d: %s", number, self._describe(move))

    def _describe(self, move: Roll | StepOver) -> str:
        if isinstance(move, Roll):
            offsets = " ".join(f"{each:.2f}" for each in move.offsets)
            return f"the base rolls to {move.along:.2f} m, wheels to {offsets} m"
        return f"'{self._ground.names[move.wheel]}' steps {move.end - move.begin:.2f} m ahead, {move.rise:.2f} m up"

    def _begin_move(self) -> bool:
        """Begin the next move; False: all are over."""
        following = self._moves[self._index + 1] if self._index + 1 < self.count else None
        if isinstance(following, StepOver) and self._correct(following):
            return True
        self._index += 1
        if following is None:
            return False
        if isinstance(following, StepOver):
            self._step(following)
            return True
        after = self._moves[self._index + 1] if self._index + 1 < self.count else None
        base = self._ahead((self._pose.x, self._pose.y))
        is_before_step = isinstance(after, StepOver) and following.along - base > SHORT
        # what is left is measured by the wheel that steps
        self._roll(following.along - SHORT if is_before_step else following.along, np.array(following.offsets))
        return True

    def _ahead(self, place: tuple[float, float] | np.ndarray) -> float:
        """Return how far ahead of where the base began a place is [m]."""
        begin, line = self._line
        return float(line @ (place - begin))

    def _correct(self, step: StepOver) -> bool:
        """Roll to where a wheel stands as it is to before its step; False: it does."""
        error = self._ahead(self._ground.places[step.wheel, :2]) - step.begin
        if abs(error) < 0.01:  # [m]
            self._corrections = 0
            return False
        self._corrections += 1
        if self._corrections > 3:
            name = self._ground.names[step.wheel]
            raise ComponentError(f"'{name}' stays {error:.3f} m from where it is to step", expected="0.01 m at most")
        self._roll(self._ahead((self._pose.x, self._pose.y)) - error, self._offsets)
        return True

    def _roll(self, along: float, offsets: np.ndarray) -> None:
        """Begin to roll: the base to a place ahead [m], wheels to offsets, shape (n,) [m]."""
        pose = self._pose
        vertices = self._target.vertices
        assert vertices is not None
        begin, line = self._line
        x, y = (begin + along * line).tolist()
        heading = pose.heading + math.remainder(self.heading - pose.heading, math.tau)
        change = np.zeros_like(vertices)
        change[:, :2] = np.outer(offsets - self._offsets, seen_from(heading, *line.tolist()))
        self._offsets = offsets
        self._rolling = _Rolling(Waypoint(x, y, heading), vertices, change, (pose.x, pose.y))

    def _step(self, step: StepOver) -> None:
        """Let a wheel step from where it is."""
        length = step.end - self._ahead(self._ground.places[step.wheel, :2])
        ahead, left = seen_from(self._pose.heading, *(length * self._line[1]).tolist())
        name = self._ground.names[step.wheel]
        self._target.step(StepContact(name, ahead, left, step.rise, clearance=self._limits.clearance))
        self._offsets = self._offsets.copy()
        self._offsets[step.wheel] += step.end - step.begin
