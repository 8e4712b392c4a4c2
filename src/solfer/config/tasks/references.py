"""Records of references that need no program: circles, lines, sines, waypoints, and tables in CSV files."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from solfer.config.records.bounds import COORDINATE, Direction, Name, Place
from solfer.config.records.record import Record
from solfer.config.records.robot_names import ComparedWith

KINDS = ("circle", "line", "sine", "waypoints", "file")
"""Kinds of references."""

Period = Annotated[float, Field(ge=0.05, le=3600.0), ComparedWith("nothing")]
Quaternion = Annotated[tuple[Annotated[float, Field(ge=-1.0, le=1.0)], ...], Field(min_length=4, max_length=4)]
Coordinate = Annotated[float, Field(**COORDINATE)]


class CircleReferenceRecord(Record):
    """A circle that begins where the reference is, and goes along the first axis of its plane's second."""

    radius: Annotated[float, ComparedWith("world")] = Field(gt=0.0, le=100.0, description="radius [m]")
    period: Period = Field(description="time of a revolution [s]")
    plane: Literal["xy", "yx", "xz", "zx", "yz", "zy"] | None = Field(
        default=None, description="two axes: the centre is at minus the first, the motion begins along the second"
    )
    normal: Direction | None = Field(
        default=None, description="instead of `plane`: the axis about which it turns, of any length"
    )
    turns: Annotated[float, Field(gt=0.0, le=1e6)] | None = Field(
        default=None, description="number of revolutions; left out: without end"
    )

    @model_validator(mode="after")
    def _check(self) -> "CircleReferenceRecord":
        if (self.plane is None) is (self.normal is None):
            raise ValueError("a circle has a 'plane' or a 'normal'; expected one of them")
        if self.normal is not None and sum(each * each for each in self.normal) < 1e-12:
            raise ValueError("a normal of the length 0; expected a direction")
        return self


class LineReferenceRecord(Record):
    """A straight line, from rest to rest."""

    to: Place = Field(description="where it ends, relative to where it begins [m]; with `absolute` a place")
    speed: Annotated[float, Field(ge=1e-4, le=100.0)] | None = Field(default=None, description="largest speed [m/s]")
    duration: Period | None = Field(default=None, description="instead of `speed`: time of the way [s]")
    back: bool = Field(default=False, description="whether it goes back again, in the same time")

    @model_validator(mode="after")
    def _check(self) -> "LineReferenceRecord":
        if (self.speed is None) is (self.duration is None):
            raise ValueError("a line has a 'speed' or a 'duration'; expected one of them")
        return self


class SineReferenceRecord(Record):
    """A sine about where the reference is."""

    amplitude: Annotated[tuple[Coordinate, ...], Field(min_length=1)] | dict[str, Coordinate] = Field(
        description="amplitude of each number [m], of a posture in the order of its joints, or by name [rad, m]"
    )
    period: Period = Field(description="period [s]")
    turns: Annotated[float, Field(gt=0.0, le=1e6)] | None = Field(
        default=None, description="number of periods; left out: without end"
    )


class WaypointReferenceRecord(Record):
    """A waypoint; what it leaves out is as at the one before."""

    time: Annotated[float, ComparedWith("nothing")] = Field(
        ge=0.0, le=1e5, description="when it is there, from the beginning of the reference on [s]"
    )
    position: Place | None = Field(default=None, description="position [m]")
    orientation: Quaternion | None = Field(
        default=None, description="quaternion (x, y, z, w); a relative one turns in the axes of the reference"
    )
    joints: dict[str, Coordinate] | None = Field(default=None, description="positions of joints by name [rad, m]")


class ReferenceRecord(Record):
    """A reference of its own: exactly one of its kinds."""

    circle: CircleReferenceRecord | None = Field(default=None, description="a circle, of positions and poses")
    line: LineReferenceRecord | None = Field(default=None, description="a straight line, of positions and poses")
    sine: SineReferenceRecord | None = Field(default=None, description="a sine, of positions, poses and postures")
    waypoints: Annotated[tuple[WaypointReferenceRecord, ...], Field(min_length=1)] | None = Field(
        default=None, description="way-points with times, smooth between them"
    )
    file: Name | None = Field(
        default=None,
        description="a CSV file, relative to the file that names it: time [s], then the numbers of the reference",
    )
    absolute: bool = Field(
        default=False,
        description="line, waypoints and file: whether numbers are those of the reference, not relative to its start",
    )

    @model_validator(mode="after")
    def _check(self) -> "ReferenceRecord":
        given = [kind for kind in KINDS if getattr(self, kind) is not None]
        if len(given) != 1:
            has = " and ".join(f"'{kind}'" for kind in given) or "no kind"
            raise ValueError(f"a reference with {has}; expected one of {', '.join(KINDS)}")
        if self.absolute and given[0] in ("circle", "sine"):
            raise ValueError(f"a {given[0]} begins where the reference is; expected no 'absolute'")
        return self

    @property
    def kind(self) -> str:
        """Which of its kinds it is."""
        return next(kind for kind in KINDS if getattr(self, kind) is not None)


class ReferencesRecord(Record):
    """References that a navigation publishes together: of tasks by name, and of joints."""

    positions: dict[str, ReferenceRecord] = Field(
        default_factory=dict, description="of tasks on a position, a centre of mass or a sight"
    )
    orientations: dict[str, ReferenceRecord] = Field(default_factory=dict, description="of tasks on an orientation")
    poses: dict[str, ReferenceRecord] = Field(default_factory=dict, description="of tasks on a pose")
    joints: ReferenceRecord | None = Field(default=None, description="of joints, which it names")

    @model_validator(mode="after")
    def _check(self) -> "ReferencesRecord":
        if not (self.positions or self.orientations or self.poses or self.joints):
            raise ValueError("there is no reference; expected positions, orientations, poses or joints")
        return self
