"""Records of a world: the ground, what lies and stands on it, and friction."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Literal, get_args

from pydantic import Field, model_validator

from solfer.config import FileRecord, Record
from solfer.config.records.bounds import COORDINATE, LENGTH, SEED, Bounds

DEFAULT_FRICTION = 0.3
"""Coefficient of a link of a robot."""

GROUND_FRICTION = 1.0
"""Coefficient of the ground and of what stands on it."""

FRICTION: Bounds = {"ge": 0.0, "le": 10.0}
"""Bounds of a coefficient."""


@dataclass(frozen=True)
class Friction:
    """Coulomb friction; engines multiply the coefficients of the two bodies that touch.

    Attributes:
        default: Coefficient of a link of the robot.
        links: Coefficients of links that differ.
        ground: Coefficient of the ground; None: there is no ground.
    """

    default: float = DEFAULT_FRICTION
    links: Mapping[str, float] = field(default_factory=dict)
    ground: float | None = GROUND_FRICTION


GROUND_NAME = "ground"

EngineName = Literal["bullet", "mujoco"]
ENGINES: tuple[str, ...] = get_args(EngineName)
"""Names of the physics engines."""

Length = Annotated[float, Field(**LENGTH)]
Coordinate = Annotated[float, Field(**COORDINATE)]
Near = Annotated[float, Field(ge=-1000.0, le=1000.0)]
STEP_LENGTH: Bounds = {"ge": LENGTH["ge"], "le": 10.0}
"""Height and depth of a step [m]: a hundred of them are a box that may be."""

MOST_HEIGHTS = 1024
"""Most heights of a grid along x, and along y."""

HIGHEST = 1000.0
"""Highest height of a grid [m], and lowest, with a minus sign."""

Row = Annotated[
    tuple[Annotated[float, Field(ge=-HIGHEST, le=HIGHEST)], ...], Field(min_length=2, max_length=MOST_HEIGHTS)
]


class GroundRecord(Record):
    """A plane through the origin of the world."""

    exists: bool = Field(
        default=True, description="`false`: there is no plane, and what is beside grids and boxes is a hole"
    )
    slope: float = Field(default=0.0, ge=-1.0, le=1.0, description="angle by which it rises along x [rad]")
    friction: float | None = Field(
        default=None, **FRICTION, description="coefficient; default: that of the robot's bundle"
    )


class BoxRecord(Record):
    """A box."""

    size: tuple[Length, Length, Length] = Field(description="lengths of the edges [m]")
    position: tuple[Coordinate, Coordinate, Coordinate] = Field(description="centre [m]")
    rpy: tuple[Coordinate, Coordinate, Coordinate] = Field(
        default=(0.0, 0.0, 0.0), description="roll, pitch, yaw [rad]"
    )
    mass: float | None = Field(default=None, ge=1e-3, le=1e5, description="mass [kg]; default: the box is fixed")
    friction: float = Field(default=GROUND_FRICTION, **FRICTION, description="coefficient")


class StairsRecord(Record):
    """Stairs of equal steps; they rise along their own x."""

    position: tuple[Near, Near] = Field(description="middle of the lowest edge [m]")
    yaw: float = Field(default=0.0, **COORDINATE, description="direction in which they rise, from x [rad]")
    count: int = Field(ge=1, le=100, description="number of steps")
    rise: float = Field(**STEP_LENGTH, description="height of a step [m]")
    tread: float = Field(**STEP_LENGTH, description="depth of a step [m]")
    width: float = Field(**LENGTH, description="length of the edges [m]")
    friction: float = Field(default=GROUND_FRICTION, **FRICTION, description="coefficient")


class UnevenRecord(Record):
    """Smooth ground at random: waves of all directions. Equal numbers give equal ground."""

    size: tuple[Length, Length] = Field(description="lengths along x and y [m]")
    height: float = Field(**STEP_LENGTH, description="highest height above the lowest one [m], which is zero")
    length: float = Field(
        **LENGTH,
        description="length in which it rises by `height` where it is steepest [m]; waves are up to twice as long",
    )
    seed: int = Field(default=0, **SEED, description="seed of the waves")


class GridRecord(Record):
    """Heights at the corners of equal squares, and surfaces between them: `heights`, a `file`, or `uneven`."""

    position: tuple[Near, Near, Near] = Field(
        default=(0.0, 0.0, 0.0), description="middle of the grid, and the z from which heights count [m]"
    )
    yaw: float = Field(default=0.0, **COORDINATE, description="direction of its x, from that of the world [rad]")
    spacing: float = Field(**STEP_LENGTH, description="edges of the squares [m]")
    friction: float = Field(default=GROUND_FRICTION, **FRICTION, description="coefficient")
    heights: Annotated[tuple[Row, ...], Field(min_length=2, max_length=MOST_HEIGHTS)] | None = Field(
        default=None, description="rows along x of heights along y [m]"
    )
    file: FileRecord | None = Field(
        default=None, description="file of `numpy.save` (`.npy`) with such rows, relative to the world's file"
    )
    uneven: UnevenRecord | None = Field(default=None, description="ground at random")

    @model_validator(mode="after")
    def _one_source(self) -> "GridRecord":
        sources = ("heights", "file", "uneven")
        given = [f"'{name}'" for name in sources if getattr(self, name) is not None]
        if len(given) != 1:
            got = " and ".join(given) or "none"
            raise ValueError(f"expected one of the keys 'heights', 'file' and 'uneven', got {got}")
        return self


class WorldRecord(Record):
    """The surroundings of a robot. Friction coefficients of bodies that touch are multiplied."""

    engine: EngineName | None = Field(
        default=None,
        description="physics engine; default: that of the environment variable SOLFER_ENGINE, or `bullet`, or `mujoco` "
        "where PyBullet is not installed",
    )
    ground: GroundRecord = Field(default_factory=GroundRecord, description="the plane below everything")
    grids: dict[str, GridRecord] = Field(default_factory=dict, description="grids of heights by name")
    stairs: dict[str, StairsRecord] = Field(default_factory=dict, description="stairs by name")
    boxes: dict[str, BoxRecord] = Field(default_factory=dict, description="boxes by name")

    @model_validator(mode="after")
    def _different_names(self) -> "WorldRecord":
        names = [GROUND_NAME, *self.grids, *self.stairs, *self.boxes]
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice is not None:
            raise ValueError(f"the name '{twice}' is used twice")
        return self
