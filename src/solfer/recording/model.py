"""A recording, as its writers and its readers see it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from solfer.errors import SizeMismatch, UnknownName

COLUMNS_KIND = "solfer_msgs/Columns"
"""Kind of a channel that is nothing but named columns."""

JOINTS_KIND = "sensor_msgs/JointState"
"""Kind of a channel with one number for each joint; its name ends with the field of the message."""

REQUEST = "request"
"""Kind of the event that something was asked of a component: its name and fields, as JSON."""

CLAIMED = "claim"
"""Kind of the event that a plugin got its joints."""

RELEASED = "release"
"""Kind of the event that a plugin gave its joints back."""

LOST = "lost"
"""Kind of the event that a plugin lost its joints."""

RESET = "reset"
"""Kind of the event that a plugin reset its component."""


@dataclass(frozen=True)
class Channel:
    """Numbers over time: one row for each time, one column for each name.

    Attributes:
        name: `<plugin>/<what>`, such as `arm/command/direct/position`.
        kind: Message that carries it in a file, one of `solfer.recording.kinds`.
        columns: Names of the columns.
        units: Unit of each column, such as 'rad' or 'm/s'; empty: none.
        frame: Frame of the axes; empty: none.
        times: Time of each row in the recorder's clock, float64, shape (T,) [s]; a file keeps it to the nanosecond.
        values: The numbers, float64, shape (T, columns).
        child: Frame that moves in `frame`, for those kinds that have one.

    Raises:
        SizeMismatch: Numbers of units, columns, times and values differ.
    """

    name: str
    kind: str
    columns: tuple[str, ...]
    units: tuple[str, ...]
    frame: str = ""
    times: np.ndarray = field(default_factory=lambda: np.zeros(0), repr=False)
    values: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)), repr=False)
    child: str = ""

    def __post_init__(self) -> None:
        if len(self.units) != len(self.columns):
            raise SizeMismatch(f"channel '{self.name}': {len(self.units)} units for {len(self.columns)} columns")
        shape = (len(self.times), len(self.columns))
        if len(self.times) and self.values.shape != shape:
            raise SizeMismatch(f"channel '{self.name}': values of the shape {self.values.shape} instead of {shape}")

    def column(self, name: str) -> np.ndarray:
        """Return the numbers of one column, shape (T,).

        Raises:
            UnknownName: There is no such column.
        """
        if name not in self.columns:
            raise UnknownName("column", name, self.columns, where=f"channel '{self.name}'")
        return self.values[:, self.columns.index(name)]


@dataclass(frozen=True)
class Event:
    """Something that happened once.

    Attributes:
        time: When, in the recorder's clock [s].
        plugin: Who; empty: the process.
        kind: What: start, run, hold, stop, abort, fault, close, ...
        text: Why, for people.
    """

    time: float
    plugin: str
    kind: str
    text: str = ""


@dataclass(frozen=True)
class Recording:
    """All that a file holds.

    Attributes:
        channels: The numbers, by the name of their channel.
        events: What happened, in the order of time.
        attachments: Files by name, such as `robot.urdf` and `configuration.yaml`.
        metadata: Texts by name, such as `version` and `seed`.
        lost: Number of rows that were not recorded: the recorder or its disk was too slow, or the disk full.
        missing: What else the file lacks, a sentence each; empty: it is complete.
    """

    channels: Mapping[str, Channel]
    events: Sequence[Event] = ()
    attachments: Mapping[str, bytes] = field(default_factory=dict)
    metadata: Mapping[str, str] = field(default_factory=dict)
    lost: int = 0
    missing: tuple[str, ...] = ()

    @property
    def plugins(self) -> tuple[str, ...]:
        """Names of the plugins that have channels, in their order."""
        return tuple(dict.fromkeys(name.partition("/")[0] for name in self.channels if "/" in name))

    @property
    def filled(self) -> list[Channel]:
        """The channels that have rows."""
        return [channel for channel in self.channels.values() if len(channel.times)]

    def __getitem__(self, name: str) -> Channel:
        """Return a channel.

        Raises:
            UnknownName: There is no such channel.
        """
        if name not in self.channels:
            raise UnknownName("channel", name, self.channels)
        return self.channels[name]
