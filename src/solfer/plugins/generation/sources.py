"""Checks topics: finds feedbacks whose topic has no publisher and is close to one that has, and commands to nothing."""

import re
from collections.abc import Iterable, Iterator

from solfer.config import Configuration, Problems
from solfer.errors import nearest
from solfer.robot.description.shipped import RobotFiles
from solfer.robot.scale import contacts_of

COMMAND_TOPIC = "/command"
"""Topic of a lower-level controller, behind its name."""


def sinks_of(configurations: Iterable[Configuration]) -> frozenset[str]:
    """Return the topics that plugins publish, and those of pipes that no plugin uses."""
    return frozenset(topic.lstrip("/") for each in configurations for topic in (*_used(each), *_listed(each)))


def check_topics(
    configuration: Configuration, files: RobotFiles | None, sinks: frozenset[str], problems: Problems
) -> None:
    """Warn of sources that are published neither by the simulated robot nor by a plugin, if they may be misspelt.

    Other sources may be published by nodes outside. Commands have to be on the topics of the robot's controllers.

    Args:
        configuration: One module; parts of it may be missing because of other mistakes.
        files: The files of its robot, if there are any.
        sinks: Topics that the plugins of the file publish.
        problems: Receives the warnings.
    """
    published = sinks if files is None or configuration.robot is None else sinks | _robot(files, configuration)
    spellings = set(map(_spelling, published))
    for record in configuration.feedbacks:
        source = (record.source or "").lstrip("/")
        if not source or _spelling(source) in spellings:
            continue
        # likeness of two topics, of 1, from which one may be the other, misspelt: `upper_body` and `lower_body` have
        # 0.7
        likeness = 0.8
        close = nearest(source, published, likeness=likeness)
        mark = record.place("source")
        if close and mark is not None:
            what = f"neither the simulated robot nor a plugin of this file publishes '{record.source}'"
            problems.warn(mark, f"{what}; did you mean {' or '.join(close)}?")
    if files is not None:
        _check_sinks(configuration, files, problems)


def _check_sinks(configuration: Configuration, files: RobotFiles, problems: Problems) -> None:
    """Warn of commands to a controller of the robot on a topic that it does not receive."""
    known = {controller.name for controller in files.controllers}
    for record in configuration.controllers:
        mark = record.place("sink")
        if mark and record.lower_level and record.leads_to in known and record.sink not in (None, COMMAND_TOPIC):
            what = f"the controller '{record.leads_to}' receives '{record.leads_to}{COMMAND_TOPIC}', not"
            problems.warn(mark, f"{what} '{record.leads_to}{record.sink}'")


def _spelling(topic: str) -> str:
    """Return a topic without its numbers: `arm_1` and `arm_2` are two topics, and neither is misspelt."""
    return re.sub("[0-9]+", "", topic)


def _used(configuration: Configuration) -> Iterator[str]:
    for record in configuration.controllers:
        if record.lower_level:
            yield f"{record.leads_to}{record.sink or COMMAND_TOPIC}"
        elif record.sink is not None:
            yield record.sink


def _listed(configuration: Configuration) -> Iterator[str]:
    tree = configuration.tree
    library = tree.get(configuration.section, "controller") if configuration.middleware else None
    for name, pipe in library.items() if library is not None else ():
        sink = pipe.get("sink")
        kind = tree.get("controller", name, "type")
        if sink is not None and isinstance(sink.value, str):
            owner = tree.get("controller", name, "controller")
            leads_to = name if owner is None else owner.value
            yield sink.value if kind is None or kind.value == "reference" else f"{leads_to}{sink.value}"


def _robot(files: RobotFiles, configuration: Configuration) -> frozenset[str]:
    """Return the topics of the simulated robot and of its lower level's controllers."""
    touching = contacts_of(files.contacts, configuration.robot.name) if files.measured else ()
    contacts = (f"contacts/{each.name}{axes}" for each in touching for axes in ("", "/link"))
    commands = (f"{controller.name}{COMMAND_TOPIC}" for controller in files.controllers)
    return frozenset((*files.measured, *contacts, *commands))
