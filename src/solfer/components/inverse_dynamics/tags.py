"""Tags of the component `inverse_dynamics`."""

from typing import Annotated

from pydantic import Field, model_validator

from solfer.components.following.tags import FollowingTags
from solfer.components.gains import GainsOfGroup
from solfer.config import LIVE, ComparedWith, NameOf, Record
from solfer.config.records.bounds import DURATION
from solfer.config.tasks.stack import Gain, Positive, TaskLevelsRecord, TaskRecord

HalfSize = Annotated[float, Field(gt=0.0, le=10.0)]


class DynamicTaskRecord(TaskRecord):
    """A task whose acceleration is D (K e + v - J dq) + dv/dt, with the error e and the velocity v of its reference."""

    velocity_gain: Annotated[Gain | tuple[Gain, ...] | None, ComparedWith(usual=10.0, factor=10.0)] = Field(
        default=None,
        **LIVE,
        description="gain D of the velocity [1/s], one number or one a row; left out: four times `gain`, which is "
        "critical damping, and 10 without it",
    )

    damping: Positive | tuple[Positive, ...] = Field(default=1e-3, description="none: it is that of an inverse")

    @model_validator(mode="after")
    def _has_no_damping(self) -> "DynamicTaskRecord":
        if "damping" in self.model_fields_set:
            raise ValueError("'damping' is that of an inverse; expected 'velocity_gain', or none")
        return self


class DynamicLimitsRecord(Record):
    """Limits of joints."""

    joints: bool = Field(default=True, description="whether joints stay in their ranges")
    speeds: bool = Field(default=True, description="whether joints stay below their largest speeds")
    speed_scale: float = Field(default=1.0, ge=1e-3, le=1.0, **LIVE, description="share of the largest speeds")
    torque_scale: float = Field(default=1.0, ge=1e-3, le=1.0, **LIVE, description="share of the largest torques")
    braking: float = Field(
        default=20.0,
        gt=0.0,
        le=1e4,
        **LIVE,
        description="acceleration with which joints brake before a limit [rad/s2, m/s2]",
    )
    horizon: float = Field(
        default=0.05, ge=1e-4, le=60.0, description="time within which they reach a speed; at least two periods [s]"
    )


class DynamicStackRecord(TaskLevelsRecord):
    """Tasks of an inverse dynamics; one level or two, of which the first counts a hundred thousand times as much."""

    tasks: dict[str, DynamicTaskRecord] = Field(min_length=1, description="tasks by name")
    limits: DynamicLimitsRecord = Field(default_factory=DynamicLimitsRecord, description="limits of joints")

    @model_validator(mode="after")
    def _check(self) -> "DynamicStackRecord":
        if len(self.levels) > 2:
            raise ValueError(f"{len(self.levels)} levels; expected one or two: contacts and limits come before them")
        return self


class InverseDynamicsTags(FollowingTags):
    """Tags of the component `inverse_dynamics`."""

    stack: DynamicStackRecord = Field(description="the tasks")
    track: Annotated[str, NameOf("group")] = Field(
        default="all", description="SRDF group of the links whose contacts carry the robot"
    )
    friction: float = Field(default=0.6, gt=0.0, le=10.0, **LIVE, description="coefficient of friction of the ground")
    ground: str | None = Field(
        default=None,
        min_length=1,
        description="topic of `solfer/Ground`, such as `odometry/ground`: contacts and friction turn with its normals; "
        "left out, those of the robot's file count",
    )
    correct_model: bool = Field(
        default=False,
        description="whether the model's masses and centre of mass are corrected by the measured forces of contacts",
    )
    sole: Annotated[tuple[HalfSize, ...], Field(min_length=2, max_length=2)] | None = Field(
        default=None, description="half length and half width of flat feet, about their contacts [m]"
    )
    torsion: float = Field(
        default=0.02,
        ge=0.0,
        le=10.0,
        **LIVE,
        description="flat feet: torque about the normal relative to its force [m]",
    )
    fade: float = Field(
        default=0.3, **DURATION, **LIVE, description="time in which the force of a contact comes or goes [s]"
    )
    settle: float = Field(
        default=10.0, ge=0.0, le=1e3, **LIVE, description="gain with which velocities of contacts vanish [1/s]"
    )
    speed_driven: Annotated[str | None, NameOf("group")] = Field(
        default=None, description="SRDF group of joints whose drives take speeds alone, as those of wheels"
    )
    follow: float = Field(
        default=0.2,
        ge=1e-3,
        le=60.0,
        **LIVE,
        description="time constant with which commanded positions and speeds return to the measured ones [s]",
    )
    tolerance: float = Field(default=5e-3, gt=0.0, le=1.0, **LIVE, description="error of a task that has arrived [m]")
    turn_tolerance: float = Field(
        default=2e-2, gt=0.0, le=4.0, **LIVE, description="error of an orientation that has arrived [rad]"
    )
    gains: tuple[GainsOfGroup, ...] = Field(
        default=(), description="stiffness and damping of groups of joints beside the torques; a later group counts"
    )
