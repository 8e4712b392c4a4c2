"""Descriptions of a robot, read from the ROS parameters or files that its configuration names."""

import json
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any, Protocol, TypeVar

from solfer.config import Configuration, Record, TextRecord
from solfer.config.loading.load import misspelt_key
from solfer.config.records.record import parse
from solfer.config.yaml.compose import compose
from solfer.config.yaml.files import opened
from solfer.config.yaml.nodes import Mark
from solfer.config.yaml.problems import Problems
from solfer.errors import ConfigError, UnknownName, nearest
from solfer.model import Actuators, Description, Semantics
from solfer.model.actuators import ActuatorsRecord
from solfer.model.contacts import ContactRecord, ContactsRecord
from solfer.model.contacts import read_contacts as contacts_of_file

RecordT = TypeVar("RecordT", bound=Record)


class Outside(Protocol):
    """The part of a Middleware that the builder uses."""

    def parameter(self, name: str, where: str = "") -> Any:
        """See `Middleware.parameter`."""

    def joint_order(self, topic: str, message: str, timeout: float, where: str = "") -> tuple[str, ...]:
        """See `Middleware.joint_order`."""

    def controller_joints(self, controller: str, timeout: float, where: str = "") -> tuple[str, ...]:
        """See `Middleware.controller_joints`."""

    def is_received(self, topic: str, message: str) -> bool:
        """See `Middleware.is_received`."""


def read_description(source: TextRecord, outside: Outside) -> Description:
    """Read the robot's description from a URDF.

    Raises:
        SolferError: The parameter or file is missing, or does not contain a URDF.
    """
    location = source.location
    if location is not None:
        return Description.from_file(location)
    return _described(_text(source, outside), _parameter(source))


@lru_cache(maxsize=8)
def _described(text: str, where: str) -> Description:
    """Read a URDF that several plugins of a process, or several models of one, may have."""
    return Description.from_text(text, where)


def read_semantics(
    source: TextRecord, outside: Outside, description: Description, others: Sequence[Description]
) -> Semantics:
    """Read groups and states from an SRDF; `others` are models with names that `description` does not have.

    Raises:
        SolferError: The parameter or file is missing, or does not contain an SRDF of the robot.
    """
    location = source.location
    if location is not None:
        return Semantics.from_file(location, description, others)
    return Semantics.from_text(_text(source, outside), description, _parameter(source), others)


def is_robot_read(configuration: Configuration) -> bool:
    """Whether the robot could be read; if not, the reason has been reported, and its name is not known."""
    robot = configuration.robot
    return robot is not None and (bool(robot.name) or _head_of_name(configuration).path[-1] != "name")


def require_robot(configuration: Configuration, path: Path) -> None:
    """Check that a file of actuators or contacts knows the configuration's robot.

    Raises:
        ConfigError: The file cannot be read, or the robot has no name.
        UnknownName: The file does not know it; the place is that of the name, whatever the file is.
    """
    known = [str(key) for key, _ in opened(path).node.items()]
    name = configuration.robot.name
    if name in known:
        return
    head = _head_of_name(configuration)
    misspelt = misspelt_key(configuration.tree)
    if misspelt is not None:
        raise misspelt
    if not name:
        raise ConfigError("the robot has no name", where=str(head), expected=f"`name`, one of {', '.join(known)}")
    among = "" if nearest(name, known) else f"one of {path}: {', '.join(known[:12])}"
    raise UnknownName("robot", name, known, where=str(head), expected=among)


def _head_of_name(configuration: Configuration) -> Mark:
    """Return where the key of the robot's name stands, or where it is missing."""
    return configuration.tree.nearest(("robot", "name")).head


def read_actuators(
    configuration: Configuration, outside: Outside, dofs: Sequence[str], others: Sequence[Description]
) -> Actuators:
    """Read actuators of the configuration's robot; those of joints that only `others` have are left out.

    Raises:
        SolferError: The parameter or file is missing, or does not fit the robot.
    """
    source = configuration.sources.actuators
    robot = configuration.robot.name
    elsewhere = {joint for other in others for joint in other.joints}
    location = source.location
    if location is not None:
        require_robot(configuration, location)
        return Actuators.from_file(location, robot, dofs, elsewhere)
    return Actuators.from_record(_part(source, outside, robot, what="actuators", kind=ActuatorsRecord), dofs, elsewhere)


def read_contacts(configuration: Configuration, outside: Outside) -> tuple[ContactRecord, ...]:
    """Read contacts of the configuration's robot.

    Raises:
        SolferError: The parameter or file is missing, or does not contain contacts of the robot.
    """
    source = configuration.sources.contacts
    robot = configuration.robot.name
    location = source.location
    if location is not None:
        require_robot(configuration, location)
        return contacts_of_file(location, robot)
    return tuple(_part(source, outside, robot, what="contacts", kind=ContactsRecord).contacts.values())


def _part(source: TextRecord, outside: Outside, robot: str, what: str, kind: type[RecordT]) -> RecordT:
    """Read the record below the robot's name in a parameter."""
    # a parameter is either the text of the file or its values as rosparam loads them; JSON is YAML
    value = _value(source, outside)
    problems = Problems()
    node = compose(value if isinstance(value, str) else json.dumps(value), _parameter(source), problems)
    part = node.get(robot)
    if part is None:
        raise ConfigError(
            f"there are no {what} of '{robot}' here", where=_parameter(source), expected=f"the key '{robot}'"
        )
    record = parse(part, kind, problems)
    problems.raise_if_any()
    return record


def _value(source: TextRecord, outside: Outside) -> Any:
    if source.parameter is None:
        raise ConfigError("neither a parameter nor a file", where=source.where(), expected="a parameter, or `file:`")
    return outside.parameter(source.parameter, source.where())


def _text(source: TextRecord, outside: Outside) -> str:
    value = _value(source, outside)
    if not isinstance(value, str):
        raise ConfigError(f"parameter '{source.parameter}' is not a text", where=source.where(), expected="XML")
    return value


def _parameter(source: TextRecord) -> str:
    return f"parameter {source.parameter}"
