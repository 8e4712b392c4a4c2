"""Base class of the feedback pipes that write a State, and what writes it."""

import abc
import logging
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from solfer.model import History, State
from solfer.numerics.filters import LowPass
from solfer.pipes.feedback_pipe import UNFIT, FeedbackPipe
from solfer.pipes.precedence import Precedence, Watch
from solfer.pipes.state_field import StateField
from solfer.transport.endpoints import NEW, NONE, OLD, PUBLISHER_TIMEOUT, MessageStatus, Publisher, Reader
from solfer.transport.messages import Message

logger = logging.getLogger(__name__)

MakeFilter = Callable[[int], LowPass]
"""Makes a filter of a given size."""


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


class _Destination:
    """What a pipe writes of a State.

    Args:
        state: The State.
        interfaces: Names of the interfaces that are written.
        dofs: The DoFs, shape (k,).
        passed: What filters make of the values, shape (interfaces, k).

    Attributes:
        dofs, passed: See above.
        live: Addresses of the State's arrays, shape (interfaces,).
        scatter: Writes values, shape (interfaces, k), of which it gets the indices, and returns what has changed.
        all: The indices of all values, shape (k,).
        changed: Names of the interfaces that have changed, by what `scatter` returns.
    """

    def __init__(self, state: State, interfaces: Sequence[str], dofs: np.ndarray, passed: np.ndarray):
        # imported here: its compiler takes a while to load
        from solfer.numerics.kernels import scatter
        from solfer.numerics.pointers import address

        # arrays of a State stay where they are
        self.live = np.array([address(state[interface]) for interface in interfaces], dtype=np.int64)
        self.dofs = np.array(dofs, dtype=np.int64)
        self.passed = passed
        self.scatter = partial(scatter, self.dofs, self.live)
        self.all = np.arange(len(dofs))
        self.changed = tuple(
            tuple(name for bit, name in enumerate(interfaces) if number >> bit & 1)
            for number in range(1 << len(interfaces))
        )


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
        passed = np.zeros((len(fields), len(dofs)))
        self.state_fields = tuple(
            StateField(field, dofs, values, passed=row, low_pass=low_pass(len(dofs)) if low_pass else None)
            for field, values, row in zip(fields, self.values, passed, strict=True)
        )
        interfaces = [each.interface for each in self.state_fields]
        self._destination = _Destination(state, interfaces, dofs, passed)
        self.part: np.ndarray | None = None
        self._precedence = Precedence(len(dofs)) if reception.measured else None
        self._ever: np.ndarray | None = None  # indices of the values received since the start; None: all
        self._filtering = False
        self.history: History | None = None
        if reception.history:
            self.history = History(interfaces, dofs, reception.history)
            self.run = partial(self._take_all, self.history)  # type: ignore[method-assign] # without a call in between
            state.histories.append(self.history)

    @property
    def measures(self) -> bool:
        """See `FeedbackPipe.measures`; other States are desired by a component."""
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
            status = reader.read()
            if status is NEW and not self._accept():
                status = OLD
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
                        sole.arrival = reader.arrival
                        sole.strikes = 0
                    else:
                        precedence.note(sole.name, self.part, reader.arrival)
            else:
                status = self._arbitrate(publishers)
        if self._filtering:
            self.filter()
        return status

    def repeat(self, arrival: float) -> None:
        """See `FeedbackPipe.repeat`; writes them to the State, or passes them to the filters."""
        super().repeat(arrival)
        self.part = None
        self._write_fields(arrival)
        if self.history is not None:
            self.history.add(arrival, arrival, self.values)

    def filter(self) -> None:
        """Make one step of the filters, if they have an input."""
        if self._filtering:
            for state_field in self.state_fields:
                state_field.filter()
            destination = self._destination
            changes = destination.scatter(destination.passed, destination.all if self._ever is None else self._ever)
            self._state.touch(*destination.changed[changes])

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
        publishers = (
            [] if self._precedence is None else self._precedence.conflicting_publishers(now - PUBLISHER_TIMEOUT)
        )
        if not publishers:
            return ""
        return f"{self.place}, where {' and '.join(publishers)} publish the same DoFs: end one of them"

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
        history.count = 0
        publisher = reader.read_next()
        # a publisher that never stops does not keep the cycle from going on
        rest = history.size * max(1, len(reader.publishers))
        while publisher is not None:
            if self._take(publisher):
                history.add(self.stamp, reader.arrival, self.values, self.part)
                history.sender = publisher.name
                parts.append(self.part)
            rest -= 1
            publisher = reader.read_next() if rest and reader.has_next else None
        history.dropped += reader.dropped - history.unread
        history.unread = reader.dropped
        if self._filtering:
            self.filter()
        if not parts:
            return NONE if reader.message is None else OLD
        if len(parts) > 1 or self._watch is not None:
            self._unite(parts)
        return NEW

    def _take(self, publisher: Publisher) -> bool:
        """Accept the message that was read last, if its publisher counts; return whether it does and fits."""
        sole = self._precedence.sole
        counts = (sole is not None and sole.name == publisher.name) or self._counts(publisher)
        self._clock = publisher.clock
        if not counts or not self._accept():
            return False
        if sole is not None and self.part is sole.part and sole.name == publisher.name:
            sole.arrival = self.reader.arrival
            sole.strikes = 0
        else:
            self._precedence.note(publisher.name, self.part, self.reader.arrival)
        return True

    def _unite(self, parts: Sequence[np.ndarray | None]) -> MessageStatus:
        """Let `part` be all that the messages of this cycle had; return whether there were any."""
        if not parts:
            return NONE if self.reader.message is None else OLD
        if self._watch is not None and self._watch.owners:
            self.arrival = self._watch.stalest.arrival
        self.part = parts[0]
        if len(parts) > 1:
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

    def _write_fields(self, arrival: float) -> None:
        """Write the newest values, which came at `arrival` [s], to the State, or pass them to the filters."""
        if not self._filtered:
            destination = self._destination
            changes = destination.scatter(self.values, destination.all if self.part is None else self.part)
            if changes:
                self.changed = arrival
                versions = self._state.versions
                for interface in destination.changed[changes]:
                    versions[interface] += 1
            return
        for state_field in self.state_fields:
            state_field.accept(self.part)
        self._filtering = True

    @abc.abstractmethod
    def _decode(self, message: Message) -> None:
        """See `FeedbackPipe._decode`; writes the values to the State, or passes them to the filters."""

    @abc.abstractmethod
    def _match(self, message: Message) -> None:
        """Find out which DoFs a message contains: `part`. `_decode` does so, too, and raises the same."""
