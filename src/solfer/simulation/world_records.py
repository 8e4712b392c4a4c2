"""Records of a world: the ground, and what stands on it."""

from typing import Annotated

from pydantic import Field, model_validator

from solfer.config import Record
from solfer.simulation.friction import GROUND

GROUND_NAME = "ground"
STEEPEST = 1.0
"""Largest slope of the ground [rad]."""

Length = Annotated[float, Field(gt=0.0)]


class GroundRecord(Record):
    """A plane through the origin of the world."""

    slope: float = Field(default=0.0, ge=-STEEPEST, le=STEEPEST, description="angle by which it rises along x [rad]")
    friction: float | None = Field(default=None, ge=0.0, description="coefficient; default: that of the robot's bundle")


class BoxRecord(Record):
    """A box."""

    size: tuple[Length, Length, Length] = Field(description="lengths of the edges [m]")
    position: tuple[float, float, float] = Field(description="centre [m]")
    rpy: tuple[float, float, float] = Field(default=(0.0, 0.0, 0.0), description="roll, pitch, yaw [rad]")
    mass: float | None = Field(default=None, gt=0.0, description="mass [kg]; default: the box is fixed")
    friction: float = Field(default=GROUND, ge=0.0, description="coefficient")


class StairsRecord(Record):
    """Stairs of equal steps; they rise along their own x."""

    position: tuple[float, float] = Field(description="middle of the lowest edge [m]")
    yaw: float = Field(default=0.0, description="direction in which they rise, from x [rad]")
    count: int = Field(ge=1, le=100, description="number of steps")
    rise: float = Field(gt=0.0, description="height of a step [m]")
    tread: float = Field(gt=0.0, description="depth of a step [m]")
    width: float = Field(gt=0.0, description="length of the edges [m]")
    friction: float = Field(default=GROUND, ge=0.0, description="coefficient")


class WorldRecord(Record):
    """What a robot stands on and bumps into. Friction coefficients of bodies that touch are multiplied."""

    ground: GroundRecord = Field(default_factory=GroundRecord, description="the plane below everything")
    stairs: dict[str, StairsRecord] = Field(default_factory=dict, description="stairs by name")
    boxes: dict[str, BoxRecord] = Field(default_factory=dict, description="boxes by name")

    @model_validator(mode="after")
    def _different_names(self) -> "WorldRecord":
        names = [GROUND_NAME, *self.stairs, *self.boxes]
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice is not None:
            raise ValueError(f"the name '{twice}' is used twice")
        return self
