"""All controllers of a robot, and what its drives have to do next."""

import logging
from collections import Counter
from collections.abc import Sequence

import numpy as np

from solfer.errors import CommandRefused, ModelError, UnknownName
from solfer.lower_level.claims import Claims, Ended, Wanted
from solfer.lower_level.controller import Controller, ImpedanceController, VelocityController
from solfer.lower_level.emergency import EmergencyStop
from solfer.lower_level.impedance import ImplicitImpedance
from solfer.lower_level.records import LowerLevelRecord
from solfer.model.kinematics import Kinematics
from solfer.pipes.messages import JointMessage

logger = logging.getLogger(__name__)

SENDERS = 64
"""Senders whose refused commands are counted one by one."""

OTHERS = "others"


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
        refusals: Number of refused commands of each sender.
        torque: Torques of the newest `update`, zero where a VelocityController rules, shape (model size,) [Nm, N].
        torque_dofs: DoFs in the model that take a torque.
        speed: Speeds of the newest `update` of the joints in `speed_dofs` [rad/s].
        speed_dofs: DoFs in the model that take a speed.

    Raises:
        ModelError: A joint is in two controllers, or in none.
    """

    def __init__(self, kinematics: Kinematics, controllers: Sequence[Controller],
                 record: LowerLevelRecord | None = None, robot: str = ""):
        self.controllers = {controller.name: controller for controller in controllers}
        _check_joints(kinematics, controllers)
        record = record or LowerLevelRecord()
        self.robot, self._silence = robot, record.silence
        self.claims = Claims({controller.name: controller.joints for controller in controllers}, record.lease)
        self.emergency = EmergencyStop(record.fade)
        self.refusals: Counter[str] = Counter()
        springs = [item for item in controllers if isinstance(item, ImpedanceController)]
        motors = [item for item in controllers if isinstance(item, VelocityController)]
        self.torque_dofs, self.speed_dofs = _dofs(springs), _dofs(motors)
        effort_limit = np.zeros(kinematics.size)
        effort_limit[self.torque_dofs] = kinematics.effort_limit[self.torque_dofs]
        self._law = ImplicitImpedance(kinematics, effort_limit, kinematics.velocity_limit)
        self._measured = np.zeros(kinematics.size)
        self.torque = self._law.torque
        self.speed = np.zeros(len(self.speed_dofs))
        self._copies = [(target, source, item.dofs) for item in springs for target, source in (
            (self._law.position, item.target), (self._law.velocity, item.velocity),
            (self._law.effort, item.applied_effort), (self._law.stiffness, item.stiffness),
            (self._law.damping, item.damping))]
        self._motors = motors

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
        except CommandRefused:
            known = message.sender in self.refusals or len(self.refusals) < SENDERS
            self.refusals[message.sender if known else OTHERS] += 1
            raise

    def claim(self, owner: str, wanted: Sequence[Wanted]) -> None:
        """Give joints to an owner, all or none; see `Claims.claim`.

        Raises:
            ClaimRefused: Somebody else has one of them.
            CommandRefused: A controller is stopped, or the emergency stop is tripped.
        """
        if self.emergency:
            raise CommandRefused(f"'{owner}' cannot claim joints: {self.emergency.reason}")
        for item in wanted:
            if not self.controllers[item.controller].running:
                raise CommandRefused(f"'{owner}' cannot claim joints: controller '{item.controller}' is stopped",
                                     expected="a start by lower_level/switch")
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
        """Forget all commands and claims, and hold the position q of the model's DoFs, shape (model size,)."""
        self._measured[:] = q
        for owner in self.claims.owners():
            self.claims.release(owner)
        for controller in self.controllers.values():
            controller.start(q[controller.dofs])
        self.torque[:], self.speed[:] = 0.0, 0.0

    def update(self, q: np.ndarray, v: np.ndarray, dt: float) -> tuple[np.ndarray, np.ndarray]:
        """Compute `torque` and `speed` for the step of `dt` [s] that begins at q, v, shape (model size,)."""
        self._measured[:] = q
        for ended in self.claims.advance(dt):
            self._fall_silent(ended)
        for controller in self.controllers.values():
            controller.advance(dt)
        for target, source, dofs in self._copies:
            target[dofs] = source
        if self.emergency:
            self.emergency.advance(dt)
            self._law.stiffness *= self.emergency.factor
            self._law.effort *= self.emergency.factor
        begin = 0
        for motor in self._motors:
            end = begin + len(motor.joints)
            self.speed[begin:end] = motor.velocity
            begin = end
        return self._law.update(q, v, dt), self.speed

    def _accept(self, target: Controller, message: JointMessage) -> None:
        if self.emergency:
            self.claims.bar(message.sender, self.emergency.reason)
            raise CommandRefused(self.emergency.reason, where=f"command of '{message.sender}'",
                                 expected="lower_level/reset_emergency_stop")
        indices, given = target.check(message)
        names, modes = tuple(message.names), tuple(given)
        if not self.claims.renew(message.sender, target.name, names, modes):
            self.claims.take(message.sender, names, Wanted(target.name, indices, modes))
        target.apply(indices, given)

    def _fall_silent(self, ended: Ended) -> None:
        if self._silence == "keep":
            return
        self._rest(ended)
        logger.warning("'%s' has fallen silent: %d joints are free", ended.owner,
                       sum(int(mask.sum()) for mask in ended.joints.values()))
        if self._silence == "stop":
            self.claims.bar(ended.owner, "it has fallen silent", for_ever=True)
        elif self._silence == "damp":
            self.emergency_stop(f"'{ended.owner}' has fallen silent")

    def _rest(self, ended: Ended) -> None:
        for controller, joints in ended.joints.items():
            self.controllers[controller].rest(joints)


def _dofs(controllers: Sequence[Controller]) -> np.ndarray:
    empty = np.zeros(0, dtype=np.intp)
    return np.concatenate([empty, *(controller.dofs for controller in controllers)])


def _check_joints(kinematics: Kinematics, controllers: Sequence[Controller]) -> None:
    names = Counter(controller.name for controller in controllers)
    if any(count > 1 for count in names.values()):
        raise ModelError(f"controllers of the same name: {', '.join(n for n, count in names.items() if count > 1)}")
    owners: dict[str, list[str]] = {}
    for controller in controllers:
        for joint in controller.joints:
            owners.setdefault(joint, []).append(controller.name)
    for joint, owner in owners.items():
        if len(owner) > 1:
            raise ModelError(f"joint '{joint}' is in the controllers {' and '.join(owner)}", expected="one controller")
    base = 0 if kinematics.base is None else 6
    free = [name for name in kinematics.dofs[base:] if name not in owners]
    if free:
        raise ModelError(f"joints without a controller: {', '.join(free)}",
                         expected="every joint in a controller; an impedance controller holds those that nobody moves")
