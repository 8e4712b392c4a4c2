"""Records of the limits of a stack of tasks."""

from typing import Annotated

from pydantic import Field, model_validator

from solfer.config.records.bounds import Name
from solfer.config.records.live import LIVE
from solfer.config.records.record import Record
from solfer.config.records.robot_names import ComparedWith

Weight = Annotated[float, Field(gt=0.0, le=1e9)]
"""Weight of a violation's square beside the tasks of the first level."""

_WEIGHT_MEANING = (
    "weight of a violation's square beside the tasks of the first level; left out: violations are forbidden"
)


class TorqueLimitsRecord(Record):
    """Joint torques that the drives can give within one period; a QP alone keeps them."""

    scale: float = Field(default=1.0, ge=1e-3, le=1.0, description="fraction of the robot's torque limits")
    weight: Weight | None = Field(default=None, description=_WEIGHT_MEANING)


class WorkspaceRecord(Record):
    """How far a link may be from another one, or from a place in the world; a QP alone keeps it."""

    link: Name = Field(description="link, frame below `frames`, or group: each of its links")
    relative: Name = Field(
        default="world",
        description="link or frame that it is near to, a group of one for each, or `world`",
    )
    nearest: float = Field(default=0.0, ge=0.0, le=1e4, description="smallest distance [m]")
    farthest: Annotated[float, ComparedWith("world")] = Field(
        default=1e4, gt=0.0, le=1e4, description="largest distance [m]"
    )
    weight: Weight | None = Field(default=None, description=_WEIGHT_MEANING)

    @model_validator(mode="after")
    def _check(self) -> "WorkspaceRecord":
        if self.nearest > self.farthest:
            raise ValueError(f"'nearest' {self.nearest:g} is above 'farthest' {self.farthest:g}")
        if self.link == self.relative:
            raise ValueError(f"'{self.link}' is relative to itself; expected another link or frame as 'relative'")
        if not self.model_fields_set & {"nearest", "farthest"}:
            raise ValueError("a workspace without a distance; expected nearest, farthest or both")
        return self


class CollisionsRecord(Record):
    """Distances of links that may touch each other: all but those that the SRDF leaves out; a QP alone keeps them."""

    distance: float = Field(default=0.02, ge=0.0, le=10.0, **LIVE, description="smallest distance [m]")
    influence: float = Field(default=0.1, gt=0.0, le=10.0, description="distance below which two links count [m]")
    pairs: tuple[Annotated[tuple[str, ...], Field(min_length=2, max_length=2)], ...] | None = Field(
        default=None, min_length=1, description="pairs of links, or of groups; left out: all that may touch"
    )
    weight: Weight | None = Field(default=None, description=_WEIGHT_MEANING)

    @model_validator(mode="after")
    def _check(self) -> "CollisionsRecord":
        if self.influence <= self.distance:
            raise ValueError(f"'influence' {self.influence:g} is not above 'distance' {self.distance:g}")
        return self


class StackLimitsRecord(Record):
    """Limits of a stack of tasks. Null spaces know none of them: there, joints stop where their range ends."""

    joints: bool = Field(default=True, description="whether joints stay in their ranges")
    speeds: bool = Field(default=True, description="whether joints stay below their largest speeds")
    speed_scale: float = Field(default=1.0, ge=1e-3, le=1.0, **LIVE, description="fraction of the largest speeds")
    horizon: float | None = Field(
        default=None,
        ge=1e-4,
        le=60.0,
        description="time within which a joint may reach the end of its range [s]; left out: one period",
    )
    torques: TorqueLimitsRecord | None = Field(default=None, description="limits of the torques")
    workspace: dict[str, WorkspaceRecord] = Field(default_factory=dict, description="workspaces by name")
    collisions: CollisionsRecord | None = Field(default=None, description="distances of links that may touch")

    @property
    def of_qps(self) -> tuple[str, ...]:
        """Keys of the limits that are given and that a QP alone can keep."""
        return tuple(key for key in ("torques", "workspace", "collisions") if getattr(self, key))
