"""One feedback for several Robots of a process: its messages are taken once a cycle."""

import numpy as np

from solfer.model import State
from solfer.pipes.endpoints import NEW, NONE, OLD, Status
from solfer.pipes.feedback import StateFeedback


class Source:
    """A feedback that is read when the first of its listeners asks in a turn.

    Args:
        pipe: The feedback.

    Attributes:
        pipe: The feedback.
        turn: Number of the turn in which it was read; `Turns` counts them.
    """

    def __init__(self, pipe: StateFeedback):
        self.pipe, self.turn = pipe, -1


class Turns:
    """Counts the cycles of a process.

    Attributes:
        number: Number of the present one.
    """

    def __init__(self) -> None:
        self.number = 0

    def next(self) -> None:
        """A cycle begins: what was read before is old."""
        self.number += 1


class SharedFeedback(StateFeedback):
    """What a source brings, for one plugin; it begins anew as if the plugin had the pipe for itself.

    Args:
        source: The source, without filters.
        turns: Counts the cycles of the process.
        state: The plugin's State, on the memory that the source writes.
        required: Whether the plugin has to wait for this pipe before it starts.

    Attributes:
        source: The source.
    """

    def __init__(self, source: Source, turns: Turns, state: State, required: bool):
        pipe = source.pipe
        super().__init__(pipe.name, pipe.reader, state, pipe.channels, required)
        self.source, self._pipe, self._turns, self._seen = source, pipe, turns, 0
        self._changes = [0] * len(pipe.channels)
        self._unheard: np.ndarray | None = None

    @property
    def refused(self) -> int:
        """See `Feedback.refused`."""
        return self._pipe.refused

    @property
    def lacks(self) -> str:
        """See `Feedback.lacks`."""
        return self._pipe.lacks

    def run(self) -> Status:
        """See `Feedback.run`."""
        source, pipe = self.source, self._pipe
        if source.turn != self._turns.number:
            source.turn = self._turns.number
            pipe.run()
        if pipe.accepted == self._seen:
            return OLD if self._seen else NONE
        self._seen = pipe.accepted
        for index, channel in enumerate(self.channels):
            if channel.changes != self._changes[index]:
                self._changes[index] = channel.changes
                self._state.touch(channel.interface)
        self.accepted += 1
        self.arrival = pipe.arrival
        if not self.heard:
            self.heard = self._complete()
        return NEW

    def restart(self) -> None:
        """See `Feedback.restart`; the source goes on."""
        super().restart()
        self._unheard = None

    def _complete(self) -> bool:
        part = self._pipe.part
        if part is None:
            return True
        if self._unheard is None:
            self._unheard = np.ones(len(self.channels[0].values), dtype=bool)
        self._unheard[part] = False
        return not self._unheard.any()

    def _decode(self, message: object) -> None:
        """See `Feedback._decode`; the source does it."""
