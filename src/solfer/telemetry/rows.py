"""What the memory of a recording holds: rows of numbers, and events."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace

import numpy as np

from solfer.recording.log import LogSource
from solfer.recording.model import Channel
from solfer.segments.ring import Ring

RECORDING = "recording"
"""File and kind of the segment."""

EVENT_COUNT = 256
"""Events that the memory holds."""

EVENT_WIDTH = 64
"""Size of an event in words of eight bytes; a longer text is cut."""


@dataclass(frozen=True)
class RowLayout:
    """Layout of the rows, and what belongs to a recording besides.

    Arrays on the same memory, such as a State that plugins share, are in a row once.

    Attributes:
        channels: The channels, without numbers.
        starts: Where each begins in a row.
        factors: Unit of the counts of each; 0: its numbers are floats.
        width: Numbers of a row.
        attachments: Texts that become files of the recording.
        metadata: Texts by name.
    """

    channels: tuple[Channel, ...]
    starts: tuple[int, ...]
    factors: tuple[float, ...]
    width: int
    attachments: Mapping[str, str] = field(default_factory=dict)
    metadata: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def of(
        cls, sources: Sequence[LogSource], attachments: Mapping[str, str], metadata: Mapping[str, str]
    ) -> tuple["RowLayout", list[np.ndarray]]:
        """Lay out what is recorded; also returns the arrays of a row in their order, all as float64."""
        pieces: dict[tuple[int, int], np.ndarray] = {}
        keys = []
        for source in sources:
            view = source.array.reshape(-1).view(np.float64)
            keys.append((view.__array_interface__["data"][0], view.size))
            pieces[keys[-1]] = view
        arrays = [pieces[key] for key in sorted(pieces)]
        *places, width = np.cumsum([0, *(array.size for array in arrays)]).tolist()
        known = dict(zip(sorted(pieces), places, strict=True))
        factors = tuple(source.factor if source.array.dtype == np.int64 else 0.0 for source in sources)
        channels = tuple(source.channel for source in sources)
        starts = tuple(known[key] for key in keys)
        return cls(channels, starts, factors, width=width, attachments=attachments, metadata=metadata), arrays

    def text(self) -> str:
        """Describe the layout for another process."""
        described = asdict(self)
        for channel in described["channels"]:
            del channel["times"], channel["values"]
        return json.dumps(described)

    @classmethod
    def from_text(cls, text: str) -> "RowLayout":
        """Return the layout that another process described."""
        parts = json.loads(text)
        channels = tuple(
            Channel(**{**each, "columns": tuple(each["columns"]), "units": tuple(each["units"])})
            for each in parts.pop("channels")
        )
        return cls(channels, tuple(parts.pop("starts")), tuple(parts.pop("factors")), **parts)

    def only(self, plugins: Sequence[str]) -> "RowLayout":
        """Return the layout with the channels and files of some plugins alone."""

        def kept(name: str) -> bool:
            return name.partition("/")[0] in plugins

        places = [place for place, channel in enumerate(self.channels) if kept(channel.name)]
        return replace(
            self,
            channels=tuple(self.channels[place] for place in places),
            starts=tuple(self.starts[place] for place in places),
            factors=tuple(self.factors[place] for place in places),
            attachments={name: text for name, text in self.attachments.items() if kept(name)},
            metadata={name: text for name, text in self.metadata.items() if "/" not in name or kept(name)},
        )

    def renamed(self, before: str, after: str) -> "RowLayout":
        """Return the layout with another begin of the names of some channels."""
        names = (
            replace(each, name=each.name.replace(before, after, 1)) if each.name.startswith(f"{before}/") else each
            for each in self.channels
        )
        return replace(self, channels=tuple(names))

    def values(self, rows: np.ndarray) -> np.ndarray:
        """Return the numbers of all channels, float64, from rows of the ring, shape (T, width)."""
        parts = []
        for channel, start, factor in zip(self.channels, self.starts, self.factors, strict=True):
            part = rows[:, start : start + len(channel.columns)]
            parts.append(factor * np.ascontiguousarray(part).view(np.int64) if factor else part)
        return np.concatenate([np.zeros((len(rows), 0)), *parts], axis=1)


def events_of(memory: memoryview, rows: int) -> Ring:
    """Return the ring of events in a segment, behind that of the rows, which takes so many bytes."""
    return Ring(memory[rows:], EVENT_WIDTH, EVENT_COUNT)
