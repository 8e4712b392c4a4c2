"""All controllers of a robot, the claims on their joints, and the emergency stop."""

import logging
from collections.abc import Collection, Mapping, Sequence
from types import MappingProxyType

import numpy as np

from solfer.config.yaml.folders import Folders
from solfer.errors import CommandRefused, Suspended, UnknownName
from solfer.lower_level.claims.claims import ClaimedJoints, Claims, LeaseEnded
from solfer.lower_level.claims.refusals import Refusals
from solfer.lower_level.emergency_stop import EmergencyStop
from solfer.lower_level.laws.controllers import LowerLevelController
from solfer.lower_level.laws.drives import Drives
from solfer.lower_level.laws.measured_position import MeasuredPosition
from solfer.lower_level.records import LowerLevelRecord
from solfer.lower_level.safeguard.safeguard import Safeguard
from solfer.model.actuators import Actuators
from solfer.model.kinematics import Kinematics
from solfer.throttle import Throttle
from solfer.transport.lower_level import TOPIC
from solfer.transport.messages import GAINS, JOINT_FIELDS, JointMessage

logger = logging.getLogger(__name__)

STARTED = "a start by lower_level/switch"
"""What commands of a stopped controller need."""

UNMEASURED: Mapping[str, float] = MappingProxyType({})
"""Positions of a claim that measures no joint."""


class LowerLevel:
    """Accepts commands for the controllers of a robot and computes torques and speeds from them.

    Args:
        kinematics: Model of the robot, with its floating base if it has one.
        controllers: Controllers that together have every actuated joint exactly once.
        record: Settings of its defences.
        passive: Joints without a drive.
        actuators: Springs between motors and joints, see `Drives`.
        posture: Position for which those are made, see `Drives`.

    Attributes:
        robot: Name of the robot: the key of its part in gains files; empty: they have no such key.
        controllers: Controllers by name.
        claims: Leases on the joints.
        emergency: The emergency stop; tripped by `emergency_stop` only.
        safeguard: Detects a fallen robot or a joint out of control; then the robot holds and refuses all commands.
        refusals: Number of refused commands of each claimant, and why they were refused.
        drives: Torques and speeds of the drives.
        starts: How often it forgot all commands and claims.
        ration: Limits of what senders may cost a cycle.
        folders: Folders of gains files that may be loaded while it runs.

    Raises:
        ModelError: A joint is in two controllers, or in none.
    """

    def __init__(
        self,
        kinematics: Kinematics,
        controllers: Sequence[LowerLevelController],
        record: LowerLevelRecord | None = None,
        passive: Collection[str] = (),
        actuators: Actuators | None = None,
        *,
        posture: np.ndarray | None = None,
    ):
        self._passive = tuple(passive)
        self.controllers = {controller.name: controller for controller in controllers}
        self.drives = Drives(kinematics, controllers, passive, actuators=actuators, posture=posture)
        record = record or LowerLevelRecord()
        self.robot = ""
        self._silence = record.silence
        self.folders = Folders()
        self.ration = record.ration
        self.claims = Claims({controller.name: controller.joints for controller in controllers}, record.lease)
        self.emergency = EmergencyStop(record.fade)
        self.safeguard = Safeguard(kinematics, record)
        self.refusals = Refusals()
        self._base = frozenset(() if kinematics.base is None else kinematics.dofs[:6])
        self._throttle = Throttle(logger)
        self._measured = MeasuredPosition(kinematics.revolutions)
        self.starts = 0

    @property
    def refused(self) -> int:
        """Number of commands that were refused."""
        return self.refusals.total()

    def controller(self, name: str) -> LowerLevelController:
        """Look up the controller `name`.

        Raises:
            UnknownName: There is no such controller.
        """
        if name not in self.controllers:
            raise UnknownName("controller", name, self.controllers)
        return self.controllers[name]

    def accept(self, controller: str, message: JointMessage) -> None:
        """Apply a command to a controller; one that is about the floating base alone concerns no drive.

        Raises:
            UnknownName: There is no such controller.
            ClaimRefused: Another claimant commands a joint of it.
            CommandRefused: The command is wrong, or no command is accepted at present. Nothing of it was applied.
        """
        target = self.controller(controller)
        if message.names and self._base.issuperset(message.names):
            return
        owner = message.claimant
        try:
            if self.emergency or self.safeguard.reason:
                self.claims.bar(owner, self.emergency.reason or self.safeguard.reason)
                self._check_suspended(f"command of '{owner}'")
            if not target.running:
                raise Suspended(
                    f"controller '{controller}' is stopped", where=f"command of '{owner}'", expected=STARTED
                )
            indices, given = target.check(message)
            names = tuple(message.names)
            modes = tuple(given)
            if not self.claims.renew(owner, controller, names, modes):
                self.claims.claim_by_command(owner, names, ClaimedJoints(controller, indices, modes))
                self._warn_distance(target, owner, indices, given=given)
        except CommandRefused as error:
            error = self._without_drive(message, error)
            self.refusals.note(owner, error)
            raise error from None
        target.apply(indices, given)

    def claim(
        self,
        owner: str,
        requested: Sequence[ClaimedJoints],
        follows: Sequence[str] = (),
        measured: Mapping[str, float] = UNMEASURED,
    ) -> bool:
        """Grant joints to an owner, all or none; see `Claims.claim`. Fields without an owner return to the default.

        Returns:
            Whether the owner had commanded before. Then it begins again, and so must the publishers of the topics that
            it `follows`: the refusals inform them.

        Raises:
            ClaimRefused: Another owner has one of them.
            Suspended: A controller is stopped, the emergency stop is tripped, the robot is out of control, or a joint
                that its owner is going to move is `measured` where it cannot be [rad, m].
        """
        self._check_suspended(f"claim of '{owner}'")
        for item in requested:
            if not self.controllers[item.controller].running:
                raise Suspended(
                    f"controller '{item.controller}' is stopped", where=f"claim of '{owner}'", expected=STARTED
                )
            if "position" in item.modes:
                self.controllers[item.controller].check_measured(item.indices, measured)
        again = self.claims.knows(owner)
        self.claims.claim(owner, requested)
        self._restore_unclaimed(requested)
        if again:
            for topic in follows:
                self.refusals.publish(
                    f"{TOPIC}{topic}",
                    Suspended(
                        f"'{owner}', which follows it, begins again",
                        expected="commands that begin at the measured state",
                    ),
                )
        return again

    def release(self, owner: str) -> None:
        """End the lease of an owner: its wheels stop, other joints are held. Its late commands are refused."""
        ended = self.claims.release(owner)
        self._take_over(ended)
        if ended.joints:  # without a lease it is not barred: a release can name any owner
            self.claims.bar(owner, "it has released its joints")

    def release_all(self, reason: str) -> tuple[str, ...]:
        """End all leases as `release` does; their owners are refused with the `reason`, and have to claim again.

        Returns:
            The owners.
        """
        owners = self.claims.owners()
        for owner in owners:
            self._take_over(self.claims.release(owner))
            self.claims.bar(owner, reason)
        return owners

    def switch(self, start: Sequence[str], stop: Sequence[str]) -> None:
        """Start and stop controllers, all or none. A stopped one holds its joints and refuses commands.

        Raises:
            UnknownName: There is no such controller.
            CommandRefused: A controller is in both lists, runs already, or is stopped already.
        """
        for name in (*start, *stop):
            self.controller(name)
        for name in start:
            if name in stop:
                raise CommandRefused(
                    f"controller '{name}' is to be started and stopped",
                    expected="each controller in one of the two lists",
                )
        for names, running in ((start, True), (stop, False)):
            for name in names:
                if self.controllers[name].running is running:
                    raise CommandRefused(
                        f"controller '{name}' {'runs' if running else 'is stopped'} already",
                        expected=f"a controller that {'is stopped' if running else 'runs'}",
                    )
        for name in start:
            self.controllers[name].running = True
        for name in stop:
            self.controllers[name].running = False
            self.claims.clear(name)
            self._rest(self.controllers[name], np.arange(len(self.controllers[name].joints)))

    def emergency_stop(self, reason: str) -> None:
        """Refuse all commands, let springs and feed-forward torques fade out, stop the wheels. Ends by reset only."""
        self.emergency.trip(f"emergency stop: {reason}")
        logger.error("%s", self.emergency.reason)
        self.release_all(self.emergency.reason)
        for controller in self.controllers.values():
            controller.rest()

    def reset_emergency_stop(self) -> None:
        """Hold the measured position again, with the default gains. Earlier owners have to claim again."""
        if self.emergency:
            logger.warning("the emergency stop is reset")
            self.emergency.reset()
            self._restart(self._measured.value)

    def start(self, q: np.ndarray) -> None:
        """Begin with a robot that was put into the position q of the model's DoFs, shape (model size,)."""
        self.starts += 1
        self._restart(q)

    def _restart(self, q: np.ndarray) -> None:
        """Forget all commands and claims, and hold the position q of the model's DoFs, shape (model size,).

        Owners of claims have to claim again: their commands were meant for another position. An owner without a name
        commands from within this process, and knows of the start.
        """
        self._measured.start(q)
        for owner in self.claims.owners():
            self.claims.release(owner)
            if owner:
                self.claims.bar(owner, "the controllers have started again")
        for controller in self.controllers.values():
            controller.start(q[controller.dofs])
        self.drives.rest()
        self.safeguard.restart(q)

    def power(self, dof: int, on: bool) -> None:
        """Switch the power of a drive on or off; with power again, its joint goes smoothly to where it is commanded."""
        self.drives.power(dof, on)
        if on:
            for controller in self.controllers.values():
                for joint in np.flatnonzero(controller.dofs == dof):
                    controller.resume(int(joint), float(self._measured.value[dof]))

    def update(self, q: np.ndarray, v: np.ndarray, dt: float) -> tuple[np.ndarray, np.ndarray]:
        """Compute torques and speeds of the drives for the step of `dt` [s] that begins at q, v, shape (model size,).

        Returns:
            `Drives.torque` and `Drives.speed`.
        """
        q = self._measured.measure(q)
        for ended in self.claims.advance(dt):
            self._expire(ended)
        if wrong := self.safeguard.advance(q, v, dt):
            self._hold(wrong)
        for controller in self.controllers.values():
            controller.advance(dt)
        self.emergency.advance(dt)
        self.drives.update(q, v, dt, self.emergency.factor)
        return self.drives.torque, self.drives.speed

    def _without_drive(self, message: JointMessage, error: CommandRefused) -> CommandRefused:
        """Return a better error about a command for a joint without a drive; of other commands the given one."""
        passive = [name for name in self._passive if name in tuple(message.names or ())]
        if not passive:
            return error
        return CommandRefused(f"joint '{passive[0]}' has no drive", where=error.where, expected="joints with a drive")

    def _warn_distance(
        self, target: LowerLevelController, sender: str, indices: np.ndarray, given: Mapping[str, np.ndarray]
    ) -> None:
        """Warn when a sender's first command is far from where the joints are held."""
        joint, distance = target.away(indices, given)
        if distance > 0.05:  # [rad, m]; springs sag by less
            self._throttle.warning(
                target.name,
                "'%s' begins %.3f away from where joint '%s' is held: it goes there smoothly",
                sender,
                distance,
                joint,
            )

    def _restore_unclaimed(self, claimed: Sequence[ClaimedJoints]) -> None:
        """Return gains and feed-forward torques of earlier owners to the default, where no owner has them now."""
        for item in claimed:
            for field in (*GAINS, "effort"):
                free = self.claims.unclaimed(item.controller, field, item.indices)
                self.controllers[item.controller].restore(field, free)

    def _check_suspended(self, where: str) -> None:
        """Raise a Suspended at `where` while no command is accepted."""
        if self.emergency:
            raise Suspended(
                self.emergency.reason,
                where=where,
                expected="a call of lower_level/reset_emergency_stop, which releases it",
            )
        if self.safeguard.reason:
            raise Suspended(self.safeguard.reason, where=where, expected=self.safeguard.expected)

    def _hold(self, reason: str) -> None:
        """Hold the measured position with the default gains: springs and torques may be the fault."""
        logger.error("the robot holds and refuses all commands: %s", reason)
        self.release_all(reason)
        for controller in self.controllers.values():
            controller.start(self._measured.value[controller.dofs])

    def _expire(self, ended: LeaseEnded) -> None:
        """Handle a lease that has timed out.

        An owner that had claimed its joints has to claim them again: its next commands may be of requests long ago.
        """
        if ended.claimed or self._silence == "stop":
            self.claims.bar(ended.owner, "its lease has timed out")
        if self._silence == "keep":
            return
        self._take_over(ended)
        logger.warning(
            "the lease of '%s' has timed out; %d joints are free now",
            ended.owner,
            sum(int(mask.sum()) for mask in ended.joints.values()),
        )
        if self._silence == "damp":
            self.emergency_stop(f"the lease of '{ended.owner}' has timed out")

    def _take_over(self, ended: LeaseEnded) -> None:
        """Hold the joints of a lease that has ended."""
        for name, joints in ended.joints.items():
            self._rest(self.controllers[name], np.flatnonzero(joints))

    def _rest(self, controller: LowerLevelController, joints: np.ndarray) -> None:
        """Hold joints of a controller, indices, in the fields that have no owner."""
        free = {field: self.claims.unclaimed(controller.name, field, joints) for field in JOINT_FIELDS}
        if unsprung := controller.hold(self._measured.value[controller.dofs], free):
            logger.warning(
                "%s: no commands any longer, and no spring to hold them; their dampers brake them", ", ".join(unsprung)
            )
