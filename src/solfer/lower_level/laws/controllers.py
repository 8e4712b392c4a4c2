"""Controllers of joints, as in a robot's own drives."""

import abc
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from solfer.errors import NotFinite, SizeMismatch, Suspended
from solfer.lower_level.gains.ramp import ALL_JOINTS, GainRamp
from solfer.lower_level.laws.catch_up import CatchUp
from solfer.lower_level.laws.command_check import CommandCheck
from solfer.lower_level.laws.limits import JointLimits
from solfer.numerics.rotations import whole_revolutions
from solfer.transport.messages import JOINT_FIELDS

if TYPE_CHECKING:
    from solfer.numerics.blocks import MemoryBlock

VELOCITY_TIMEOUT = 0.5
"""Time after which a velocity that is not renewed becomes zero, without a record [s]."""

RAMP_DURATION = 0.5
"""Time in which loaded gains, and feed-forward torque when it is switched, come into force [s]."""


class LowerLevelController(abc.ABC):
    """Applies commands to its joints. A command is checked whole, and applied whole or not at all.

    Args:
        name: Name of the controller.
        limits: Its joints and their limits.
        timeout: Time after which a velocity that is not renewed becomes zero [s].

    Attributes:
        joints: Names of the joints, in the controller's order.
        dofs: Their DoFs in the model.
        running: False while it is stopped and holds; then `LowerLevel` refuses commands.
        velocity: Commanded velocities, shape (len(joints),) [rad/s, m/s].
        check: Checks a command, for `apply`; see `CommandCheck.check`.
        block: The numbers of the compiled step.
    """

    TYPE: ClassVar[str]
    FIELDS: ClassVar[tuple[str, ...]]

    def __init__(self, name: str, limits: JointLimits, timeout: float = VELOCITY_TIMEOUT):
        self.name = name
        self.limits = limits
        self.joints = limits.joints
        self.dofs = limits.dofs
        self.running = True
        self.velocity = np.zeros(len(self.joints))
        self.check = CommandCheck(name, limits, self.FIELDS).check
        self._age = np.full(len(self.joints), np.inf)  # of the velocities
        self.block = self._make_block(timeout)

    def _make_block(self, timeout: float, **springs: Any) -> "MemoryBlock":
        """Make the block, and find what is compiled."""
        # imported here: its compiler takes a while to load
        from solfer.lower_level.laws import controllers_kernel as kernel
        from solfer.numerics.blocks import MemoryBlock

        self._advance = kernel.advance
        numbers = {"dofs": self.dofs, "velocity": self.velocity, "age": self._age}
        return MemoryBlock(kernel.CONTROLLER, count=len(self.joints), timeout=timeout, **numbers, **springs)

    def restore(self, field: str, joints: np.ndarray) -> None:  # noqa: B027 wheels have none
        """Let a gain of joints, indices, return to its default, and a feed-forward torque to zero."""

    def hold(self, position: np.ndarray, free: Mapping[str, np.ndarray]) -> list[str]:
        """Hold joints whose owner sends no more, without a bump.

        Args:
            position: Measured positions of all joints, shape (len(joints),) [rad, m].
            free: For each field, indices of the joints without an owner, shape (k,).

        Returns:
            Names of the joints without a spring of their own.
        """
        self.rest(free["velocity"])
        return []

    def apply(self, indices: np.ndarray, given: Mapping[str, np.ndarray]) -> None:
        """Apply a checked command; joints and fields that it does not name stay as they are."""
        if "velocity" in given:
            self.velocity[indices] = given["velocity"]
            self._age[indices] = 0.0

    def away(self, indices: np.ndarray, given: Mapping[str, np.ndarray]) -> tuple[str, float]:
        """Find the joint that a command moves furthest ("": none), and its distance from the held position [rad, m]."""
        return "", 0.0

    def check_measured(self, indices: np.ndarray, measured: Mapping[str, float]) -> None:  # noqa: B027 wheels are free
        """Check where the next owner of joints, indices, measures them, by name [rad, m].

        Raises:
            Suspended: A joint is farther from its target than its spring can be stretched.
        """

    def rest(self, joints: np.ndarray | slice = ALL_JOINTS) -> None:
        """Hold the joints at `joints`, indices or a mask: their velocities become zero, all else stays."""
        self.velocity[joints] = 0.0

    def resume(self, joint: int, position: float) -> None:  # noqa: B027 wheels have none
        """Move a joint, an index, to its command from its position [rad, m]: its drive works again."""

    def advance(self, dt: float) -> None:
        """Let `dt` [s] pass."""
        self._advance(self.block.address, dt, 1.0)

    def start(self, position: np.ndarray) -> None:
        """Forget all commands, and start with the joints at `position`, shape (len(joints),)."""
        self.velocity[:] = 0.0


class VelocityController(LowerLevelController):
    """Turns joints at a commanded velocity, such as the wheels of a robot; starts at zero."""

    TYPE = "velocity"
    FIELDS = ("velocity",)


class ImpedanceController(LowerLevelController):
    """Springs and dampers at the joints, around targets that never jump and never move faster than the joints may.

    Args:
        stiffness: Default stiffness, shape (len(joints),) [Nm/rad].
        damping: Default damping, shape (len(joints),) [Nms/rad].

    Attributes:
        position: Accepted position, of joints without ends in the revolution nearest to the one before; it does not
            expire [rad].
        target: Position of the springs: follows `position` by `CatchUp`, at most at the velocity limit of each joint
            [rad].
        effort: Commanded feed-forward torque [Nm].
        feed_forward: Whether it is applied; a change takes RAMP_DURATION.
        applied_effort: Feed-forward torque that is applied [Nm].
        stiffness: Stiffness of the springs [Nm/rad].
        damping: Damping relative to `velocity` [Nms/rad].
        default_gains: Stiffness and damping without a command, shape (len(joints),) each [Nm/rad, Nms/rad].

    Raises:
        SizeMismatch: The gains are not one for each joint.
        NotFinite: A gain is not a finite number that is zero or positive.
    """

    TYPE = "impedance"
    FIELDS = JOINT_FIELDS

    def __init__(
        self,
        name: str,
        limits: JointLimits,
        stiffness: ArrayLike,
        damping: ArrayLike,
        timeout: float = VELOCITY_TIMEOUT,
    ):
        super().__init__(name, limits, timeout)
        size = len(self.joints)
        self.default_gains = self._gains(stiffness=stiffness, damping=damping)
        self.stiffness, self.damping = (gain.copy() for gain in self.default_gains.values())
        self.position, self.target, self.effort, self.applied_effort = np.zeros((4, size))
        self._revolutions = np.where(np.isinf(limits.upper), math.tau, 0.0)
        self._turns = bool(self._revolutions.any())
        self.feed_forward = True
        self._feed_forward_ratio = 1.0
        self._ramps = {field: GainRamp(getattr(self, field)) for field in self.default_gains}
        self._leftover = GainRamp(self.effort)
        self._catch_up = CatchUp(limits.velocity, self.position)
        self.block = self._make_block(
            timeout,
            has_springs=1,
            position=self.position,
            target=self.target,
            effort=self.effort,
            applied_effort=self.applied_effort,
            stiffness=self.stiffness,
            damping=self.damping,
            lower=limits.lower,
            upper=limits.upper,
            fastest=limits.velocity,
            ramp_addresses=np.array([each.block.address for each in (*self._ramps.values(), self._leftover)]),
            catch_up_address=self._catch_up.block.address,
        )

    def load_gains(self, stiffness: ArrayLike, damping: ArrayLike) -> None:
        """Set other default gains, and ramp to them within RAMP_DURATION.

        Raises:
            SizeMismatch: The gains are not one for each joint.
            NotFinite: A gain is not a finite number that is zero or positive.
        """
        self.default_gains = self._gains(stiffness=stiffness, damping=damping)
        for field, ramp in self._ramps.items():
            ramp.begin(self.default_gains[field], RAMP_DURATION)

    def apply(self, indices: np.ndarray, given: Mapping[str, np.ndarray]) -> None:
        """See `LowerLevelController.apply`; a commanded gain comes into force by a ramp."""
        super().apply(indices, given)
        if "position" in given:
            position = given["position"]
            if self._turns:  # joints without ends may be counted in another revolution
                ahead = self.position[indices] - position
                position = position + whole_revolutions(ahead, self._revolutions[indices])
            self.position[indices] = position
            self._catch_up.renew(indices)
        if "effort" in given:
            self.effort[indices] = given["effort"]
            self._leftover.stop(indices)
        for field, ramp in self._ramps.items():
            if field in given:
                ramp.command(indices, given[field])

    def restore(self, field: str, joints: np.ndarray) -> None:
        """Ramp a gain of joints, indices, back to the default within RAMP_DURATION, or a feed-forward torque to 0."""
        if field == "effort":
            self._leftover.begin(np.zeros(len(joints)), RAMP_DURATION, joints)
        else:
            self._ramps[field].begin(self.default_gains[field][joints], RAMP_DURATION, joints)

    def hold(self, position: np.ndarray, free: Mapping[str, np.ndarray]) -> list[str]:
        """See `LowerLevelController.hold`: default gains, and targets with which their springs pull as before.

        Feed-forward torques stay: with a spring of stiffness k they are the same as a target that is tau / k further,
        and an owner that carries the joint again begins with them. A spring whose target another owner commands returns
        to the default within RAMP_DURATION. A position on which default gains are at work is still approached.
        """
        super().hold(position, free)
        usual = self.default_gains["stiffness"]
        changed = free["stiffness"][self.stiffness[free["stiffness"]] != usual[free["stiffness"]]]
        kept = np.intersect1d(changed, free["position"])
        pull = self.stiffness[kept] * (self.target[kept] - position[kept])
        away = np.divide(pull, usual[kept], out=np.zeros_like(pull), where=usual[kept] > 0.0)
        furthest = 0.5  # distance of a target from its joint [rad, m]
        target = position[kept] + np.clip(away, -furthest, furthest)
        np.clip(target, self.limits.lower[kept], self.limits.upper[kept], out=target)
        self.position[kept] = self.target[kept] = target
        self._catch_up.start(kept)
        for field, ramp in self._ramps.items():
            at_once = np.intersect1d(kept, free[field])
            ramp.begin(self.default_gains[field][at_once], 0.0, at_once)
            self.restore(field, np.setdiff1d(free[field], kept))
        return [self.joints[index] for index in free["position"] if usual[index] == 0.0]

    def away(self, indices: np.ndarray, given: Mapping[str, np.ndarray]) -> tuple[str, float]:
        """See `LowerLevelController.away`."""
        if "position" not in given:
            return super().away(indices, given)
        steps = given["position"] - self.target[indices]
        distances = np.abs(steps - whole_revolutions(steps, self._revolutions[indices]))
        furthest = int(np.argmax(distances))
        return self.joints[indices[furthest]], float(distances[furthest])

    def check_measured(self, indices: np.ndarray, measured: Mapping[str, float]) -> None:
        """See `LowerLevelController.check_measured`; a motor at its largest torque stretches a spring by tau / k."""
        # A link hangs on its actuator's spring, 0.004 rad at CENTAURO's largest torques, and was measured 10 ms ago
        # while it moves at 4 rad/s.
        margin = 0.05  # [rad, m]
        for index in indices[self.stiffness[indices] > 0.0]:
            joint = self.joints[index]
            held = self.target[index]
            limits = self.limits
            away = measured.get(joint, held) - held
            away -= float(whole_revolutions(away, self._revolutions[index]))
            stretch = (limits.effort[index] + abs(self.applied_effort[index])) / self.stiffness[index]
            if abs(away) > margin + stretch:
                raise Suspended(
                    f"joint '{joint}' is measured at {measured[joint]:.3f}, and controller '{self.name}' holds it at "
                    f"{held:.3f} by a spring that its motor stretches by {stretch:.3f} at most",
                    expected="an encoder that agrees, or an emergency stop and its reset: then it is held where it is",
                )

    def start(self, position: np.ndarray) -> None:
        """Hold `position` with the default gains and no feed-forward torque."""
        super().start(position)
        self.position[:] = self.target[:] = position
        self._catch_up.start()
        self.effort[:] = self.applied_effort[:] = 0.0
        self._leftover.stop()
        for field, ramp in self._ramps.items():
            ramp.begin(self.default_gains[field], 0.0)

    def resume(self, joint: int, position: float) -> None:
        """See `LowerLevelController.resume`; `CatchUp` leads its target to the command, in the joint's revolution."""
        ahead = self.position[joint] - position
        ahead -= whole_revolutions(ahead, self._revolutions[joint])
        self.position[joint] = position + ahead
        self.target[joint] = position
        self._catch_up.fall_behind(joint, ahead)

    def advance(self, dt: float) -> None:
        """Let `dt` [s] pass: the springs' targets move on towards the accepted position."""
        goal = 1.0 if self.feed_forward else 0.0
        if self._feed_forward_ratio != goal:
            largest = dt / RAMP_DURATION
            self._feed_forward_ratio += float(np.clip(goal - self._feed_forward_ratio, -largest, largest))
        self._advance(self.block.address, dt, self._feed_forward_ratio)

    def _gains(self, **given: ArrayLike) -> dict[str, np.ndarray]:
        gains = {kind: np.array(values, dtype=float) for kind, values in given.items()}
        where = f"controller '{self.name}'"
        for kind, gain in gains.items():
            if gain.shape != (len(self.joints),):
                raise SizeMismatch(f"{gain.size} values of {kind} for {len(self.joints)} joints", where=where)
            for joint, value in zip(self.joints, gain, strict=True):
                if not (np.isfinite(value) and value >= 0.0):
                    raise NotFinite(f"{kind} {value:g} of joint '{joint}'", where=where, expected="zero or more")
        return gains
