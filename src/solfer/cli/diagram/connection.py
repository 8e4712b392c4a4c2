"""The network that some configurations make."""

from collections.abc import Iterable, Iterator, Sequence

from solfer.cli.diagram.network import LOWER_LEVEL, SENSORS, Arrow, End, Kind, Network, PluginBox
from solfer.cli.pipes import content, received, sinks, state_of, topic_of
from solfer.config import AnyPipeRecord, Configuration, FeedbackRecord


def connect(
    configurations: Sequence[Configuration],
    components: Sequence[str],
    shared: dict[str, tuple[tuple[str, ...], ...]] | None = None,
) -> Network:
    """Build the network of some plugins.

    A controller pipe whose sink is the source of another plugin's feedback becomes an arrow between the two. Of the
    others, pipes of the lower level lead there, measured states come from the sensors, and the rest ends at its topic.

    Args:
        configurations: One for each plugin.
        components: Name of the component of each.
        shared: See `Network`.
    """
    boxes = tuple(_box(each, name) for each, name in zip(configurations, components, strict=True))
    arrows = [arrow for each in configurations for arrow in _received(each, configurations)]
    arrows += [arrow for each in configurations for arrow in _sent(each, arrows)]
    return Network(configurations[0].system, boxes, tuple(arrows), shared or {})


def _box(configuration: Configuration, component: str) -> PluginBox:
    module, urdf = configuration.module, configuration.sources.urdf
    model = urdf.parameter or (urdf.file or "").rsplit("/", 1)[-1]
    robot = configuration.robot.configuration
    idle = module.mode == "idle"
    return PluginBox(module.name, component, robot, model, module.layer, configuration.rate, idle)


def _received(receiver: Configuration, configurations: Iterable[Configuration]) -> Iterator[Arrow]:
    head = End(Kind.PLUGIN, receiver.module.name)
    for pipe in received(receiver):
        topic = topic_of(pipe)
        tails = [End(Kind.PLUGIN, each.module.name) for each in configurations if topic in set(sinks(each))]
        for tail in tails or [_outside(pipe)]:
            yield _arrow(tail, head, pipe)


def _sent(sender: Configuration, arrows: Iterable[Arrow]) -> Iterator[Arrow]:
    """Yield the pipes of a plugin that no other plugin receives."""
    tail, idle = End(Kind.PLUGIN, sender.module.name), sender.module.mode == "idle"
    known = {arrow.topic for arrow in arrows if arrow.tail == tail}
    for pipe in sender.controllers:
        topic = topic_of(pipe)
        if pipe.lower_level:
            yield _arrow(tail, LOWER_LEVEL, pipe, idle)
        elif topic not in known:
            yield _arrow(tail, End(Kind.TOPIC, topic or pipe.name), pipe)


def _outside(pipe: FeedbackRecord) -> End:
    """Return the origin of a feedback that no plugin of the picture sends."""
    return SENSORS if state_of(pipe) in ("measured", "motor side") else End(Kind.TOPIC, topic_of(pipe) or pipe.name)


def _arrow(tail: End, head: End, pipe: AnyPipeRecord, idle: bool = False) -> Arrow:
    return Arrow(tail, head, pipe.name, content(pipe), pipe.refers_to, topic_of(pipe), idle)
