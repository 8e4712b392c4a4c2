"""Tags of the component `inverse_kinematics`."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from solfer.components.following.tags import FollowingTags, MotionRecord
from solfer.config import LIVE, NameOf, Record
from solfer.config.tasks.original import OriginalStackTags, hands
from solfer.config.tasks.stack import StackRecord

_ORIGINAL = "; with the original's tags "


class DeflectionRecord(Record):
    """How far the robot yields under its load."""

    time_constant: float = Field(
        default=0.5,
        ge=0.01,
        le=100.0,
        **LIVE,
        description="within this it is taken over; longer than the robot swings [s]",
    )
    most: float = Field(
        default=0.05,
        gt=0.0,
        le=1.0,
        **LIVE,
        description="largest one: what is held otherwise is not pushed farther [rad, m]",
    )


class InverseKinematicsTags(FollowingTags, OriginalStackTags):
    """Tags of the component `inverse_kinematics`."""

    stack: StackRecord | None = Field(default=None, description="the stack of tasks; left out: the original's tags")
    chain: Annotated[str | None, NameOf("group")] = Field(
        default=None, min_length=1, description="SRDF group of the joints that move; left out: all, and the base"
    )
    motion: MotionRecord | None = Field(
        default=None,
        **LIVE,
        description="how references move; left out: the defaults" + _ORIGINAL + "0.01 m in a cycle",
    )
    closed_on: Literal["model", "measurement"] | None = Field(
        default=None,
        description="where tasks are computed: at the positions that are commanded, or at the measured ones; left out: "
        "`model`" + _ORIGINAL + "`measurement`",
    )
    lead: Annotated[float, Field(gt=0.0, le=100.0)] | None = Field(
        default=None,
        description="measurement: how far a command may be from the measured position [rad, m]; left out: any way",
    )
    reach: Annotated[float, Field(ge=0.0, le=1e3)] | None = Field(
        default=None,
        description="length of limbs, by which tasks with large errors are damped [m]; 0: they are not; "
        "left out: 0.5" + _ORIGINAL + "0",
    )
    deflection: DeflectionRecord | None = Field(
        default=None,
        description="model: how it takes over what joints and base give way under the weight, so that points are at "
        "their references in spite of that; left out: it does not",
    )

    @model_validator(mode="after")
    def _check(self) -> "InverseKinematicsTags":
        if self.stack is None and not self.has_stack:
            raise ValueError("there is neither 'stack' nor 'IK'; expected one of them")
        for key in ("track", "reference", "workspace_init", "ik", "tunning", "tunnings"):
            if self.stack is not None and getattr(self, key) is not None:
                raise ValueError(f"'{'IK' if key == 'ik' else key}' beside 'stack'; expected one of them")
        if self.lead is not None and not self.is_measured:
            raise ValueError("'lead' has no effect on a model; expected closed_on: measurement, or no 'lead'")
        if self.deflection is not None and self.is_measured:
            raise ValueError("'deflection' has no effect on a measurement; expected closed_on: model, or none")
        return self

    @property
    def is_measured(self) -> bool:
        """Whether tasks are computed at the measured positions."""
        return (self.closed_on or ("model" if self.stack else "measurement")) == "measurement"

    @property
    def characteristic_length(self) -> float:
        """Length of the damping of tasks with a large error [m]."""
        return (0.5 if self.stack else 0.0) if self.reach is None else self.reach

    def stack_record(self) -> StackRecord:
        """Return the stack of tasks, also of the original's tags.

        Raises:
            SolferError: A tag of the original is missing, or contradicts another.
        """
        return hands(self) if self.stack is None else self.stack

    def motion_of(self, task: str, period: float) -> MotionRecord:
        """Return how the reference of a task moves, in a control cycle of `period` [s]."""
        if task in self.motions or self.motion is not None or self.stack is not None:
            return super().motion_of(task, period)
        step = 0.01  # [m] most that the original moves a reference in one cycle
        return MotionRecord(speed=step / period, acceleration=None, feed_forward=False)
