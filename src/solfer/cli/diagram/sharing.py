"""Groups of plugins in a shared plugin that can have one Robot (section 2.3 of the paper)."""

from collections.abc import Hashable, Sequence

from solfer.cli.pipes import carried, received, sinks, state_of, topic_of
from solfer.config import Configuration, TextRecord
from solfer.config.records.points import PointTags


def robot_groups(configurations: Sequence[Configuration]) -> tuple[tuple[str, ...], ...]:
    """Group the names of plugins that can have one Robot.

    A Robot can be shared where the descriptions and maps are equal and nothing in it would be fed from two different
    sources, unless one of these is a component on that Robot. The DoFs of a pipe are not known without the robot: an
    interface counts as fed from two sources unless all that one plugin receives for it is received by the other one,
    too.
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
    own = {topic for each in (*members, configuration) for topic in sinks(each)}
    wanted = _sources(configuration)
    for member in members:
        given = _sources(member)
        pairs = ((given[fed] - own, wanted[fed] - own) for fed in given.keys() & wanted.keys())
        if _model(member) != _model(configuration) or not all(one <= other or other <= one for one, other in pairs):
            return False
    return True


def _model(configuration: Configuration) -> tuple[Hashable, ...]:
    """Collect what has to be equal: descriptions, predefined maps, and the parts that are read."""
    sources, robot = configuration.sources, configuration.robot
    texts = (sources.urdf, sources.srdf, sources.actuators, sources.contacts)
    maps = tuple(
        (name, record.loading, record.source, _text(record.urdf))
        for name, record in sorted(configuration.mappings.items())
    )
    return (*map(_text, texts), maps, robot.actuators.read, robot.contacts.read)


def _text(record: TextRecord | None) -> Hashable:
    return None if record is None else (record.parameter, record.location)


def _sources(configuration: Configuration) -> dict[tuple[str, str], set[str]]:
    """Map each interface of each State to its topics; Robot Points go to a component, not into its Robot."""
    sources: dict[tuple[str, str], set[str]] = {}
    for pipe in received(configuration):
        for interface in carried(pipe) if not isinstance(pipe, PointTags) else ():
            sources.setdefault((state_of(pipe), interface), set()).add(topic_of(pipe))
    return sources
