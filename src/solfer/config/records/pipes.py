"""Records of pipes: those that a plugin receives (feedback) and those that it sends (controller).

A record contains the generic part of a pipe with the middleware's part laid over it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from pydantic import BeforeValidator, Field, model_validator

from solfer.config.records.bounds import TIMEOUT, Name
from solfer.config.records.conventions import (
    AnglesRecord,
    ConventionRecord,
    OffsetOrientationRecord,
    OffsetPositionRecord,
)
from solfer.config.records.record import Record
from solfer.config.records.robot_names import NameOf

HOMES = {
    "JOINT": "joint",
    "OPERATIONAL": "body",
    "POINT": "point",
    "POINTS": "point",
    "CONTACT": "contact",
    "CONTACTS": "contact",
}
"""Home of each kind: its records are in `solfer.config.kinds.<home>`, its pipes are made by `solfer.pipes.<home>`."""

if TYPE_CHECKING:
    Space = str
else:
    Space = Literal[tuple(HOMES)]

CONTROLLER_ALIASES = {
    "custom_controller/ActuatorPositionControllerClasses": "impedance",
    "custom_controller/ActuatorVelocityController": "velocity",
}
"""Types of the original program's lower level, and their replacements."""

Function = Literal["state", "motor", "reference"]
"""State of a Robot that a pipe writes or publishes: measured on the link or the motor side, or desired."""


JOINT_COMMAND = "solfer/JointCommand"
"""Message of joints between plugins and to the lower level."""

LOWER_LEVEL_LAYERS = ("online", "lower_level")
"""Values of `layer` for pipes to and from the robot itself; XBotCore calls what it measures `online`."""


@dataclass(frozen=True)
class Content:
    """Content of pipes of a kind, as far as others than these pipes need it.

    Attributes:
        joints: Whether it is numbers of joints: those have a motor side, limits, a calibration, and a lower level.
        body: Whether it is the state of a rigid body, whose first message may report where the State's base is.
        contacts: Whether the Robot has to have contacts.
        port: Whether it belongs to a port of the component, and not to the Robot.
        measures: Whether a feedback writes a State, which is a measured one if its `function` does not say otherwise.
        needed: Keys that every feedback has to have, beside those of its record and of the middleware.
        online: Topics of the lower level's measurements by `function`: XBotCore's pipes do not name them.
    """

    joints: bool = False
    body: bool = False
    contacts: bool = False
    port: bool = False
    measures: bool = False
    needed: tuple[str, ...] = ()
    online: Mapping[str, str] = field(default_factory=dict)


class DofsRecord(Record):
    """The DoFs that a pipe carries, and their order at its other end."""

    chain: Name = Field(description="SRDF group, or `all`: the part of the robot")
    type: Name = Field(
        description="`all`, `actuated` or `unactuated` DoFs of the chain, `body` for a link, or a map's name",
    )
    name: str | None = Field(default=None, description="the link, for the type `body`")
    mapping: Name = Field(description="bidirectional map between the robot's order and the pipe's")

    @model_validator(mode="after")
    def _body_has_a_name(self) -> "DofsRecord":
        if self.type == "body" and self.name is None:
            raise ValueError("the type 'body' needs the key 'name', a link")
        return self


class InterfaceRecord(Record):
    """The State interfaces that a pipe carries; other keys are interfaces that were added to the State."""

    model_config = Record.model_config | {"extra": "allow"}
    __pydantic_extra__: dict[str, bool]

    position: bool = Field(default=False, description="whether positions are carried [rad, m]")
    velocity: bool = Field(default=False, description="whether velocities are carried [rad/s, m/s]")
    effort: bool = Field(default=False, description="whether efforts are carried, the State's torque [Nm, N]")
    acceleration: bool = Field(default=False, description="JOINT: whether accelerations are carried [rad/s2, m/s2]")
    stiffness: bool = Field(default=False, description="JOINT: whether the joints' stiffness is carried [Nm/rad, N/m]")
    damping: bool = Field(default=False, description="JOINT: whether the joints' damping is carried [Nms/rad, Ns/m]")

    def __eq__(self, other: object) -> bool:
        return super().__eq__(other) and self.model_extra == other.model_extra  # type: ignore[attr-defined]

    def __hash__(self) -> int:
        return hash((super().__hash__(), self.carried))

    @model_validator(mode="after")
    def _torque_is_effort(self) -> "InterfaceRecord":
        if "torque" in (self.model_extra or {}):
            raise ValueError("the State's torque travels as 'effort'; expected effort: true")
        return self

    @property
    def carried(self) -> tuple[str, ...]:
        """Names of what is carried."""
        return tuple(name for name, switch in self if switch)

    @property
    def measurable(self) -> bool:
        """Whether a message of measured joints has room for all."""
        return not set(self.carried) - {"position", "velocity", "effort"}


class FilterRecord(Record):
    """A second-order low-pass filter of every interface of a pipe, at the rate of the plugin."""

    run: bool = Field(default=True, description="whether the filter runs")
    frequency: float = Field(ge=1e-3, le=2000, description="cut-off frequency, below half of the rate [Hz]")
    damping: float = Field(default=1.0, ge=1e-3, le=1000, description="damping ratio")


class ToleranceRecord(Record):
    """Distance that a first measurement may lie outside of the joints' limits.

    Prismatic joints have no tolerance of position and velocity: their unit is another one.
    """

    position: float = Field(default=0.0, ge=0, le=1e4, description="tolerance of positions [deg]")
    velocity: float = Field(default=0.0, ge=0, le=1e5, description="tolerance of velocities [deg/s]")
    torque: float = Field(default=0.0, ge=0, le=1e5, description="tolerance of efforts [Nm]")


class LimitsRecord(Record):
    """Checks of the measurement with which a plugin would start; it does not start outside of the joints' limits."""

    tolerance: ToleranceRecord = Field(default_factory=ToleranceRecord, description="tolerances")


class PipeRecord(Record):
    """Tags that both directions share.

    Attributes:
        content: What pipes of this kind carry.
    """

    content: ClassVar[Content] = Content()

    name: str = Field(description="name of the pipe")
    dofs: DofsRecord = Field(description="the DoFs: chain, type, mapping")
    interface: InterfaceRecord = Field(description="the State interfaces: position, velocity, effort")
    convention: ConventionRecord | None = Field(
        default=None, description="conventions of a rigid body's state, or of Points with an orientation"
    )
    filter: FilterRecord | None = Field(default=None, description="low-pass filter")
    calibration: Name | None = Field(default=None, description="calibration of the hardware's joints")
    message: str | None = Field(
        default=None,
        description="`package/Type` of the message; XBOT, left out: the one that fits the other end",
    )
    layer: Literal["online", "lower_level", "RT", "NRT"] | None = Field(
        default=None, description="XBOT: layer that the other end lives in"
    )

    @property
    def default_message(self) -> str:
        """Message of a pipe that names none, the same for every plugin and bridge at either end."""
        return JOINT_COMMAND

    @property
    def travels_as(self) -> str:
        """Message of the pipe: its own or the default."""
        return self.message or self.default_message

    @property
    def carried(self) -> tuple[str, ...]:
        """What it carries, in words: the interfaces of a State."""
        return self.interface.carried

    @property
    def refers_to(self) -> str:
        """What its numbers refer to, in words: a map, a link, or axes."""
        return f"map {self.dofs.mapping}"


class FeedbackRecord(PipeRecord):
    """A pipe that a plugin receives."""

    space: Space = Field(description="what it carries, or `SKIP` to leave it out")
    function: Function | None = Field(
        default=None,
        description="State that it writes: `state` (measured; OPERATIONAL: if left out), `motor` (measured, motor "
        "side) or `reference` (desired)",
    )
    source: str | None = Field(
        default=None,
        description="ROS: topic; XBOT: name of the pipe; left out with `layer: online`: the lower level's own",
    )
    initialize: bool = Field(default=False, description="whether the plugin waits for a first message when it starts")
    timeout: float | None = Field(
        default=None,
        **TIMEOUT,
        description="age of the newest message above which a cycle is a strike [s]; left out: 0.2, or 5 periods of the "
        "plugin if these are longer",
    )
    strikes: int = Field(default=10, ge=1, le=1_000_000, description="strikes in a row until the pipe times out")
    on_timeout: Literal["keep", "hold", "stop", "damp"] | None = Field(
        default=None,
        description="what happens then; left out: `hold` for the State of the robot, `keep` for references of others",
    )
    history: int | None = Field(
        default=None,
        ge=2,
        le=1000,
        description="measured States: most messages of one cycle that are handed over one by one in the State's "
        "`histories`; left out: the newest message alone counts",
    )
    reference: str | None = Field(default=None, description="ROS: the sender's name of the link, if it is another one")
    sensor: Annotated[Name | None, NameOf("link")] = Field(
        default=None,
        description="XBOT, OPERATIONAL with `layer: online`: link of the inertial sensor that is read, in place of "
        "`dofs.name`; `source` counts only together with `message`",
    )
    limits: LimitsRecord | None = Field(
        default=None,
        description="measured joints: no plugin starts while they are outside of their limits; left out: no check",
    )
    offset_position: OffsetPositionRecord | None = Field(
        default=None, description="where the sensor sits on its link, in addition to the URDF"
    )
    offset_orientation: OffsetOrientationRecord | None = Field(
        default=None, description="rotation from the sensor to its link, in addition to the URDF"
    )
    output_angles: AnglesRecord | None = Field(default=None, description="order of the rotations of Euler angles")
    calibrate: bool = Field(
        default=False,
        description="OPERATIONAL: whether heading and position of the first message are those that the State has then, "
        "so that a sender with a world of its own fits",
    )

    @model_validator(mode="after")
    def _online_has_a_topic(self) -> "FeedbackRecord":
        """Fill in the topic of what XBotCore measures: its pipes have the layer only, or the link of a sensor."""
        topic = self.content.online.get(self.function or "state") if self.layer in LOWER_LEVEL_LAYERS else None
        by_sensor = self.reads_sensor and self.message is None
        if topic is not None and (self.source is None or by_sensor):
            self.__dict__["source"] = topic  # a record is frozen once it is made
        return self

    @model_validator(mode="after")
    def _motors_are_joints(self) -> "FeedbackRecord":
        _require_joints(self)
        if self.calibrate and not self.content.body:
            raise ValueError(f"'calibrate' is for rigid bodies (space: OPERATIONAL), not for {self.space}")
        if self.limits is not None and (not self.content.joints or self.function == "reference"):
            raise ValueError("'limits' are for measured joints (space: JOINT, function: state or motor)")
        if self.history is not None and not self.measures:
            raise ValueError("'history' is for measured States (space: JOINT or OPERATIONAL, function: state or motor)")
        return self

    @property
    def reads_sensor(self) -> bool:
        """Whether the link `sensor` is measured."""
        return self.sensor is not None and self.content.body and self.layer in LOWER_LEVEL_LAYERS

    @property
    def measured_link(self) -> str | None:
        """The link that is measured; None: none is."""
        return None

    @property
    def measures(self) -> bool:
        """Whether it writes a measured State of the Robot."""
        return self.content.measures and self.function != "reference"

    @property
    def of_plugins(self) -> bool:
        """Whether it carries what other plugins request, and nothing that is measured."""
        return not self.measures and not self.content.contacts

    @property
    def measures_joints(self) -> bool:
        """Whether it writes joints of the State that is measured on the link side."""
        return self.content.joints and self.function == "state"

    @property
    def timeout_action(self) -> Literal["keep", "hold", "stop", "damp"]:
        """Return the action on a timeout: that of the record, else the safe one for the content."""
        if self.on_timeout is not None:
            return self.on_timeout
        measured = self.function in ("state", "motor") or (self.function is None and self.content.measures)
        return "hold" if measured else "keep"


def _require_joints(record: "FeedbackRecord | ControllerRecord") -> None:
    if record.function == "motor" and not record.content.joints:
        raise ValueError(f"the motor side in {record.space} space; it has joints only: space: JOINT")


def _known_type(value: object) -> object:
    """Map old names of a type; an empty text, as old files have it, counts as not given."""
    return CONTROLLER_ALIASES.get(value, value) or None if isinstance(value, str) else value


class ControllerRecord(PipeRecord):
    """A pipe that a plugin sends to."""

    space: Space = Field(default="JOINT", description="what it carries, or `SKIP` to leave it out")
    type: Annotated[Literal["reference", "impedance", "velocity"] | None, BeforeValidator(_known_type)] = Field(
        default=None,
        description="ROS: `reference` (to other plugins), or a controller of the lower level: `impedance`, `velocity`",
    )
    function: Function = Field(
        default="reference",
        description="State that it sends: `reference` (desired), `state` (measured) or `motor` (measured, motor side)",
    )
    frame_id: Name = Field(
        default="world", description="OPERATIONAL: name of the world in the messages, such as `odom`"
    )
    controller: Name | None = Field(
        default=None,
        description="controller of the lower level that gets the commands, so that plugins on disjoint joints have "
        "pipes of their own to it; default: the one with the pipe's name",
    )
    open_loop: bool = Field(
        default=False,
        description="lower level: whether its joints may be commanded though no feedback measures them: each starts "
        "where the first command is, at once; left out: the plugin waits until all of them are measured",
    )
    sink: str | None = Field(
        default=None, description="topic; of a lower-level controller it follows the controller's name"
    )
    ff_service: Name | None = Field(
        default=None,
        description="service below the controller's name that switches feed-forward torques; each start switches "
        "them on",
    )
    load_service: Name | None = Field(
        default=None,
        description="service below the controller's name that loads the gains of `source.controller` at each start; "
        "default: `/load_gains` of a controller with springs",
    )
    initialize: str | None = Field(
        default=None, deprecated="a controller starts from the measured state", description="obsolete"
    )

    @model_validator(mode="after")
    def _lower_level_has_joints(self) -> "ControllerRecord":
        _require_joints(self)
        if self.frame_id != "world" and not self.content.body:
            raise ValueError(f"'frame_id' is for rigid bodies (space: OPERATIONAL), not for {self.space}")
        if self.lower_level and not self.content.joints:
            raise ValueError(f"a controller of the lower level in {self.space} space; it has joints only: space: JOINT")
        if self.lower_level and self.function != "reference":
            raise ValueError("a controller of the lower level cannot be sent measurements: function: reference")
        for name in ("controller", "open_loop"):
            if getattr(self, name) and not self.lower_level:
                raise ValueError(f"'{name}' is for pipes to the lower level: type: impedance, or velocity")
        return self

    @property
    def leads_to(self) -> str:
        """Name of the controller of the lower level that it commands."""
        return self.controller or self.name

    @property
    def has_springs(self) -> bool:
        """Whether it commands a controller with gains, not one of speeds alone."""
        return self.lower_level and self.type != "velocity" and self.interface.carried != ("velocity",)

    @property
    def lower_level(self) -> bool:
        """Whether it commands the robot itself; such a pipe sends nothing in the mode `idle`."""
        return self.layer == "lower_level" or self.type in ("impedance", "velocity")


AnyPipeRecord = FeedbackRecord | ControllerRecord
"""A pipe of either direction, for code that looks at the tags of one of them."""


@dataclass(frozen=True)
class KindRecords:
    """Records of a kind of pipe.

    Attributes:
        feedback: Record of a pipe that a plugin receives.
        controller: Record of a pipe that a plugin sends to.
        tags: Tags that only this kind has; None: those of every pipe.
        title: What it carries, as the title of the reference of these tags.
    """

    feedback: type[FeedbackRecord]
    controller: type[ControllerRecord]
    tags: type[Record] | None = None
    title: str = ""
