"""Which topics cross the border between the layers."""

from collections.abc import Iterable
from dataclasses import dataclass

from solfer.config import Configuration, PipeRecord
from solfer.errors import MiddlewareError
from solfer.pipes.messages import POINTS, VECTOR_MESSAGES, canonical

OTHER_LAYER = "NRT"
"""Layer at the other end of a pipe that crosses the border."""

DEFAULT_MESSAGES = {"JOINT": "solfer/JointCommand", "OPERATIONAL": "nav_msgs/Odometry", "POINTS": POINTS}
"""Message of a pipe that names none, by its space."""


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
    """The topics that plugins of the real-time layer hear from outside, and those that they tell outside.

    These are the pipes with `layer: NRT`. What plugins of the layer tell each other does not come from outside: a topic
    that one of them tells goes not in, also if the pipe that hears it is marked.

    Raises:
        MiddlewareError: A pipe does not say what it carries, two pipes of one topic differ in it, or a topic would
            cross the border in both directions.
        UnknownName: A message that no pipe can carry.
    """
    inwards: dict[str, Route] = {}
    outwards: dict[str, Route] = {}
    told: set[str] = set()
    for configuration in configurations:
        for pipe in configuration.feedbacks:
            _add(inwards, pipe, pipe.source)
        for pipe in configuration.controllers:
            _add(outwards, pipe, pipe.sink)
            if pipe.sink and not pipe.lower_level and not configuration.module.silent:
                told.add(pipe.sink.lstrip("/"))
    for topic in sorted(inwards.keys() & outwards.keys()):
        raise MiddlewareError(f"topic '{topic}' would cross the border in both directions",
                              expected="plugins of the real-time layer that hear each other without `layer: NRT`")
    return [route for topic, route in inwards.items() if topic not in told], list(outwards.values())


def _add(known: dict[str, Route], pipe: PipeRecord, topic: str | None) -> None:
    if pipe.layer != OTHER_LAYER or not topic:
        return
    route = Route(topic.lstrip("/"), canonical(_message(pipe), pipe.where("message")))
    before = known.setdefault(route.topic, route)
    if before.message != route.message:
        raise MiddlewareError(f"topic '{route.topic}' carries {before.message} in another pipe",
                              where=pipe.where("message"), expected=before.message)


def _message(pipe: PipeRecord) -> str:
    message = pipe.message or DEFAULT_MESSAGES.get(pipe.space)
    if message is None:
        raise MiddlewareError(f"pipe '{pipe.name}' does not say what it carries", where=pipe.where(),
                              expected=f"message: one of {', '.join(VECTOR_MESSAGES)}")
    return message


