"""What all pipes that a plugin hears have in common: how messages are taken or refused, and written to a State."""

import abc
import logging
from collections.abc import Sequence

import numpy as np

from solfer.errors import NotFinite, PipeError
from solfer.logs import Throttle
from solfer.model import State
from solfer.numerics.filters import LowPass
from solfer.pipes.endpoints import Reader, Status
from solfer.pipes.messages import Message

INTERFACES = {"position": "position", "velocity": "velocity", "effort": "torque"}
"""Field of a pipe, and the State's interface that it belongs to."""


class Channel:
    """Numbers that a pipe brings for one interface of a State.

    Args:
        field: One of INTERFACES.
        dofs: DoFs of the State that they belong to, shape (k,).
        low_pass: Filter of the numbers; None: they are taken as they come.

    Attributes:
        field: One of INTERFACES.
        values: The newest numbers, shape (k,).
    """

    def __init__(self, field: str, dofs: np.ndarray, low_pass: LowPass | None = None):
        self.field, self.values, self.filtered = field, np.zeros(len(dofs)), low_pass is not None
        self._interface, self._dofs, self._low_pass = INTERFACES[field], dofs, low_pass
        self._held = np.zeros(len(dofs)) if self.filtered else self.values
        self._passed = np.zeros(len(dofs)) if self.filtered else self.values

    def accept(self) -> None:
        """`values` are whole and good: those that a filter sees from now on."""
        np.copyto(self._held, self.values)

    def write(self, state: State) -> None:
        """Write what was accepted last to the State; one step of the filter."""
        if self._low_pass is not None:
            np.copyto(self._passed, self._held)
            self._low_pass.step(self._passed)
        state.write(self._interface, self._passed, self._dofs)


class Feedback(abc.ABC):
    """A pipe that a plugin hears.

    A message that does not fit is refused whole: nothing of it is used, and the refusal is counted and logged once a
    second.

    Args:
        name: Name of the pipe in the configuration.
        reader: Where the messages come from.
        required: Whether the plugin has to wait for this pipe before it starts.

    Attributes:
        accepted: Messages that were taken over.
        refused: Messages that were not.
    """

    def __init__(self, name: str, reader: Reader, required: bool = True):
        self.name, self.reader, self.required = name, reader, required
        self.accepted = self.refused = 0
        self._throttle = Throttle(logging.getLogger(__name__))

    def run(self) -> Status:
        """Take over the newest message: NEW if there was one that fits, OLD or NONE if not."""
        status = self.reader.read()
        if status is not Status.NEW:
            return status
        try:
            self._decode(self.reader.message)
        except (PipeError, NotFinite) as error:
            self.refused += 1
            sender = self.reader.message.sender or self.reader.topic
            self._throttle.warning("refused", "feedback '%s' refuses a message of %s: %s", self.name, sender, error)
            return Status.OLD
        self.accepted += 1
        return Status.NEW

    @abc.abstractmethod
    def _decode(self, message: Message) -> None:
        """Take the numbers out of a message.

        Raises:
            PipeError: The message does not fit.
            NotFinite: A number is none.
        """


class StateFeedback(Feedback):
    """A pipe that writes a State; filters make one step in every cycle, whether there is news or not.

    Args:
        name: Name of the pipe in the configuration.
        reader: Where the messages come from.
        state: State that is written.
        channels: The interfaces that are written.
        required: Whether the plugin has to wait for this pipe before it starts.
    """

    def __init__(self, name: str, reader: Reader, state: State, channels: Sequence[Channel], required: bool):
        super().__init__(name, reader, required)
        self._state, self._channels = state, tuple(channels)
        self._filtered = any(channel.filtered for channel in self._channels)

    def run(self) -> Status:
        """See `Feedback.run`."""
        status = super().run()
        if self._filtered and status is Status.NEW:
            for channel in self._channels:
                channel.accept()
        if status is Status.NEW or (self._filtered and self.accepted):
            for channel in self._channels:
                channel.write(self._state)
        return status
