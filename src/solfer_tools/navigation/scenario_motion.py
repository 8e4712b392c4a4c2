"""How the motion of a scenario is published: as velocities, or as positions that close the loop."""

import abc
import math
from collections.abc import Sequence

import numpy as np

from solfer.errors import SolferError
from solfer.interfaces.support import BASE_PORT, LEAD, VERTICES_PORT
from solfer.numerics.planar_move import PlanarMove, turned
from solfer.transport import Middleware, Writer
from solfer.transport.messages import FieldsMessage, PointsMessage, VectorMessage
from solfer_tools.navigation.course import MeasuredPose
from solfer_tools.navigation.reference_course import BegunReference
from solfer_tools.scenarios import Player


class ScenarioMotion(abc.ABC):
    """Publishes the motion of a scenario.

    Attributes:
        writers: Where it is published.
    """

    writers: Sequence[Writer] = ()

    @abc.abstractmethod
    def awaits(self) -> str:
        """Read what is measured; returns what is missing."""

    @abc.abstractmethod
    def go_on(self, period: float) -> None:
        """Take over that the player has gone on by a period [s]."""

    @abc.abstractmethod
    def publish(self, pace: float) -> None:
        """Publish the player's motion at a pace, 0 at rest."""

    @abc.abstractmethod
    def arrives(self, period: float) -> bool:
        """Return whether the robot still moves, a period [s] later, when nothing is left to play."""


class ScenarioVelocities(ScenarioMotion):
    """Publishes velocities on `wheels_state` and `wheels_support`.

    Args:
        middleware: Carries it.
        player: Plays the scenario.
        name: Namespace of the topics, with its slash.
        odometry: Topic of the odometry, for the heading at the beginning; empty: it is zero.
    """

    def __init__(self, middleware: Middleware, player: Player, name: str, odometry: str):
        self._player = player
        self._support = middleware.writer(f"{name}wheels_support", "solfer/WheelsSupport")
        self._state = middleware.writer(f"{name}wheels_state", "solfer/WheelsState")
        self._pose = MeasuredPose(middleware, odometry) if odometry else None
        self._heading = 0.0
        self.writers = self._support, self._state

    def awaits(self) -> str:
        """See `ScenarioMotion.awaits`."""
        if self._pose is None:
            return ""
        missing = self._pose.awaits()
        if not missing:
            self._heading = self._pose.heading
            self._pose = None
        return missing

    def go_on(self, period: float) -> None:
        """Do nothing: velocities have no place."""

    def publish(self, pace: float) -> None:
        """See `ScenarioMotion.publish`."""
        player = self._player
        x, y, z, rate = (pace * player.base_velocity).tolist()
        along, across = turned(self._heading, x, y)
        vertices = tuple((pace * player.vertex_velocity).ravel().tolist())
        self._support.write(FieldsMessage({"position": (), "velocity": vertices}))
        camber = tuple(player.camber.tolist())
        self._state.write(FieldsMessage({"x": along, "y": across, "z": z, "rz": rate, "cs": camber, "cm": ()}))

    def arrives(self, period: float) -> bool:
        """See `ScenarioMotion.arrives`."""
        return False


class OdometryJumps:
    """Finds jumps of an odometry: it is not where it would be if it had gone on as before."""

    def __init__(self) -> None:
        self._measured = np.zeros(4)
        self._step = np.zeros(4)
        self._measured_at = -math.inf

    def find(self, pose: MeasuredPose, now: float) -> PlanarMove | None:
        """Return how a pose has jumped that was measured `now` [s]; None: it has not."""
        measured = np.array((pose.x, pose.y, pose.z, pose.heading))
        expected = self._measured + self._step
        passed = now - self._measured_at
        self._step = measured - self._measured
        self._measured = measured
        self._measured_at = now
        yaw = float(measured[3] - expected[3])
        move = PlanarMove(expected[:3], measured[:3], yaw)
        # margins [m, rad] and largest speeds [m/s, rad/s] as plugins have them
        has_jumped = move.distance > 0.05 + 2.0 * passed or abs(yaw) > 0.1 + 3.0 * passed
        if has_jumped or passed == math.inf:
            self._step[:] = 0.0
        return move if has_jumped else None


class ScenarioPositions(ScenarioMotion):
    """Publishes positions for the pipes `base` and `vertices` of the target, in the frame of the odometry.

    They are ahead of the course by the way of `LEAD`: the target follows them without a lag then, and goes back to the
    course wherever it has left it. Where the odometry jumps, the course moves with the robot.

    Args:
        middleware: Carries it.
        player: Plays the scenario.
        name: Namespace of the topics and the service, with its slash.
        odometry: Topic of the odometry.

    Raises:
        SolferError: There is no odometry, or the scenario changes the camber of wheels.
    """

    def __init__(self, middleware: Middleware, player: Player, name: str, odometry: str):
        if not odometry:
            raise SolferError("positions without odometry", where="--positions", expected="a topic of the odometry")
        if any(getattr(step, "cs", None) is not None for step in player.scenario.pattern):
            raise SolferError("positions carry no camber", where="--positions", expected="a scenario without `cs`")
        self._player = player
        self._middleware = middleware
        self._begun = BegunReference(middleware, f"{name}get_reference")
        self._base_writer = middleware.writer(f"{name}{BASE_PORT}", "geometry_msgs/PoseStamped")
        self._vertices_writer = middleware.writer(f"{name}{VERTICES_PORT}", "solfer/RobotPoints")
        self._pose = MeasuredPose(middleware, odometry)
        self.writers = self._base_writer, self._vertices_writer
        self._begin: dict[str, np.ndarray] = {}
        self._heading = self._ended = 0.0
        self._base = np.zeros(4)
        self._vertices = np.zeros_like(player.vertex_velocity)
        self._jumps = OdometryJumps()

    def awaits(self) -> str:
        """See `ScenarioMotion.awaits`."""
        if missing := self._pose.awaits():
            return missing
        for task in (BASE_PORT, VERTICES_PORT):
            if task not in self._begin and (missing := self._request(task)):
                return missing
        self._move_with_odometry()
        return ""

    def go_on(self, period: float) -> None:
        """See `ScenarioMotion.go_on`."""
        self._base += period * self._player.base_velocity
        self._vertices += period * self._player.vertex_velocity

    def publish(self, pace: float) -> None:
        """See `ScenarioMotion.publish`."""
        if len(self._begin) < 2:
            return
        begin = self._begin[BASE_PORT]
        player = self._player
        x, y, z, yaw = (self._base + LEAD * pace * player.base_velocity).tolist()
        place = begin[:3] + (*turned(self._heading, x, y), z)
        half = 0.5 * (self._heading + yaw)
        self._base_writer.write(VectorMessage("world", np.array((*place, 0.0, 0.0, math.sin(half), math.cos(half)))))
        vertices = self._begin[VERTICES_PORT] + self._vertices + LEAD * pace * player.vertex_velocity
        self._vertices_writer.write(PointsMessage("world", (), vertices))

    def arrives(self, period: float) -> bool:
        """See `ScenarioMotion.arrives`."""
        self._ended += period
        return self._ended < 4.0 * LEAD or self._pose.still < 0.3  # [s]: it stands after the last position

    def _request(self, task: str) -> str:
        """Request the begin of a reference; return what is missing."""
        values = self._begun.values(task)
        if isinstance(values, str):
            return values
        if task == VERTICES_PORT:
            if len(values) != self._vertices.size:
                vertices = f"{len(values) // 3} vertices of {self._begun.service}"
                raise SolferError(vertices, expected=f"{len(self._vertices)}, one for each leg")
            values = values.reshape(-1, 3)
        else:
            self._heading = 2.0 * math.atan2(values[5], values[6])
        self._begin[task] = values
        return ""

    def _move_with_odometry(self) -> None:
        """Move the course as the odometry has jumped: from where it would be if it had gone on as before."""
        move = self._jumps.find(self._pose, self._middleware.now())
        if move is not None:
            move.move(self._begin[BASE_PORT][:3])
            self._heading += move.yaw
