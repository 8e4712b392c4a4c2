"""Records of a main configuration: its skeleton, robot configurations and modules."""

import os
from typing import Any, Literal

from pydantic import Field, create_model

from solfer.config.records.bounds import COUNT, DURATION, RATE, TIMEOUT, Name
from solfer.config.records.middlewares import MIDDLEWARES, MiddlewareName
from solfer.config.records.record import Record
from solfer.config.records.sources import FileRecord
from solfer.config.yaml.files import located
from solfer.config.yaml.nodes import YamlNode


class MainKeys(Record):
    """The skeleton of a main configuration; the parts that a module uses are checked when it is loaded."""

    middleware: MiddlewareName = Field(
        description=f"{' or '.join(f'`{name}`' for name in MIDDLEWARES)}: what the pipes travel through"
    )
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
    modules: dict[str, Any] = Field(description="plugin configurations by name")


_sections: dict[str, Any] = {
    kind.section: (kind.keys, Field(default_factory=kind.keys, description=f"keys for {kind.title} only"))
    for kind in MIDDLEWARES.values()
    if not kind.block
}
MainRecord: type[MainKeys] = create_model("MainRecord", __base__=MainKeys, __doc__=MainKeys.__doc__, **_sections)
"""The skeleton with a section for each middleware."""


class OverloadRecord(Record):
    """When a loop is overloaded: motions slow down then, and rest before the robot is lost."""

    left_out: float = Field(default=0.1, ge=0.01, le=0.5, description="fraction of the periods of a second left out")
    age: float = Field(default=0.05, **TIMEOUT, description="age of what is measured of the robot [s]")


class BaseJumpRecord(Record):
    """When the estimate of the base has jumped: farther than this in a time in which it can have moved less."""

    distance: float = Field(default=0.05, gt=0.0, le=10.0, description="margin of its place [m]")
    angle: float = Field(default=0.1, gt=0.0, le=3.0, description="margin of each of its angles [rad]")
    speed: float = Field(default=2.0, gt=0.0, le=100.0, description="largest speed that the robot can have [m/s]")
    turn_speed: float = Field(default=3.0, gt=0.0, le=100.0, description="largest rate of its angles [rad/s]")


class ModuleRecord(Record):
    """Keys of every plugin configuration; all its other keys are tags of the component."""

    name: str = Field(description="name of the configuration")
    layer: Literal["NRT", "RT"] = Field(description="layer that the plugin runs in: `NRT` or `RT`")
    mode: Literal["full", "idle"] = Field(description="`full`, or `idle`: nothing is sent to the lower level")
    silent: bool = Field(default=False, description="whether nothing is published to other plugins either")
    robot: Name = Field(description="robot configuration")
    controller: str | tuple[str, ...] = Field(description="set of controller pipes, or a list of pipes")
    blend: float = Field(
        default=0.5,
        **DURATION,
        description="shortest time in which commands blend in from the measured state at a start [s]; it takes longer "
        "where a joint would else need more than a fifth of its speed limit, and no time where nothing differs",
    )
    stall: float | None = Field(
        default=None,
        **TIMEOUT,
        description="lateness of its own loop at which the plugin holds, forgets its requests and starts again "
        "[s]; left out: 0.2, or 5 periods if these are longer; never longer than the `timeout` of a feedback",
    )
    base_jump: BaseJumpRecord = Field(
        default_factory=BaseJumpRecord,
        description="when the estimate of the base has jumped: references in the world move with it then",
    )
    overload: OverloadRecord = Field(
        default_factory=OverloadRecord, description="when its loop is too slow for the robot"
    )
    kinematics: bool = Field(description="whether the component needs kinematics")
    dynamics: bool = Field(description="whether the component needs dynamics")
    model_change: bool = Field(description="whether the component writes the State that it reads")
    class_: str | None = Field(
        default=None,
        alias="class",
        description="component or generator, as `package.module:Class`, or `library.so::Class` of a compiled one; "
        "without it the plugin of `-p` counts",
    )
    requires: tuple[Name, ...] = Field(
        default=(),
        description="in a shared plugin or an RT layer: names of others in it; where one of them stops, this one stops",
    )
    secondary_file: FileRecord | None = Field(default=None, description="file that is laid over all others")
    shared: dict[str, Any] = Field(
        default_factory=dict, description="keys that replace those above where a shared plugin lists the configuration"
    )


class SharedRecord(Record):
    """The configuration of a shared plugin: it runs others in one process (Listing 17 of the paper)."""

    name: str = Field(description="name of the configuration")
    layer: Literal["NRT", "RT"] = Field(description="layer of all its plugins: `NRT` or `RT`")
    mode: Literal["full", "idle"] = Field(default="full", description="`idle` makes all its plugins idle")
    plugins: tuple[str, ...] = Field(
        default=(), description="plugins in the order of their cycles: `plugin::configuration`, or `plugin` alone"
    )
    budget: float | None = Field(
        default=None,
        ge=0.01,
        le=1,
        description="fraction of the period that each component may take under ROS, where an RT layer has its "
        "`executor`; left out: as long as it likes",
    )
    overruns: int = Field(
        default=20, ge=1, le=1_000_000, description="overruns of it, not forgiven, at which the component is stopped"
    )
    grace: int = Field(default=100, **COUNT, description="first cycles of each start in which overruns do not count")


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


class RobotHead(Record):
    """Keys that all robot configurations share."""

    name: str = Field(default="", description="name of the robot, top key of its actuators and contacts")
    rate: float = Field(**RATE, description="rate of the control cycle [Hz], usually in the layer's file")


class RobotRecord(Record):
    """A robot configuration."""

    name: str = Field(description="name of the robot")
    configuration: str = Field(description="name of this configuration")
    feedback: FeedbackChoice = Field(default_factory=FeedbackChoice, description="feedback pipes: a set or a list")
    actuators: ReadRecord = Field(description="whether actuators are read")
    contacts: ContactsChoice = Field(description="whether contacts are read, and received")


def placed_class(target: str | None, folder: str) -> str | None:
    """Return the `class` of a module; a path to its library counts from `folder`, that of the configuration."""
    library, separator, name = (target or "").partition("::")
    if not separator or os.sep not in library:
        return target
    return f"{located(library, folder)}{separator}{name}"
