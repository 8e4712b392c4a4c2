"""Ends of pipes that only keep and tell messages."""

import copy

from solfer.pipes import Reader, Status, Writer


class Told(Reader):
    """A topic on which the test speaks."""

    topic = "told"

    def __init__(self, message=None):
        super().__init__()
        self.message, self._new = message, message is not None

    def tell(self, message):
        """Say something."""
        self.message, self._new = message, True

    def read(self):
        if self.message is None:
            return Status.NONE
        new, self._new = self._new, False
        return Status.NEW if new else Status.OLD

    def age(self):
        return 0.0


class Kept(Writer):
    """Keeps copies of what is written."""

    topic = "kept"

    def __init__(self):
        self.messages = []

    def write(self, message):
        self.messages.append(copy.deepcopy(message))
