"""Records of pipes that carry Robot Points between plugins (Table 1, row 6 of the paper)."""

from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from pydantic import Field, model_validator

from solfer.config.records.bounds import Name
from solfer.config.records.conventions import ConventionRecord
from solfer.config.records.pipes import Content, ControllerRecord, FeedbackRecord, KindRecords
from solfer.config.records.record import Record
from solfer.config.records.robot_names import NameOf

QUANTITIES = {
    "position": 3,
    "orientation": 4,
    "pose": 7,
    "velocity": 3,
    "acceleration": 3,
    "twist": 6,
    "force": 3,
    "torque": 3,
    "wrench": 6,
}
"""Quantities of a Robot Point, with their count of numbers; linear before angular, quaternions (x, y, z, w)."""

MESSAGES = {
    "position": "geometry_msgs/PointStamped",
    "orientation": "geometry_msgs/QuaternionStamped",
    "pose": "geometry_msgs/PoseStamped",
    "twist": "geometry_msgs/TwistStamped",
    "wrench": "geometry_msgs/WrenchStamped",
    "velocity": "geometry_msgs/Vector3Stamped",
    "acceleration": "geometry_msgs/Vector3Stamped",
    "force": "geometry_msgs/Vector3Stamped",
    "torque": "geometry_msgs/Vector3Stamped",
}
"""Message of a single Point by its quantity."""

POINTS_MESSAGE = "solfer/RobotPoints"
"""Message of several Points, or wrenches."""

Quantity = Literal["position", "orientation", "pose", "velocity", "acceleration", "twist", "force", "torque", "wrench"]


def require_without(record: Record, what: str, but: tuple[str, ...] = ()) -> None:
    """Check that a pipe of `what` has no key without a meaning there, `but` some; a ValueError if it does."""
    others = ("convention", "filter", "calibration", "offset_position", "offset_orientation", "output_angles")
    idle = [key for key in others if key not in but and getattr(record, key, None) is not None]
    if idle:
        raise ValueError(f"a {what} has no '{idle[0]}'; expected a pipe without it")


class PointTags(Record):
    """Tags of a pipe of Points, which replace its DoFs; the component's port has the name of the pipe."""

    content: ClassVar[Content] = Content(port=True)

    space: Literal["POINT", "POINTS"] = Field(description="`POINT`, or `POINTS` for several in one message")
    dofs: None = Field(default=None, description="nothing: a Point has no DoFs")
    quantity: Quantity = Field(description="what the Points are")
    interface: Literal["world", "fixed"] = Field(
        default="world", description="axes of the numbers: those of the world, or `fixed` to the link"
    )
    link: Annotated[Name | None, NameOf("link")] = Field(
        default=None, description="the link, for the interface `fixed`"
    )
    names: tuple[str, ...] | None = Field(default=None, min_length=1, description="POINTS: their names, in order")
    count: int | None = Field(default=None, ge=1, le=1000, description="POINTS: how many, where they have no names")

    if TYPE_CHECKING:
        convention: ConventionRecord | None  # the pipe's

    @model_validator(mode="after")
    def _complete(self) -> "PointTags":
        if self.interface == "fixed" and self.link is None:
            raise ValueError("the interface 'fixed' needs the key 'link'")
        given = (self.names is not None) + (self.count is not None)
        if given != (self.space == "POINTS"):
            raise ValueError("POINTS need either 'names' or 'count', a POINT needs none of them")
        require_without(self, "Point", ("convention", "output_angles"))
        self._check_convention()
        if self.names is not None and len(set(self.names)) < len(self.names):
            raise ValueError("a name that stands twice in 'names'")
        return self

    def _check_convention(self) -> None:
        """Check that each convention acts on the quantity; a ValueError if one does not."""
        angles = getattr(self, "output_angles", None)
        if self.convention is None:
            if angles is not None:
                raise ValueError("'output_angles' without angles; expected convention.orientation.type: EULER")
            return
        if self.quantity not in ("orientation", "pose"):
            raise ValueError(f"a Point of the quantity '{self.quantity}' has no conventions; it has no orientation")
        if self.convention.twist.frame is not None:
            raise ValueError("a Point has no 'convention.twist'; its axes are those of the tag 'interface'")
        if self.convention.position.type == "NONE" and self.quantity != "pose":
            raise ValueError(f"a Point of the quantity '{self.quantity}' has no position that could be ignored")
        if self.euler and (self.quantity != "orientation" or self.size is not None or not self.received):
            raise ValueError("angles are only received, as a single orientation: space: POINT, quantity: orientation")
        if angles is not None and not self.euler:
            raise ValueError("'output_angles' without angles; expected convention.orientation.type: EULER")

    @property
    def euler(self) -> bool:
        """Whether the orientation travels as three angles."""
        return self.convention is not None and self.convention.orientation.type == "EULER"

    @property
    def received(self) -> bool:
        """Whether the plugin receives the Points."""
        return isinstance(self, FeedbackRecord)

    @property
    def default_message(self) -> str:
        """See `PipeRecord.default_message`."""
        if self.size is not None:
            return POINTS_MESSAGE
        return MESSAGES["velocity" if self.euler else self.quantity]

    @property
    def carried(self) -> tuple[str, ...]:
        """See `PipeRecord.carried`: the quantity."""
        return (f"{self.quantity} of {'a point' if self.size is None else f'{self.size} points'}",)

    @property
    def refers_to(self) -> str:
        """See `PipeRecord.refers_to`."""
        return f"axes of {self.frame}"

    @property
    def frame(self) -> str:
        """The frame whose axes the numbers are in."""
        return self.link if self.interface == "fixed" else "world"

    @property
    def size(self) -> int | None:
        """Number of Points; None for a single one."""
        return self.count if self.names is None else len(self.names)


class PointFeedbackRecord(PointTags, FeedbackRecord):
    """Points that a plugin receives: an input of its component."""


class PointControllerRecord(PointTags, ControllerRecord):
    """Points that a plugin publishes: an output of its component."""


RECORDS = KindRecords(PointFeedbackRecord, PointControllerRecord, PointTags, title="Points")
