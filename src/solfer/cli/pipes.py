"""What a pipe carries and where it leads, as the commands print it."""

from collections.abc import Iterator

from solfer.config import AnyPipeRecord, Configuration, ControllerRecord, FeedbackRecord
from solfer.config.records.contacts import ContactTags
from solfer.config.records.points import PointTags
from solfer.robot.contact_pipes import contact_pipes, contacts_here


def received(configuration: Configuration) -> tuple[FeedbackRecord, ...]:
    """Return the pipes that a plugin receives: those that it lists, and those of contacts whose file is here."""
    return (*configuration.feedbacks, *contact_pipes(configuration, contacts_here(configuration)))


def carried(pipe: AnyPipeRecord) -> tuple[str, ...]:
    """Return the interfaces that a pipe carries, the quantity of its Robot Points, or the wrenches of its contacts."""
    if isinstance(pipe, ContactTags):
        return tuple(f"wrench of {name}" for name in pipe.contacts or ("all contacts",))
    if isinstance(pipe, PointTags):
        return (f"{pipe.quantity} of {'a point' if pipe.size is None else f'{pipe.size} points'}",)
    return pipe.interface.carried


def state_of(pipe: AnyPipeRecord) -> str:
    """Return the State of a Robot that a pipe carries: `measured`, `motor side`, `desired`; empty for Robot Points."""
    if isinstance(pipe, PointTags):
        return ""
    return {"reference": "desired", "motor": "motor side"}.get(pipe.function or "", "measured")


def content(pipe: AnyPipeRecord) -> str:
    """Describe what a pipe carries, such as `measured position, velocity`."""
    return f"{state_of(pipe)} {', '.join(carried(pipe))}".strip()


def reference_of(pipe: AnyPipeRecord) -> str:
    """Describe what its numbers refer to: the map of a joint-space pipe, the link of a body, the axes of vectors."""
    if isinstance(pipe, ContactTags):
        return f"axes of {'its link' if pipe.interface == 'fixed' else 'world'}"
    if isinstance(pipe, PointTags):
        return f"axes of {pipe.frame}"
    if pipe.dofs.type == "body":
        return f"link {pipe.measured_link if isinstance(pipe, FeedbackRecord) else pipe.dofs.name}"
    return f"map {pipe.dofs.mapping}"


def topic_of(pipe: AnyPipeRecord) -> str:
    """Return the topic of a pipe, or its name under XBOT, as both of its ends write it; empty if it has none.

    The topic of a lower-level controller lies below the controller's name.
    """
    if isinstance(pipe, FeedbackRecord):
        return _plain(pipe.source)
    if isinstance(pipe, ControllerRecord) and pipe.lower_level:
        return f"{pipe.name}{pipe.sink or '/command'}"
    return _plain(pipe.sink)


def sinks(configuration: Configuration) -> Iterator[str]:
    """Yield the topics that a plugin sends to other plugins."""
    return (topic_of(pipe) for pipe in configuration.controllers if pipe.sink and not pipe.lower_level)


def _plain(topic: str | None) -> str:
    return (topic or "").lstrip("/")
