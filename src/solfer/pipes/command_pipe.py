"""Base class of the pipes that publish commands."""

import abc

import numpy as np

from solfer.numerics.filters import LowPass
from solfer.transport.endpoints import Writer
from solfer.transport.messages import Message


class CommandPipe(abc.ABC):
    """A pipe that a plugin publishes: `collect` in every cycle, then `send`.

    Args:
        name: Name of the pipe in the configuration.
        writer: Publishes the messages.
        sent: The message, filled again in every cycle.

    Attributes:
        sent: The message as the receiver gets it.
    """

    def __init__(self, name: str, writer: Writer, sent: Message):
        self.name = name
        self.writer = writer
        self.sent = sent
        self._filters: list[tuple[LowPass, np.ndarray]] = []
        writer.prepare(sent)

    @property
    def quantity(self) -> str:
        """Quantity of the Robot Points that it carries, one of `solfer.config.kinds.point.QUANTITIES`; empty: none."""
        return ""

    @abc.abstractmethod
    def collect(self) -> bool | None:
        """Fill the message with the newest values; true: its gate has to look at them, see `JointCommandPipe`."""

    def reset(self) -> None:
        """Reset the filters: the next values are sent without a filter's delay."""
        for low_pass, _ in self._filters:
            low_pass.reset()

    def send(self, stamp: float) -> None:
        """Send the collected values, stamped with `stamp` [s]."""
        self.sent.stamp = stamp
        self.writer.write(self.sent)
