"""Feedbacks of plugins that share a Robot: each is read once a cycle, before the first of them."""

import math
from operator import attrgetter

import numpy as np

from solfer.config.records.pipes import FeedbackRecord
from solfer.pipes.feedback_pipe import FeedbackPipe
from solfer.pipes.precedence import Watch
from solfer.pipes.state_feedback_pipe import StateFeedbackPipe
from solfer.transport.endpoints import NEW, NONE, OLD, MessageStatus
from solfer.transport.messages import Message


class CycleCount:
    """Counts the cycles of a process.

    Attributes:
        number: Number of the present one.
    """

    def __init__(self) -> None:
        self.number = 0

    def next(self) -> None:
        """Start the next cycle: earlier reads are old."""
        self.number += 1


class CachedFeedback:
    """A feedback that is read by the first of its pipes in each turn.

    It begins again (filters, alignment, which joints have been received) when all of its pipes that are in use do.

    Args:
        pipe: The feedback.
        turns: Counts the cycles of the process.

    Attributes:
        pipe: The feedback.
        turns: See above.
        turn: Number of the cycle in which it was read last; -1 before.
    """

    def __init__(self, pipe: FeedbackPipe, turns: CycleCount):
        self.pipe = pipe
        self.turns = turns
        self.turn = -1
        self._shares: list[CachedFeedbackPipe] = []
        self._timeout = 0.0
        self._strikes = 1

    def share(self, record: FeedbackRecord) -> "CachedFeedbackPipe":
        """Make the pipe of one plugin that configures this feedback by `record`."""
        share = CachedFeedbackPipe(self, record.name, record.initialize or record.limits is not None)
        self._shares.append(share)
        return share

    def restart(self) -> None:
        """Begin again if no other reader goes on with what was received before."""
        recent = self.turns.number - 1
        if not any(share.received and share.turn >= recent for share in self._shares):
            self.pipe.restart()

    def set_timeout(self, timeout: float, strikes: int) -> None:
        """See `FeedbackPipe.set_timeout`; the most patient plugin counts."""
        self._timeout = max(self._timeout, timeout)
        self._strikes = max(self._strikes, strikes)
        self.pipe.set_timeout(self._timeout, self._strikes)


class CachedFeedbackPipe(FeedbackPipe):
    """A plugin's share of a source; it restarts as if the plugin had the pipe for itself.

    Args:
        source: The source.
        name: Name of the pipe in the plugin's configuration.
        required: Whether the plugin has to wait for this pipe before it starts.

    Attributes:
        source: The source.
        turn: Number of the cycle in which it ran last; -1 before.
    """

    def __init__(self, source: CachedFeedback, name: str, required: bool):
        pipe = source.pipe
        super().__init__(name, pipe.reader, required)
        self.source = source
        self.turn = -1
        self._pipe = pipe
        self.warnings = pipe.warnings
        self._seen = 0
        self._turns = source.turns
        self._not_received: np.ndarray | None = None

    refused = property(attrgetter("_pipe.refused"))
    measures = property(attrgetter("_pipe.measures"))
    changed = property(attrgetter("_pipe.changed"))
    ignored = property(attrgetter("_pipe.ignored"))
    dropped = property(attrgetter("_pipe.dropped"))
    lacks = property(attrgetter("_pipe.lacks"))

    def conflict(self, now: float) -> str:
        """See `FeedbackPipe.conflict`."""
        return self._pipe.conflict(now)

    def unsettled(self, now: float) -> str:
        """See `FeedbackPipe.unsettled`."""
        return self._pipe.unsettled(now)

    def set_timeout(self, timeout: float, strikes: int) -> None:
        """See `FeedbackPipe.set_timeout`; the most patient plugin counts."""
        self.source.set_timeout(timeout, strikes)

    def watched(self, dofs: np.ndarray, watch: Watch | None) -> Watch | None:
        """See `FeedbackPipe.watched`."""
        return self._pipe.watched(dofs, watch)

    def check_start(self) -> None:
        """See `FeedbackPipe.check_start`."""
        self._pipe.check_start()

    def run(self) -> MessageStatus:
        """See `FeedbackPipe.run`."""
        source = self.source
        pipe = self._pipe
        self.turn = turn = self._turns.number
        if source.turn != turn:  # the first of the pipes in this cycle
            source.turn = turn
            pipe.run()
        self.handovers = pipe.handovers
        if pipe.accepted == self._seen:
            return OLD if self._seen else NONE
        self._seen = pipe.accepted
        self.accepted += 1
        watch = self._watch
        self.arrival = watch.stalest.arrival if watch is not None and watch.owners else pipe.arrival
        self.stamp = pipe.stamp
        if not self.received:
            self.received = self._complete()
        return NEW

    def restart(self) -> None:
        """See `FeedbackPipe.restart`; restarts the source only if no other plugin goes on with it."""
        self.received = False
        self.arrival = math.inf
        self._not_received = None
        self.source.restart()

    def _complete(self) -> bool:
        pipe = self._pipe
        if not isinstance(pipe, StateFeedbackPipe) or pipe.part is None:
            return pipe.received
        if self._not_received is None:
            self._not_received = np.ones(len(pipe.state_fields[0].values), dtype=bool)
        self._not_received[pipe.part] = False
        return not self._not_received.any()

    def _match(self, message: Message) -> None:
        """Do nothing: the source matches its messages."""

    def _decode(self, message: Message) -> None:
        """Do nothing: the source reads its messages."""
