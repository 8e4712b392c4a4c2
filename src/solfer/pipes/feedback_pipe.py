"""Base class of the pipes that a plugin receives: it accepts or refuses messages."""

import abc
import logging
import math

import numpy as np

from solfer.errors import NotFinite, PipeError, SolferError, UnknownName, Unrelated
from solfer.pipes.pipe_warnings import PipeWarnings
from solfer.pipes.precedence import Watch
from solfer.transport.clocks.sender_clock import SenderClock
from solfer.transport.endpoints import NEW, OLD, PUBLISHER_TIMEOUT, MessageStatus, Reader
from solfer.transport.messages import Message

logger = logging.getLogger(__name__)

UNFIT = (PipeError, UnknownName, NotFinite)
"""Errors of a message that does not fit."""


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
        status = self.reader.read()
        return OLD if status is NEW and not self._accept() else status

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
        if len(reader.publishers) > 1 and not self.measures:
            self._name_publishers()
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
