"""One feedback for several plugins that share a Robot: it is read once a cycle, before the first of them."""

import math
from collections.abc import Callable

import numpy as np

from solfer.config.records.pipes import FeedbackRecord
from solfer.pipes.feedback_pipe import FeedbackPipe, StateFeedbackPipe
from solfer.transport.endpoints import NEW, NONE, OLD, MessageStatus, Publisher, Reader, Writer
from solfer.transport.messages import Message


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


class Source:
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

    def __init__(self, pipe: FeedbackPipe, turns: Turns):
        self.pipe = pipe
        self.turns = turns
        self.turn = -1
        self._shares: list[SharedFeedbackPipe] = []
        self._timeout = 0.0
        self._strikes = 1

    def share(self, record: FeedbackRecord) -> "SharedFeedbackPipe":
        """Make the pipe of one plugin that configures this feedback by `record`."""
        share = SharedFeedbackPipe(self, record.name, record.initialize or record.limits is not None)
        self._shares.append(share)
        return share

    def restart(self) -> None:
        """Begin again if no other reader goes on with what was received before."""
        recent = self.turns.number - 1
        if not any(share.received and share.turn >= recent for share in self._shares):
            self.pipe.restart()

    def be_patient(self, timeout: float, strikes: int) -> None:
        """See `FeedbackPipe.be_patient`; the most patient plugin counts."""
        self._timeout = max(self._timeout, timeout)
        self._strikes = max(self._strikes, strikes)
        self.pipe.be_patient(self._timeout, self._strikes)


class SharedFeedbackPipe(FeedbackPipe):
    """A plugin's share of a source; it restarts as if the plugin had the pipe for itself.

    Args:
        source: The source.
        name: Name of the pipe in the plugin's configuration.
        required: Whether the plugin has to wait for this pipe before it starts.

    Attributes:
        source: The source.
        turn: Number of the cycle in which it ran last; -1 before.
    """

    def __init__(self, source: Source, name: str, required: bool):
        pipe = source.pipe
        super().__init__(name, pipe.reader, required)
        self.source = source
        self.turn = -1
        self._pipe = pipe
        self._seen = 0
        self._turns = source.turns
        self._not_received: np.ndarray | None = None

    @property
    def refused(self) -> int:
        """See `FeedbackPipe.refused`."""
        return self._pipe.refused

    @property
    def refusal(self) -> str:  # type: ignore[override]
        """See `FeedbackPipe.refusal`."""
        return self._pipe.refusal

    @property
    def refused_at(self) -> float:  # type: ignore[override]
        """See `FeedbackPipe.refused_at`."""
        return self._pipe.refused_at

    @property
    def measures(self) -> bool:
        """See `FeedbackPipe.measures`."""
        return self._pipe.measures

    @property
    def changed(self) -> float:  # type: ignore[override]
        """See `FeedbackPipe.changed`."""
        return self._pipe.changed

    @property
    def ignored(self) -> int:
        """See `FeedbackPipe.ignored`."""
        return self._pipe.ignored

    @property
    def dropped(self) -> int:
        """See `FeedbackPipe.dropped`."""
        return self._pipe.dropped

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
        """See `FeedbackPipe.be_patient`; the most patient plugin counts."""
        self.source.be_patient(timeout, strikes)

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
        self.arrival = pipe.arrival
        self.stamp = pipe.stamp
        if not self.received:
            self.received = self._complete()
        return NEW

    def restart(self) -> None:
        """See `FeedbackPipe.restart`; restarts the source only if no other plugin goes on with it."""
        super().restart()
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


class Written:
    """What one plugin writes into a shared Robot and publishes on a topic: the others need not receive it.

    Args:
        now: The clock of the plugins [s].

    Attributes:
        count: Number of times that it was published.
        time: When it was published last, in the pipe's own clock [s]; minus infinity before.
        is_received: Whether another plugin counts on it.
    """

    def __init__(self, now: Callable[[], float]):
        self.count = 0
        self.time = -math.inf
        self._now = now
        self.is_received = False

    def note(self) -> None:
        """Note that it was published."""
        self.count += 1
        self.time = self._now()

    def age(self) -> float:
        """Return the time since it was published last [s]; infinity before."""
        return self._now() - self.time


class NotedWriter(Writer):
    """Notes each message that is written.

    Args:
        writer: Publishes the messages.
        written: Takes the notes.
    """

    def __init__(self, writer: Writer, written: Written):
        self.topic = writer.topic
        self.carries = writer.carries
        self._writer = writer
        self._written = written

    @property
    def is_received(self) -> bool:  # type: ignore[override]
        """See `Writer.received`."""
        return self._written.is_received or self._writer.is_received

    def prepare(self, message: Message) -> None:
        """See `Writer.prepare`."""
        self._writer.prepare(message)

    def write(self, message: Message) -> None:
        """See `Writer.write`."""
        self._writer.write(message)
        self._written.note()


class WrittenReader(Reader):
    """Stands in for the topic of what another plugin has written: no message is received.

    Args:
        topic: The topic.
        written: Notes of the other plugin.
    """

    def __init__(self, topic: str, written: Written):
        self.topic = topic
        self._written = written
        self._seen = 0
        written.is_received = True

    def read(self) -> MessageStatus:
        """See `Reader.read`."""
        written = self._written
        if written.count == self._seen:
            return OLD if self._seen else NONE
        self._seen = written.count
        self.arrival = written.time
        return NEW

    def update(self) -> tuple[Publisher, ...]:
        """See `Reader.update`; no publisher writes to it."""
        return ()

    def read_from(self, publisher: Publisher) -> MessageStatus:
        """See `Reader.read_from`."""
        return self.read()

    def age(self) -> float:
        """See `Reader.age`."""
        return self._written.age()


class WrittenFeedbackPipe(FeedbackPipe):
    """A feedback that counts as read: another plugin has written its values into the Robot that both share."""

    def _decode(self, message: Message) -> None:
        """Do nothing: the values are there."""
