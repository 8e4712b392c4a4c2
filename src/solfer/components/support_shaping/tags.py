"""Tags of the component `support_shaping`."""

from typing import Annotated, Literal

from pydantic import Field

from solfer.components.wheeled_motion.tags import DrivingTags, Limit
from solfer.config import LIVE, NameOf
from solfer.errors import SizeMismatch

Distance = Annotated[float, Field(gt=0.0, le=5.0)]
Weight = Annotated[float, Field(gt=0.0, le=1e6)]


class SupportShapingTags(DrivingTags):
    """Tags of the component `support_shaping`."""

    margins: tuple[Distance, ...] = Field(
        default=(0.2,),
        min_length=1,
        **LIVE,
        description="least distances of the balance from the edges of the support polygon, of the edge from each wheel "
        "clockwise to the next, or one number for all [m]",
    )
    workspaces: tuple[Distance, ...] = Field(
        default=(0.65,),
        min_length=1,
        **LIVE,
        description="largest distances of the wheels from their hips, or one number for all [m]",
    )
    margin_gain: Weight = Field(
        default=50.0, **LIVE, description="weight of what margins lack, beside changes of the vertices' velocities"
    )
    workspace_gain: Weight = Field(default=120.0, **LIVE, description="the same of workspaces")
    hips: Annotated[str, NameOf("group")] = Field(
        default="hips", min_length=1, description="SRDF group of the links from which the wheels' distances count"
    )
    balance: Literal["center_of_pressure", "center_of_mass"] = Field(
        default="center_of_pressure",
        description="what has the margins; the centre of mass also where no forces of the ground are known",
    )
    horizon: float = Field(
        default=0.5,
        gt=0.0,
        le=60.0,
        **LIVE,
        description="time in which margins and workspaces may be used up; improved [s]",
    )
    recovery: Limit = Field(
        default=0.05, **LIVE, description="largest speed with which a margin that is too small grows; improved [m/s]"
    )
    warn_below: float = Field(
        default=0.02,
        ge=0.0,
        le=1.0,
        **LIVE,
        description="a warning is logged where less than this is left of a limit [m]",
    )
    infeasible: Literal["slow", "hold"] = Field(
        default="slow",
        description="what happens while a limit cannot be kept: the motion slows down to a fifth, or holds",
    )
    reactive: bool = Field(
        default=False, description="whether the support polygon moves under a robot that is pushed; improved"
    )
    reactive_margin: Distance = Field(
        default=0.2, **LIVE, description="distance of the capture point from an edge below which it does [m]"
    )
    centers: bool = Field(
        default=False,
        description="whether a wheel's centre or its vertex moves its distance, as in `NwheelsZMPIV`; original",
    )

    def each(self, tag: str, count: int) -> tuple[float, ...]:
        """Return the numbers of a tag, one for each of `count` wheels; a SizeMismatch if there are others."""
        values: tuple[float, ...] = getattr(self, tag)
        if len(values) == 1:
            return values * count
        if len(values) != count:
            raise SizeMismatch(
                f"{len(values)} numbers in '{tag}'",
                where=self.where(tag),
                expected=f"one for each of the {count} wheels, or one",
            )
        return values
