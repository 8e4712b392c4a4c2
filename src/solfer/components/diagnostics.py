"""Messages that report how things are, with the fields of `diagnostic_msgs`."""

from dataclasses import dataclass, field

from solfer.interfaces.geometry import Header


@dataclass(frozen=True)
class Entry:
    """A `diagnostic_msgs/KeyValue`."""

    key: str
    value: str


@dataclass(frozen=True)
class Status:
    """A `diagnostic_msgs/DiagnosticStatus`; the level is 0 where all is well, 1 for a warning."""

    level: int = 0
    name: str = ""
    message: str = ""
    hardware_id: str = ""
    values: tuple[Entry, ...] = ()


@dataclass(frozen=True)
class Statuses:
    """A `diagnostic_msgs/DiagnosticArray`."""

    header: Header = field(default_factory=Header)
    status: tuple[Status, ...] = ()
