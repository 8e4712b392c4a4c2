"""Records of the notation of a rigid body's state, and of how its sensor is mounted."""

from typing import Literal

import numpy as np
from pydantic import Field, model_validator

from solfer.config.records.bounds import OFFSET, Bounds
from solfer.config.records.record import Record
from solfer.errors import ConfigError
from solfer.numerics.rotations import require_rotation

_ENTRY: Bounds = {"ge": -1.001, "le": 1.001}
"""Bounds of an entry of a rotation; rounding is checked with the matrix as a whole."""


class OrientationRecord(Record):
    """Notation of a rigid body's orientation."""

    type: Literal["QUATERNION", "EULER"] = Field(
        default="QUATERNION", description="a quaternion, or angles about x, y, z (geometry_msgs/Vector3Stamped)"
    )
    convention: Literal["HAMILTONIAN", "JPL"] = Field(default="HAMILTONIAN", description="kind of a quaternion")
    order: Literal["xyzw", "wxyz"] = Field(default="xyzw", description="order of the four numbers of a quaternion")


class PositionRecord(Record):
    """Notation of a rigid body's position."""

    type: Literal["FULL", "NONE"] = Field(default="FULL", description="three coordinates, or `NONE` to ignore them")


class TwistRecord(Record):
    """Notation of a rigid body's twist."""

    frame: Literal["world", "body"] | None = Field(
        default=None, description="axes of the twist; left out: those that the message prescribes"
    )


class ConventionRecord(Record):
    """Conventions in which the state of a rigid body travels."""

    orientation: OrientationRecord = Field(default_factory=OrientationRecord, description="orientation")
    position: PositionRecord = Field(default_factory=PositionRecord, description="position")
    twist: TwistRecord = Field(default_factory=TwistRecord, description="linear and angular velocity")


class OffsetPositionRecord(Record):
    """Position of a sensor on its link, in the axes of the link; in addition to the URDF."""

    x: float = Field(**OFFSET, description="along x [m]")
    y: float = Field(**OFFSET, description="along y [m]")
    z: float = Field(**OFFSET, description="along z [m]")

    def vector(self) -> np.ndarray:
        """Return the offset, shape (3,) [m]."""
        return np.array((self.x, self.y, self.z))


class OffsetOrientationRecord(Record):
    """Orientation of a sensor on its link: the matrix that rotates from the sensor's axes to those of the link.

    Its columns are the sensor's axes, seen from the link. It is applied in addition to the URDF.
    """

    xx: float = Field(**_ENTRY, description="row x, column x")
    xy: float = Field(**_ENTRY, description="row x, column y")
    xz: float = Field(**_ENTRY, description="row x, column z")
    yx: float = Field(**_ENTRY, description="row y, column x")
    yy: float = Field(**_ENTRY, description="row y, column y")
    yz: float = Field(**_ENTRY, description="row y, column z")
    zx: float = Field(**_ENTRY, description="row z, column x")
    zy: float = Field(**_ENTRY, description="row z, column y")
    zz: float = Field(**_ENTRY, description="row z, column z")

    @model_validator(mode="after")
    def _is_a_rotation(self) -> "OffsetOrientationRecord":
        try:
            require_rotation(self.matrix(), "the matrix")
        except ConfigError as error:
            raise ValueError(f"{error.what}; expected {error.expected}") from None
        return self

    def matrix(self) -> np.ndarray:
        """Return the rotation from the sensor to the link, shape (3, 3)."""
        return np.array(((self.xx, self.xy, self.xz), (self.yx, self.yy, self.yz), (self.zx, self.zy, self.zz)))


class AnglesRecord(Record):
    """Order in which a frame is rotated about its own axes: 0 is x, 1 is y, 2 is z."""

    angle_1: Literal[0, 1, 2] = Field(description="axis of the first rotation")
    angle_2: Literal[0, 1, 2] = Field(description="axis of the second rotation")
    angle_3: Literal[0, 1, 2] = Field(description="axis of the third rotation")

    @model_validator(mode="after")
    def _each_axis_once(self) -> "AnglesRecord":
        if set(self.axes()) != {0, 1, 2}:
            raise ValueError("three rotations that do not use each axis once; expected 0, 1 and 2 in any order")
        return self

    def axes(self) -> tuple[int, int, int]:
        """Return the axes in the order of the rotations."""
        return self.angle_1, self.angle_2, self.angle_3
