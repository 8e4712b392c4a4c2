"""Carries a crossing out: rolls base and wheels, and lets wheels step."""

import logging
import math
from concurrent.futures import Future

import numpy as np

from solfer.errors import ComponentError
from solfer.interfaces.ground import GROUND, GroundEstimate
from solfer.interfaces.support import VERTICES_PORT, LiftReply, StepContact
from solfer.numerics.planar_move import seen_from, turned
from solfer.transport import Middleware
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


class _Rolling:
    """A move on the ground: of the base to a waypoint, and of the wheels along with it.

    Args:
        goal: Where the base goes.
        vertices: Where the vertices are, shape (n, 3) [m].
        change: By how much they move, shape (n, 3) [m].
        place: Where the base is, x and y [m].
    """

    def __init__(self, goal: Waypoint, vertices: np.ndarray, change: np.ndarray, place: tuple[float, float]):
        self.follower = WaypointFollower((goal,), DriveLimits(speed=SPEED, turn_speed=0.2))
        self._goal = goal
        self._vertices = vertices
        self._change = change
        self._length = math.dist(place, (goal.x, goal.y))
        self._duration = float(np.abs(change).max()) / SPEED
        self._passed = 0.0
        self._rested = 0.0

    def vertices(self, place: tuple[float, float], period: float) -> np.ndarray:
        """Return where the vertices are to be after a period [s], with the base at a place; shape (n, 3) [m]."""
        self._passed += period
        left = math.dist(place, (self._goal.x, self._goal.y))
        done = min(1.0, self._passed / self._duration) if self._duration > 0.0 else 1.0
        if self._length > 0.05:  # [m]
            done = min(done, max(0.0, 1.0 - max(0.0, left - 0.01) / self._length))
        self._done = done
        return self._vertices + done * self._change

    def is_over(self, moves: bool, still: float, period: float) -> bool:
        """Return whether base and wheels have come to rest."""
        self._rested = 0.0 if moves or self._done < 1.0 else self._rested + period
        return self._rested > 1.0 and still >= 0.3  # [s]


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
        limits: What wheels can do.

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
        limits: CrossingLimits = CrossingLimits(),  # noqa: B008 frozen
    ):
        self._middleware = middleware
        self._goal = goal
        self._terrain = terrain
        self._limits = limits
        self._pose = MeasuredPose(middleware, odometry)
        self._ground = middleware.reader(ground, GROUND)
        name = f"{target}/" if target else ""
        self._service = f"{name}step"
        self._begun = BegunReference(middleware, f"{name}get_reference")
        self._velocities = middleware.writer(f"{name}cmd_vel", "geometry_msgs/Twist")
        self._support = middleware.writer(f"{name}wheels_support", "solfer/WheelsSupport")
        self.writers = (self._velocities, self._support)
        self._felt = GroundEstimate()
        self._moves: tuple[Roll | StepOver, ...] = ()
        self._begin = np.zeros(2)
        self._ahead = np.zeros(2)
        self.heading = 0.0
        self._offsets = np.zeros(0)
        self._vertices: np.ndarray | None = None
        self._index = -1
        self._corrections = 0
        self._rolling: _Rolling | None = None
        self._answer: Future[LiftReply] | None = None

    def awaits(self) -> str:
        """See `Course.awaits`.

        Raises:
            ComponentError: There is no way to the goal, or a wheel cannot step.
        """
        self._ground.read()
        missing = self._pose.awaits()
        if not missing and self._ground.age() > STALE_AGE:
            missing = f"the felt ground on {self._ground.topic}"
        if missing:
            if self._rolling is not None:
                self._rolling.follower.stop()
            return missing
        self._felt = value_of(GroundEstimate, self._ground.message)
        if self._answer is not None:
            if not self._answer.done():
                return f"an answer of {self._service}"
            self._end_step(self._answer.result())
        if self._vertices is None:
            values = self._begun.values(VERTICES_PORT)
            if isinstance(values, str):
                return values
            self._vertices = values.reshape(-1, 3)
        if not self._moves:
            self._plan()
        return ""

    def step(self, period: float, pace: float) -> bool:
        """See `Course.step`."""
        if self._rolling is None and not self._begin_move():
            return False
        rolling = self._rolling
        assert self._vertices is not None
        if rolling is None:
            self.rest()
            return True
        pose = self._pose
        moves = rolling.follower.step((pose.x, pose.y, pose.heading), period, pace)
        x, y, rate = rolling.follower.velocity
        vertices = rolling.vertices((pose.x, pose.y), period * pace)
        self._velocities.write(twist(*seen_from(pose.heading, x, y), rate))
        self._support.write(FieldsMessage({"position": vertices.ravel().tolist(), "velocity": []}))
        if rolling.is_over(moves, pose.still, period):
            self._vertices = vertices
            self._rolling = None
        return True

    def rest(self) -> None:
        """See `Course.rest`."""
        if self._rolling is not None:
            self._rolling.follower.stop()
        self._velocities.write(twist(0.0, 0.0, 0.0))

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
        way = math.dist((self._pose.x, self._pose.y), (self._goal.x, self._goal.y))
        return 15.0 * steps + way / SPEED

    @property
    def steps(self) -> int:
        """How many steps were made."""
        return sum(isinstance(each, StepOver) for each in self._moves[: max(self._index, 0)])

    def _plan(self) -> None:
        """Plan the way from where the robot stands.

        Raises:
            ComponentError: There is none, or the ground is another one.
        """
        pose = self._pose
        felt = self._felt
        places = np.array([(each.x, each.y) for each in felt.places])
        heights = np.array([each.z for each in felt.places])
        differences = heights - self._terrain.heights(places)
        wrong = np.abs(differences - np.median(differences))
        if not wrong.max() <= WRONG_HEIGHT:
            index = int(np.argmax(wrong))
            raise ComponentError(
                f"the ground below '{felt.names[index]}' is {wrong[index]:.3f} m from that of the map, as others are",
                expected=f"a map of this place, right to {WRONG_HEIGHT:g} m",
            )
        wheels = [seen_from(pose.heading, x - pose.x, y - pose.y) for x, y in places.tolist()]
        planner = CrossingPlanner(self._terrain, felt.names, np.array(wheels), self._limits)
        begin = pose.x, pose.y
        goal = self._goal.x, self._goal.y
        crossing = planner.plan(begin, goal, pose.heading)
        direction = math.atan2(goal[1] - begin[1], goal[0] - begin[0])
        self._begin[:] = begin
        self._ahead[:] = turned(direction, 1.0, 0.0)
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
        return f"'{self._felt.names[move.wheel]}' steps {move.end - move.begin:.2f} m ahead, {move.rise:.2f} m up"

    def _begin_move(self) -> bool:
        """Begin the next move; False: all are over."""
        following = self._moves[self._index + 1] if self._index + 1 < len(self._moves) else None
        if isinstance(following, StepOver) and self._correct(following):
            return True
        self._index += 1
        if following is None:
            return False
        if isinstance(following, StepOver):
            self._request(following)
            return True
        after = self._moves[self._index + 1] if self._index + 1 < self.count else None
        is_before_step = isinstance(after, StepOver) and following.along - self._base > SHORT
        # what is left is measured by the wheel that steps
        self._roll(following.along - SHORT if is_before_step else following.along, np.array(following.offsets))
        return True

    @property
    def _base(self) -> float:
        """How far the base is from where it began [m]."""
        return float(self._ahead @ ((self._pose.x, self._pose.y) - self._begin))

    def _place(self, wheel: int) -> float:
        """Return how far ahead of where the base began a wheel is [m]."""
        place = self._felt.places[wheel]
        return float(self._ahead @ ((place.x, place.y) - self._begin))

    def _correct(self, step: StepOver) -> bool:
        """Roll to where a wheel stands as it is to before its step; False: it does."""
        error = self._place(step.wheel) - step.begin
        if abs(error) < 0.01:  # [m]
            self._corrections = 0
            return False
        self._corrections += 1
        if self._corrections > 3:
            name = self._felt.names[step.wheel]
            raise ComponentError(f"'{name}' stays {error:.3f} m from where it is to step", expected="0.01 m at most")
        self._roll(self._base - error, self._offsets)
        return True

    def _roll(self, along: float, offsets: np.ndarray) -> None:
        """Begin to roll: the base to a place on the way [m], wheels to offsets, shape (n,) [m]."""
        assert self._vertices is not None
        x, y = (self._begin + along * self._ahead).tolist()
        heading = self._pose.heading + math.remainder(self.heading - self._pose.heading, math.tau)
        ahead = seen_from(heading, *self._ahead.tolist())
        change = np.zeros_like(self._vertices)
        change[:, :2] = np.outer(offsets - self._offsets, ahead)
        self._offsets = offsets
        self._rolling = _Rolling(Waypoint(x, y, heading), self._vertices, change, (self._pose.x, self._pose.y))

    def _request(self, step: StepOver) -> None:
        """Request a step."""
        ahead, left = ((step.end - self._place(step.wheel)) * self._ahead).tolist()
        ahead, left = seen_from(self._pose.heading, ahead, left)
        request = StepContact(self._felt.names[step.wheel], ahead, left, step.rise, clearance=self._limits.clearance)
        self._answer = self._middleware.request(
            self._service, "solfer/StepContact", request, reply=LiftReply, timeout=120.0
        )

    def _end_step(self, reply: LiftReply) -> None:
        """Go on after a step, from where vertices are then.

        Raises:
            ComponentError: The wheel did not step.
        """
        step = self._moves[self._index]
        assert isinstance(step, StepOver)
        self._answer = None
        if not reply.success:
            raise ComponentError(f"{self._service} refuses: {reply.message}", expected="a wheel that can step")
        if reply.message:
            logger.warning("%s, where the map has another height", reply.message)
        self._offsets = self._offsets.copy()
        self._offsets[step.wheel] += step.end - step.begin
        self._vertices = None
