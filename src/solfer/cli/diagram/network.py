"""Which plugins there are, and which pipe leads from where to where."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from enum import Enum

from solfer.config import Configuration, ControllerRecord, FeedbackRecord, PipeRecord
from solfer.config.points import PointTags


class Kind(Enum):
    """What stands at an end of an arrow."""

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


SENSORS, LOWER_LEVEL = End(Kind.SENSORS), End(Kind.LOWER_LEVEL)


@dataclass(frozen=True)
class Arrow:
    """A pipe from one end to another.

    Attributes:
        tail: Who sends.
        head: Who hears.
        pipe: Name of the pipe, as the plugin at the head calls it; at the lower level that of its controller.
        state: Which State of a Robot it carries, see `state_of`.
        carries: What it carries of that, such as `position`.
        mapping: Map between the Robot's DoFs and the pipe's; empty if there is none.
        topic: The topic, or name of the pipe under XBOT; empty if there is none.
        silent: Whether nothing is sent, because the plugin is idle.
    """

    tail: End
    head: End
    pipe: str
    state: str = ""
    carries: tuple[str, ...] = ()
    mapping: str = ""
    topic: str = ""
    silent: bool = False

    @property
    def content(self) -> str:
        """What it carries, in words."""
        return f"{self.state} {', '.join(self.carries)}".strip()


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
    """

    name: str
    component: str
    robot: str
    model: str
    layer: str
    rate: float
    idle: bool


@dataclass(frozen=True)
class Network:
    """What a picture shows.

    Attributes:
        system: HW or SM.
        plugins: The plugins, in the order in which they were asked for.
        arrows: The pipes.
        shared: Shared plugins: for each name the groups of plugins that have one Robot.
    """

    system: str
    plugins: tuple[PluginBox, ...]
    arrows: tuple[Arrow, ...]
    shared: dict[str, tuple[tuple[str, ...], ...]] = field(default_factory=dict)

    def ends(self, kind: Kind) -> list[End]:
        """The ends of arrows that are of a kind, each once."""
        found = (end for arrow in self.arrows for end in (arrow.tail, arrow.head) if end.kind is kind)
        return list(dict.fromkeys(found))


def connect(
    configurations: Sequence[Configuration],
    components: Sequence[str],
    shared: dict[str, tuple[tuple[str, ...], ...]] | None = None,
) -> Network:
    """The network of some plugins.

    A controller pipe whose sink is the source of another plugin's feedback becomes an arrow between the two. Of the
    others, pipes of the lower level lead there, measured states come from the sensors, and the rest ends at its topic.

    Args:
        configurations: One for each plugin.
        components: Name of the component of each.
        shared: See `Network`.
    """
    boxes = tuple(_box(each, name) for each, name in zip(configurations, components, strict=True))
    arrows = [arrow for each in configurations for arrow in _heard(each, configurations)]
    arrows += [arrow for each in configurations for arrow in _sent(each, arrows)]
    return Network(configurations[0].system, boxes, tuple(arrows), shared or {})


def _box(configuration: Configuration, component: str) -> PluginBox:
    module, urdf = configuration.module, configuration.sources.urdf
    model = urdf.parameter or (urdf.file or "").rsplit("/", 1)[-1]
    robot = configuration.robot.configuration
    idle = module.mode == "idle"
    return PluginBox(module.name, component, robot, model, module.layer, configuration.rate, idle)


def _heard(listener: Configuration, configurations: Iterable[Configuration]) -> Iterator[Arrow]:
    head = End(Kind.PLUGIN, listener.module.name)
    for pipe in listener.feedbacks:
        topic = topic_of(pipe.source)
        tails = [End(Kind.PLUGIN, each.module.name) for each in configurations if topic in set(sinks(each))]
        for tail in tails or [_outside(pipe, topic)]:
            yield _arrow(tail, head, pipe, topic)


def _sent(sender: Configuration, heard: Iterable[Arrow]) -> Iterator[Arrow]:
    """Pipes of a plugin that none of the other plugins hears."""
    tail, idle = End(Kind.PLUGIN, sender.module.name), sender.module.mode == "idle"
    known = {arrow.topic for arrow in heard if arrow.tail == tail}
    for pipe in sender.controllers:
        topic = topic_sent(pipe)
        if pipe.lower_level:
            yield _arrow(tail, LOWER_LEVEL, pipe, topic, silent=idle)
        elif topic not in known:
            yield _arrow(tail, End(Kind.TOPIC, topic or pipe.name), pipe, topic)


def carried(pipe: PipeRecord) -> tuple[str, ...]:
    """The interfaces that a pipe carries, or the quantity of its Robot Points."""
    if isinstance(pipe, PointTags):
        return (pipe.quantity,)
    return tuple(name for name, switch in pipe.interface or () if switch is True)


def state_of(pipe: PipeRecord) -> str:
    """Which State of a Robot a pipe carries: `measured` or `desired`; empty for Robot Points, which are neither."""
    if pipe.space not in ("JOINT", "OPERATIONAL"):
        return ""
    return "desired" if pipe.function == "reference" else "measured"


def topic_sent(pipe: ControllerRecord) -> str:
    """The topic of a controller pipe; that of a lower-level controller is below the controller's name."""
    return f"{pipe.name}{pipe.sink or '/command'}" if pipe.lower_level else topic_of(pipe.sink)


def sinks(configuration: Configuration) -> Iterator[str]:
    """Topics that a plugin sends to other plugins."""
    return (topic_sent(pipe) for pipe in configuration.controllers if pipe.sink and not pipe.lower_level)


def _outside(pipe: FeedbackRecord, topic: str) -> End:
    """Where a feedback comes from that no plugin of the picture sends."""
    return SENSORS if state_of(pipe) == "measured" else End(Kind.TOPIC, topic or pipe.name)


def _arrow(tail: End, head: End, pipe: PipeRecord, topic: str, silent: bool = False) -> Arrow:
    mapping = "" if pipe.dofs is None else pipe.dofs.mapping
    return Arrow(tail, head, pipe.name, state_of(pipe), carried(pipe), mapping, topic, silent)


def topic_of(name: str | None) -> str:
    """A topic's name as both of its ends write it."""
    return (name or "").lstrip("/")
