"""Events of a recording for people: requests that come often are counted."""

import re
from collections.abc import Iterable
from dataclasses import dataclass

from solfer.recording.model import REQUEST, Event


@dataclass(frozen=True)
class EventGroup:
    """An event, or requests of one name.

    Attributes:
        first: The first one.
        last: Time of the last one [s].
        count: How many there are.
    """

    first: Event
    last: float
    count: int = 1

    def counted(self, start: float) -> str:
        """Describe requests that came often, with times after `start` [s]."""
        span = f"{self.first.time - start:.1f} to {self.last - start:.1f} s"
        return f"{self.count} x {request_name(self.first)}, {span}"


def request_name(event: Event) -> str:
    """Return the declaration that a request was made of; empty: the event is another one."""
    # a text that was cut is no JSON
    found = re.match(r'\["([^"\\]*)"', event.text) if event.kind == REQUEST else None
    return found[1] if found else ""


def grouped(events: Iterable[Event]) -> list[EventGroup]:
    """Count the requests of each name of each plugin, where there are more than three; other events stay alone."""
    requests: dict[tuple[str, str], list[Event]] = {}
    alone: list[Event] = []
    for event in events:
        name = request_name(event)
        (requests.setdefault((event.plugin, name), []) if name else alone).append(event)
    groups = []
    for found in requests.values():
        if len(found) > 3:
            groups.append(EventGroup(found[0], found[-1].time, len(found)))
        else:
            alone += found
    groups += [EventGroup(event, event.time) for event in alone]
    return sorted(groups, key=lambda each: each.first.time)
