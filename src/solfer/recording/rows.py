"""Rows of a ring: which of its columns belong to which channel."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace

import numpy as np

from solfer.recording.log import LogSource
from solfer.recording.model import Channel

_DESCRIBED = ("name", "kind", "columns", "units", "frame", "child")


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
        views = [source.array.reshape(-1).view(np.float64) for source in sources]
        pieces = sorted({(_address(view), view.size): view for view in views}.items(), key=lambda piece: piece[0])
        places = np.cumsum([0, *(view.size for _, view in pieces)]).tolist()
        known = {key: start for (key, _), start in zip(pieces, places, strict=False)}
        starts = tuple(known[_address(view), view.size] for view in views)
        factors = tuple(source.factor if source.array.dtype == np.int64 else 0.0 for source in sources)
        channels = tuple(source.channel for source in sources)
        layout = cls(
            channels, starts, factors, width=places[-1], attachments=dict(attachments), metadata=dict(metadata)
        )
        return layout, [view for _, view in pieces]

    def text(self) -> str:
        """Describe the layout for another process."""
        channels = [{name: getattr(channel, name) for name in _DESCRIBED} for channel in self.channels]
        return json.dumps({**asdict(self), "channels": channels})

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
        kept = [index for index, each in enumerate(self.channels) if each.name.partition("/")[0] in plugins]
        files = {name: text for name, text in self.attachments.items() if name.partition("/")[0] in plugins}
        texts = {
            name: text for name, text in self.metadata.items() if name.partition("/")[0] in plugins or "/" not in name
        }
        return replace(
            self,
            channels=tuple(self.channels[index] for index in kept),
            starts=tuple(self.starts[index] for index in kept),
            factors=tuple(self.factors[index] for index in kept),
            attachments=files,
            metadata=texts,
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


def _address(array: np.ndarray) -> int:
    return array.__array_interface__["data"][0]
