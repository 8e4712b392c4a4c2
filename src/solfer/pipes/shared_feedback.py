"""One feedback for several Robots of a process: its messages are read once a cycle."""

import numpy as np

from solfer.model import State
from solfer.pipes.feedback_pipe import StateFeedbackPipe
from solfer.transport.endpoints import NEW, NONE, OLD, MessageStatus


class Source:
    """A feedback that is read by the first of its pipes in each turn.

    Args:
        pipe: The feedback.

    Attributes:
        pipe: The feedback.
        turn: Number of the turn in which it was read; `Turns` counts them.
    """

    def __init__(self, pipe: StateFeedbackPipe):
        self.pipe, self.turn = pipe, -1


class Turns:
    """Counts the cycles of a process.

    Attributes:
        number: Number of the present one.
    """

    def __init__(self) -> None:
        self.number = 0

    def next(self) -> None:
        """Start the next cycle: earlier reads are old."""
        self.number += 1


class SharedFeedbackPipe(StateFeedbackPipe):
    """A plugin's share of a source; it restarts as if the plugin had the pipe for itself.

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
        super().__init__(pipe.name, pipe.reader, state, pipe.state_fields, required)
        self.source, self._pipe, self._turns, self._seen = source, pipe, turns, 0
        self._changes = [0] * len(pipe.state_fields)
        self._not_received: np.ndarray | None = None

    @property
    def refused(self) -> int:
        """See `FeedbackPipe.refused`."""
        return self._pipe.refused

    @property
    def ignored(self) -> int:
        """See `FeedbackPipe.ignored`."""
        return self._pipe.ignored

    @property
    def lacks(self) -> str:
        """See `FeedbackPipe.lacks`."""
        return self._pipe.lacks

    def rivalry(self, now: float) -> str:
        """See `FeedbackPipe.rivalry`."""
        return self._pipe.rivalry(now)

    def doubt(self, now: float) -> str:
        """See `FeedbackPipe.doubt`."""
        return self._pipe.doubt(now)

    def be_patient(self, timeout: float, strikes: int) -> None:
        """See `FeedbackPipe.be_patient`; pipes that share a source are configured alike."""
        self._pipe.be_patient(timeout, strikes)

    def check_start(self) -> None:
        """See `FeedbackPipe.check_start`."""
        self._pipe.check_start()

    def run(self) -> MessageStatus:
        """See `FeedbackPipe.run`."""
        source, pipe = self.source, self._pipe
        if source.turn != self._turns.number:
            source.turn = self._turns.number
            pipe.run()
        self.handovers = pipe.handovers
        if pipe.accepted == self._seen:
            return OLD if self._seen else NONE
        self._seen = pipe.accepted
        for index, state_field in enumerate(self.state_fields):
            if state_field.changes != self._changes[index]:
                self._changes[index] = state_field.changes
                self._state.touch(state_field.interface)
        self.accepted += 1
        self.arrival = pipe.arrival
        if not self.received:
            self.received = self._complete()
        return NEW

    def restart(self) -> None:
        """See `FeedbackPipe.restart`; does not restart the source."""
        super().restart()
        self._not_received = None

    def _complete(self) -> bool:
        part = self._pipe.part
        if part is None:
            return True
        if self._not_received is None:
            self._not_received = np.ones(len(self.state_fields[0].values), dtype=bool)
        self._not_received[part] = False
        return not self._not_received.any()

    def _match(self, message: object) -> None:
        """Do nothing: the source matches its messages."""

    def _gather(self, message: object) -> None:
        """Do nothing: the source reads its messages."""
