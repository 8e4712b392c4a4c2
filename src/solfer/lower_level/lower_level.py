"""All controllers of a robot, and what its drives have to do next."""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from solfer.errors import ModelError, UnknownName
from solfer.lower_level.controller import Controller, ImpedanceController, VelocityController
from solfer.lower_level.impedance import ImplicitImpedance
from solfer.model.kinematics import Kinematics
from solfer.pipes.messages import JointMessage


class LowerLevel:
    """Accepts commands for the controllers of a robot and computes torques and speeds from them.

    Args:
        kinematics: Model of the robot, with its floating base if it has one.
        controllers: Controllers that together have every actuated joint exactly once.

    Attributes:
        controllers: Controllers by name.
        torque: Torques of the newest `update`, zero where a VelocityController rules, shape (model size,) [Nm, N].
        torque_dofs: DoFs in the model that take a torque.
        speed: Speeds of the newest `update` of the joints in `speed_dofs` [rad/s].
        speed_dofs: DoFs in the model that take a speed.

    Raises:
        ModelError: A joint is in two controllers, or in none.
    """

    def __init__(self, kinematics: Kinematics, controllers: Sequence[Controller]):
        self.controllers = {controller.name: controller for controller in controllers}
        _check_joints(kinematics, controllers)
        springs = [item for item in controllers if isinstance(item, ImpedanceController)]
        motors = [item for item in controllers if isinstance(item, VelocityController)]
        self.torque_dofs, self.speed_dofs = _dofs(springs), _dofs(motors)
        effort_limit = np.zeros(kinematics.size)
        effort_limit[self.torque_dofs] = kinematics.effort_limit[self.torque_dofs]
        self._law = ImplicitImpedance(kinematics, effort_limit, kinematics.velocity_limit)
        self.torque = self._law.torque
        self.speed = np.zeros(len(self.speed_dofs))
        self._copies = [(target, source, item.dofs) for item in springs for target, source in (
            (self._law.position, item.target), (self._law.velocity, item.velocity), (self._law.effort, item.effort),
            (self._law.stiffness, item.stiffness), (self._law.damping, item.damping))]
        self._motors = motors

    @property
    def refused(self) -> int:
        """Number of commands that were refused."""
        return sum(controller.refused for controller in self.controllers.values())

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
            CommandRefused: The command is wrong; nothing of it was applied.
        """
        self.controller(controller).accept(message)

    def start(self, q: np.ndarray) -> None:
        """Forget all commands and hold the position q of the model's DoFs, shape (model size,)."""
        for controller in self.controllers.values():
            controller.start(q[controller.dofs])
        self.torque[:], self.speed[:] = 0.0, 0.0

    def update(self, q: np.ndarray, v: np.ndarray, dt: float) -> tuple[np.ndarray, np.ndarray]:
        """Compute `torque` and `speed` for the step of `dt` [s] that begins at q, v, shape (model size,)."""
        for controller in self.controllers.values():
            controller.advance(dt)
        for target, source, dofs in self._copies:
            target[dofs] = source
        begin = 0
        for motor in self._motors:
            end = begin + len(motor.joints)
            self.speed[begin:end] = motor.velocity
            begin = end
        return self._law.update(q, v, dt), self.speed


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
