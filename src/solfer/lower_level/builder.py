"""Builds a robot's lower level from its records."""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from solfer.errors import ModelError, UnknownName
from solfer.lower_level.gains.defaults import default_gains
from solfer.lower_level.laws.controllers import ImpedanceController, LowerLevelController, VelocityController
from solfer.lower_level.laws.limits import JointLimits
from solfer.lower_level.lower_level import LowerLevel
from solfer.lower_level.records import ALL, GainRecord, JointControllerRecord, LowerLevelRecord
from solfer.model.actuators import Actuators
from solfer.model.kinematics import Kinematics


def build_lower_level(
    kinematics: Kinematics,
    records: Mapping[str, JointControllerRecord],
    groups: Mapping[str, Iterable[str]],
    gains: Mapping[str, GainRecord] | None = None,
    record: LowerLevelRecord | None = None,
    *,
    posture: np.ndarray | None = None,
    actuators: Actuators | None = None,
) -> LowerLevel:
    """Build the controllers of a robot; without any record one impedance controller called `joints` holds it.

    Args:
        kinematics: Model of the robot.
        records: Controllers by name.
        groups: Names of the joints of each group.
        gains: Default gains by joint; without them see `default_gains`.
        record: Settings of the lower level's defences.
        posture: Positions of all DoFs for which missing gains are computed, and joints with two masses are chosen,
            shape (kinematics.size,).
        actuators: Joints with a drive, springs between motors and joints, and the motors' inertia; None: all joints
            but followers have one, and are rigid.

    Raises:
        UnknownName: A group that does not exist.
        ModelError: A joint is in two controllers or in none, or a joint of an impedance controller has no gains.
    """
    records = records or {"joints": JointControllerRecord(type="impedance")}
    passive = kinematics.followers.names if actuators is None else actuators.passive
    base = 0 if kinematics.base is None else 6
    driven = [joint for joint in kinematics.dofs[base:] if joint not in passive]
    if not driven:
        raise ModelError("no joint has a drive", expected="at least one joint among the actuators")
    return LowerLevel(
        kinematics,
        [
            _controller(name, item, kinematics, driven=driven, groups=groups, gains=gains, posture=posture)
            for name, item in records.items()
        ],
        record,
        passive=passive,
        actuators=actuators,
        posture=posture,
    )


def _controller(
    name: str,
    record: JointControllerRecord,
    kinematics: Kinematics,
    driven: Sequence[str],
    groups: Mapping[str, Iterable[str]],
    *,
    gains: Mapping[str, GainRecord] | None,
    posture: np.ndarray | None,
) -> LowerLevelController:
    members = _members(record.group, record.where("group"), driven, groups=groups)
    left_out = _members(record.except_, record.where("except"), driven, groups=groups) if record.except_ else set()
    joints = [joint for joint in driven if joint in members and joint not in left_out]
    if not joints:
        raise ModelError(
            f"controller '{name}' has no joint that moves",
            where=record.where("group"),
            expected="a group with a joint that has a drive",
        )
    limits = JointLimits.from_model(kinematics, joints, record.where())
    if record.type == "velocity":
        return VelocityController(name, limits, record.timeout)
    if gains is None:
        return ImpedanceController(name, limits, *default_gains(kinematics, limits.dofs, posture), record.timeout)
    missing = [joint for joint in joints if joint not in gains]
    if missing:
        raise ModelError(
            f"no gains for the joints {', '.join(missing)} of controller '{name}'",
            where=record.where(),
            expected="gains for each joint of the group, or no file of gains",
        )
    return ImpedanceController(
        name,
        limits,
        [gains[joint].stiffness for joint in joints],
        damping=[gains[joint].damping for joint in joints],
        timeout=record.timeout,
    )


def _members(group: str, where: str, moving: Iterable[str], groups: Mapping[str, Iterable[str]]) -> set[str]:
    if group == ALL:
        return set(moving)
    if group not in groups:
        raise UnknownName("group", group, (ALL, *groups), where=where)
    return set(groups[group])
