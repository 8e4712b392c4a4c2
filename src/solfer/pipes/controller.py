"""What all pipes that a plugin sends to have in common."""

import abc

import numpy as np

from solfer.numerics.filters import LowPass
from solfer.pipes.endpoints import Writer
from solfer.pipes.messages import Message


class Controller(abc.ABC):
    """A pipe that a plugin sends to: `collect` in every cycle, then `send`.

    Args:
        name: Name of the pipe in the configuration.
        writer: Where the messages go.
        sent: The message that is sent again and again.

    Attributes:
        sent: What the receiver gets.
    """

    def __init__(self, name: str, writer: Writer, sent: Message):
        self.name, self.writer, self.sent = name, writer, sent
        self._filters: list[tuple[LowPass, np.ndarray]] = []
        writer.prepare(sent)

    @abc.abstractmethod
    def collect(self) -> None:
        """Take the newest numbers into the message."""

    def reset(self) -> None:
        """Forget the past: what is collected next is sent as it is, without a filter's delay."""
        for low_pass, _ in self._filters:
            low_pass.reset()

    def send(self, stamp: float) -> None:
        """Send what was collected, stamped with `stamp` [s]."""
        self.sent.stamp = stamp
        self.writer.write(self.sent)
