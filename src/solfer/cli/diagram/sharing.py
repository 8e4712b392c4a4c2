"""Which plugins of a shared plugin can have one Robot (section 2.3 of the paper)."""

from collections.abc import Hashable, Iterable, Iterator, Sequence

from solfer.cli.diagram.network import carried, sinks, topic_of
from solfer.config import Configuration, TextRecord


def robot_groups(configurations: Sequence[Configuration]) -> tuple[tuple[str, ...], ...]:
    """Names of plugins, those with one Robot together.

    A Robot can be shared where the descriptions and maps are equal and nothing in it would be fed from two different
    sources, unless one of these is a component on that Robot.
    """
    groups: list[list[Configuration]] = []
    for configuration in configurations:
        group = next((group for group in groups if _fits(configuration, group)), None)
        if group is None:
            groups.append([configuration])
        else:
            group.append(configuration)
    return tuple(tuple(dict.fromkeys(member.module.name for member in group)) for group in groups)


def _fits(configuration: Configuration, members: Sequence[Configuration]) -> bool:
    if _model(configuration) != _model(members[0]):
        return False
    everybody = (*members, configuration)
    own = {topic for each in everybody for topic in sinks(each)}
    sources: dict[Hashable, str] = {}
    return all(source in own or sources.setdefault(fed, source) == source for fed, source in _feeds(everybody))


def _model(configuration: Configuration) -> tuple[Hashable, ...]:
    """What has to be equal: descriptions, predefined maps, and what is read of them."""
    sources, robot = configuration.sources, configuration.robot
    texts = (sources.urdf, sources.srdf, sources.actuators, sources.contacts)
    maps = tuple((name, record.loading, record.source, _text(record.urdf))
                 for name, record in sorted(configuration.mappings.items()))
    return (*map(_text, texts), maps, robot.actuators.read, robot.contacts.read)


def _text(record: TextRecord | None) -> Hashable:
    return None if record is None else (record.parameter, record.location)


def _feeds(configurations: Iterable[Configuration]) -> Iterator[tuple[Hashable, str]]:
    """What is fed into a Robot, interface by interface, and from where."""
    for configuration in configurations:
        for pipe in configuration.feedbacks:
            for interface in carried(pipe) if pipe.dofs else ():
                yield (pipe.function, pipe.dofs.chain, pipe.dofs.type, interface), topic_of(pipe.source)
