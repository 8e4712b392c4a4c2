"""Which topics cross the border between the layers."""

from collections.abc import Iterable
from dataclasses import dataclass

from solfer.config import AnyPipeRecord, Configuration
from solfer.errors import MiddlewareError
from solfer.transport.messages import canonical


@dataclass(frozen=True)
class Route:
    """A topic that crosses the border.

    Attributes:
        topic: Its name, the same on both sides.
        message: Canonical name of its message.
    """

    topic: str
    message: str


def routes(configurations: Iterable[Configuration]) -> tuple[list[Route], list[Route]]:
    """Return the topics that plugins of the real-time layer receive from outside, and those that they publish outside.

    These are the pipes with `layer: NRT`. What plugins of the layer send each other does not come from outside: a topic
    that one of them publishes is not forwarded inwards, even if the pipe that receives it is marked.

    Raises:
        MiddlewareError: Two pipes of one topic differ in their message, or a topic would cross the border
            in both directions.
        UnknownName: A message that no pipe can carry.
    """
    inwards: dict[str, Route] = {}
    outwards: dict[str, Route] = {}
    published: set[str] = set()
    for configuration in configurations:
        for pipe in configuration.feedbacks:
            _add(inwards, pipe, pipe.source)
        for command in configuration.controllers:
            _add(outwards, command, command.sink)
            if command.sink and not command.lower_level and not configuration.module.silent:
                published.add(command.sink.lstrip("/"))
    for topic in sorted(inwards.keys() & outwards.keys()):
        raise MiddlewareError(
            f"topic '{topic}' would cross the border in both directions",
            expected="plugins of the real-time layer that receive from each other without `layer: NRT`",
        )
    return [route for topic, route in inwards.items() if topic not in published], list(outwards.values())


def _add(known: dict[str, Route], pipe: AnyPipeRecord, topic: str | None) -> None:
    if pipe.layer != "NRT" or not topic:
        return
    route = Route(topic.lstrip("/"), canonical(pipe.travels_as, pipe.where("message")))
    before = known.setdefault(route.topic, route)
    if before.message != route.message:
        raise MiddlewareError(
            f"topic '{route.topic}' carries {before.message} in another pipe",
            where=pipe.where("message"),
            expected=before.message,
        )
