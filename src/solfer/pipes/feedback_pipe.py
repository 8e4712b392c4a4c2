"""Base classes of the pipes that a plugin receives: they accept or refuse messages, and write them to a State."""

import abc
import logging
import math
from collections.abc import Sequence

import numpy as np

from solfer.errors import NotFinite, PipeError, SolferError, UnknownName
from solfer.model import State
from solfer.pipes.precedence import Precedence
from solfer.pipes.state_field import StateField
from solfer.throttle import Throttle
from solfer.transport.endpoints import NEW, NONE, OLD, RIVALRY, MessageStatus, Publisher, Reader
from solfer.transport.messages import Message

logger = logging.getLogger(__name__)

UNFIT = (PipeError, UnknownName, NotFinite)
"""Errors of a message that does not fit."""


class FeedbackPipe(abc.ABC):
    """A pipe that a plugin receives.

    A message that does not fit is refused whole: nothing of it is used, and the refusal is counted and logged once a
    second. Where a topic has several publishers, the newest message counts, and their names are logged; for measured
    States the first publisher counts, see `StateFeedbackPipe`.

    Args:
        name: Name of the pipe in the configuration.
        reader: Receives the messages.
        required: Whether the plugin has to wait for this pipe before it starts.

    Attributes:
        accepted: Number of accepted messages.
        received: Whether all values of the pipe have been received since the start or the last `restart`.
        arrival: Arrival of the newest accepted message, in the pipe's own clock [s]; infinity while there is none since
            the start or the last `restart`.
        handovers: How often another publisher replaced one that had timed out.
    """

    handovers = 0

    def __init__(self, name: str, reader: Reader, required: bool = True):
        self.name, self.reader, self.required = name, reader, required
        self.accepted, self.received, self.arrival = 0, False, math.inf
        self._refused, self._throttle = 0, Throttle(logger)

    @property
    def refused(self) -> int:
        """Number of messages that did not fit."""
        return self._refused + self.reader.refused

    @property
    def ignored(self) -> int:
        """Number of messages that did not count because another publisher publishes the same."""
        return 0

    @property
    def lacks(self) -> str:
        """Description of the values that have not been received yet."""
        return self.place

    @property
    def place(self) -> str:
        """The pipe's name and topic."""
        return f"'{self.name}' ({self.reader.topic})"

    def run(self) -> MessageStatus:
        """Read and accept the newest message: NEW if there was one that fits, OLD or NONE if not."""
        reader = self.reader
        status = reader.read()
        if status is not NEW:
            return status
        if len(reader.publishers) > 1:
            self._name_publishers()
        return NEW if self._accept() else OLD

    def rivalry(self, now: float) -> str:
        """Return the publishers of the same DoFs at the time `now` [s]: either may be right; empty: there are none."""
        return ""

    def doubt(self, now: float) -> str:
        """Return why no plugin may start with the values at the time `now` [s]; empty: it may. Can block briefly."""
        return ""

    def be_patient(self, timeout: float, strikes: int) -> None:  # noqa: B027 most have no precedence
        """Set the timeout after which another publisher of the same may replace one; see `Precedence`."""

    def check_start(self) -> None:  # noqa: B027 most accept every start
        """Check the received values, with which a plugin is about to start.

        Raises:
            OutOfLimits: A measured joint is outside of its limits.
        """

    def restart(self) -> None:
        """Begin anew: discard what was received so far. Written values stay."""
        self.received, self.arrival = False, math.inf

    def _complete(self) -> bool:
        """Return whether all values of the pipe have been received."""
        return True

    def _accept(self) -> bool:
        """Decode the message that was read last; return whether it fits."""
        reader = self.reader
        try:
            self._decode(reader.message)
        except UNFIT as error:
            self._refuse(error)
            return False
        self.accepted += 1
        self.arrival = reader.arrival
        if not self.received:
            self.received = self._complete()
        return True

    def _refuse(self, error: SolferError) -> None:
        self._refused += 1
        sender = self.reader.message.sender or self.reader.topic
        self._throttle.warning(sender, "feedback '%s' refuses a message of %s: %s", self.name, sender, error.line)

    def _name_publishers(self) -> None:
        reader = self.reader
        recent_senders = reader.recent_senders(reader.arrival - RIVALRY)
        if len(recent_senders) > 1:
            self._throttle.warning(
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


class StateFeedbackPipe(FeedbackPipe):
    """A pipe that writes a State; filters make one step in every cycle, also without a new message.

    A measured DoF has one source: of several publishers of the same DoFs the first one counts (`Precedence`).
    Publishers of different DoFs complete each other, and each of them is read separately.

    Args:
        name: Name of the pipe in the configuration.
        reader: Receives the messages.
        state: State that is written.
        state_fields: The interfaces that are written.
        required: Whether the plugin has to wait for this pipe before it starts.
        filtered: Whether the state fields have filters.
        measured: Whether the State is measured; else the newest message of any publisher counts.

    Attributes:
        state_fields: The interfaces that are written.
        part: Indices of the values in the newest messages; None: all.
    """

    def __init__(
        self,
        name: str,
        reader: Reader,
        state: State,
        state_fields: Sequence[StateField],
        required: bool,
        filtered: bool = False,
        measured: bool = False,
    ):
        super().__init__(name, reader, required)
        self._state, self._filtered = state, filtered
        self.state_fields = tuple(state_fields)
        self.part: np.ndarray | None = None
        self._precedence = Precedence(len(self.state_fields[0].values)) if measured else None
        self._ever: np.ndarray | None = None  # indices of the values received since the start; None: all
        self._filtering = False

    @property
    def ignored(self) -> int:
        """See `FeedbackPipe.ignored`."""
        return 0 if self._precedence is None else self._precedence.ignored

    def run(self) -> MessageStatus:
        """See `FeedbackPipe.run`."""
        if self._precedence is None:
            status = super().run()
            if status is NEW:
                self._write_fields()
        else:
            status = self._receive(self.reader.update())
        if self._filtering:
            for state_field in self.state_fields:
                state_field.filter(self._ever)
        return status

    def restart(self) -> None:
        """See `FeedbackPipe.restart`; resets the filters as well."""
        super().restart()
        self._filtering = False
        for state_field in self.state_fields:
            state_field.reset()

    def rivalry(self, now: float) -> str:
        """See `FeedbackPipe.rivalry`."""
        rivals = [] if self._precedence is None else self._precedence.rivals(now - RIVALRY)
        if not rivals:
            return ""
        return f"{self.place}, where {' and '.join(rivals)} publish the same DoFs: end one of them"

    def doubt(self, now: float) -> str:
        """See `FeedbackPipe.doubt`."""
        rivalry = self.rivalry(now)
        if rivalry or self._precedence is None:
            return rivalry
        awaited = self.reader.awaited()
        if not awaited:
            return ""
        return f"{self.place}, where {' and '.join(awaited)} may publish, too"

    def be_patient(self, timeout: float, strikes: int) -> None:
        """See `FeedbackPipe.be_patient`."""
        if self._precedence is not None:
            self._precedence.timeout, self._precedence.strikes = timeout, strikes

    def _receive(self, publishers: Sequence[Publisher]) -> MessageStatus:
        """Read and accept the newest message of each publisher."""
        reader, sole = self.reader, self._precedence.sole
        if len(publishers) != 1 or sole is None or sole.name != publishers[0].name:
            return self._arbitrate(publishers)
        status = reader.read_from(publishers[0])
        if status is not NEW:
            return status
        if not self._accept():
            return OLD
        sole.note(self.part, reader.arrival)
        self._write_fields()
        return NEW

    def _arbitrate(self, publishers: Sequence[Publisher]) -> MessageStatus:
        """Do the same where there are several publishers, or an unknown one."""
        reader, arrival = self.reader, -math.inf if self.arrival == math.inf else self.arrival
        parts = []
        for publisher in publishers:
            if reader.read_from(publisher) is NEW and self._counts(publisher) and self._accept():
                self._precedence.note(publisher.name, self.part, reader.arrival)
                self._write_fields()
                parts.append(self.part)
                self.arrival = arrival = max(arrival, reader.arrival)
        if not parts:
            return NONE if reader.message is None else OLD
        self.part = None if any(part is None for part in parts) else np.unique(np.concatenate(parts))
        return NEW

    def _counts(self, publisher: Publisher) -> bool:
        """Return whether the message that was read last is from a publisher that counts."""
        precedence, reader = self._precedence, self.reader
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
            self._throttle.warning(
                publisher.name,
                "feedback %s; %d messages of %s were ignored",
                self.rivalry(reader.arrival) or self.place,
                precedence.ignored,
                publisher.name,
            )
        return counts

    def _write_fields(self) -> None:
        """Write the newest values to the State, or pass them to the filters."""
        if not self._filtered:
            for state_field in self.state_fields:
                state_field.write(state_field.values, self.part)
            return
        for state_field in self.state_fields:
            state_field.accept(self.part)
        self._filtering = True

    def _decode(self, message: Message) -> None:
        self._match(message)
        self._gather(message)

    @abc.abstractmethod
    def _match(self, message: Message) -> None:
        """Find out which DoFs a message contains: `part`. Raises as `_decode`."""

    @abc.abstractmethod
    def _gather(self, message: Message) -> None:
        """Read the values of the message that was matched last. Raises as `_decode`."""
