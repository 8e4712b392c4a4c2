"""Record of a mock of a robot's hardware: what lies between a simulated robot and its plugins."""

from typing import Literal

from pydantic import Field

from solfer.config import FileRecord, Record
from solfer.config.records.bounds import COORDINATE, SEED, Name
from solfer.config.records.conventions import OffsetOrientationRecord, OffsetPositionRecord
from solfer.simulation.sensors.kinds.joints import JointNoiseRecord


class DelayRecord(Record):
    """Times between one end and the other, in simulated time; whole steps of the simulation."""

    measurement: float = Field(default=0.0, ge=0.0, le=1.0, description="of measurements [s]")
    command: float = Field(default=0.0, ge=0.0, le=1.0, description="of commands to the controllers [s]")


class EncoderRecord(Record):
    """The encoder of a joint: `joint position = direction * reading + zero`."""

    name: Name = Field(description="the hardware's name of the joint")
    direction: Literal[1, -1] = Field(description="1, or -1 where it counts against the model's joint")
    zero: float = Field(**COORDINATE, description="position of the model's joint at which it reads zero [rad, m]")


class MountRecord(Record):
    """How a sensor is really mounted, relative to the frame of its link in the URDF."""

    offset_position: OffsetPositionRecord | None = Field(default=None, description="where it sits on the link")
    offset_orientation: OffsetOrientationRecord | None = Field(
        default=None, description="how it is oriented on the link"
    )


class HardwareRecord(Record):
    """A mock: a robot of the simulation, and how its joints look from outside. Paths are relative to the file."""

    robot: FileRecord = Field(description="the robot's bundle")
    gains: FileRecord | None = Field(default=None, description="gains of its drives (default: the bundle's)")
    delay: DelayRecord = Field(default_factory=DelayRecord, description="delays in both directions")
    seed: int = Field(default=0, **SEED, description="seed of all noise; equal seeds give equal noise")
    joint_noise: JointNoiseRecord = Field(default_factory=JointNoiseRecord, description="noise of joint states")
    imu: MountRecord | None = Field(default=None, description="mounting of the IMU (default: as in the URDF)")
    joints: dict[str, EncoderRecord] = Field(description="encoders by the model's joints, in the order of the hardware")
