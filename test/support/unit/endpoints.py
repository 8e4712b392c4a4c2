"""Endpoints of pipes that only keep and publish messages."""

import copy

from solfer.transport import MessageStatus, Reader, Writer
from solfer.transport.endpoints import Publisher


class StandInReader(Reader):
    """A topic on which the test publishes."""

    topic = "measured"

    def __init__(self, message=None):
        self.message, self._new, self.publishers = message, message is not None, (Publisher("sender"),)

    def publish(self, message):
        """Publish a message."""
        self.message, self._new = message, True

    def read(self):
        if self.message is None:
            return MessageStatus.NONE
        new, self._new = self._new, False
        return MessageStatus.NEW if new else MessageStatus.OLD

    def update(self):
        return self.publishers

    def read_from(self, publisher):
        return self.read()

    def age(self):
        return 0.0


class KeptWriter(Writer):
    """Keeps copies of what is written."""

    topic = "kept"

    def __init__(self):
        self.messages = []

    def write(self, message):
        self.messages.append(copy.deepcopy(message))
