"""What is wrong with the messages of a pipe: for its log, its health, and what waits for it."""

import logging
import math

from solfer.errors import Contradiction, SolferError
from solfer.throttle import Throttle
from solfer.transport.endpoints import Reader

NAMING_DELAY = 0.2
"""Time within which a plugin receives that its robot was put into another state, and within which joints agree with
their velocities again after an impact: a contradiction that is still there then is one of a sensor [s]."""


class PipeWarnings:
    """Counts refused messages and logs why, once a second for each sender.

    What contradicts earlier measurements is logged `NAMING_DELAY` later, unless the pipe restarts meanwhile, or it was
    an impact.

    Args:
        logger: That of the pipe.
        name: Name of the pipe.
        reader: Receives its messages.

    Attributes:
        throttle: Logs for the pipe.
        refused: Number of messages that did not fit.
        refusal: Sender and reason of the newest refusal; of several in a row of the first.
        refused_at: When the newest message was refused, in the pipe's own clock [s].
        is_open: Whether no message was accepted since.
        contradicts: Whether the newest message was refused since it contradicts other measurements.
        pending: Sender, error and arrival of a contradiction that is not logged yet; None: there is none.
        remark: What was odd with a message that counts; empty: nothing yet.
        remarked_at: When that message arrived, in the pipe's own clock [s].
    """

    def __init__(self, logger: logging.Logger, name: str, reader: Reader):
        self.throttle = Throttle(logger)
        self._name = name
        self._reader = reader
        self.refused = 0
        self.refusal = ""
        self.remark = ""
        self.refused_at = self.remarked_at = -math.inf
        self.is_open = self.contradicts = self._is_named = False
        self.pending: tuple[str, Contradiction, float] | None = None

    @property
    def lasting(self) -> str:
        """Return why messages are refused at present; empty: they are not, or for a moment."""
        return self.refusal if self.is_open and self.pending is None else ""

    def note(self, error: SolferError) -> str:
        """Note why the message that was read last is refused; return its sender."""
        sender = self._reader.message.sender or self._reader.topic
        if not self.is_open:
            self.refusal = f"{sender}: {error.line}"
            self.is_open = True
        return sender

    def refuse(self, error: SolferError) -> None:
        """Count the message that was read last as refused."""
        sender = self.note(error)
        self.refused += 1
        self.refused_at = self._reader.arrival
        self.contradicts = isinstance(error, Contradiction)
        if not isinstance(error, Contradiction) or self._is_named:
            self._log(sender, error)
        elif self.pending is None:
            self.pending = sender, error, self.refused_at

    def log_pending(self) -> None:
        """Log a contradiction that is still there."""
        if self.pending is not None and self._reader.arrival >= self.pending[2] + NAMING_DELAY:
            self._log(*self.pending[:2])
            self.pending = None
            self.is_open = self._is_named = True

    def close(self) -> None:
        """Note that a message was accepted."""
        self.is_open = self.contradicts = self._is_named = False
        if self.pending is not None and self.pending[1].fleeting:
            self.pending = None

    def restart(self) -> None:
        """Forget a contradiction that is not logged yet."""
        if self.pending is not None:
            self.pending = None
            self.is_open = False

    def warn(self, key: str, remark: str) -> None:
        """Note what is odd with the message that was read last; it is logged once a second for each `key`."""
        self.remark = remark
        self.remarked_at = self._reader.arrival
        self.throttle.warning(key, "feedback '%s' (%s): %s", self._name, self._reader.topic, remark)

    def _log(self, sender: str, error: SolferError) -> None:
        self.throttle.warning(sender, "feedback '%s' refuses a message of %s: %s", self._name, sender, error.line)
