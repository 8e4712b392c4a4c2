"""What a pipe carries and where it leads, as the commands print it."""

from collections.abc import Iterator

from solfer.config import AnyPipeRecord, Configuration, ControllerRecord, FeedbackRecord
from solfer.robot.contact_pipes import contact_pipes, contacts_here


def received(configuration: Configuration) -> tuple[FeedbackRecord, ...]:
    """Return the pipes that a plugin receives: those that it lists, and those of contacts whose file is here."""
    return (*configuration.feedbacks, *contact_pipes(configuration, contacts_here(configuration)))


def state_of(pipe: AnyPipeRecord) -> str:
    """Return the State of a Robot that a pipe carries: `measured`, `motor side`, `desired`; empty for Robot Points."""
    if pipe.content.port:
        return ""
    return {"reference": "desired", "motor": "motor side"}.get(pipe.function or "", "measured")


def content(pipe: AnyPipeRecord) -> str:
    """Describe what a pipe carries, such as `measured position, velocity`."""
    return f"{state_of(pipe)} {', '.join(pipe.carried)}".strip()


def topic_of(pipe: AnyPipeRecord) -> str:
    """Return the topic of a pipe, or its name under XBOT, as both of its ends write it; empty if it has none.

    The topic of a lower-level controller lies below the controller's name.
    """
    if isinstance(pipe, FeedbackRecord):
        return _plain(pipe.source)
    if isinstance(pipe, ControllerRecord) and pipe.lower_level:
        return f"{pipe.leads_to}{pipe.sink or '/command'}"
    return _plain(pipe.sink)


def sinks(configuration: Configuration) -> Iterator[str]:
    """Yield the topics that a plugin sends to other plugins."""
    return (topic_of(pipe) for pipe in configuration.controllers if pipe.sink and not pipe.lower_level)


def _plain(topic: str | None) -> str:
    return (topic or "").lstrip("/")
