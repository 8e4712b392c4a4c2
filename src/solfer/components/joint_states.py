"""Joint-space trajectories: the paper's `joint_states` (Listings 9 and 16)."""

from typing import Annotated

import numpy as np
from pydantic import Field

from solfer.components.base import Component
from solfer.components.declaration import Service
from solfer.components.move_joints import JointGoals, MoveJoints, Reply
from solfer.config import NameOf, Record
from solfer.errors import ComponentError, UnknownName
from solfer.numerics.ramp import Ramp
from solfer.robot import Robot


class JointStates(Component):
    """Moves joints to positions in synchronised ramps and turns wheels at given speeds, by a service.

    All joints of a request start together and arrive together, within the speed of the request and the velocity
    limits of the robot. A request during a motion takes over smoothly.
    """

    class Tags(Record):
        """Tags of the component in its configuration."""

        chain: Annotated[str, NameOf("group")] = Field("all", description="SRDF group of the joints that may be moved")
        wheels: Annotated[str, NameOf("group")] = Field(
            "wheels", description="SRDF group of the joints that turn without end"
        )
        speed: float = Field(
            0.5, ge=1e-3, le=100.0, description="largest joint speed of a request that gives none [rad/s]"
        )
        wheel_acceleration: float = Field(
            3.0, ge=1e-3, le=1000.0, description="rate of change of the wheels' speed [rad/s2]"
        )

    def __init__(self, robot: Robot, tags: "JointStates.Tags | None" = None, name: str = "joint_states"):
        super().__init__(robot, tags or self.Tags(), name)
        self.kinematics = False
        chain = np.intersect1d(self._group("chain"), robot.actuated)
        self._wheels = np.intersect1d(self._group("wheels"), chain)
        self._joints = np.setdiff1d(chain, self._wheels)
        self._goals = JointGoals(robot, self._joints, self._wheels, self.tags.chain)
        self._limit = robot.upper_limits.velocity[self._joints]
        self._ramp = Ramp(len(self._joints))
        self._time = self._duration = 0.0
        self._position, self._velocity, self._goal = (np.zeros(len(self._joints)) for _ in range(3))
        self._wheel_velocity, self._wheel_goal = np.zeros(len(self._wheels)), np.zeros(len(self._wheels))
        self._step = np.zeros(len(self._wheels))

    def _group(self, tag: str) -> np.ndarray:
        """Return the DoFs of a tag's group; a group that exists only by default may be missing in the robot."""
        name, selectors = getattr(self.tags, tag), self.model.selectors
        if name not in selectors and tag not in self.tags.model_fields_set:
            return np.zeros(0, dtype=int)
        try:
            return selectors[name].indices
        except UnknownName as error:
            raise error.at(self.tags.where(tag)) from None

    def init(self) -> None:
        """Start from where the robot is, at rest."""
        command, state = self.model.command, self.model.state
        command.position[:] = state.position
        command.velocity[:] = 0.0
        self._position[:] = state.position[self._joints]
        self._rest()

    def update(self) -> None:
        """Follow the ramp of the joints, and bring the wheels nearer to their speed."""
        if self._time < self._duration:
            self._time = min(self._time + self.period, self._duration)
            self._ramp.at(self._time, self._position, self._velocity)
        step = self.tags.wheel_acceleration * self.period
        np.subtract(self._wheel_goal, self._wheel_velocity, out=self._step)
        np.maximum(self._step, -step, out=self._step)
        np.minimum(self._step, step, out=self._step)
        self._wheel_velocity += self._step

    def send(self) -> None:
        """Write positions and velocities of the joints, and velocities of the wheels."""
        command = self.model.command
        command.position[self._joints] = self._position
        command.velocity[self._joints] = self._velocity
        command.velocity[self._wheels] = self._wheel_velocity

    def stop(self) -> None:
        """Hold the joints where the ramp is; wheels stand still at once."""
        self._rest()

    def services(self) -> tuple[Service, ...]:
        """Offer the service `<name>/trajectory`."""
        return (Service("trajectory", "solfer/MoveJoints", MoveJoints, Reply, self.trajectory),)

    def trajectory(self, request: MoveJoints) -> Reply:
        """Carry out a request; nothing changes if any part of it is wrong.

        Raises:
            UnknownName: A state or joint that this component does not move.
            SizeMismatch: Numbers of joints and values differ.
            NotFinite: A value is NaN or infinite.
            ComponentError: A value is beyond the robot's limits, or the request contradicts itself.
        """
        speed = self._speed(request.speed)
        goal, wheel_goal = self._goals.targets_of(request, self._goal, self._wheel_goal)
        if self._goals.moves_joints(request):
            limits = np.minimum(speed, self._limit)
            self._duration = self._ramp.plan(self._position, self._velocity, goal, limits)
            self._time = 0.0
        self._goal[:], self._wheel_goal[:] = goal, wheel_goal
        spin = np.abs(wheel_goal - self._wheel_velocity).max(initial=0.0) / self.tags.wheel_acceleration
        return Reply(duration=float(max(self._duration - self._time, spin)))

    def _speed(self, speed: float) -> float:
        if not np.isfinite(speed) or speed < 0.0:
            raise ComponentError(f"speed {speed:g} rad/s", expected="a positive number, or 0 for the configured speed")
        return speed or self.tags.speed

    def _rest(self) -> None:
        self._time = self._duration = 0.0
        self._goal[:] = self._position
        self._velocity[:] = 0.0
        self._wheel_velocity[:] = 0.0
        self._wheel_goal[:] = 0.0
