"""Calibrations: names, signs and zeros of the hardware's joints.

They belong into the file of a system, so that `system` switches them together with everything else.
"""

from collections.abc import Iterable
from typing import Literal

from pydantic import Field

from solfer.config.records.bounds import COORDINATE, Name
from solfer.config.records.record import Record


class JointCalibrationRecord(Record):
    """One joint: `robot position = sign * (hardware position - offset)`."""

    name: Name | None = Field(default=None, description="the hardware's name (default: the robot's)")
    sign: Literal[1, -1] = Field(default=1, description="1, or -1 where the hardware counts the other way round")
    offset: float = Field(default=0.0, **COORDINATE, description="reading of the hardware at the robot's zero [rad, m]")


class CalibrationRecord(Record):
    """Joints of one kind of encoder, by the robot's names."""

    name: str = Field(description="name of the calibration")
    joints: dict[str, JointCalibrationRecord] = Field(description="the joints, by the robot's names")

    def hardware(self, joint: str) -> str:
        """Return the hardware's name of one of the `joints`."""
        return self.joints[joint].name or joint

    def robot(self, names: Iterable[str]) -> tuple[str, ...]:
        """Return the robot's names of joints that the hardware calls `names`; unknown ones are left out."""
        known = {self.hardware(joint): joint for joint in self.joints}
        return tuple(known[name] for name in names if name in known)
