"""Tags of how tasks follow references."""

from typing import Annotated

from pydantic import Field

from solfer.config import LIVE, Record

Rate = Annotated[float, Field(gt=0.0, le=1e6)]


class MotionRecord(Record):
    """How references move to their targets, and points to their references."""

    speed: Rate = Field(
        default=1.0, **LIVE, description="largest speed, with `feed_forward` also of the correction of an error [m/s]"
    )
    acceleration: Rate | None = Field(default=4.0, **LIVE, description="largest acceleration [m/s2]; null: any")
    turn_speed: Rate = Field(default=2.0, **LIVE, description="largest speed of a turn [rad/s]")
    turn_acceleration: Rate | None = Field(
        default=8.0, **LIVE, description="largest acceleration of a turn [rad/s2]; null: any"
    )
    feed_forward: bool = Field(default=True, description="whether tasks get the velocity of the reference, too")

    @property
    def limits(self) -> tuple[float, float, float, float]:
        """Speed [m/s], acceleration [m/s2], and those of a turn [rad/s, rad/s2]; inf where there is none."""
        free = float("inf")
        return (self.speed, self.acceleration or free, self.turn_speed, self.turn_acceleration or free)


class FollowingTags(Record):
    """Tags of a component whose tasks follow references."""

    motion: MotionRecord | None = Field(default=None, **LIVE, description="how references move; left out: the defaults")
    motions: dict[str, MotionRecord] = Field(default_factory=dict, description="the same for single tasks, by name")
    tolerance: float = Field(default=1e-3, gt=0.0, le=1.0, **LIVE, description="error of a task that has arrived [m]")
    turn_tolerance: float = Field(
        default=5e-3, gt=0.0, le=4.0, **LIVE, description="error of an orientation that has arrived [rad]"
    )

    def motion_of(self, task: str, period: float) -> MotionRecord:
        """Return how the reference of a task moves, in a control cycle of `period` [s]."""
        return self.motions.get(task, self.motion or MotionRecord())
