"""Publishers and subscribers of a middleware's topics."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from solfer.errors import nearest


@dataclass(frozen=True)
class Missing:
    """A topic has no publisher or subscriber, or one with another type of message.

    Attributes:
        what: Description, in one line.
        names: Topics that may have been meant, best first.
    """

    what: str
    names: tuple[str, ...]

    @property
    def hint(self) -> str:
        """Names that may have been meant, as the end of a line."""
        return f"; did you mean {', '.join(self.names)}?" if self.names else ""


@dataclass(frozen=True)
class Topics:
    """The topics that other nodes than the asking one publish or subscribe.

    Attributes:
        published: Type of the messages that are published on a topic, by its name, as in `Reader.carries`; empty:
            unknown.
        received: Type of the messages that are subscribed, in the same way.
    """

    published: Mapping[str, str] = field(default_factory=dict)
    received: Mapping[str, str] = field(default_factory=dict)

    def missing_publisher(self, topic: str, message: str) -> Missing | None:
        """Check that a topic is published with this type of message; None: it is."""
        return _missing(self.published, topic, message, none=f"no publisher on {topic}", other=f"{topic} carries")

    def missing_subscriber(self, topic: str, message: str) -> Missing | None:
        """Check that a topic is subscribed with this type of message; None: it is."""
        other = f"a subscriber of {topic} expects"
        return _missing(self.received, topic, message, none=f"no subscriber on {topic}", other=other)


def _missing(topics: Mapping[str, str], topic: str, message: str, none: str, other: str) -> Missing | None:
    """Return what is wrong with a topic: `none` has it, or `other` messages."""
    present = next((kind for name, kind in topics.items() if name.lstrip("/") == topic.lstrip("/")), None)
    if present in ("", message):
        return None
    what = none if present is None else f"{other} {present}, not {message}"
    return Missing(what, _alike(topic, message, topics))


def _alike(topic: str, message: str, topics: Mapping[str, str]) -> tuple[str, ...]:
    """List up to three topics with similar names, those of the same message first; else any of the same message."""
    fitting = [name for name, present in topics.items() if present == message and name != topic]
    foreign = [name for name, present in topics.items() if present != message and name != topic]
    return tuple((nearest(topic, fitting) + nearest(topic, foreign))[:3] or sorted(fitting)[:3])
