"""Records of a main configuration: its skeleton, robot configurations and modules."""

from typing import Any, Literal

from pydantic import Field

from solfer.config.records.bounds import DURATION, PATIENCE
from solfer.config.records.record import Record
from solfer.config.records.sources import FileRecord
from solfer.config.yaml.nodes import YamlNode


class MiddlewareRecord(Record):
    """The part of a configuration for one middleware."""

    source: dict[str, Any] = Field(default_factory=dict, description="where URDF, SRDF, actuators and contacts are")
    mapping: dict[str, Any] = Field(default_factory=dict, description="maps, by name")
    feedback: dict[str, Any] = Field(default_factory=dict, description="this middleware's part of feedbacks, by pipe")
    controller: dict[str, Any] = Field(
        default_factory=dict, description="this middleware's part of controllers, by pipe"
    )


class MainRecord(Record):
    """The skeleton of a main configuration; the parts that a module uses are checked when it is loaded."""

    middleware: Literal["ROS", "XBOT"] = Field(description="`ROS` or `XBOT`: what the pipes travel through")
    system: Literal["HW", "SM"] = Field(description="`HW` (hardware) or `SM` (simulation)")
    layers: dict[Literal["RT", "NRT"], FileRecord] = Field(
        default_factory=dict, description="for each layer the file that is laid over this one"
    )
    robot: dict[str, Any] = Field(description="the robot's name, files of the systems, and robot configurations")
    feedbacks: dict[str, Any] = Field(default_factory=dict, description="named sets of feedback pipes")
    controllers: dict[str, Any] = Field(default_factory=dict, description="named sets of controller pipes")
    feedback: dict[str, Any] = Field(default_factory=dict, description="library of feedback pipes")
    controller: dict[str, Any] = Field(default_factory=dict, description="library of controller pipes")
    calibration: dict[str, Any] = Field(default_factory=dict, description="library of calibrations of the hardware")
    ros: MiddlewareRecord = Field(default_factory=MiddlewareRecord, description="keys for ROS only")
    xbot: MiddlewareRecord = Field(default_factory=MiddlewareRecord, description="keys for XBotCore only")
    modules: dict[str, Any] = Field(description="plugin configurations by name")


class ModuleRecord(Record):
    """Keys of every plugin configuration; all its other keys are tags of the component."""

    name: str = Field(description="name of the configuration")
    layer: Literal["NRT", "RT"] = Field(description="layer that the plugin runs in: `NRT` or `RT`")
    mode: Literal["full", "idle"] = Field(description="`full`, or `idle`: nothing is sent to the lower level")
    silent: bool = Field(default=False, description="whether nothing is published to other plugins either")
    robot: str = Field(min_length=1, description="robot configuration")
    controller: str | tuple[str, ...] = Field(description="set of controller pipes, or a list of pipes")
    blend: float = Field(
        default=0.5,
        **DURATION,
        description="shortest time in which commands blend in from the measured state at a start [s]; it takes longer "
        "where a joint would else need more than a fifth of its speed limit, and no time where nothing differs",
    )
    stall: float | None = Field(
        default=None,
        **PATIENCE,
        description="lateness of its own loop at which the plugin holds, forgets its requests and begins anew "
        "[s]; left out: 0.06, or 5 periods if these are longer; never longer than the `timeout` of a feedback",
    )
    kinematics: bool = Field(description="whether the component needs kinematics")
    dynamics: bool = Field(description="whether the component needs dynamics")
    model_change: bool = Field(description="whether the component writes the State that it reads")
    class_: str | None = Field(
        default=None,
        alias="class",
        description="component or generator, as `package.module:Class`; without it the plugin of `-p` counts",
    )
    secondary_file: FileRecord | None = Field(default=None, description="file that is laid over all others")


class SharedRecord(Record):
    """The configuration of a shared plugin: it runs others in one process (Listing 17 of the paper)."""

    name: str = Field(description="name of the configuration")
    layer: Literal["NRT", "RT"] = Field(description="layer of all its plugins: `NRT` or `RT`")
    mode: Literal["full", "idle"] = Field(default="full", description="`idle` makes all its plugins idle")
    plugins: tuple[str, ...] = Field(
        default=(), description="plugins in the order of their cycles: `plugin::configuration`, or `plugin` alone"
    )


def is_shared(name: str, module: YamlNode) -> bool:
    """Return whether a module is a shared plugin: it lists `plugins`, or has the paper's name for one."""
    return name == "shared" or module.get("plugins") is not None


class ReadRecord(Record):
    """Whether a description is read."""

    read: bool = Field(description="whether it is read")
    feedback: bool | None = Field(default=None, deprecated="actuators are not received", description="-")


class ContactsChoice(Record):
    """Whether contacts are read, and whether their wrenches are received."""

    read: bool = Field(description="whether they are read")
    feedback: bool = Field(
        default=False, description="whether the wrenches of those that name a topic in their file are received"
    )


class FeedbackChoice(Record):
    """Which feedback pipes a robot receives."""

    layer: str | None = Field(default=None, description="a named set of `feedbacks`")
    list: tuple[str, ...] | None = Field(default=None, description="the pipes, in the order in which they are read")


class RobotRecord(Record):
    """A robot configuration."""

    name: str = Field(description="name of the robot")
    configuration: str = Field(description="name of this configuration")
    feedback: FeedbackChoice = Field(default_factory=FeedbackChoice, description="feedback pipes: a set or a list")
    actuators: ReadRecord = Field(description="whether actuators are read")
    contacts: ContactsChoice = Field(description="whether contacts are read, and received")
