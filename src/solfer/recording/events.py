"""Events as messages: a status of diagnostics, which the viewers of ROS 2 show."""

import struct

from solfer.recording.kinds import STAMP_PLACE, Cdr
from solfer.recording.model import Event


def event_message(event: Event, time: int) -> bytes:
    """Make the message of an event at a time [ns]."""
    cdr = Cdr()
    cdr.header("")
    cdr.number("I", 1)
    cdr.number("B", 2 if event.kind in ("abort", "aborted", "fault", "lost") else 0)
    for text in (event.plugin, event.text, ""):
        cdr.string(text)
    cdr.number("I", 1)
    cdr.string("kind")
    cdr.string(event.kind)
    struct.pack_into("<iI", cdr.data, STAMP_PLACE, *divmod(time, 1_000_000_000))
    return bytes(cdr.data)


def event_of(message: bytes, time: int) -> Event:
    """Read an event of a time [ns] from its message; the inverse of `event_message`."""
    place = STAMP_PLACE + 8
    _, place = _string(message, place)
    place = _aligned(place) + 4 + 1  # one status, its level
    plugin, place = _string(message, place)
    text, place = _string(message, place)
    _, place = _string(message, place)
    _, place = _string(message, _aligned(place) + 4)
    kind, _ = _string(message, place)
    return Event(1e-9 * time, plugin, kind, text=text)


def _aligned(place: int) -> int:
    return place + -(place - STAMP_PLACE) % 4


def _string(message: bytes, place: int) -> tuple[str, int]:
    begin = _aligned(place) + 4
    end = begin + struct.unpack_from("<I", message, begin - 4)[0]
    return message[begin : end - 1].decode(), end
