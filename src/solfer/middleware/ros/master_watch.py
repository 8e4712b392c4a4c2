"""Notices that the ROS master is gone, or is another one than at the start."""

import threading
from collections.abc import Callable

import rosgraph

from solfer.errors import MiddlewareError
from solfer.middleware.ros.master import require_master

PERIOD = 1.0
"""Time between two questions [s]."""


class MasterWatch:
    """Asks the master for its number again and again, in a thread of its own.

    A node goes on without a master, but nobody finds it any more, also after the master is back: its registrations are
    lost. Whoever wants them back has to start anew.

    Args:
        ask: Returns a number that changes when the master starts anew; raises MiddlewareError if it does not answer.
        period: Time between two questions [s].

    Attributes:
        loss: What happened to the master, in one line; empty while all is well.

    Raises:
        MiddlewareError: The master does not answer.
    """

    def __init__(self, ask: Callable[[], int] = require_master, period: float = PERIOD):
        self._ask, self._period, self.loss = ask, period, ""
        self._number = ask()
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Ask no more."""
        self._end.set()
        self._thread.join()

    def _watch(self) -> None:
        while not self.loss and not self._end.wait(self._period):
            try:
                number = self._ask()
            except MiddlewareError as error:
                self.loss = error.what
            else:
                if number != self._number:
                    self.loss = f"another ROS master answers at {rosgraph.get_master_uri()}"
