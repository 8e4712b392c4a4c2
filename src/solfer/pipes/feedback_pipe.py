"""Base classes of the pipes that a plugin receives: they accept or refuse messages, and write them to a State."""

import abc
import logging
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from solfer.errors import NotFinite, PipeError, SolferError, UnknownName, Unrelated
from solfer.model import History, State
from solfer.numerics.filters import LowPass
from solfer.pipes.pipe_warnings import PipeWarnings
from solfer.pipes.precedence import Precedence, Watch
from solfer.pipes.state_field import StateField
from solfer.transport.endpoints import NEW, NONE, OLD, PUBLISHER_TIMEOUT, MessageStatus, Publisher, Reader
from solfer.transport.messages import Message
from solfer.transport.sender_clock import SenderClock

logger = logging.getLogger(__name__)

MakeFilter = Callable[[int], LowPass]
"""Makes a filter of a given size."""

UNFIT = (PipeError, UnknownName, NotFinite)
"""Errors of a message that does not fit."""


@dataclass(frozen=True)
class Reception:
    """How a pipe receives numbers of a State.

    Attributes:
        required: Whether the plugin has to wait for the pipe before it starts.
        low_pass: Makes the filter of one field; None: there is none.
        measured: Whether the State is measured; else the newest message of any publisher counts.
        history: Most messages of one cycle that are handed over, of a reader that keeps as many; 0: the newest alone.
            Measured States only.
    """

    required: bool = True
    low_pass: MakeFilter | None = None
    measured: bool = False
    history: int = 0


class FeedbackPipe(abc.ABC):
    """A pipe that a plugin receives.

    A message that does not fit is refused whole: nothing of it is used, see `PipeWarnings`. One that has nothing of
    what the pipe receives is no fault as soon as another one fits.
    Where a topic has several publishers, the newest message counts, and their names are logged; for measured States
    the first publisher counts, see `StateFeedbackPipe`.

    Args:
        name: Name of the pipe in the configuration.
        reader: Receives the messages.
        required: Whether the plugin has to wait for this pipe before it starts.

    Attributes:
        accepted: Number of accepted messages.
        received: Whether all values of the pipe have been received since the start or the last `restart`.
        arrival: Arrival of the newest accepted message, in the pipe's own clock [s]; infinity while there is none since
            the start or the last `restart`. If several publishers are required it is that of the stalest of them.
        stamp: When the numbers of the newest accepted message were true, by the sender's clock [s]; zero before the
            first. For measured States see `SenderClock`.
        handovers: How often another publisher replaced one that had timed out.
        changed: Arrival of the newest message that changed any number of the State [s]; infinity: that is not known.
        warnings: What is wrong with its messages.
    """

    _watch: Watch | None = None
    _clock: SenderClock | None = None  # of the sender of the message that was read last; None: any stamp counts
    handovers = 0
    changed = math.inf

    def __init__(self, name: str, reader: Reader, required: bool = True):
        self.name = name
        self.reader = reader
        self.required = required
        self.accepted = 0
        self.received = False
        self.arrival = math.inf
        self.stamp = 0.0
        self._stamp = 0.0  # of the message that was read last
        self.warnings = PipeWarnings(logger, name, reader)

    @property
    def refused(self) -> int:
        """Number of messages that did not fit."""
        return self.warnings.refused + self.reader.refused

    @property
    def measures(self) -> bool:
        """Whether it writes what is measured into a State."""
        return False

    @property
    def ignored(self) -> int:
        """Number of messages that did not count because another publisher publishes the same."""
        return 0

    @property
    def dropped(self) -> int:
        """Number of messages that are lacking in a history because there were too many in one cycle."""
        return 0

    @property
    def lacks(self) -> str:
        """Description of the values that have not been received yet, and why messages with them are refused."""
        refusal = self.warnings.lasting
        return f"{self.place}, which refuses messages of {refusal}" if refusal else self.place

    @property
    def place(self) -> str:
        """The pipe's name and topic."""
        return f"'{self.name}' ({self.reader.topic})"

    @property
    def silent(self) -> str:
        """Name of the publisher that has been silent for the longest time; empty: there are not several that count."""
        stalest = None if self._watch is None else self._watch.stalest
        return "" if stalest is None else stalest.name

    def require(self, dofs: np.ndarray) -> None:
        """Require the pipe at a start; from then on each publisher of some of the Robot's `dofs` has to go on."""
        self.required = True
        self._watch = self.watched(dofs, self._watch)

    def watched(self, dofs: np.ndarray, watch: Watch | None) -> Watch | None:
        """Add DoFs of the Robot to a watch of the pipe's publishers, or make one; None: any of them may end."""
        return watch

    def run(self) -> MessageStatus:
        """Read and accept the newest message: NEW if there was one that fits, OLD or NONE if not."""
        reader = self.reader
        status = reader.read()
        if status is not NEW:
            return status
        if len(reader.publishers) > 1:
            self._name_publishers()
        return NEW if self._accept() else OLD

    def conflict(self, now: float) -> str:
        """Return the publishers of the same DoFs at the time `now` [s]: either may be right; empty: there are none."""
        return ""

    def unsettled(self, now: float) -> str:
        """Return why no plugin may start with the values at the time `now` [s]; empty: it may. Can block briefly."""
        return ""

    def set_timeout(self, timeout: float, strikes: int) -> None:  # noqa: B027 most have no precedence
        """Set the timeout after which another publisher of the same may replace one; see `Precedence`."""

    def check_start(self) -> None:  # noqa: B027 most accept every start
        """Check the received values, with which a plugin is about to start.

        Raises:
            OutOfLimits: A measured joint is outside of its limits.
        """

    def check_fit(self, message: Message, quantity: str = "") -> None:  # noqa: B027 most fit by their message
        """Check that this pipe can use what a known sender sends, before it does.

        Args:
            message: A message as the sender will send it; its numbers do not count.
            quantity: What the numbers of Robot Points are; empty: unknown.

        Raises:
            PipeError: It would refuse such messages, or miss a part of them for ever.
            UnknownName: They contain an unknown name.
        """

    def restart(self) -> None:
        """Begin again: discard what was received so far. Written values stay."""
        self.received = False
        self.arrival = math.inf
        self.warnings.restart()

    def repeat(self, arrival: float) -> None:
        """Count numbers that were written where messages are decoded to as all of a message of `arrival` [s]."""
        self.accepted += 1
        self.arrival = arrival
        self.received = True

    def _complete(self) -> bool:
        """Return whether all values of the pipe have been received."""
        return True

    def _accept(self) -> bool:
        """Decode the message that was read last; return whether it fits."""
        reader = self.reader
        warnings = self.warnings
        if warnings.pending is not None:
            warnings.log_pending()
        message = reader.message
        if message is not None:
            clock = self._clock
            self._stamp = message.stamp if clock is None else clock.time(message.stamp, reader.arrival)
            if clock is not None and clock.is_distrusted:
                warnings.warn("clock", f"{message.sender} sends {clock.fault}; arrivals count instead")
        try:
            self._decode(message)
        except UNFIT as error:
            self._refuse(error)
            return False
        if warnings.is_open:
            warnings.close()
        self.accepted += 1
        self.arrival = reader.arrival
        self.stamp = self._stamp
        if not self.received:
            self.received = self._complete()
        return True

    def _refuse(self, error: SolferError) -> None:
        unrelated = isinstance(error, Unrelated)
        if unrelated and self.arrival < math.inf:
            return  # another publisher has what the pipe receives
        if unrelated and self.measures:
            self.warnings.note(error)  # a plugin that waits for the pipe logs it
        else:
            self.warnings.refuse(error)

    def _name_publishers(self) -> None:
        reader = self.reader
        recent_senders = reader.recent_senders(reader.arrival - PUBLISHER_TIMEOUT)
        if len(recent_senders) > 1:
            self.warnings.throttle.warning(
                "publishers",
                "feedback '%s': %s publish on %s at the same time; the newest message counts, now that of %s",
                self.name,
                " and ".join(recent_senders),
                reader.topic,
                reader.message.sender,
            )

    @abc.abstractmethod
    def _decode(self, message: Message) -> None:
        """Read the values of a message.

        Raises:
            PipeError: The message does not fit.
            UnknownName: It contains an unknown name.
            NotFinite: A value is NaN or infinite.
        """


class _StateWriter:
    """Writes numbers of certain DoFs to a State.

    Args:
        state: The State.
        interfaces: Names of the interfaces that are written.
        dofs: The DoFs, shape (k,).
    """

    def __init__(self, state: State, interfaces: Sequence[str], dofs: np.ndarray):
        # imported here: its compiler takes a while to load
        from solfer.numerics.kernels import scatter
        from solfer.numerics.pointers import address

        self._state = state
        self._scatter = scatter
        self._dofs = dofs
        self._all = np.arange(len(dofs))
        # arrays of a State stay where they are
        self._live = np.array([address(state[interface]) for interface in interfaces], dtype=np.int64)
        self._touched = _subsets(interfaces)

    def write(self, values: np.ndarray, part: np.ndarray | None) -> bool:
        """Write values of some of the DoFs, None: of all; return whether any number has changed.

        Args:
            values: The values, shape (interfaces, k).
            part: Indices of the values that are written.
        """
        changes = self._scatter(values, self._all if part is None else part, self._dofs, self._live)
        if changes:
            self._state.touch(*self._touched[changes])
        return bool(changes)


class StateFeedbackPipe(FeedbackPipe):
    """A pipe that writes a State; filters make one step in every cycle, also without a new message.

    A measured DoF has one source: of several publishers of the same DoFs the first one counts (`Precedence`).
    Publishers of different DoFs complete each other, and each of them is read separately.

    Args:
        name: Name of the pipe in the configuration.
        reader: Receives the messages.
        state: State that is written.
        fields: Fields of the pipe, which name the interfaces that are written.
        dofs: DoFs that are written, shape (k,).
        reception: How it receives.

    Attributes:
        state_fields: The interfaces that are written.
        values: Where their newest values are decoded to, shape (len(state_fields), k).
        part: Indices of the values in the newest messages; None: all.
        history: Every message of a cycle, which the State has as well; None: the newest alone counts.
    """

    def __init__(
        self,
        name: str,
        reader: Reader,
        state: State,
        fields: Sequence[str],
        dofs: np.ndarray,
        *,
        reception: Reception,
    ):
        super().__init__(name, reader, reception.required)
        low_pass = reception.low_pass
        self._state = state
        self._filtered = low_pass is not None
        self.values = np.zeros((len(fields), len(dofs)))
        self._passed = np.zeros((len(fields), len(dofs)))
        self.state_fields = tuple(
            StateField(field, dofs, values, passed=passed, low_pass=low_pass(len(dofs)) if low_pass else None)
            for field, values, passed in zip(fields, self.values, self._passed, strict=True)
        )
        self._writer = _StateWriter(state, [each.interface for each in self.state_fields], dofs)
        self.part: np.ndarray | None = None
        self._precedence = Precedence(len(dofs)) if reception.measured else None
        self._ever: np.ndarray | None = None  # indices of the values received since the start; None: all
        self._filtering = False
        self.history: History | None = None
        if reception.history:
            self.history = History([each.interface for each in self.state_fields], dofs, reception.history)
            state.histories.append(self.history)

    @property
    def measures(self) -> bool:
        """See `FeedbackPipe.measures`; other States are what a component wants."""
        return self._precedence is not None

    @property
    def ignored(self) -> int:
        """See `FeedbackPipe.ignored`."""
        return 0 if self._precedence is None else self._precedence.ignored

    @property
    def dropped(self) -> int:
        """See `FeedbackPipe.dropped`."""
        return 0 if self.history is None else self.history.dropped

    def watched(self, dofs: np.ndarray, watch: Watch | None) -> Watch | None:
        """See `FeedbackPipe.watched`."""
        if self._precedence is not None:
            flags = np.isin(self.state_fields[0].dofs, dofs)
            watch = Watch(flags if watch is None else flags | watch.dofs)
            self._precedence.watch(watch)
        return watch

    def run(self) -> MessageStatus:
        """See `FeedbackPipe.run`."""
        precedence = self._precedence
        reader = self.reader
        if precedence is None:
            status = super().run()
            if status is NEW:
                self._write_fields()
        elif self.history is not None:
            status = self._take_all(self.history)
        else:
            publishers = reader.update()
            sole = precedence.sole
            if len(publishers) == 1 and sole is not None and sole.name == publishers[0].name:
                status = reader.read_from(publishers[0])
                self._clock = publishers[0].clock
                if status is NEW and not self._accept():
                    status = OLD
                if status is NEW:
                    if self.part is sole.part:
                        sole.note(reader.arrival)
                    else:
                        precedence.note(sole.name, self.part, reader.arrival)
                    self._write_fields()
            else:
                status = self._arbitrate(publishers)
        if self._filtering:
            self.filter()
        return status

    def repeat(self, arrival: float) -> None:
        """See `FeedbackPipe.repeat`; writes them to the State, or passes them to the filters."""
        super().repeat(arrival)
        self.part = None
        self._write_fields()
        if self.history is not None:
            self.history.add(arrival, arrival, self.values)

    def filter(self) -> None:
        """Make one step of the filters, if they have an input."""
        if self._filtering:
            for state_field in self.state_fields:
                state_field.filter()
            self._writer.write(self._passed, self._ever)

    def restart(self) -> None:
        """See `FeedbackPipe.restart`; resets the filters as well."""
        super().restart()
        self._filtering = False
        for publisher in self.reader.publishers:
            publisher.clock.restart()
        for state_field in self.state_fields:
            state_field.reset()
        if self.history is not None:
            self.history.clear()

    def conflict(self, now: float) -> str:
        """See `FeedbackPipe.conflict`."""
        rivals = [] if self._precedence is None else self._precedence.rivals(now - PUBLISHER_TIMEOUT)
        if not rivals:
            return ""
        return f"{self.place}, where {' and '.join(rivals)} publish the same DoFs: end one of them"

    def unsettled(self, now: float) -> str:
        """See `FeedbackPipe.unsettled`."""
        conflict = self.conflict(now)
        if conflict or self._precedence is None:
            return conflict
        awaited = self.reader.awaited()
        if not awaited:
            return ""
        return f"{self.place}, where {' and '.join(awaited)} may publish, too"

    def set_timeout(self, timeout: float, strikes: int) -> None:
        """See `FeedbackPipe.set_timeout`."""
        if self._precedence is not None:
            self._precedence.timeout = timeout
            self._precedence.strikes = strikes

    def _arbitrate(self, publishers: Sequence[Publisher]) -> MessageStatus:
        """Read and accept the newest message of each publisher, where there are several, or an unknown one."""
        reader = self.reader
        arrival = -math.inf if self.arrival == math.inf else self.arrival
        parts = []
        for publisher in publishers:
            if reader.read_from(publisher) is NEW and self._take(publisher):
                parts.append(self.part)
                self.arrival = arrival = max(arrival, reader.arrival)
        return self._unite(parts)

    def _take_all(self, history: History) -> MessageStatus:
        """Read and accept every message since the last cycle, in the order of their arrival."""
        reader = self.reader
        parts: list[np.ndarray | None] = []
        history.clear()
        publisher = reader.read_next()
        # a publisher that never stops does not keep the cycle from going on
        rest = history.size * max(1, len(reader.publishers))
        while publisher is not None:
            if self._take(publisher):
                history.add(self.stamp, reader.arrival, self.values, self.part)
                history.sender = publisher.name
                parts.append(self.part)
            rest -= 1
            publisher = reader.read_next() if rest else None
        history.dropped += reader.dropped - history.unread
        history.unread = reader.dropped
        return self._unite(parts)

    def _take(self, publisher: Publisher) -> bool:
        """Accept the message that was read last, if its publisher counts; return whether it does and fits."""
        sole = self._precedence.sole
        counts = (sole is not None and sole.name == publisher.name) or self._counts(publisher)
        self._clock = publisher.clock
        if not counts or not self._accept():
            return False
        self._precedence.note(publisher.name, self.part, self.reader.arrival)
        self._write_fields()
        return True

    def _unite(self, parts: Sequence[np.ndarray | None]) -> MessageStatus:
        """Let `part` be all that the messages of this cycle had; return whether there were any."""
        if not parts:
            return NONE if self.reader.message is None else OLD
        if self._watch is not None and self._watch.owners:
            self.arrival = self._watch.stalest.arrival
        self.part = None if any(part is None for part in parts) else np.unique(np.concatenate(parts))
        return NEW

    def _counts(self, publisher: Publisher) -> bool:
        """Return whether the message that was read last is from a publisher that counts."""
        precedence = self._precedence
        reader = self.reader
        try:
            self._match(reader.message)
        except UNFIT as error:
            self._refuse(error)
            return False
        counts = precedence.admits(publisher.name, self.part, reader.arrival)
        if precedence.handovers != self.handovers:
            self.handovers = precedence.handovers
            logger.warning(
                "feedback %s: %s counts from now on, since the one before timed out", self.place, publisher.name
            )
        if not counts:
            self.warnings.throttle.warning(
                publisher.name,
                "feedback %s; %d messages of %s were ignored",
                self.conflict(reader.arrival) or self.place,
                precedence.ignored,
                publisher.name,
            )
        return counts

    def _write_fields(self) -> None:
        """Write the newest values to the State, or pass them to the filters."""
        if not self._filtered:
            if self._writer.write(self.values, self.part):
                self.changed = self.arrival
            return
        for state_field in self.state_fields:
            state_field.accept(self.part)
        self._filtering = True

    @abc.abstractmethod
    def _match(self, message: Message) -> None:
        """Find out which DoFs a message contains: `part`. `_decode` does so, too, and raises the same."""


def _subsets(names: Sequence[str]) -> tuple[tuple[str, ...], ...]:
    """Return the names of which the bits of a number are set, for each number."""
    return tuple(
        tuple(name for bit, name in enumerate(names) if number >> bit & 1) for number in range(1 << len(names))
    )
