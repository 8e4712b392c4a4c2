"""The network that some configurations make."""

from collections.abc import Iterable, Iterator, Sequence

from solfer.cli.pipes import content, received, sinks, state_of, topic_of
from solfer.cli.plugins import Declared, checked, component_of, configurations_of, known_declarations
from solfer.config import AnyPipeRecord, Configuration, FeedbackRecord
from solfer.errors import raise_all
from solfer.plugins.sharing.groups import conflicts, robot_groups
from solfer_tools.cli.diagram.network import LOWER_LEVEL_END, SENSORS, Arrow, End, Kind, Network, PluginBox


def connect(
    configurations: Sequence[Configuration],
    components: Sequence[str],
    shared: dict[str, tuple[tuple[str, ...], ...]] | None = None,
    declared: Sequence[tuple[Declared, ...]] = (),
) -> Network:
    """Build the network of some plugins.

    A controller pipe whose sink is the source of another plugin's feedback becomes an arrow between the two. Of the
    others, pipes of the lower level lead there, measured states come from the sensors, and the rest ends at its topic.
    A topic that one component declares to publish leads to the plugins that receive it.

    Args:
        configurations: One for each plugin.
        components: Name of the component of each.
        shared: See `Network`.
        declared: What the component of each declares; empty: not known.
    """
    listed = declared or [()] * len(configurations)
    boxes = tuple(_box(*each) for each in zip(configurations, components, listed, strict=True))
    arrows = [arrow for each in configurations for arrow in _received(each, configurations, boxes)]
    arrows += list(_declared(boxes))
    arrows += [arrow for each in configurations for arrow in _sent(each, arrows)]
    return Network(configurations[0].system, boxes, tuple(arrows), shared=shared or {})


def _box(configuration: Configuration, component: str, declared: tuple[Declared, ...]) -> PluginBox:
    module = configuration.module
    urdf = configuration.sources.urdf
    model = urdf.parameter or (urdf.file or "").rsplit("/", 1)[-1]
    robot = configuration.robot.configuration
    idle = module.mode == "idle"
    return PluginBox(
        module.name,
        component,
        robot,
        model=model,
        layer=module.layer,
        rate=configuration.rate,
        idle=idle,
        declared=declared,
    )


def _received(
    receiver: Configuration, configurations: Iterable[Configuration], boxes: Iterable[PluginBox]
) -> Iterator[Arrow]:
    head = End(Kind.PLUGIN, receiver.module.name)
    for pipe in received(receiver):
        topic = topic_of(pipe)
        tails = [End(Kind.PLUGIN, each.module.name) for each in configurations if topic in set(sinks(each))]
        tails += [End(Kind.PLUGIN, box.name) for box in boxes if topic in box.declares("topic out")]
        for tail in tails or [_outside(pipe)]:
            yield _arrow(tail, head, pipe)


def _declared(boxes: Sequence[PluginBox]) -> Iterator[Arrow]:
    """Yield the topics that one component declares to publish, and another one to receive."""
    for sender in boxes:
        for one in sender.declared:
            topic = one.name.lstrip("/")
            for box in boxes:
                if one.kind == "topic out" and topic in box.declares("topic in"):
                    tail = End(Kind.PLUGIN, sender.name)
                    head = End(Kind.PLUGIN, box.name)
                    yield Arrow(tail, head, topic, content=one.interface, topic=topic)


def _sent(sender: Configuration, arrows: Iterable[Arrow]) -> Iterator[Arrow]:
    """Yield the pipes of a plugin that no other plugin receives."""
    tail = End(Kind.PLUGIN, sender.module.name)
    idle = sender.module.mode == "idle"
    known = {arrow.topic for arrow in arrows if arrow.tail == tail}
    for pipe in sender.controllers:
        topic = topic_of(pipe)
        if pipe.lower_level:
            yield _arrow(tail, LOWER_LEVEL_END, pipe, idle=idle)
        elif topic not in known:
            yield _arrow(tail, End(Kind.TOPIC, topic or pipe.name), pipe)


def _outside(pipe: FeedbackRecord) -> End:
    """Return the origin of a feedback that no plugin of the picture sends."""
    return SENSORS if state_of(pipe) in ("measured", "motor side") else End(Kind.TOPIC, topic_of(pipe) or pipe.name)


def _arrow(tail: End, head: End, pipe: AnyPipeRecord, idle: bool = False) -> Arrow:
    return Arrow(
        tail, head, pipe.name, content=content(pipe), reference=pipe.refers_to, topic=topic_of(pipe), idle=idle
    )


def network_of(file: str, names: Sequence[str], system: str | None = None, search_paths: Sequence[str] = ()) -> Network:
    """Build the network of a file's plugins; see `check` for the arguments.

    Raises:
        SolferError: One of the configurations is wrong.
        SolferErrors: Several mistakes.
    """
    report = checked(file, names, system, search_paths=search_paths)
    raise_all(report.errors)
    configurations = list(configurations_of(report))
    groups = {name: robot_groups(each.configurations) for name, each in report.shared.items()}
    raise_all([error for each in groups.values() for group in each for error in conflicts(group, received=received)])
    shared = {
        name: tuple(tuple(dict.fromkeys(member.module.name for member in group)) for group in each)
        for name, each in groups.items()
    }
    declarations = [known_declarations(each) for each in configurations]
    return connect(configurations, [component_of(each) for each in configurations], shared, declared=declarations)
