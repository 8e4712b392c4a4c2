"""Tags of the component `wheeled_motion`."""

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, model_validator

from solfer.config import LIVE, ComparedWith, NameOf, Record
from solfer.config.records.bounds import LENGTH
from solfer.config.tasks.original import OriginalTaskTags, translated
from solfer.config.tasks.stack import StackRecord, TaskRecord
from solfer.errors import UnknownName
from solfer.model.contacts import AxisRecord

CONSTRAINTS = "CONSTRAINTS"
BASE = "BASE"
STEERING = "STEERING"
VERTICES = "CONTACT_POINTS"
CAMBER = "CAMBER"
CASTER = "CASTER"

ANGLE_ERRORS = {STEERING: 0.1, CAMBER: 2.0, CASTER: 2.0}
"""Largest errors of angles [rad]: references farther away follow the wheel."""

PACED_STEERING_ERROR = 0.2
"""Largest error of the steering with `pace`, where the motion waits for its wheels [rad]."""

TASK_POINTS = {BASE: "base", VERTICES: "vertices", CAMBER: "camber", CASTER: "caster"}
"""Points of the component, by the tasks that they belong to."""

_TASK_OTHERS = "only `support_shaping` and `NwheelsZMPII` read it"
_UNREAD = "nothing reads it, in the original neither"

Margin = Annotated[float, Field(gt=0.0, le=1.0)]
Limit = Annotated[float, Field(gt=0.0, le=100.0)]
Factor = Annotated[float, Field(ge=0.0, le=1e3)]


class SteeringRecord(Record):
    """How wheels steer."""

    icm: Factor = Field(default=1.0, **LIVE, description="gain of the direction by the motion of the base")
    sp: Factor = Field(default=0.05, **LIVE, description="gain of the direction by the error of the wheel's vertex")
    damp_icm: Margin = Field(
        default=2e-4, **LIVE, description="way in a cycle below which the first one counts less [m]"
    )
    damp_sp: Margin = Field(
        default=8e-4, **LIVE, description="way in a cycle below which the second one counts less [m]"
    )
    damp: Margin = Field(default=4e-4, **LIVE, description="the same of both together [m]")
    tracking: Factor = Field(default=1.0, **LIVE, description="speed for an error of the vertex [1/s]")


class DrivingTags(OriginalTaskTags):
    """Tags of components that drive on wheels."""

    replaced: ClassVar[Mapping[str, str]] = {
        "faithful": "`law: original` or `law: improved` takes its place",
        **dict.fromkeys(
            ("feed_forward", "start_in_place", "prompt", "limits"),
            "`law: improved` has it, `law: original` does without",
        ),
    }
    renamed: ClassVar[Mapping[str, Mapping[str, tuple[str, Any]]]] = {
        "faithful": {"true": ("law", "original"), "false": ("law", "improved")}
    }

    chain: Annotated[str | None, NameOf("group")] = Field(
        default=None, min_length=1, description="SRDF group of the DoFs that it moves; left out: all"
    )
    track: Annotated[str, NameOf("group")] = Field(min_length=1, description="SRDF group of the wheels' links")
    ik: tuple[str, ...] = Field(
        alias="IK",
        min_length=1,
        description="tasks by priority: `CONSTRAINTS` (no wheel slips), `BASE`, `STEERING`, `CONTACT_POINTS` (vertices "
        "along the wheels), `CAMBER`, `CASTER`",
    )
    base: Literal["link", "center_of_mass"] = Field(
        default="link", description="what x and y of the task `BASE` are those of: the base's link, or the whole robot"
    )
    minor_axis: Annotated[float | None, ComparedWith("tube")] = Field(
        default=None, **LENGTH, description="radius of a wheel's tube [m]; left out: as of its contact"
    )
    major_axis: Annotated[float | None, ComparedWith("ring")] = Field(
        default=None, ge=0.0, le=LENGTH["le"], description="radius of a wheel's ring [m]; left out: as of its contact"
    )
    reference_axis: dict[str, AxisRecord] = Field(
        default_factory=dict,
        description="axles of wheels in the frames of their links, and of the links that carry them, by link; left "
        "out: as of the contact",
    )
    steering: str = Field(
        default="reactif", min_length=1, description="the one of `steerings` that counts, where `across` is 0"
    )
    steerings: dict[str, SteeringRecord] = Field(
        default_factory=lambda: {"reactif": SteeringRecord()}, description="how wheels steer, by name"
    )
    base_speed: Annotated[Limit, ComparedWith("wheel")] = Field(
        default=0.5, **LIVE, description="largest speed of the base that messages ask for [m/s]"
    )
    turn_speed: Limit = Field(default=0.5, **LIVE, description="the same of turns [rad/s]")
    vertex_speed: Limit = Field(default=0.1, **LIVE, description="the same of vertices, as seen from the base [m/s]")
    correction: Limit = Field(
        default=0.04,
        **LIVE,
        description="largest speed of the base by an error of its place, with `pace` [m/s]",
    )
    turn_correction: Limit = Field(
        default=0.1,
        **LIVE,
        description="the same of an error of its orientation, about each axis, where the base turns fast; 15 % of "
        "it and a tenth of the rate otherwise [rad/s]",
    )
    furthest: Limit = Field(
        default=0.3,
        **LIVE,
        description="distance of the base or a vertex from its reference at which the component fails, with `pace` [m]",
    )
    acceleration: Limit = Field(
        default=0.3, **LIVE, description="most that the speed changes by which messages move the base [m/s2]"
    )
    turn_acceleration: Limit = Field(default=0.5, **LIVE, description="the same of turns [rad/s2]")
    vertex_acceleration: Limit = Field(default=0.2, **LIVE, description="the same of vertices [m/s2]")
    support_margin: float = Field(
        default=0.04,
        **LENGTH,
        **LIVE,
        description="distance of the centre of mass from the edges of the support polygon that motions leave, with "
        "`pace` [m]",
    )
    lift_margin: float = Field(
        default=0.06,
        **LENGTH,
        **LIVE,
        description="the same in the polygon of the other wheels before one is lifted [m]",
    )
    law: Literal["original", "improved"] = Field(
        default="improved",
        description="`original`: it moves as the original program does, to the number; `improved`: the base does not "
        "lag, wheels start and stop in place, and joints keep their ranges and speeds",
    )
    rest: bool = Field(
        default=True,
        description="improved: whether wheels that steer as `steerings` say stop where no motion is desired and "
        "vertices are near their references",
    )
    across: float = Field(
        default=2.0,
        ge=0.0,
        le=20.0,
        **LIVE,
        description="improved: gain with which errors of vertices across their wheels steer them, beyond 2 mm [1/s]; "
        "0: as `steerings` say",
    )
    pace: bool = Field(
        default=True,
        description="improved: whether the motion slows down along its path for wheels that do not point there yet, "
        "and for joints that cannot be faster",
    )

    support: Any = Field(default=None, alias="SUPPORT", deprecated=_UNREAD, description="obsolete")
    shape: Any = Field(default=None, alias="SHAPE", deprecated=_UNREAD, description="obsolete")

    @model_validator(mode="after")
    def _check_law(self) -> "DrivingTags":
        """Raise a ValueError where a tag of the improved law is given that the original does not have."""
        if self.is_original and (given := [tag for tag in ("rest", "across", "pace") if tag in self.model_fields_set]):
            raise ValueError(f"`law: original` with {', '.join(f'`{tag}`' for tag in given)}: it has none of these")
        return self

    @property
    def is_original(self) -> bool:
        """Whether it moves as the original program does."""
        return self.law == "original"

    @property
    def is_paced(self) -> bool:
        """Whether motions wait for wheels and joints."""
        return self.pace and not self.is_original

    @property
    def speeds(self) -> tuple[float, float, float]:
        """Largest speeds of the base [m/s], its heading [rad/s] and of a vertex [m/s]."""
        return self.base_speed, self.turn_speed, self.vertex_speed

    @property
    def accelerations(self) -> tuple[float, float, float]:
        """The same of accelerations."""
        return self.acceleration, self.turn_acceleration, self.vertex_acceleration

    @property
    def rests(self) -> bool:
        """Whether wheels that steer by `steerings` rest with small errors."""
        return self.rest and not self.is_original

    @property
    def gain_across(self) -> float:
        """Gain of errors across the wheels [1/s]; 0: they steer by `steerings`."""
        return 0.0 if self.is_original else self.across

    def steering_record(self) -> SteeringRecord:
        """Return how wheels steer; an UnknownName if there is no such record."""
        if self.steering not in self.steerings:
            raise UnknownName("steering", self.steering, self.steerings, where=self.where("steering"))
        return self.steerings[self.steering]

    def stack_record(self) -> StackRecord:
        """Return the stack of tasks.

        Raises:
            SolferError: A tag is missing, or contradicts another.
        """
        known = {name: TaskRecord(point=point) for name, point in TASK_POINTS.items()}
        known[CONSTRAINTS] = TaskRecord(point="rolling", link=self.track)
        known[STEERING] = TaskRecord(point="steering", link=self.track)
        record = translated(self, known, chain=self.chain)
        if CONSTRAINTS in record.tasks:
            # its rows are velocities: it has no error that a gain could count for
            still = record.tasks[CONSTRAINTS].model_copy(update={"gain": 0.0})
            record = record.model_copy(update={"tasks": {**record.tasks, CONSTRAINTS: still}}).placed_as(record)
        if VERTICES in record.tasks:
            # a gain for each wheel is that of its rows along, across and upwards
            task = record.tasks[VERTICES]
            rows = {key: 3 * each for key in ("gain", "damping") if isinstance(each := getattr(task, key), tuple)}
            vertices = task.model_copy(update=rows).placed_as(task)
            record = record.model_copy(update={"tasks": {**record.tasks, VERTICES: vertices}}).placed_as(record)
        return record


class WheeledMotionTags(DrivingTags):
    """Tags of the component `wheeled_motion`."""

    margins: Any = Field(default=None, deprecated=_TASK_OTHERS, description="obsolete")
    workspaces: Any = Field(default=None, deprecated=_TASK_OTHERS, description="obsolete")
    margin_gain: Any = Field(default=None, deprecated=_TASK_OTHERS, description="obsolete")
    workspace_gain: Any = Field(default=None, deprecated=_TASK_OTHERS, description="obsolete")
