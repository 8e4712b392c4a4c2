"""Joint-space trajectories: the paper's `joint_states` (Listings 9 and 16)."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from solfer.components.base import Component
from solfer.components.declaration import Service
from solfer.config import NameOf, Record
from solfer.errors import ComponentError, NotFinite, SizeMismatch, UnknownName
from solfer.numerics.ramp import Ramp
from solfer.robot import Robot

RESET = "reset"
"""Name of the request to stay where the robot is now."""


@dataclass(frozen=True)
class MoveJoints:
    """A motion: a named state of the SRDF or 'reset', or joints with positions and/or velocities.

    Attributes:
        state: Named state, or 'reset'; empty if joints are given.
        joints: Names of joints.
        positions: Goals of joints with an end [rad], empty or one for each joint.
        velocities: Speeds of joints that turn without end [rad/s], empty or one for each joint.
        speed: Largest speed of a joint with an end [rad/s]; 0 stands for the configured one.
    """

    state: str = ""
    joints: tuple[str, ...] = ()
    positions: tuple[float, ...] = ()
    velocities: tuple[float, ...] = ()
    speed: float = 0.0


@dataclass(frozen=True)
class Reply:
    """Answer to `MoveJoints`: whether it is carried out, why not, and how long it takes [s]."""

    success: bool = True
    message: str = ""
    duration: float = 0.0


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
        speed: float = Field(0.5, gt=0.0, description="largest joint speed of a request that gives none [rad/s]")
        wheel_acceleration: float = Field(3.0, gt=0.0, description="rate of change of the wheels' speed [rad/s2]")

    def __init__(self, robot: Robot, tags: "JointStates.Tags | None" = None, name: str = "joint_states"):
        super().__init__(robot, tags or self.Tags(), name)
        self.kinematics = False
        chain = np.intersect1d(self._group("chain"), robot.actuated)
        self._wheels = np.intersect1d(self._group("wheels"), chain)
        self._joints = np.setdiff1d(chain, self._wheels)
        self._place = {robot.dofs[dof]: index for index, dof in enumerate(self._joints)}
        self._wheel_place = {robot.dofs[dof]: index for index, dof in enumerate(self._wheels)}
        self._limit = robot.upper_limits.velocity[self._joints]
        self._lower = robot.lower_limits.position[self._joints]
        self._upper = robot.upper_limits.position[self._joints]
        self._wheel_limit = robot.upper_limits.velocity[self._wheels]
        self._ramp = Ramp(len(self._joints))
        self._time = self._duration = 0.0
        self._position, self._velocity, self._goal = (np.zeros(len(self._joints)) for _ in range(3))
        self._wheel_velocity, self._wheel_goal = np.zeros(len(self._wheels)), np.zeros(len(self._wheels))
        self._step = np.zeros(len(self._wheels))

    def _group(self, tag: str) -> np.ndarray:
        """DoFs of the group that a tag names; a group that exists only by default may be missing in the robot."""
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
        """The service `<name>/trajectory`."""
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
        goal, wheel_goal = self._goal.copy(), self._wheel_goal.copy()
        if request.state:
            if request.joints:
                raise ComponentError(f"both state '{request.state}' and joints are given", expected="one of the two")
            self._take_state(request.state, goal, wheel_goal)
        elif request.joints:
            self._take_joints(request, goal, wheel_goal)
        else:
            raise ComponentError("the request names neither a state nor joints", expected="state, or joints")
        self._check(goal, wheel_goal, request.state)
        if request.state or any(joint in self._place for joint in request.joints):
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

    def _take_state(self, name: str, goal: np.ndarray, wheel_goal: np.ndarray) -> None:
        if name == RESET:
            goal[:] = self.model.state.position[self._joints]
            wheel_goal[:] = 0.0
            return
        states = self.model.semantics.states
        if name not in states:
            raise UnknownName("state", name, (*states, RESET))
        known = [(self._place[joint], value) for joint, value in states[name].items() if joint in self._place]
        if not known:
            raise ComponentError(f"state '{name}' has no joint of group '{self.tags.chain}'")
        for index, value in known:
            goal[index] = value

    def _take_joints(self, request: MoveJoints, goal: np.ndarray, wheel_goal: np.ndarray) -> None:
        joints = request.joints
        for what, values in (("positions", request.positions), ("velocities", request.velocities)):
            if len(values) not in (0, len(joints)):
                raise SizeMismatch(f"{len(values)} {what} for {len(joints)} joints", expected="none, or one a joint")
            if not np.isfinite(values).all():
                joint = joints[int(np.argmin(np.isfinite(values)))]
                raise NotFinite(f"{what} of joint '{joint}' is not a finite number")
        if len(set(joints)) < len(joints):
            twice = next(name for name in joints if joints.count(name) > 1)
            raise ComponentError(f"joint '{twice}' is given twice")
        for index, joint in enumerate(joints):
            if joint in self._place:
                goal[self._place[joint]] = _value(joint, index, "position", request.positions, request.velocities)
            elif joint in self._wheel_place:
                place = self._wheel_place[joint]
                wheel_goal[place] = _value(joint, index, "velocity", request.velocities, request.positions)
            else:
                raise UnknownName("joint", joint, (*self._place, *self._wheel_place))

    def _check(self, goal: np.ndarray, wheel_goal: np.ndarray, state: str) -> None:
        of = f" of state '{state}'" if state and state != RESET else ""
        for joint, index in self._place.items():
            value, lower, upper = goal[index], self._lower[index], self._upper[index]
            asked = value != self._goal[index] and state != RESET
            if asked and not lower <= value <= upper:
                raise ComponentError(
                    f"position {value:.6g} rad{of} is beyond the limits of joint '{joint}'",
                    expected=f"{lower:.6g} to {upper:.6g} rad",
                )
        for joint, index in self._wheel_place.items():
            if abs(wheel_goal[index]) > self._wheel_limit[index]:
                raise ComponentError(
                    f"velocity {wheel_goal[index]:.6g} rad/s is beyond the limit of joint '{joint}'",
                    expected=f"at most {self._wheel_limit[index]:.6g} rad/s",
                )

    def _rest(self) -> None:
        self._time = self._duration = 0.0
        self._goal[:] = self._position
        self._velocity[:] = 0.0
        self._wheel_velocity[:] = 0.0
        self._wheel_goal[:] = 0.0


def _value(joint: str, index: int, wanted: str, values: tuple[float, ...], others: tuple[float, ...]) -> float:
    """The number of a joint that obeys a `wanted` kind of number; the other kind may only be zero."""
    if not values or (others and others[index] != 0.0):
        raise ComponentError(f"joint '{joint}' obeys a {wanted}", expected=f"a {wanted} for it, and nothing else")
    return values[index]
