"""Joint-space motions: the paper's `joint_states` (Listings 9 and 16)."""

from copy import copy
from typing import Annotated

import numpy as np
from pydantic import Field

from solfer.components.base import Component
from solfer.components.move_joints import CmndReply, JointGoals, JointStateCmnd, MoveJoints, Reply
from solfer.components.trajectories.check import StaleTrajectory
from solfer.components.trajectories.follower import TrajectoryFollower
from solfer.config import LIVE, NameOf, Record
from solfer.errors import ComponentError, SolferError, UnknownName, described
from solfer.interfaces.declaration import Action, LiveParameter, Outcome, Service, TopicIn
from solfer.interfaces.trajectories import (
    FOLLOW,
    INVALID_GOAL,
    INVALID_JOINTS,
    OLD_HEADER_TIMESTAMP,
    TRAJECTORY,
    FollowFeedback,
    FollowGoal,
    FollowResult,
    JointTrajectory,
)
from solfer.numerics.ramp import Ramp
from solfer.numerics.rotations import whole_revolutions
from solfer.recording.log import Logger
from solfer.recording.model import JOINTS_KIND
from solfer.robot import Robot


class _JointRamp:
    """A ramp of all joints, which moves those that follow no trajectory.

    Args:
        size: Number n of joints.

    Attributes:
        moves: Which joints it moves, shape (n,); live.
    """

    def __init__(self, size: int):
        self.moves = np.ones(size, dtype=bool)
        self._ramp = Ramp(size)
        self._time = self._duration = 0.0
        self._position = np.zeros(size)
        self._velocity = np.zeros(size)

    @property
    def left(self) -> float:
        """Time until its end [s]."""
        return self._duration - self._time

    @property
    def stop_time(self) -> float:
        """See `Ramp.stop_time`."""
        return self._ramp.stop_time

    def plan(self, position: np.ndarray, velocity: np.ndarray, goal: np.ndarray, limits: np.ndarray) -> None:
        """Begin with all joints; see `Ramp.plan`."""
        self._duration = self._ramp.plan(position, velocity, goal, limits)
        self._time = 0.0
        self.moves[:] = True

    def advance(self, step: float, position: np.ndarray, velocity: np.ndarray) -> None:
        """Go on by a time [s], and write positions and velocities of the joints that it moves, shape (n,) each."""
        if self._time >= self._duration:
            return
        self._time = min(self._time + step, self._duration)
        self._ramp.at(self._time, self._position, self._velocity)
        np.copyto(position, self._position, where=self.moves)
        np.copyto(velocity, self._velocity, where=self.moves)

    def coast(self, step: float, position: np.ndarray, velocity: np.ndarray) -> None:
        """Write what `advance` would write, and stay."""
        copy(self).advance(step, position, velocity)

    def end(self) -> None:
        """End where the joints are."""
        self.moves[:] = True
        self._time = self._duration = 0.0


class _WheelSpeeds:
    """Speeds of wheels, which come nearer to their goals with a limited acceleration.

    Args:
        count: Number k of wheels.

    Attributes:
        velocity, goal: Present and final speeds, shape (k,) [rad/s]; live.
    """

    def __init__(self, count: int):
        self.velocity = np.zeros(count)
        self.goal = np.zeros(count)
        self._step = np.zeros(count)

    def advance(self, limit: float) -> None:
        """Change each speed by `limit` at most [rad/s]."""
        np.subtract(self.goal, self.velocity, out=self._step)
        np.maximum(self._step, -limit, out=self._step)
        np.minimum(self._step, limit, out=self._step)
        self.velocity += self._step


class JointStates(Component):
    """Moves joints to positions in synchronised ramps and turns wheels at given speeds, by a service.

    All joints of a request start together and arrive together, within the speed of the request and the velocity
    limits of the robot. A request during a motion takes over smoothly.

    Joints with an end also follow trajectories, from a topic or as goals of an action. A trajectory takes over the
    joints that it names, and the others go on; where it replaces another one they come to rest.
    """

    class Tags(Record):
        """Tags of the component in its configuration."""

        chain: Annotated[str, NameOf("group")] = Field("all", description="SRDF group of the joints that may be moved")
        wheels: Annotated[str, NameOf("group")] = Field(
            "wheels", description="SRDF group of the joints that turn without end"
        )
        speed: float = Field(
            0.5, ge=1e-3, le=100.0, **LIVE, description="largest joint speed of a request that gives none [rad/s]"
        )
        wheel_acceleration: float = Field(
            3.0, ge=1e-3, le=1000.0, **LIVE, description="rate of change of the wheels' speed [rad/s2]"
        )

    def __init__(self, robot: Robot, tags: "JointStates.Tags | None" = None, name: str = "joint_states"):
        super().__init__(robot, tags or self.Tags(), name)
        self.kinematics = False
        chain = np.intersect1d(self._group("chain"), robot.actuated)
        self._wheels = np.intersect1d(self._group("wheels"), chain)
        self._joints = np.setdiff1d(chain, self._wheels)
        self._goals = JointGoals(robot, self._joints, self._wheels, chain=self.tags.chain)
        self._limit = robot.upper_limits.velocity[self._joints]
        self._turns = robot.revolutions[self._joints]
        self._ramp = _JointRamp(len(self._joints))
        self._position, self._velocity, self._goal = (np.zeros(len(self._joints)) for _ in range(3))
        self._follower = TrajectoryFollower(
            robot, self._joints, self._position, velocity=self._velocity, coast=self._ramp.coast
        )
        self._speeds = _WheelSpeeds(len(self._wheels))
        self._error = np.zeros(len(self._joints))

    def _group(self, tag: str) -> np.ndarray:
        """Return the DoFs of a tag's group; a group that exists only by default may be missing in the robot."""
        name = getattr(self.tags, tag)
        selectors = self.model.selectors
        if name not in selectors and tag not in self.tags.model_fields_set:
            return np.zeros(0, dtype=int)
        try:
            return selectors[name].indices
        except UnknownName as error:
            raise error.at(self.tags.where(tag)) from None

    def init(self) -> None:
        """Start from where the robot is, at rest."""
        command = self.model.command
        command.position[:] = self.start_position
        command.velocity[:] = 0.0
        self._position[:] = self.start_position[self._joints]
        self._rest()

    def update(self) -> None:
        """Follow the ramp and the trajectory of the joints, and bring the wheels nearer to their speed."""
        step = self.time_step
        if self._follower.waiting:
            self._take_over(step)
        self._ramp.advance(step, self._position, self._velocity)
        self._follower.advance(step)
        if self._follower.violated:
            self._brake()
        self._speeds.advance(self.tags.wheel_acceleration * step)

    def send(self) -> None:
        """Write positions and velocities of the joints, and velocities of the wheels."""
        command = self.model.command
        command.position[self._joints] = self._position
        command.velocity[self._joints] = self._velocity
        command.velocity[self._wheels] = self._speeds.velocity

    def stop(self) -> None:
        """Hold the joints where the ramp is; wheels stand still at once."""
        self._rest()

    def start_log(self, logger: Logger) -> None:
        """Declare the ramp: where the joints are on it, where it leads and how far they are from it; and the wheels."""
        names, wheels = ([self.model.dofs[dof] for dof in part] for part in (self._joints, self._wheels))
        logger.add("ramp/position", self._position, names, "rad", kind=JOINTS_KIND)
        logger.add("ramp/velocity", self._velocity, names, "rad/s", kind=JOINTS_KIND)
        logger.add("goal/position", self._goal, names, "rad", kind=JOINTS_KIND)
        logger.add("error/position", self._error, names, "rad", kind=JOINTS_KIND)
        logger.add("wheels/velocity", self._speeds.velocity, wheels, "rad/s", kind=JOINTS_KIND)
        logger.add("wheel_goal/velocity", self._speeds.goal, wheels, "rad/s", kind=JOINTS_KIND)

    def log(self, logger: Logger, time: float) -> None:
        """See `Component.log`: how far the measured joints are from the ramp."""
        np.take(self.model.state.position, self._joints, out=self._error)
        self._error -= self._position

    def services(self) -> tuple[Service, ...]:
        """Offer the services `<name>/trajectory`, and `<name>/joint_state_cmnd` with the original program's fields."""
        return (
            Service("trajectory", "solfer/MoveJoints", MoveJoints, reply=Reply, handler=self.trajectory),
            Service("joint_state_cmnd", "solfer/JointStateCmnd", JointStateCmnd, reply=CmndReply, handler=self.command),
        )

    def live_parameters(self) -> tuple[LiveParameter, ...]:
        """Offer the speed of requests, which counts for the next one, and the wheels' acceleration."""
        return tuple(LiveParameter((key,)) for key in ("speed", "wheel_acceleration"))

    def command(self, request: JointStateCmnd) -> CmndReply:
        """Carry out a request of the original program; see `trajectory`."""
        self.trajectory(self._goals.moved_by(request, self.period))
        return CmndReply()

    def topics(self) -> tuple[TopicIn, ...]:
        """Receive trajectories on `<name>/joint_trajectory`."""
        return (TopicIn("joint_trajectory", TRAJECTORY, JointTrajectory, handler=self.follow),)

    def actions(self) -> tuple[Action, ...]:
        """Offer the action `<name>/follow_joint_trajectory`."""
        return (
            Action(
                "follow_joint_trajectory",
                FOLLOW,
                FollowGoal,
                feedback=FollowFeedback,
                result=FollowResult,
                begin=self.begin,
                outcome=self._follower.outcome,
                report=self._follower.report,
                cancel=self.cancel,
            ),
        )

    def follow(self, trajectory: JointTrajectory) -> None:
        """Follow a trajectory; nothing changes if any part of it is wrong. One without points stops all joints.

        Raises:
            SolferError: It is wrong; see `TrajectoryCheck`.
        """
        if trajectory.points:
            self._take(trajectory)
        else:
            self._follower.leave("a trajectory without points has stopped it")
            self._brake()

    def begin(self, goal: FollowGoal) -> Outcome | None:
        """Follow the trajectory of a goal; returns why not if any part of it is wrong, and then nothing changes."""
        try:
            self._take(goal.trajectory, goal)
        except SolferError as error:
            why = described(error, lines=True)
            codes = {UnknownName: INVALID_JOINTS, StaleTrajectory: OLD_HEADER_TIMESTAMP}
            return Outcome(FollowResult(codes.get(type(error), INVALID_GOAL), why), False, why)
        return None

    def cancel(self) -> None:
        """Stop all joints, smoothly; those that obey speeds go on."""
        self._follower.forget()
        self._brake()

    def trajectory(self, request: MoveJoints) -> Reply:
        """Carry out a request; nothing changes if any part of it is wrong.

        Raises:
            UnknownName: A state or joint that this component does not move.
            SizeMismatch: Numbers of joints and values differ.
            NotFinite: A value is NaN or infinite.
            ComponentError: A value is beyond the robot's limits, or the request contradicts itself.
        """
        if not np.isfinite(request.speed) or request.speed < 0.0:
            raise ComponentError(
                f"speed {request.speed:g} rad/s", expected="a positive number, or 0 for the configured speed"
            )
        goal, wheel_goal = self._goals.targets_of(request, self._goal, self._speeds.goal)
        moved = goal != self._goal
        goal[moved] -= whole_revolutions(goal - self._position, self._turns)[moved]
        if self._goals.moves_joints(request):
            self._follower.leave("a request of the service has taken over")
            self._plan(goal, np.minimum(request.speed or self.tags.speed, self._limit))
        self._goal[:] = goal
        self._speeds.goal[:] = wheel_goal
        spin = np.abs(wheel_goal - self._speeds.velocity).max(initial=0.0) / self.tags.wheel_acceleration
        return Reply(duration=float(max(self._ramp.left, spin)))

    def _take(self, trajectory: JointTrajectory, goal: FollowGoal | None = None) -> None:
        self._follower.begin(trajectory, self.clock(), goal)
        self._take_over(0.0)

    def _take_over(self, step: float) -> None:
        """Let a trajectory take over whose time has come, within some time [s]."""
        before = self._follower.moving
        taken = self._follower.take_over(step)
        if taken is not None:
            if before:
                self._slow_down()
            places, end = taken
            self._ramp.moves[places] = False
            self._goal[places] = end

    def _plan(self, goal: np.ndarray, limits: np.ndarray) -> None:
        """Begin a ramp of all joints, from how they move at present."""
        self._ramp.plan(self._position, self._velocity, goal, limits)
        self._goal[:] = goal

    def _brake(self) -> None:
        """Stop all joints, those of a trajectory too."""
        self._follower.leave("it was stopped")
        self._slow_down()

    def _slow_down(self) -> None:
        """Begin a ramp that brings all joints to rest within its `stop_time`, none of them faster than it is."""
        robot = self.model
        joints = self._joints
        position = self._position
        lower, upper = (each.position[joints] for each in (robot.lower_limits, robot.upper_limits))
        rest = position + 0.5 * self._ramp.stop_time * self._velocity
        goal = np.clip(rest, np.minimum(lower, position), np.maximum(upper, position))
        self._plan(goal, np.abs(self._velocity))

    def _rest(self) -> None:
        self._follower.forget()
        self._ramp.end()
        self._goal[:] = self._position
        self._velocity[:] = 0.0
        self._speeds.velocity[:] = 0.0
        self._speeds.goal[:] = 0.0
