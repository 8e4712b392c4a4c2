"""What is recorded, declared by its owners: live arrays with names, units and frames."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from solfer.errors import RecordingError, SizeMismatch
from solfer.recording.kinds import NAMED, UNITS, check
from solfer.recording.model import COLUMNS_KIND, Channel


@dataclass(frozen=True, eq=False)
class LogSource:
    """A channel, and where its numbers are.

    Attributes:
        channel: The channel, without numbers.
        array: The numbers of the newest cycle, contiguous; int64 counts in units of `factor`.
        factor: Unit of a count, such as 1e-9 of nanoseconds; it does not count for floats.
    """

    channel: Channel
    array: np.ndarray
    factor: float = 1.0


@dataclass(frozen=True)
class RunDocuments:
    """What a recording of a plugin needs besides its numbers.

    Attributes:
        files: Texts that become files of its own, by name: its effective configuration, the description of its robot.
        texts: Short ones, by a name that no other plugin has, such as `<plugin>/tags`, or that holds for all: `seed`.
    """

    files: Mapping[str, str] = field(default_factory=dict)
    texts: Mapping[str, str] = field(default_factory=dict)


class Logger:
    """Collects what is recorded of a plugin or of a part of it.

    Args:
        prefix: Begin of the names of its channels, such as `arm/log`.

    Attributes:
        sources: What was declared so far, also of its sections.
    """

    def __init__(self, prefix: str, sources: list[LogSource] | None = None):
        self._prefix = prefix
        self.sources: list[LogSource] = [] if sources is None else sources

    def section(self, name: str) -> "Logger":
        """Return a logger of the same recording whose channels begin with `<prefix>/<name>`."""
        return Logger(f"{self._prefix}/{name}", self.sources)

    def add(  # noqa: PLR0913, PLR0917 for users: what describes a channel, by its names
        self,
        name: str,
        array: np.ndarray,
        columns: Sequence[str] = (),
        unit: str | Sequence[str] = "",
        frame: str = "",
        kind: str = COLUMNS_KIND,
        child: str = "",
        factor: float = 1.0,
    ) -> None:
        """Declare an array, which is recorded after each cycle as it is then: fill it in place.

        Args:
            name: Name of the channel: `<prefix>/<name>`.
            array: float64, or int64 of counts; contiguous; neither its memory nor its size changes.
            columns: Name of each number, in the order of the memory; none: those of the kind, or their indices.
            unit: Unit of all numbers, or of each, such as 'rad'; without `columns`, those of the kind by default.
            frame: Frame of the axes.
            kind: Message that carries it, one of `solfer.recording.kinds`.
            child: Frame that moves in `frame`.
            factor: See `LogSource`.

        Raises:
            RecordingError: The array cannot be recorded, or there is a channel of this name.
            SizeMismatch: Columns or units are not as many as the numbers.
            UnknownName: There is no such kind.
        """
        where = f"channel '{self._prefix}/{name}'"
        names = tuple(columns) or NAMED.get(kind) or tuple(str(index) for index in range(array.size))
        if not columns and not unit:
            unit = with_units(names, UNITS) if kind in NAMED else ""
        units = (unit,) * len(names) if isinstance(unit, str) else tuple(unit)
        if len(names) != array.size:
            raise SizeMismatch(f"{len(names)} columns for {array.size} numbers", where=where)
        if array.dtype not in (np.float64, np.int64) or not array.flags.c_contiguous:
            raise RecordingError(
                f"an array of {array.dtype} that is {'' if array.flags.c_contiguous else 'not '}contiguous",
                where=where,
                expected="a contiguous array of float64 or int64, which is filled in place",
            )
        channel = Channel(f"{self._prefix}/{name}", kind, names, units=units, frame=frame, child=child)
        check(channel)
        if any(each.channel.name == channel.name for each in self.sources):
            raise RecordingError("it is declared twice", where=where, expected="a name for each")
        self.sources.append(LogSource(channel, array, factor))


def with_units(columns: Iterable[str], units: dict[str, str]) -> tuple[str, ...]:
    """Return the unit of each column; none for those that have none."""
    return tuple(units.get(column, "") for column in columns)
