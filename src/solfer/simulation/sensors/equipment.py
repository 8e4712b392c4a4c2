"""The sensors of a robot, from the files of its bundle."""

from dataclasses import dataclass
from typing import Any

from solfer.config import FileRecord
from solfer.model.contacts import ContactRecord, read_contacts


@dataclass(frozen=True)
class Equipment:
    """The sensors of a robot, and what they measure.

    Attributes:
        record: Its sensors, a `SensorsRecord`.
        contacts: Its contacts.
    """

    record: Any
    contacts: tuple[ContactRecord, ...] = ()


def load_equipment(
    robot: str,
    sensors: Any,
    contacts: FileRecord | None,
) -> Equipment:
    """Load the equipment of the robot called `robot`.

    Args:
        robot: Key of the robot in its files.
        sensors: Its sensors, a `SensorsRecord`.
        contacts: File of its contacts.

    Raises:
        ConfigError, UnknownName: A file is wrong.
    """
    touching = () if contacts is None else read_contacts(contacts.location, robot)
    return Equipment(sensors, touching)
