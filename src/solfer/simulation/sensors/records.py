"""Records of a robot's sensors: where they are mounted, how often they publish, and how well they measure."""

from typing import Annotated

from pydantic import Field

from solfer.config import Record
from solfer.config.records.bounds import NOISE, SEED, Bounds
from solfer.config.records.conventions import OffsetOrientationRecord, OffsetPositionRecord

_Bias = Annotated[float, Field(ge=-NOISE["le"], le=NOISE["le"])]
Bias = tuple[_Bias, _Bias, _Bias]
NO_BIAS = (0.0, 0.0, 0.0)

PUBLICATION: Bounds = {"ge": 0.01, "le": 1000.0}
"""Bounds of a rate of publication: above 0, at most that of the steps [Hz]."""


class Rates(Record):
    """Rates of publication in simulated time [Hz]; each is the rate of the steps divided by a whole number."""

    joints: float = Field(default=200.0, **PUBLICATION, description="joint states")
    base: float = Field(default=200.0, **PUBLICATION, description="pose and twist of a floating base")
    imu: float = Field(default=200.0, **PUBLICATION, description="inertial measurement unit")
    motors: float = Field(default=200.0, **PUBLICATION, description="motor side of the joints")
    contacts: float = Field(default=200.0, **PUBLICATION, description="wrenches of the contacts")


class JointNoiseRecord(Record):
    """Standard deviations of one sample of a joint state."""

    position: float = Field(default=0.0, **NOISE, description="[rad, m]")
    velocity: float = Field(default=0.0, **NOISE, description="[rad/s, m/s]")
    effort: float = Field(default=0.0, **NOISE, description="[Nm, N]")


class ImuNoiseRecord(Record):
    """Standard deviations of one sample of an inertial measurement unit, for each axis."""

    orientation: float = Field(default=0.0, **NOISE, description="[rad]")
    angular: float = Field(default=0.0, **NOISE, description="[rad/s]")
    acceleration: float = Field(default=0.0, **NOISE, description="[m/s^2]")


class ImuBiasRecord(Record):
    """Bias that an inertial measurement unit adds to each sample, in its own axes."""

    angular: Bias = Field(default=NO_BIAS, description="[rad/s]")
    acceleration: Bias = Field(default=NO_BIAS, description="[m/s^2]")


class ImuRecord(Record):
    """An inertial measurement unit."""

    link: str = Field(min_length=1, description="link with the sensor's frame")
    offset_position: OffsetPositionRecord | None = Field(
        default=None, description="where it really sits on the link (default: at its origin)"
    )
    offset_orientation: OffsetOrientationRecord | None = Field(
        default=None, description="how it is really turned on the link (default: as its frame)"
    )
    noise: ImuNoiseRecord = Field(default_factory=ImuNoiseRecord, description="standard deviations of one sample")
    bias: ImuBiasRecord = Field(default_factory=ImuBiasRecord, description="what is added to each sample")


class SensorsRecord(Record):
    """Sensors of a robot."""

    seed: int = Field(default=0, **SEED, description="seed of all noise; equal seeds give equal noise")
    rates: Rates = Field(default_factory=Rates, description="rates of publication")
    joint_noise: JointNoiseRecord = Field(default_factory=JointNoiseRecord, description="noise of joint states")
    imu: ImuRecord | None = Field(default=None, description="inertial measurement unit")
