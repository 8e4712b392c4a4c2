"""Everything that belongs to one robot, loaded from its bundle."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from solfer.config import read
from solfer.errors import UnknownName
from solfer.lower_level import GainsRecord, LowerLevel, build_lower_level
from solfer.model.description import Description
from solfer.model.kinematics import Kinematics
from solfer.model.semantics import Group, Semantics
from solfer.simulation.friction import Friction
from solfer.simulation.records import BundleRecord, FrictionRecord
from solfer.simulation.sensors import Equipment, load_equipment


@dataclass(frozen=True)
class Bundle:
    """A robot as the simulation takes it; see `Simulation` for the meaning of the parts."""

    description: Description
    kinematics: Kinematics
    lower_level: LowerLevel
    states: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    start: str | None = None
    friction: Friction = Friction()
    equipment: Equipment = Equipment()


def load_bundle(path: str | Path, description_text: str | None = None) -> Bundle:
    """Load the bundle of a robot.

    Args:
        path: The bundle's file.
        description_text: URDF that is used instead of the bundle's.

    Raises:
        ConfigError, ModelError, UnknownName: A file of the bundle is wrong.
    """
    record = read(path, BundleRecord)
    description = (Description.from_file(record.urdf.location) if description_text is None
                   else Description.from_text(description_text, "URDF"))
    semantics = None if record.srdf is None else Semantics.from_file(record.srdf.location, description)
    groups = {} if semantics is None else semantics.groups
    states = {} if semantics is None else semantics.states
    kinematics = Kinematics(description, record.floating_base)
    gains = None if record.gains is None else read(record.gains.location, GainsRecord, (record.name,)).gains
    lower_level = build_lower_level(kinematics, record.controllers,
                                    {name: group.joints for name, group in groups.items()}, gains,
                                    record.lower_level, record.name)
    start = None if record.start is None else record.start.state
    if start is not None and start not in states:
        raise UnknownName("state", start, states, where=record.start.where("state"))
    return Bundle(description, kinematics, lower_level, states, start,
                  _friction(record.friction, description, groups), _equipment(record, kinematics))


def _equipment(record: BundleRecord, kinematics: Kinematics) -> Equipment:
    """Sensors of the robot; its files may tell of joints that the model in use does not have."""
    joints = kinematics.dofs[0 if kinematics.base is None else 6:]
    whole = Description.from_file(record.urdf.location).joints
    return load_equipment(record.name, joints, record.sensors, record.actuators, record.contacts, whole)


def _friction(record: FrictionRecord, description: Description, groups: Mapping[str, Group]) -> Friction:
    """Friction of single links from that of groups: the links that the joints of a group carry."""
    links: dict[str, float] = {}
    for name, value in record.groups.items():
        if name not in groups:
            raise UnknownName("group", name, groups, where=record.where("groups", name))
        joints = (description.joints[joint] for joint in groups[name].joints if joint in description.joints)
        links |= {joint.child: value for joint in joints}
    return Friction(record.default, links, record.ground)
