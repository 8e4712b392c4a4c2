"""Records of stacks of tasks."""

from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import Field, model_validator

from solfer.config.records.bounds import COORDINATE, Direction, Name, Offset, Place
from solfer.config.records.live import LIVE
from solfer.config.records.record import Record
from solfer.config.records.robot_names import ComparedWith
from solfer.config.tasks.limits import StackLimitsRecord
from solfer.config.tasks.references import ReferenceRecord

KINDS: dict[str, tuple[str, ...]] = {
    "position": ("link", "offset", "relative", "axes", "dofs", "without"),
    "orientation": ("link", "relative", "dofs", "without"),
    "pose": ("link", "offset", "relative", "dofs", "without"),
    "center_of_mass": ("relative", "axes", "dofs", "without"),
    "angular_momentum": ("dofs", "without"),
    "posture": ("dofs", "without"),
    "look_at": ("link", "axis", "target", "dofs", "without"),
    "steering": ("link", "relative", "dofs", "without"),
    "rolling": ("link", "dofs", "without"),
}
"""What a task may move, and the keys that each kind has beside those of all tasks."""

Row = Literal["x", "y", "z", "rx", "ry", "rz"] | Annotated[int, Field(ge=0, le=999)]
Gain = Annotated[float, Field(ge=0.0, le=1e4)]
Rate = Annotated[float, Field(ge=-1e4, le=1e4)]
Positive = Annotated[float, Field(gt=0.0, le=1e9)]
Coordinate = Annotated[float, Field(**COORDINATE)]
Quaternion = Annotated[tuple[Annotated[float, Field(ge=-1e3, le=1e3)], ...], Field(min_length=4, max_length=4)]


class FrameRecord(Record):
    """A frame that tasks may name like a link."""

    type: Literal["link", "ground", "wheel"] = Field(
        default="link", description="`link`: fixed to a link; `ground`: on the ground below it; `wheel`: as it rolls"
    )
    link: Name = Field(description="the link; for `wheel` that of a wheel among the robot's contacts")
    offset: Offset = Field(default=(0.0, 0.0, 0.0), description="link: origin in the frame of the link [m]")
    orientation: Quaternion = Field(
        default=(0.0, 0.0, 0.0, 1.0), description="link: quaternion (x, y, z, w) from the frame to the link"
    )
    height: Annotated[float, ComparedWith("world")] = Field(
        default=0.0, **COORDINATE, description="ground: its height in the world [m]"
    )
    axis: Direction = Field(default=(1.0, 0.0, 0.0), description="ground: axis of the link that shows forward")

    @model_validator(mode="after")
    def _check(self) -> "FrameRecord":
        own = {"link": ("offset", "orientation"), "ground": ("height", "axis"), "wheel": ()}[self.type]
        for key in ("offset", "orientation", "height", "axis"):
            if key in self.model_fields_set and key not in own:
                raise ValueError(f"a frame of the type '{self.type}' has no '{key}'; expected a frame without it")
        return self


class TaskRecord(Record):
    """A task: what moves, and how."""

    point: Name = Field(
        description="what moves: " + ", ".join(f"`{kind}`" for kind in KINDS) + ", or a point of the component",
    )
    link: Name | Annotated[tuple[Name, ...], Field(min_length=1)] | None = Field(
        default=None, description="link, frame or SRDF group; several links are a task `NAME/LINK` each"
    )
    offset: Offset | None = Field(default=None, description="position, pose: the point in the frame of the link [m]")
    relative: Name | None = Field(default=None, description="link or frame that it is seen from; left out: the world")
    axes: Literal["frame", "world"] = Field(
        default="frame", description="axes of what is relative: those of the frame, or of the world"
    )
    axis: Direction | None = Field(default=None, description="look_at: axis of the link that turns to the target; x")
    target: Name | Place | None = Field(
        default=None, description="look_at: link or frame, or a place in the world [m]; left out: 1 m ahead"
    )
    reference: Name | tuple[Coordinate, ...] | ReferenceRecord | None = Field(
        default=None,
        description="numbers of the point, quaternions (x, y, z, w); a point of the component; for `posture` "
        "a named state; for what moves by itself a map, which `inverse_kinematics` follows; "
        "left out: where it is at the start",
    )
    gain: Annotated[Gain | tuple[Gain, ...] | None, ComparedWith(usual=1.0, factor=100.0)] = Field(
        default=None,
        **LIVE,
        description="gain K of the error [1/s], one number or one a row; 1, for `rolling` and momentum 0",
    )
    velocity: Rate | tuple[Rate, ...] = Field(default=0.0, description="feed-forward velocity, as the gain")
    weight: Positive | tuple[Positive, ...] = Field(
        default=1.0, **LIVE, description="weight within its level, as the gain"
    )
    damping: Positive | tuple[Positive, ...] = Field(
        default=1e-3, **LIVE, description="damping of the inverse, as the gain"
    )
    correction: Positive | tuple[Positive, ...] | None = Field(
        default=None, **LIVE, description="largest rate by which an error is corrected, as the gain; left out: any"
    )
    rows: tuple[Row, ...] | None = Field(default=None, min_length=1, description="rows that count; left out: all")
    dofs: tuple[str, ...] | None = Field(
        default=None, min_length=1, description="DoFs that move it, or groups; left out: all, for `posture` all joints"
    )
    without: tuple[str, ...] | None = Field(default=None, min_length=1, description="DoFs or groups that do not")

    @model_validator(mode="after")
    def _check(self) -> "TaskRecord":
        if self.point in KINDS:
            for key in ("link", "offset", "relative", "axes", "axis", "target"):
                if key in self.model_fields_set and key not in KINDS[self.point]:
                    raise ValueError(f"a task on '{self.point}' has no '{key}'; expected a task without it")
            if "link" in KINDS[self.point] and self.link is None:
                raise ValueError(f"a task on '{self.point}' needs the key 'link'")
        movable = ("position", "orientation", "pose", "center_of_mass", "posture")
        if isinstance(self.reference, ReferenceRecord) and self.point not in movable:
            raise ValueError(f"a reference that moves, of '{self.point}'; expected one of {', '.join(movable)}")
        if self.relative is not None and self.relative in self.links:
            raise ValueError(f"'{self.relative}' is relative to itself; expected another link or frame as 'relative'")
        if "axes" in self.model_fields_set and self.relative is None:
            raise ValueError("'axes' without 'relative'; expected both")
        return self

    def unit_of(self, field: str) -> tuple[str, str]:
        """See `Record.unit_of`: what moves decides on the units of the reference and of its velocity."""
        if field == "reference" and self.point in ("position", "center_of_mass"):
            return "m", "world" if self.relative is None else ""
        if field == "velocity" and self.point in ("position", "center_of_mass", "orientation"):
            return "rad/s" if self.point == "orientation" else "m/s", ""
        return "", ""

    @property
    def links(self) -> tuple[str, ...]:
        """Names of links, frames and groups."""
        return (self.link,) if isinstance(self.link, str) else self.link or ()

    @property
    def is_held(self) -> bool:
        """Whether its reference is, or begins, where its point is at the start."""
        return self.reference is None or isinstance(self.reference, ReferenceRecord)

    @property
    def is_motion(self) -> bool:
        """Whether it is linear in the velocities, so that its error means nothing."""
        return self.point in ("rolling", "angular_momentum")


class TaskLevelsRecord(Record):
    """Tasks in levels in the order of priority, each of tasks that are weighed against each other."""

    frames: dict[str, FrameRecord] = Field(default_factory=dict, description="frames by name")
    tasks: Mapping[str, TaskRecord] = Field(min_length=1, description="tasks by name")
    levels: tuple[Annotated[tuple[str, ...], Field(min_length=1)], ...] = Field(
        min_length=1, description="names of the tasks of each level, the most important first"
    )


class StackRecord(TaskLevelsRecord):
    """A stack of tasks: levels that give joint velocities within limits."""

    tasks: dict[str, TaskRecord] = Field(min_length=1, description="tasks by name")
    solver: Literal["null_spaces", "qp"] = Field(default="qp", description="what turns tasks into joint velocities")
    policy: Literal["hold", "stop", "relax"] = Field(
        default="hold",
        description="what follows where a QP has no solution: the level and all after it add nothing, the plugin "
        "stops, or the constraints of `relax` give way",
    )
    relax: tuple[str, ...] | None = Field(
        default=None,
        min_length=1,
        description="policy relax: `torques`, `collisions`, and names of workspaces that give way; left out: all",
    )
    limits: StackLimitsRecord = Field(default_factory=StackLimitsRecord, description="limits")

    @model_validator(mode="after")
    def _check(self) -> "StackRecord":
        if self.solver == "null_spaces" and self.limits.of_qps:
            raise ValueError(f"null spaces know no '{self.limits.of_qps[0]}'; expected solver: qp, or no such limit")
        for key in ("policy", "relax"):
            if self.solver == "null_spaces" and key in self.model_fields_set:
                raise ValueError(f"null spaces have no '{key}'; expected solver: qp, or no such key")
        if self.relax is not None and self.policy != "relax":
            raise ValueError(f"'relax' with the policy '{self.policy}'; expected policy: relax")
        return self
