"""Record of a robot's bundle: the file that names everything that belongs to one robot."""

from typing import Annotated, Literal

from pydantic import Field

from solfer.config import FileRecord, Record
from solfer.config.records.bounds import Name
from solfer.lower_level.records import JointControllerRecord, LowerLevelRecord
from solfer.simulation.sensors.records import SensorsRecord
from solfer.simulation.world.records import DEFAULT_FRICTION, FRICTION, GROUND_FRICTION


class PartRecord(Record):
    """A part of the robot that can be controlled as a robot of its own."""

    at: Name = Field(description="link above the cut")
    keep: Literal["upper", "lower"] = Field(description="what stays of the robot")


class StartRecord(Record):
    """How a simulation begins."""

    state: Name = Field(description="named state of the SRDF")


class FrictionRecord(Record):
    """Friction coefficients; Bullet multiplies those of the two bodies that touch."""

    default: float = Field(default=DEFAULT_FRICTION, **FRICTION, description="of a link of the robot")
    groups: dict[str, Annotated[float, Field(**FRICTION)]] = Field(
        default_factory=dict, description="of the links of a group of the SRDF"
    )
    ground: float = Field(default=GROUND_FRICTION, **FRICTION, description="of the ground")


class BundleRecord(Record):
    """A robot: its files, its controllers, and how it is simulated. Paths are relative to the bundle's file."""

    name: Name = Field(description="name of the robot")
    urdf: FileRecord = Field(description="model")
    srdf: FileRecord | None = Field(default=None, description="groups and named states")
    contacts: FileRecord | None = Field(default=None, description="contact points")
    actuators: FileRecord | None = Field(default=None, description="actuators")
    gains: FileRecord | None = Field(default=None, description="default gains of the impedance controllers")
    floating_base: bool | None = Field(default=None, description="whether the base floats; default: as in the URDF")
    parts: dict[str, PartRecord] = Field(default_factory=dict, description="parts by name")
    start: StartRecord | None = Field(
        default=None, description="how a simulation begins; default: `standing`, else the first state, else zero"
    )
    controllers: dict[str, JointControllerRecord] = Field(default_factory=dict, description="lower-level controllers")
    lower_level: LowerLevelRecord = Field(default_factory=LowerLevelRecord, description="how it defends the robot")
    friction: FrictionRecord = Field(default_factory=FrictionRecord, description="friction of the robot and the ground")
    sensors: SensorsRecord = Field(default_factory=SensorsRecord, description="what the robot measures with")

    def with_perfect_sensors(self) -> "BundleRecord":
        """Return the robot with sensors without errors and without delay, for whom these are not the subject."""
        return self.model_copy(update={"sensors": self.sensors.perfect()})
