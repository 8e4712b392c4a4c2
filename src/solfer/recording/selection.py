"""Chosen columns of a recording."""

import dataclasses
import fnmatch
import math
from collections.abc import Callable, Sequence

import numpy as np

from solfer.errors import UnknownName
from solfer.recording.kinds import NAMED
from solfer.recording.model import COLUMNS_KIND, Channel, Recording

HALF_OF_RESOLUTION = 5e-10
"""Half of the resolution of times in a file [s]."""


def select(recording: Recording, patterns: Sequence[str], where: str = "") -> Recording:
    """Return a recording of chosen columns alone.

    Args:
        recording: The recording.
        patterns: Names of channels, of columns, or `<channel>/<column>`; `*` and `?` stand for anything. None: all.
        where: Its file, for errors.

    Raises:
        UnknownName: A pattern fits nothing.
    """
    if not patterns:
        return recording
    chosen: dict[str, set[int]] = {}
    for pattern in patterns:
        hits = [(channel.name, place) for channel in recording.channels.values() for place in _hits(channel, pattern)]
        if not hits:
            columns = dict.fromkeys(column for channel in recording.channels.values() for column in channel.columns)
            raise UnknownName("column", pattern, [*recording.channels, *columns], where=where)
        for name, place in hits:
            chosen.setdefault(name, set()).add(place)
    channels = {
        name: _narrowed(channel, sorted(chosen[name])) for name, channel in recording.channels.items() if name in chosen
    }
    return dataclasses.replace(recording, channels=channels)


def chooses(patterns: Sequence[str]) -> Callable[[Channel], bool]:
    """Return whether `select` needs a channel's numbers."""
    return lambda channel: not patterns or any(_hits(channel, pattern) for pattern in patterns)


def _hits(channel: Channel, pattern: str) -> list[int]:
    """Return the places of the columns that a pattern fits."""
    return [
        place
        for place, column in enumerate(channel.columns)
        if any(fnmatch.fnmatchcase(name, pattern) for name in (channel.name, column, f"{channel.name}/{column}"))
    ]


def _narrowed(channel: Channel, places: list[int]) -> Channel:
    if len(places) == len(channel.columns):
        return channel
    columns = tuple(channel.columns[place] for place in places)
    units = tuple(channel.units[place] for place in places)
    kind = COLUMNS_KIND if channel.kind in NAMED else channel.kind  # whose messages hold all columns
    return dataclasses.replace(channel, kind=kind, columns=columns, units=units, values=channel.values[:, places])


def span(recording: Recording) -> tuple[float, float]:
    """Return the times of the first and the last row [s]; zeros without any."""
    filled = recording.filled
    first = min((float(each.times[0]) for each in filled), default=0.0)
    return first, max((float(each.times[-1]) for each in filled), default=0.0)


def between(recording: Recording, begin: float | None, end: float | None, start: float) -> Recording:
    """Return the rows and events from `begin` to `end` alone.

    Args:
        recording: The recording.
        begin: First time [s after `start`]; None: from the beginning.
        end: Last time [s after `start`]; None: to the end.
        start: What both count from, in the recorder's clock [s].
    """
    low = -math.inf if begin is None else start + begin
    high = math.inf if end is None else start + end
    channels = {name: _within(channel, low, high) for name, channel in recording.channels.items()}
    events = [event for event in recording.events if low <= event.time <= high]
    return dataclasses.replace(recording, channels=channels, events=events)


def _within(channel: Channel, low: float, high: float) -> Channel:
    rows = slice(*np.searchsorted(channel.times, (low - HALF_OF_RESOLUTION, high + HALF_OF_RESOLUTION)))
    return dataclasses.replace(channel, times=channel.times[rows], values=channel.values[rows])
