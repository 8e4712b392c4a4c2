"""What all pipes that a plugin hears have in common: how messages are taken or refused, and written to a State."""

import abc
import logging
import math
from collections.abc import Sequence

import numpy as np

from solfer.errors import NotFinite, PipeError, UnknownName
from solfer.logs import Throttle
from solfer.model import State
from solfer.pipes.channel import Channel
from solfer.pipes.endpoints import NEW, OLD, Reader, Status
from solfer.pipes.messages import Message

RIVALRY = 1.0
"""Who spoke within this time is said to speak at present [s]."""


class Feedback(abc.ABC):
    """A pipe that a plugin hears.

    A message that does not fit is refused whole: nothing of it is used, and the refusal is counted and logged once a
    second. Where several senders speak on a topic, the newest message counts, and their names are logged.

    Args:
        name: Name of the pipe in the configuration.
        reader: Where the messages come from.
        required: Whether the plugin has to wait for this pipe before it starts.

    Attributes:
        accepted: Messages that were taken over.
        heard: Whether everything that the pipe carries has come since the start, or since it began anew.
        arrival: When the newest message arrived that was taken over, in the pipe's own clock [s]; infinity while there
            is none since the start, or since it began anew.
    """

    def __init__(self, name: str, reader: Reader, required: bool = True):
        self.name, self.reader, self.required = name, reader, required
        self.accepted, self.heard, self.arrival = 0, False, math.inf
        self._refused, self._throttle = 0, Throttle(logging.getLogger(__name__))

    @property
    def refused(self) -> int:
        """Messages that were not taken over."""
        return self._refused + self.reader.refused

    @property
    def lacks(self) -> str:
        """What has not been heard yet."""
        return f"'{self.name}' ({self.reader.topic})"

    def run(self) -> Status:
        """Take over the newest message: NEW if there was one that fits, OLD or NONE if not."""
        reader = self.reader
        status = reader.read()
        if status is not NEW:
            return status
        if len(reader.senders) > 1:
            self._name_senders()
        try:
            self._decode(reader.message)
        except (PipeError, UnknownName, NotFinite) as error:
            self._refused += 1
            sender = reader.message.sender or reader.topic
            self._throttle.warning(sender, "feedback '%s' refuses a message of %s: %s", self.name, sender, error.line)
            return OLD
        self.accepted += 1
        self.arrival = reader.arrival
        if not self.heard:
            self.heard = self._complete()
        return NEW

    def restart(self) -> None:
        """Begin anew: what was heard so far was about another time. What was written stays."""
        self.heard, self.arrival = False, math.inf

    def _complete(self) -> bool:
        """Whether everything that the pipe carries has come."""
        return True

    def _name_senders(self) -> None:
        reader = self.reader
        senders = reader.speakers(reader.arrival - RIVALRY)
        if len(senders) > 1:
            self._throttle.warning(
                "senders", "feedback '%s': %s speak on %s at the same time; the newest message counts, now that of %s",
                self.name, " and ".join(senders), reader.topic, reader.message.sender)

    @abc.abstractmethod
    def _decode(self, message: Message) -> None:
        """Take the numbers out of a message.

        Raises:
            PipeError: The message does not fit.
            UnknownName: It is about something that nobody knows.
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
        filtered: Whether the channels have filters.

    Attributes:
        channels: The interfaces that are written.
        part: Places of what the newest message brought; None: everything.
    """

    def __init__(self, name: str, reader: Reader, state: State, channels: Sequence[Channel], required: bool,
                 filtered: bool = False):
        super().__init__(name, reader, required)
        self._state, self._filtered = state, filtered
        self.channels = tuple(channels)
        self.part: np.ndarray | None = None
        self._ever: np.ndarray | None = None
        """Places of what has been brought since the start; None: everything."""
        self._filtering = False

    def run(self) -> Status:
        """See `Feedback.run`."""
        status = super().run()
        if not self._filtered:
            if status is NEW:
                for channel in self.channels:
                    channel.write(channel.values, self.part)
            return status
        if status is NEW:
            for channel in self.channels:
                channel.accept(self.part)
            self._filtering = True
        if self._filtering:
            for channel in self.channels:
                channel.filter(self._ever)
        return status

    def restart(self) -> None:
        """See `Feedback.restart`; filters begin anew as well."""
        super().restart()
        self._filtering = False
        for channel in self.channels:
            channel.reset()
