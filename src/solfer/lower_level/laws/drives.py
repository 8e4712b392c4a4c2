"""Torques and speeds of a robot's drives, from all its controllers."""

from collections import Counter
from collections.abc import Collection, Sequence

import numpy as np

from solfer.errors import ModelError
from solfer.lower_level.gains.defaults import DRIVE_PERIOD
from solfer.lower_level.laws.controllers import ImpedanceController, LowerLevelController, VelocityController
from solfer.lower_level.laws.impedance import ImplicitImpedance
from solfer.lower_level.laws.springs import Springs, springs_of
from solfer.lower_level.laws.two_mass import TwoMassImpedance
from solfer.model.actuators import Actuators
from solfer.model.kinematics import Kinematics
from solfer.model.neutral_posture import neutral_posture


class Drives:
    """Computes torques of the joints on springs and speeds of those on motors.

    Args:
        kinematics: Model of the robot, with its floating base if it has one.
        controllers: Controllers that together have every actuated joint exactly once.
        passive: Joints without a drive, whose torques stay zero.
        actuators: Springs between motors and joints, and the motors; None: all joints are rigid.
        posture: Position for which joints with two masses are chosen, shape (model size,); None: `neutral_posture`.

    Attributes:
        torque: Torques on the joints in the newest `update`, for `speed_dofs` friction of the motor alone, shape
            (model size,) [Nm, N].
        torque_dofs: DoFs in the model that are driven by a torque: also those of a VelocityController with two masses.
        speed: Speeds of the newest `update` of the joints in `speed_dofs` [rad/s].
        speed_dofs: DoFs in the model that are driven by a speed.

    Raises:
        ModelError: Two controllers have the same name, or a joint is in two of them, or in none.
    """

    def __init__(
        self,
        kinematics: Kinematics,
        controllers: Sequence[LowerLevelController],
        passive: Collection[str],
        actuators: Actuators | None,
        posture: np.ndarray | None,
    ):
        # imported here: its compiler takes a while to load
        from solfer.lower_level.laws import kernel
        from solfer.numerics.blocks import MemoryBlock

        _check_joints(kinematics, controllers, passive)
        impedances = [item for item in controllers if isinstance(item, ImpedanceController)]
        motors = [item for item in controllers if isinstance(item, VelocityController)]
        springs = springs_of(kinematics, actuators, posture, dt=DRIVE_PERIOD)
        moved = _dofs(impedances)
        held = _dofs(motors)
        swinging = held[springs.two_mass[held]] if springs else held[:0]
        self.torque_dofs, self.speed_dofs = np.concatenate((moved, swinging)), np.setdiff1d(held, swinging)
        self._law = _law(kinematics, self.torque_dofs, springs, posture=posture)
        self._limits = kinematics.effort_limit
        self._law.damping[swinging] = 1e7  # [Nms/rad], with which a motor holds its speed
        self.torque = self._law.torque
        self.speed = np.zeros(len(self.speed_dofs))
        self._controllers = controllers
        self._block = MemoryBlock(
            kernel.DRIVES,
            size=kinematics.size,
            table=self._law.table,
            controller_count=len(controllers),
            controller_addresses=np.array([item.block.address for item in controllers]),
            speed_count=len(self.speed),
            speed_dofs=self.speed_dofs,
            speed=self.speed,
        )
        self._collect = kernel.collect

    @property
    def two_mass(self) -> TwoMassImpedance | None:
        """Motors and springs of the joints; None: no joint has a spring."""
        return self._law if isinstance(self._law, TwoMassImpedance) else None

    def place(self, q: np.ndarray) -> None:
        """Put all motors where the joints are, q of shape (model size,), at rest: the robot was put there."""
        self._law.place(q)

    def power(self, dof: int, on: bool) -> None:
        """Switch the power of a drive on a torque on or off; without it, its motor has friction and inertia alone."""
        if dof in self.torque_dofs:
            self._law.limit(dof, float(self._limits[dof]) if on else 0.0)

    def rest(self) -> None:
        """Set torques and speeds to zero until the next `update`."""
        self.torque[:] = 0.0
        self.speed[:] = 0.0

    def update(self, q: np.ndarray, v: np.ndarray, dt: float, factor: float) -> None:
        """Compute `torque` and `speed` for one step.

        Args:
            q: Position at the begin of the step, shape (model size,).
            v: Velocity at the begin of the step, shape (model size,).
            dt: Duration of the step [s].
            factor: Factor of springs and feed-forward torques, from 0 to 1.
        """
        self._collect(self._block.address, factor)
        self._law.update(q, v, dt)


def _dofs(controllers: Sequence[LowerLevelController]) -> np.ndarray:
    empty = np.zeros(0, dtype=np.intp)
    return np.concatenate([empty, *(controller.dofs for controller in controllers)])


def _law(
    kinematics: Kinematics, dofs: np.ndarray, springs: Springs | None, posture: np.ndarray | None
) -> ImplicitImpedance:
    """Make the law of the DoFs that are driven by torques."""
    effort_limit = np.zeros(kinematics.size)
    effort_limit[dofs] = kinematics.effort_limit[dofs]
    limits = effort_limit, kinematics.velocity_limit
    if springs is None:
        return ImplicitImpedance(kinematics, *limits)
    return TwoMassImpedance(
        kinematics,
        limits,
        springs,
        posture=neutral_posture(kinematics) if posture is None else posture,
        dt=DRIVE_PERIOD,
    )


def _check_joints(
    kinematics: Kinematics, controllers: Sequence[LowerLevelController], passive: Collection[str]
) -> None:
    names = Counter(controller.name for controller in controllers)
    if any(count > 1 for count in names.values()):
        raise ModelError(
            f"controllers of the same name: {', '.join(n for n, count in names.items() if count > 1)}",
            expected="a name of its own for each controller",
        )
    owners: dict[str, list[str]] = {}
    for controller in controllers:
        for joint in controller.joints:
            owners.setdefault(joint, []).append(controller.name)
    for joint, owner in owners.items():
        if len(owner) > 1:
            raise ModelError(f"joint '{joint}' is in the controllers {' and '.join(owner)}", expected="one controller")
    base = 0 if kinematics.base is None else 6
    free = [name for name in kinematics.dofs[base:] if name not in owners and name not in passive]
    if free:
        raise ModelError(
            f"joints without a controller: {', '.join(free)}",
            expected="every joint in a controller; an impedance controller holds joints without commands",
        )
