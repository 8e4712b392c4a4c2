"""All controllers of a robot, who may command them, and the emergency stop."""

import logging
from collections.abc import Sequence

import numpy as np

from solfer.errors import CommandRefused, Suspended, UnknownName
from solfer.lower_level.claims import Claims, Ended, Wanted
from solfer.lower_level.controller import Controller
from solfer.lower_level.drives import Drives
from solfer.lower_level.emergency import EmergencyStop
from solfer.lower_level.records import LowerLevelRecord
from solfer.lower_level.refusals import Refusals
from solfer.model.kinematics import Kinematics
from solfer.pipes.messages import JointMessage

logger = logging.getLogger(__name__)

RELEASES = "a call of lower_level/reset_emergency_stop, which releases it"
STARTS = "a start by lower_level/switch"


class LowerLevel:
    """Accepts commands for the controllers of a robot and computes torques and speeds from them.

    Args:
        kinematics: Model of the robot, with its floating base if it has one.
        controllers: Controllers that together have every actuated joint exactly once.
        record: How it defends itself.
        robot: Name of the robot: the key of its part in gains files; empty: they have no such key.

    Attributes:
        controllers: Controllers by name.
        claims: Who commands which joints.
        emergency: The emergency stop; tripped by `emergency_stop` only.
        refusals: Number of refused commands of each sender, and why they were refused.
        drives: What the drives have to do next.
        starts: How often it forgot all commands and claims.

    Raises:
        ModelError: A joint is in two controllers, or in none.
    """

    def __init__(self, kinematics: Kinematics, controllers: Sequence[Controller],
                 record: LowerLevelRecord | None = None, robot: str = ""):
        self.controllers = {controller.name: controller for controller in controllers}
        self.drives = Drives(kinematics, controllers)
        record = record or LowerLevelRecord()
        self.robot, self._silence = robot, record.silence
        self.claims = Claims({controller.name: controller.joints for controller in controllers}, record.lease)
        self.emergency = EmergencyStop(record.fade)
        self.refusals = Refusals()
        self._measured, self.starts = np.zeros(kinematics.size), 0

    @property
    def refused(self) -> int:
        """Number of commands that were refused."""
        return self.refusals.total()

    def controller(self, name: str) -> Controller:
        """The controller `name`.

        Raises:
            UnknownName: There is no such controller.
        """
        if name not in self.controllers:
            raise UnknownName("controller", name, self.controllers)
        return self.controllers[name]

    def accept(self, controller: str, message: JointMessage) -> None:
        """Apply a command to a controller.

        Raises:
            UnknownName: There is no such controller.
            ClaimRefused: Somebody else commands a joint of it.
            CommandRefused: The command is wrong, or no command is taken at present. Nothing of it was applied.
        """
        target = self.controller(controller)
        try:
            self._accept(target, message)
        except CommandRefused as error:
            self.refusals.note(message.sender, error)
            raise

    def claim(self, owner: str, wanted: Sequence[Wanted]) -> None:
        """Give joints to an owner, all or none; see `Claims.claim`.

        Raises:
            ClaimRefused: Somebody else has one of them.
            Suspended: A controller is stopped, or the emergency stop is tripped.
        """
        if self.emergency:
            raise Suspended(self.emergency.reason, where=f"claim of '{owner}'", expected=RELEASES)
        for item in wanted:
            if not self.controllers[item.controller].running:
                raise Suspended(f"controller '{item.controller}' is stopped", where=f"claim of '{owner}'",
                                expected=STARTS)
        self.claims.claim(owner, wanted)

    def release(self, owner: str) -> None:
        """End the lease of an owner: its wheels stop, its positions hold. What it sends late is refused."""
        self._rest(self.claims.release(owner))
        self.claims.bar(owner, "it has released its joints")

    def switch(self, start: Sequence[str], stop: Sequence[str]) -> None:
        """Start and stop controllers, all or none. A stopped one holds its joints and refuses commands.

        Raises:
            UnknownName: There is no such controller.
            CommandRefused: A controller stands in both lists, runs already, or is stopped already.
        """
        for name in (*start, *stop):
            self.controller(name)
        for name in start:
            if name in stop:
                raise CommandRefused(f"controller '{name}' is to be started and stopped")
        for names, running in ((start, True), (stop, False)):
            for name in names:
                if self.controllers[name].running is running:
                    raise CommandRefused(f"controller '{name}' {'runs' if running else 'is stopped'} already")
        for name in start:
            self.controllers[name].running = True
        for name in stop:
            self.controllers[name].running = False
            self.controllers[name].rest()
            self.claims.clear(name)

    def emergency_stop(self, reason: str) -> None:
        """Refuse all commands, let springs and feed-forward torques fade out, stop the wheels. Ends by reset only."""
        self.emergency.trip(f"emergency stop: {reason}")
        logger.error("%s", self.emergency.reason)
        for owner in self.claims.owners():
            self.claims.release(owner)
            self.claims.bar(owner, self.emergency.reason)
        for controller in self.controllers.values():
            controller.rest()

    def reset_emergency_stop(self) -> None:
        """Hold the measured position again, with the default gains. Who has commanded before has to claim anew."""
        if self.emergency:
            logger.warning("the emergency stop is reset")
            self.emergency.reset()
            self.start(self._measured)

    def start(self, q: np.ndarray) -> None:
        """Forget all commands and claims, and hold the position q of the model's DoFs, shape (model size,).

        Whoever had a claim has to claim anew: what it sends was meant for another position. Who has no name commands
        from within this process, and knows of the start.
        """
        self._measured[:] = q
        self.starts += 1
        for owner in self.claims.owners():
            self.claims.release(owner)
            if owner:
                self.claims.bar(owner, "the controllers have started anew")
        for controller in self.controllers.values():
            controller.start(q[controller.dofs])
        self.drives.rest()

    def update(self, q: np.ndarray, v: np.ndarray, dt: float) -> tuple[np.ndarray, np.ndarray]:
        """Torques and speeds of the drives for the step of `dt` [s] that begins at q, v, shape (model size,).

        Returns:
            `Drives.torque` and `Drives.speed`.
        """
        self._measured[:] = q
        for ended in self.claims.advance(dt):
            self._fall_silent(ended)
        for controller in self.controllers.values():
            controller.advance(dt)
        self.emergency.advance(dt)
        self.drives.update(q, v, dt, self.emergency.factor)
        return self.drives.torque, self.drives.speed

    def _accept(self, target: Controller, message: JointMessage) -> None:
        if self.emergency:
            self.claims.bar(message.sender, self.emergency.reason)
            raise Suspended(self.emergency.reason, where=f"command of '{message.sender}'", expected=RELEASES)
        if not target.running:
            raise Suspended(f"controller '{target.name}' is stopped", where=f"command of '{message.sender}'",
                            expected=STARTS)
        indices, given = target.check(message)
        names, modes = tuple(message.names), tuple(given)
        if not self.claims.renew(message.sender, target.name, names, modes):
            self.claims.take(message.sender, names, Wanted(target.name, indices, modes))
        target.apply(indices, given)

    def _fall_silent(self, ended: Ended) -> None:
        if self._silence == "keep":
            return
        self._rest(ended)
        logger.warning("'%s' has fallen silent; of its joints are free now: %d", ended.owner,
                       sum(int(mask.sum()) for mask in ended.joints.values()))
        if self._silence == "stop":
            self.claims.bar(ended.owner, "it has fallen silent", for_ever=True)
        elif self._silence == "damp":
            self.emergency_stop(f"'{ended.owner}' has fallen silent")

    def _rest(self, ended: Ended) -> None:
        for controller, joints in ended.joints.items():
            self.controllers[controller].rest(joints)
