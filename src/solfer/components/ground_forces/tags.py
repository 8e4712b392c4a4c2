"""Tags of the component `ground_forces`."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from solfer.components.filter_tags import FilterTags
from solfer.config import LIVE, ComparedWith, NameOf, Record
from solfer.config.records.bounds import DURATION, Bounds
from solfer.config.records.sources import FileRecord

FORCE: Bounds = {"ge": 0.0, "le": 1e5}
"""Bounds of forces and of their deviations [N, Nm]."""

POSITIVE: Bounds = {"ge": 1e-6, "le": 1e6}
"""Bounds of deviations that weigh: their inverse has to be a number."""

Span = Annotated[float, Field(ge=1e-3, le=1e6), ComparedWith("nothing")]
"""Times that divide, of any length [s]."""


class FiltersTags(Record):
    """Filters of what is measured."""

    torque: FilterTags | None = Field(None, description="of the joints' torques")


class TouchTags(Record):
    """When a contact touches the ground."""

    above: float = Field(10.0, **FORCE, **LIVE, description="a contact touches above this normal force [N]")
    below: float = Field(5.0, **FORCE, **LIVE, description="it touches no more below this normal force [N]")
    speed: float = Field(
        150.0, **FORCE, **LIVE, description="by how much both rise with the contact's speed along the normal [N/(m/s)]"
    )
    delay: float = Field(0.01, **DURATION, **LIVE, description="time for which the force has to be there, or away [s]")

    @model_validator(mode="after")
    def _ordered(self) -> "TouchTags":
        if self.below > self.above:
            raise ValueError(f"'below' of {self.below:g} N with 'above' of {self.above:g} N; expected at most as much")
        return self


class OffsetTags(Record):
    """What is known of the offsets of torque sensors, and from what they are learnt."""

    deviation: float = Field(1.2, **POSITIVE, description="deviation of the offsets [Nm, N]")
    push: float = Field(20.0, **POSITIVE, description="deviation of what pushes a base at rest besides [N, Nm]")
    largest_push: float = Field(
        50.0, **FORCE, description="a force that is larger pushes the base: it is not taken for offsets [N]"
    )
    interval: Span = Field(0.1, description="time after which errors of torques and pushes are others [s]")
    memory: Span = Field(300.0, description="time constant with which offsets are forgotten [s]")


class GroundForcesTags(Record):
    """Tags of `GroundForces`."""

    track: Annotated[str, NameOf("group")] = Field(
        "all", description="SRDF group of the links whose contacts the ground may push"
    )
    contact_source: FileRecord | None = Field(
        None,
        description="file of contacts: only these count, and are added where the Robot lacks them; default: its own",
    )
    method: Literal["projection", "weighted"] = Field(
        "projection",
        description="`projection`: the forces that keep contacts in place, as in the paper; `weighted`: those that "
        "explain torques and momentum best",
    )
    filter: FiltersTags = Field(default_factory=FiltersTags, description="filters of what is measured")
    prefix: str = Field("", description="stands in front of the contacts' names in the names of Points")
    touch: TouchTags | None = Field(
        None, description="when contacts touch: the wrench of another one is zero; default: all as computed"
    )
    friction: float | None = Field(
        None,
        ge=0.01,
        le=10.0,
        **LIVE,
        description="coefficient of friction of the ground, beyond which forces are reported",
    )
    observer: float | None = Field(
        None,
        ge=0.01,
        le=2000.0,
        description="weighted: cut-off of the momentum observer [Hz]; default: the robot counts as not accelerated",
    )
    offsets: OffsetTags | None = Field(
        None, description="weighted: estimates the offsets of the torque sensors; default: they have none"
    )
    torque_deviation: float = Field(1.0, **POSITIVE, description="weighted: deviation of the joints' torques [Nm, N]")
    push_deviation: float = Field(
        1.0, **POSITIVE, description="weighted: deviation of what pushes the base besides the ground [N, Nm]"
    )
