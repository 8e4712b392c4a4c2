"""Plugins, and the pipes between them, the sensors and the lower level."""

from dataclasses import dataclass, field
from enum import Enum

from solfer.cli.plugins import Declared


class Kind(Enum):
    """Kind of an arrow's end."""

    PLUGIN = "plugin"
    SENSORS = "sensors"
    LOWER_LEVEL = "lower level"
    TOPIC = "topic"


@dataclass(frozen=True)
class End:
    """One end of an arrow; `name` is that of the plugin or the topic, empty for sensors and the lower level."""

    kind: Kind
    name: str = ""

    def __str__(self) -> str:
        return f"{self.kind.value} {self.name}".rstrip()


SENSORS = End(Kind.SENSORS)
LOWER_LEVEL_END = End(Kind.LOWER_LEVEL)


@dataclass(frozen=True)
class Arrow:
    """A pipe from one end to another.

    Attributes:
        tail: The sender.
        head: The receiver.
        pipe: Name of the pipe, as the plugin at the head calls it; at the lower level that of its controller.
        content: What it carries, such as `measured position, velocity`.
        reference: What its numbers refer to, such as `map RBDL`.
        topic: The topic, or name of the pipe under XBOT; empty if there is none.
        idle: Whether nothing is sent, because the plugin is idle.
    """

    tail: End
    head: End
    pipe: str
    content: str = ""
    reference: str = ""
    topic: str = ""
    idle: bool = False


@dataclass(frozen=True)
class PluginBox:
    """A plugin.

    Attributes:
        name: Name of its configuration.
        component: Name of its component.
        robot: Name of its robot configuration.
        model: Where its Robot's URDF comes from.
        layer: RT or NRT.
        rate: Rate of its cycle [Hz].
        idle: Whether it commands nothing.
        declared: What its component declares.
    """

    name: str
    component: str
    robot: str
    model: str
    layer: str
    rate: float
    idle: bool
    declared: tuple[Declared, ...] = ()

    def declares(self, kind: str) -> set[str]:
        """Return the names of all declarations of a kind, without a leading slash."""
        return {one.name.lstrip("/") for one in self.declared if one.kind == kind}


@dataclass(frozen=True)
class Network:
    """The content of a picture.

    Attributes:
        system: HW or SM.
        plugins: The plugins, in the requested order.
        arrows: The pipes.
        shared: Shared plugins: for each name the groups of plugins that have one Robot.
    """

    system: str
    plugins: tuple[PluginBox, ...]
    arrows: tuple[Arrow, ...]
    shared: dict[str, tuple[tuple[str, ...], ...]] = field(default_factory=dict)

    def ends(self, kind: Kind) -> list[End]:
        """Return the ends of arrows that are of a kind, each once."""
        found = (end for arrow in self.arrows for end in (arrow.tail, arrow.head) if end.kind is kind)
        return list(dict.fromkeys(found))
