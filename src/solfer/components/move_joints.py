"""Requests to move joints: a named state, or joints with positions and speeds."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from solfer.errors import ComponentError, NotFinite, SizeMismatch, UnknownName
from solfer.robot import Robot


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


@dataclass(frozen=True)
class JointStateCmnd:
    """The request of the original program.

    Attributes:
        position: Named state, 'reset', or a joint.
        velocity: Of a joint: its goal [rad], or its speed if it turns without end [rad/s].
        pos_step: Largest step of a joint in a cycle [rad]; 0 stands for the configured speed.
    """

    position: str = ""
    velocity: float = 0.0
    pos_step: float = 0.0


@dataclass(frozen=True)
class CmndReply:
    """Answer to `JointStateCmnd`: whether it is carried out, and why not."""

    success: bool = True
    message: str = ""


class JointGoals:
    """Finds the goals of a request.

    Args:
        robot: The Robot.
        joints: DoFs of the joints with an end, which obey positions, shape (n,).
        wheels: DoFs of the joints that turn without end, which obey velocities, shape (m,).
        chain: Name of the group that they belong to, for errors.
    """

    _RESET = "reset"
    """State name that requests to stay where the robot is now."""

    def __init__(self, robot: Robot, joints: np.ndarray, wheels: np.ndarray, chain: str):
        self._robot = robot
        self._joints = joints
        self._chain = chain
        self._place = {robot.dofs[dof]: index for index, dof in enumerate(joints)}
        self._wheel_place = {robot.dofs[dof]: index for index, dof in enumerate(wheels)}
        self._lower = robot.lower_limits.position[joints]
        self._upper = robot.upper_limits.position[joints]
        self._wheel_limit = robot.upper_limits.velocity[wheels]

    def moves_joints(self, request: MoveJoints) -> bool:
        """Return whether a request moves joints with an end."""
        return bool(request.state) or any(joint in self._place for joint in request.joints)

    def moved_by(self, command: JointStateCmnd, period: float) -> MoveJoints:
        """Translate a request of the original program, in whose `period` of a cycle [s] its steps count.

        Raises:
            NotFinite: A number is NaN or infinite.
            ComponentError: The step is negative.
            UnknownName: Neither a state nor a joint has that name.
        """
        name = command.position
        if not np.isfinite((command.velocity, command.pos_step)).all():
            raise NotFinite(f"velocity or pos_step of '{name}' is not a finite number")
        if command.pos_step < 0.0:
            raise ComponentError(f"pos_step {command.pos_step:g} rad", expected="a positive number, or 0")
        speed = min(command.pos_step / period, 2.0)  # [rad/s] as in the original program
        if name == self._RESET or name in self._robot.semantics.states:
            return MoveJoints(state=name, speed=speed)
        if name in self._wheel_place:
            return MoveJoints(joints=(name,), velocities=(command.velocity,))
        if name not in self._place:
            known = (self._RESET, *self._robot.semantics.states, *self._place, *self._wheel_place)
            raise UnknownName("state or joint", name, known)
        return MoveJoints(joints=(name,), positions=(command.velocity,), speed=speed)

    def targets_of(
        self, request: MoveJoints, goal: np.ndarray, wheel_goal: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Compute positions, shape (n,) [rad], and velocities, shape (m,) [rad/s]; values that are not requested stay.

        Args:
            request: The request.
            goal: Present goals of the joints with an end; stay as they are.
            wheel_goal: Present goals of the others; stay as they are.

        Raises:
            UnknownName: A state or joint is not known.
            SizeMismatch: Numbers of joints and values differ.
            NotFinite: A value is NaN or infinite.
            ComponentError: A value is beyond the robot's limits, or the request contradicts itself.
        """
        new = goal.copy()
        new_wheels = wheel_goal.copy()
        if request.state:
            if request.joints:
                raise ComponentError(f"both state '{request.state}' and joints are given", expected="one of the two")
            self._set_state(request.state, new, new_wheels)
        elif request.joints:
            self._set_joints(request, new, new_wheels)
        else:
            raise ComponentError("the request names neither a state nor joints", expected="state, or joints")
        if request.state != self._RESET:
            self._check_joints(new, new != goal, request.state)
            self._check_wheels(new_wheels)
        return new, new_wheels

    def _set_state(self, name: str, goal: np.ndarray, wheel_goal: np.ndarray) -> None:
        if name == self._RESET:
            goal[:] = self._robot.state.position[self._joints]
            wheel_goal[:] = 0.0
            return
        states = self._robot.semantics.states
        if name not in states:
            raise UnknownName("state", name, (*states, self._RESET))
        known = [(self._place[joint], value) for joint, value in states[name].items() if joint in self._place]
        if not known:
            raise ComponentError(
                f"state '{name}' has no joint of group '{self._chain}'", expected="a named state of its joints"
            )
        for index, value in known:
            goal[index] = value

    def _set_joints(self, request: MoveJoints, goal: np.ndarray, wheel_goal: np.ndarray) -> None:
        joints = request.joints
        _check_values(joints, "positions", request.positions)
        _check_values(joints, "velocities", request.velocities)
        if len(set(joints)) < len(joints):
            twice = next(name for name in joints if joints.count(name) > 1)
            raise ComponentError(f"joint '{twice}' is given twice", expected="each joint once")
        for index, joint in enumerate(joints):
            if joint in self._place:
                goal[self._place[joint]] = _value(
                    joint, index, "position", values=request.positions, others=request.velocities
                )
            elif joint in self._wheel_place:
                place = self._wheel_place[joint]
                wheel_goal[place] = _value(
                    joint, index, "velocity", values=request.velocities, others=request.positions
                )
            else:
                raise UnknownName("joint", joint, (*self._place, *self._wheel_place))

    def _check_joints(self, goal: np.ndarray, moved: np.ndarray, state: str) -> None:
        targets_of = f" of state '{state}'" if state else ""
        for joint, index in self._place.items():
            value = goal[index]
            lower = self._lower[index]
            upper = self._upper[index]
            if moved[index] and not lower <= value <= upper:
                raise ComponentError(
                    f"position {value:.6g} rad{targets_of} is beyond the limits of joint '{joint}'",
                    expected=f"{lower:.6g} to {upper:.6g} rad",
                )

    def _check_wheels(self, goal: np.ndarray) -> None:
        for joint, index in self._wheel_place.items():
            if abs(goal[index]) > self._wheel_limit[index]:
                raise ComponentError(
                    f"velocity {goal[index]:.6g} rad/s is beyond the limit of joint '{joint}'",
                    expected=f"at most {self._wheel_limit[index]:.6g} rad/s",
                )


def _check_values(joints: Sequence[str], what: str, values: Sequence[float]) -> None:
    if len(values) not in (0, len(joints)):
        raise SizeMismatch(f"{len(values)} {what} for {len(joints)} joints", expected="none, or one a joint")
    if not np.isfinite(values).all():
        joint = joints[int(np.argmin(np.isfinite(values)))]
        raise NotFinite(f"{what} of joint '{joint}' is not a finite number")


def _value(joint: str, index: int, kind: str, values: tuple[float, ...], others: tuple[float, ...]) -> float:
    """Return the value of a joint that obeys a `kind` kind of number; the other kind may only be zero."""
    if not values or (others and others[index] != 0.0):
        raise ComponentError(f"joint '{joint}' obeys a {kind}", expected=f"a {kind} for it, and nothing else")
    return values[index]
