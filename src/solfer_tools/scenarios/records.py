"""Records of scenario files: where a motion begins, tables of goals, and a verb for each step of the pattern."""

from typing import Annotated, Literal

from pydantic import ConfigDict, Field

from solfer.config import Record
from solfer.config.records.bounds import COORDINATE, COUNT, Bounds

INDEX: Bounds = {"ge": 0, "le": 9999}
TABLE: Bounds = {"min_length": 1, "max_length": 10_000}

Coordinate = Annotated[float, Field(**COORDINATE)]
Legs = Annotated[tuple[Coordinate, ...], Field(min_length=1, max_length=32)]
Base = Annotated[tuple[Coordinate, ...], Field(min_length=4, max_length=4)]
Change = tuple[Annotated[int, Field(ge=0, le=3)], Annotated[int, Field(**INDEX)], Annotated[float, Field(ge=0, le=10)]]


class ScenarioRecord(Record):
    """A scenario file without its pattern. Vertices are those of the support polygon, one for each leg."""

    model_config = ConfigDict(validate_by_name=False, validate_by_alias=True)

    base_now: Base = Field(alias="base now", description="where the base begins: x, y, z [m], heading [rad]")
    base_const_vel: Base = Field(
        default=(0.0, 0.0, 0.0, 0.0), description="velocity that is added to the base's until the end [m/s, rad/s]"
    )
    vel: float = Field(
        gt=0.0,
        le=1.0,
        description="fraction of what is left that vertices go in a period; speed of the base [m/s, rad/s]",
    )
    dt: float = Field(ge=1e-4, le=1.0, description="period [s]")
    x_cp: Legs = Field(alias="x cp", description="where the vertices begin: x of each leg [m]")
    y_cp: Legs = Field(alias="y cp", description="where the vertices begin: y of each leg [m]")
    z_cp: Legs = Field(alias="z cp", description="where the vertices begin: z of each leg [m]")
    x_cp_ref: tuple[Legs, ...] = Field(alias="x cp ref", **TABLE, description="goals of the vertices: x [m]")
    y_cp_ref: tuple[Legs, ...] = Field(alias="y cp ref", **TABLE, description="goals of the vertices: y [m]")
    z_cp_ref: tuple[Legs, ...] = Field(alias="z cp ref", **TABLE, description="goals of the vertices: z [m]")
    base_ref: tuple[Base, ...] = Field(alias="base ref", **TABLE, description="goals of the base [m, rad]")
    cs_ref: tuple[Legs, ...] | None = Field(
        default=None, alias="cs ref", **TABLE, description="camber of each leg [rad]; without it, cambers stay at zero"
    )


class FootprintRecord(Record):
    """A step in which the vertices go to goals, given by their rows in the tables."""

    x_cp: int = Field(**INDEX, description="row of `x cp ref`")
    y_cp: int = Field(**INDEX, description="row of `y cp ref`")
    z_cp: int = Field(**INDEX, description="row of `z cp ref`")


class MoveRecord(FootprintRecord):
    """Vertices and base go to their goals."""

    type: Literal["move"]
    base: int = Field(**INDEX, description="row of `base ref`")
    cs: int | None = Field(default=None, **INDEX, description="row of `cs ref`; without it, cambers stay")


class TurnRecord(FootprintRecord):
    """The base drives forward while its heading changes."""

    type: Literal["turn"]
    radius: float = Field(**COORDINATE, description="heading to reach [rad]")
    angle: float = Field(ge=-10.0, le=10.0, description="speed forward [m/s]")


class CircleRecord(FootprintRecord):
    """The base drives on a circle while its heading changes."""

    type: Literal["circle"]
    radius: float = Field(**COORDINATE, description="radius [m]")
    angle: float = Field(**COORDINATE, description="heading to reach [rad]")
    x_sign: Literal[-1, 1] = Field(description="sign of the velocity along x")
    y_sign: Literal[-1, 1] = Field(description="sign of the velocity along y")


class WaitRecord(Record):
    """Nothing moves but for the constant velocity."""

    type: Literal["wait"]
    steps: int = Field(**COUNT, description="periods")


class LegRecord(Record):
    """A leg that loses or gets its contact with the ground."""

    leg: int = Field(**INDEX, description="leg, from zero on")


class LegClaimRecord(LegRecord):
    """A leg is claimed: it loses its contact with the ground and may be lifted."""

    type: Literal["claim"]


class LegReleaseRecord(LegRecord):
    """A leg is released: it gets its contact with the ground again."""

    type: Literal["release"]


BASE_ROW = 3
"""Row of the base in the motions of a `SpeedRecord`, behind x, y and z of the vertices."""


class SpeedRecord(Record):
    """Speeds change."""

    type: Literal["speed"]
    motions: tuple[Change, ...] = Field(
        **TABLE,
        description="row (0 to 2: x, y, z of the vertices, 3: base), column (leg; x, y, z, heading of the base), speed",
    )


Step = MoveRecord | TurnRecord | CircleRecord | WaitRecord | LegClaimRecord | LegReleaseRecord | SpeedRecord

VERBS: dict[str, type[Step]] = {
    "move": MoveRecord,
    "turn": TurnRecord,
    "circle": CircleRecord,
    "wait": WaitRecord,
    "claim": LegClaimRecord,
    "release": LegReleaseRecord,
    "speed": SpeedRecord,
}
"""Record of each verb."""
