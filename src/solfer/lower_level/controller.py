"""Controllers of joints: what a robot's own drives do with a command."""

import abc
from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from solfer.errors import NotFinite, SizeMismatch
from solfer.lower_level.command import CommandCheck
from solfer.lower_level.gain_ramp import GainRamp
from solfer.lower_level.limits import JointLimits
from solfer.lower_level.watchdog import Watchdog
from solfer.pipes.messages import JOINT_FIELDS, JointMessage

TIMEOUT = 0.5  # [s]
RAMP = 0.5
"""Time in which loaded gains come into force, and feed-forward torque when it is switched [s]."""


class Controller(abc.ABC):
    """Takes commands for its joints. A command is checked whole, and applied whole or not at all.

    Args:
        name: Name of the controller.
        limits: Its joints and their limits.
        timeout: Time after which a velocity that is not renewed becomes zero [s].

    Attributes:
        joints: Names of the joints, in the controller's order.
        dofs: Their DoFs in the model.
        running: False while it holds and is not to be commanded; `LowerLevel` refuses what comes.
        velocity: Commanded velocities, shape (len(joints),) [rad/s, m/s].
    """

    TYPE: ClassVar[str]
    FIELDS: ClassVar[tuple[str, ...]]

    def __init__(self, name: str, limits: JointLimits, timeout: float = TIMEOUT):
        self.name, self.limits, self.joints, self.dofs, self.running = name, limits, limits.joints, limits.dofs, True
        self.velocity = np.zeros(len(self.joints))
        self._check = CommandCheck(name, limits, self.FIELDS)
        self._watchdog = Watchdog(len(self.joints), timeout)

    def accept(self, message: JointMessage) -> None:
        """Check and apply a command.

        Raises:
            CommandRefused: The command is wrong; nothing of it was applied.
        """
        self.apply(*self.check(message))

    def check(self, message: JointMessage) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        """What a command says; see `CommandCheck.check`.

        Raises:
            CommandRefused: The command is wrong.
        """
        return self._check.check(message)

    def apply(self, indices: np.ndarray, given: Mapping[str, np.ndarray]) -> None:
        """Take over what was checked; joints and fields that it does not name stay as they are."""
        for field, numbers in given.items():
            getattr(self, field)[indices] = numbers
        if "velocity" in given:
            self._watchdog.renew(indices)

    def rest(self, joints: np.ndarray | slice = slice(None)) -> None:
        """Hold the joints at `joints`, indices or a mask: their velocities become zero, all else stays."""
        self.velocity[joints] = 0.0

    def advance(self, dt: float) -> None:
        """Let `dt` [s] pass."""
        self.velocity[self._watchdog.advance(dt)] = 0.0

    def start(self, position: np.ndarray) -> None:
        """Forget all commands; the joints are at `position`, shape (len(joints),)."""
        self.velocity[:] = 0.0
        self._watchdog.reset()


class VelocityController(Controller):
    """Turns joints at a commanded velocity, such as the wheels of a robot; starts at zero."""

    TYPE = "velocity"
    FIELDS = ("velocity",)


class ImpedanceController(Controller):
    """Springs and dampers at the joints, around targets that never move faster than the joints may.

    Args:
        stiffness: Default stiffness, shape (len(joints),) [Nm/rad].
        damping: Default damping, shape (len(joints),) [Nms/rad].

    Attributes:
        position: Accepted position, kept for ever [rad].
        target: Position of the springs: follows `position` at the velocity limit of each joint at most [rad].
        effort: Commanded feed-forward torque [Nm].
        feed_forward: Whether it is applied; a change takes RAMP.
        applied_effort: Feed-forward torque that is applied [Nm].
        stiffness: Stiffness of the springs [Nm/rad].
        damping: Damping about `velocity` [Nms/rad].

    Raises:
        SizeMismatch: The gains are not one for each joint.
        NotFinite: A gain is not a finite number that is zero or positive.
    """

    TYPE = "impedance"
    FIELDS = JOINT_FIELDS

    def __init__(self, name: str, limits: JointLimits, stiffness: Sequence[float], damping: Sequence[float],
                 timeout: float = TIMEOUT):
        super().__init__(name, limits, timeout)
        size = len(self.joints)
        self._default = {"stiffness": self._gain("stiffness", stiffness), "damping": self._gain("damping", damping)}
        self.stiffness, self.damping = (gain.copy() for gain in self._default.values())
        self.position, self.target, self.effort, self.applied_effort, self._change = (np.zeros(size) for _ in range(5))
        self.feed_forward, self._share = True, 1.0
        self._ramps = {field: GainRamp(getattr(self, field)) for field in self._default}

    def load_gains(self, stiffness: Sequence[float], damping: Sequence[float]) -> None:
        """Take other default gains and go over to them within RAMP.

        Raises:
            SizeMismatch: The gains are not one for each joint.
            NotFinite: A gain is not a finite number that is zero or positive.
        """
        loaded = {"stiffness": self._gain("stiffness", stiffness), "damping": self._gain("damping", damping)}
        self._default = loaded
        for field, ramp in self._ramps.items():
            ramp.begin(loaded[field], RAMP)

    def apply(self, indices: np.ndarray, given: Mapping[str, np.ndarray]) -> None:
        """See `Controller.apply`; a commanded gain holds at once."""
        super().apply(indices, given)
        for field, ramp in self._ramps.items():
            if field in given:
                ramp.leave(indices)

    def start(self, position: np.ndarray) -> None:
        """Hold `position` with the default gains and no feed-forward torque."""
        super().start(position)
        self.position[:] = self.target[:] = position
        self.effort[:] = self.applied_effort[:] = 0.0
        for field, ramp in self._ramps.items():
            ramp.begin(self._default[field], 0.0)

    def advance(self, dt: float) -> None:
        """Let `dt` [s] pass: the springs' targets move on towards the accepted position."""
        super().advance(dt)
        for ramp in self._ramps.values():
            ramp.advance(dt)
        wanted = 1.0 if self.feed_forward else 0.0
        if self._share != wanted:
            self._share += float(np.clip(wanted - self._share, -dt / RAMP, dt / RAMP))
        np.multiply(self.effort, self._share, out=self.applied_effort)
        change = self._change
        step = self.limits.velocity * dt
        np.subtract(self.position, self.target, out=change)
        np.minimum(change, step, out=change)
        np.maximum(change, np.negative(step, out=step), out=change)
        np.add(self.target, change, out=self.target)

    def _gain(self, kind: str, values: Sequence[float]) -> np.ndarray:
        gain = np.array(values, dtype=float)
        where = f"controller '{self.name}'"
        if gain.shape != (len(self.joints),):
            raise SizeMismatch(f"{gain.size} values of {kind} for {len(self.joints)} joints", where=where)
        for joint, value in zip(self.joints, gain, strict=True):
            if not (np.isfinite(value) and value >= 0.0):
                raise NotFinite(f"{kind} {value:g} of joint '{joint}'", where=where, expected="zero or more")
        return gain
