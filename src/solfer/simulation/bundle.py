"""Everything that belongs to one robot, loaded from its bundle."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from solfer.config import FileRecord, read
from solfer.config.yaml.files import located
from solfer.errors import UnknownName
from solfer.lower_level import GainsRecord, JointControllerRecord, LowerLevel, build_lower_level
from solfer.model.actuators import Actuators
from solfer.model.kinematics import Kinematics
from solfer.model.srdf.semantics import Semantics
from solfer.model.urdf.description import Description
from solfer.model.urdf.fixed_base import warn_of_fixed_base
from solfer.model.urdf.unfit import check_masses, warn_of_unfit
from solfer.simulation.bundle_records import BundleRecord, FrictionRecord
from solfer.simulation.robot_body.postures import Postures
from solfer.simulation.sensors import Equipment, load_equipment
from solfer.simulation.world.records import Friction

URDF_SUFFIXES = (".urdf", ".xacro")
"""Ends of names of bare URDFs, in letters of any case."""


@dataclass(frozen=True)
class Bundle:
    """A robot as the simulation uses it.

    Attributes:
        description: The robot.
        kinematics: Its model.
        lower_level: Its controllers.
        states: Named states: joint positions by name. Joints that a state does not name are as in `start`.
        start: Name of the state in which a simulation begins, and which completes the others; None: the robot's neutral
            posture.
        friction: Friction of the robot and of the ground.
        equipment: What the robot measures with.
        groups: Links of the robot by the name of their group.
        lossless: Joints without the damping and friction of their URDF: an actuator with its own losses moves them.
    """

    description: Description
    kinematics: Kinematics
    lower_level: LowerLevel
    states: Mapping[str, Mapping[str, float]]
    start: str | None
    friction: Friction
    equipment: Equipment
    groups: Mapping[str, tuple[str, ...]]
    lossless: Collection[str] = ()


def find_robot(name: str) -> Path:
    """Find the bundle of a robot of this package, or the file itself.

    Raises:
        UnknownName: There is no robot of that name.
    """
    if "/" in name or name.lower().endswith((".yaml", *URDF_SUFFIXES)):
        return Path(name)
    folder = located("package://solfer/config/robots", ".")
    known = sorted(path.parent.name for path in folder.glob("*/robot.yaml"))
    if name not in known:
        raise UnknownName("robot", name, known)
    return folder / name / "robot.yaml"


def read_bundle(path: str | Path, srdf: str | Path | None = None, floating_base: bool | None = None) -> BundleRecord:
    """Read the file of a robot.

    Args:
        path: The robot's bundle, or a bare URDF (`.urdf`, or `.xacro`): then one `position_controller` has all joints.
        srdf: SRDF that is used instead of the bundle's.
        floating_base: Whether the base floats; None: as in the bundle, and without that as in the URDF.

    Raises:
        ConfigError: The bundle's file is wrong.
    """
    path = Path(path)
    if path.suffix.lower() in URDF_SUFFIXES:
        record = BundleRecord(
            name=path.stem,
            urdf=_file(path),
            controllers={"position_controller": JointControllerRecord(type="impedance")},
        )
    else:
        record = read(path, BundleRecord)
    given = {"srdf": None if srdf is None else _file(srdf), "floating_base": floating_base}
    return record.model_copy(update={key: value for key, value in given.items() if value is not None})


def load_bundle(robot: str | Path | BundleRecord, description_text: str | None = None) -> Bundle:
    """Load a robot.

    Args:
        robot: Its bundle, a record or a file, or its bare URDF; see `read_bundle`.
        description_text: URDF that is used instead of the bundle's.

    Raises:
        ConfigError, ModelError, UnknownName: A file of the bundle is wrong.
    """
    record = robot if isinstance(robot, BundleRecord) else read_bundle(robot)
    description = (
        Description.from_file(record.urdf.location)
        if description_text is None
        else Description.from_text(description_text, "URDF")
    )
    semantics = None if record.srdf is None else Semantics.from_file(record.srdf.location, description)
    groups = {} if semantics is None else semantics.groups
    states = {} if semantics is None else semantics.states
    warn_of_fixed_base(description, record.floating_base)
    kinematics = Kinematics(description, record.floating_base)
    check_masses(description, kinematics.base is not None)
    warn_of_unfit(description, kinematics.base is not None)
    actuators = _actuators(record, kinematics, description if description_text is None else None)
    if actuators is not None:
        kinematics.drive(actuators, rotors=False)
    gains = None if record.gains is None else read(record.gains.location, GainsRecord, (record.name,)).gains
    start = _start(record, states)
    joints = Postures(states, start, kinematics).positions_of()
    lower_level = build_lower_level(
        kinematics,
        record.controllers,
        {name: group.joints for name, group in groups.items()},
        gains=gains,
        record=record.lower_level,
        posture=np.concatenate([np.zeros(kinematics.size - len(joints)), joints]),  # a floating base at zero
        actuators=actuators,
    )
    lower_level.robot = record.name
    _allow_gains(record, lower_level)
    links = {  # those that the joints of a group carry
        name: tuple(description.joints[joint].child for joint in group.joints if joint in description.joints)
        for name, group in groups.items()
    }
    return Bundle(
        description,
        kinematics,
        lower_level,
        states=states,
        start=start,
        friction=_friction(record.friction, links),
        equipment=load_equipment(record.name, record.sensors, record.contacts),
        groups=links,
        lossless=() if actuators is None else actuators.names,
    )


def _allow_gains(record: BundleRecord, lower_level: LowerLevel) -> None:
    """Let gains be loaded from the folder of the bundle, and from those that it names."""
    if record.place() is not None:  # a bare URDF has no folder of its own
        lower_level.folders.add(record.folder() or ".")
    defence = record.lower_level
    for index, folder in enumerate(defence.gains_folders):
        where = defence.where("gains_folders", index)
        lower_level.folders.add(located(folder, defence.folder("gains_folders"), where), where)


def _actuators(record: BundleRecord, kinematics: Kinematics, whole: Description | None) -> Actuators | None:
    """Read the actuators of the moving joints; the file may have those of `whole` that the model in use lacks."""
    if record.actuators is None:
        return None
    joints = kinematics.dofs[0 if kinematics.base is None else 6 :]
    whole = whole or Description.from_file(record.urdf.location)
    return Actuators.from_file(record.actuators.location, record.name, joints, elsewhere=whole.joints)


def _file(path: str | Path) -> FileRecord:
    return FileRecord(file=str(Path(path).absolute()))


def _start(record: BundleRecord, states: Mapping[str, Mapping[str, float]]) -> str | None:
    """Choose the state in which a simulation begins; None: in the neutral posture."""
    if record.start is None:
        # the name that collections of robots have given to the state in which a robot stands
        return "standing" if "standing" in states else next(iter(states), None)
    if record.start.state not in states:
        raise UnknownName("state", record.start.state, states, where=record.start.where("state"))
    return record.start.state


def _friction(record: FrictionRecord, groups: Mapping[str, tuple[str, ...]]) -> Friction:
    """Compute the friction of single links from that of groups."""
    links: dict[str, float] = {}
    for name, value in record.groups.items():
        if name not in groups:
            raise UnknownName("group", name, groups, where=record.where("groups", name))
        links |= dict.fromkeys(groups[name], value)
    return Friction(record.default, links, record.ground)
