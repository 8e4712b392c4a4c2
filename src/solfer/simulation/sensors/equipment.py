"""The sensors of a robot, from the files of its bundle."""

from collections.abc import Collection, Sequence
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
        actuators: Springs of its joints; None: the motor side is not measured.
        contacts: Its contacts.
    """

    record: SensorsRecord = field(default_factory=SensorsRecord)
    actuators: Actuators | None = None
    contacts: tuple[ContactRecord, ...] = ()


def load_equipment(
    robot: str,
    joints: Sequence[str],
    sensors: SensorsRecord,
    actuators: FileRecord | None,
    contacts: FileRecord | None,
    elsewhere: Collection[str] = (),
) -> Equipment:
    """Load the equipment of the robot called `robot`.

    Args:
        robot: Key of the robot in its files.
        joints: Its moving joints, in the order of the model.
        sensors: Its sensors.
        actuators: File of its actuators.
        contacts: File of its contacts.
        elsewhere: Joints of other models of the robot; their actuators are left out.

    Raises:
        ConfigError, UnknownName: A file is wrong.
    """
    springs = None if actuators is None else Actuators.from_file(actuators.location, robot, joints, elsewhere)
    touching = () if contacts is None else read_contacts(contacts.location, robot)
    return Equipment(sensors, springs, touching)
