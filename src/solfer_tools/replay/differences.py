"""Differences of the commands of a replay from the recorded ones."""

from dataclasses import dataclass

import numpy as np

from solfer.recording.model import Channel
from solfer_tools.replay.replay import Replay

TOLERANCE = 1e-9
"""Largest difference of numbers that count as the same."""


@dataclass(frozen=True)
class ColumnDifference:
    """A number that a plugin sends otherwise than it did.

    Attributes:
        channel: Where it is sent, such as `command/direct/position`.
        column: Its name, such as that of a joint.
        unit: Its unit.
        cycle: The first cycle in which it differs, from 1 on.
        time: When that was, after the first recorded cycle [s].
        largest: Largest difference.
    """

    channel: str
    column: str
    unit: str
    cycle: int
    time: float
    largest: float


@dataclass(frozen=True)
class ReplayDifferences:
    """How a replay differs from its recording.

    Attributes:
        compared: Number of cycles in which both plugins ran.
        alone: Number of cycles in which only one of them ran.
        numbers: Number of columns that were compared.
        different: Columns that differ, the first one first.
        unmatched: Channels of commands that only one of them has.
        largest: Largest difference of all.
    """

    compared: int
    alone: int
    numbers: int
    different: tuple[ColumnDifference, ...]
    unmatched: tuple[str, ...]
    largest: float

    @property
    def same(self) -> bool:
        """Whether all commands are the recorded ones, and there are some."""
        return not (self.different or self.unmatched or self.alone) and self.compared > 0


def recorded_commands(replay: Replay) -> dict[str, Channel]:
    """Return the recorded commands, by the names of their channels behind `<plugin>/`."""
    prefix = f"{replay.rows.plugin}/"
    return {
        name.removeprefix(prefix): channel
        for name, channel in replay.rows.recording.channels.items()
        if name.startswith(f"{prefix}command/") and len(channel.times)
    }


def differences(replay: Replay) -> ReplayDifferences:
    """Compare the commands of a replay that has run with the recorded ones, in the cycles in which both plugins ran."""
    rows = replay.rows
    recorded = recorded_commands(replay)
    both = replay.running & rows.running
    found: list[ColumnDifference] = []
    numbers = 0
    largest = 0.0
    for name, channel in replay.commands.items():
        shared = [column for column in channel.columns if name in recorded and column in recorded[name].columns]
        if not shared:
            continue
        ours = channel.values[:, [channel.columns.index(column) for column in shared]][both]
        gaps = _gaps(ours, rows.values(recorded[name], shared)[both])
        numbers = numbers + len(shared)
        largest = max(largest, float(gaps.max(initial=0.0)))
        for place in np.flatnonzero((gaps > TOLERANCE).any(axis=0)):
            first = int(np.flatnonzero(both)[(gaps[:, place] > TOLERANCE).argmax()])
            unit = channel.units[channel.columns.index(shared[place])]
            time = float(rows.times[first] - rows.times[0])
            found.append(
                ColumnDifference(
                    name, shared[place], unit, cycle=first + 1, time=time, largest=float(gaps[:, place].max())
                )
            )
    found.sort(key=lambda each: (each.cycle, -each.largest))
    alone = int((replay.running != rows.running).sum())
    unmatched = tuple(sorted(recorded.keys() ^ replay.commands.keys()))
    return ReplayDifferences(
        int(both.sum()), alone, numbers, different=tuple(found), unmatched=unmatched, largest=largest
    )


def _gaps(ours: np.ndarray, theirs: np.ndarray) -> np.ndarray:
    """Return the distances of numbers; two that are not finite, and the same, have none."""
    with np.errstate(invalid="ignore"):
        gaps = np.abs(ours - theirs)
    same = (ours == theirs) | (np.isnan(ours) & np.isnan(theirs))
    return np.where(same, 0.0, np.where(np.isnan(gaps), np.inf, gaps))
