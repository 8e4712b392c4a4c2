"""The sensors of a robot, from the files of its bundle."""

from dataclasses import dataclass, field

from solfer.config import FileRecord
from solfer.model.actuators import Actuators
from solfer.model.contacts import ContactRecord, read_contacts
from solfer.simulation.sensors.records import SensorsRecord


@dataclass(frozen=True)
class Equipment:
    """The sensors of a robot, and what they measure.

    Attributes:
        record: Its sensors.
        actuators: Springs and friction of its joints; None: the motor side is not measured.
        contacts: Its contacts.
    """

    record: SensorsRecord = field(default_factory=SensorsRecord)
    actuators: Actuators | None = None
    contacts: tuple[ContactRecord, ...] = ()


def load_equipment(
    robot: str,
    sensors: SensorsRecord,
    actuators: Actuators | None,
    contacts: FileRecord | None,
) -> Equipment:
    """Load the equipment of the robot called `robot`.

    Args:
        robot: Key of the robot in its files.
        sensors: Its sensors.
        actuators: Its actuators.
        contacts: File of its contacts.

    Raises:
        ConfigError, UnknownName: A file is wrong.
    """
    touching = () if contacts is None else read_contacts(contacts.location, robot)
    return Equipment(sensors, actuators, touching)
