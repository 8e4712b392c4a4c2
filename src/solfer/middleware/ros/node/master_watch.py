"""Detects that the ROS master is gone, is another one than at the start, or has forgotten this node."""

import logging
import threading
import time
from collections.abc import Callable

import rosgraph

from solfer.errors import MiddlewareError
from solfer.middleware.ros.node.master import require_master

logger = logging.getLogger(__name__)


class MasterWatch:
    """Checks the master's number, and that it knows this node, periodically, in a thread of its own.

    A node goes on without a master, but no node finds it any more, even after a master is back: only the master that
    received registrations keeps them, and rospy has no way to make all of them again, so that the node has to start
    again. A master that answers late, or is away for a moment and comes back as the same process, lost nothing.

    Args:
        lost: Called once, in the watch's thread, when the master is lost.
        number: Returns a number that changes when the master starts again; MiddlewareError: it does not answer.
        known: Returns whether the master knows this node; raises MiddlewareError in the same way.
        period: Time between two calls [s].
        timeout: Time without an answer after which the master is lost [s].

    Attributes:
        loss: What happened to the master, in one line; empty while all is well.

    Raises:
        MiddlewareError: The master does not answer.
    """

    def __init__(
        self,
        lost: Callable[[], None] = lambda: None,
        number: Callable[[], int] = require_master,
        known: Callable[[], bool] = lambda: True,
        period: float = 1.0,
        timeout: float = 5.0,
    ):
        self._request = number
        self._known = known
        self._lost = lost
        self._period = period
        self._timeout = timeout
        self.loss = ""
        self._number = number()
        self._registered = False
        self._failures = 0
        self._since = 0.0
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop watching; `loss` stays as it is."""
        self._end.set()
        if threading.current_thread() is not self._thread:
            self._thread.join()

    def _watch(self) -> None:
        while not self._end.wait(self._period):
            try:
                loss = self._check()
            except MiddlewareError as error:
                loss = self._count(error.what)
            else:
                if self._failures:
                    logger.info("the ROS master answers again")
                self._failures = 0
            if loss and not self._end.is_set():
                self.loss = loss
                self._lost()
                return

    def _check(self) -> str:
        """Describe what is wrong with a master that answers; empty: nothing."""
        if self._request() != self._number:
            return f"another ROS master answers at {rosgraph.get_master_uri()}, which does not know this node"
        known = self._known()
        if self._registered and not known:
            return f"the ROS master at {rosgraph.get_master_uri()} does not know this node any more"
        self._registered = known
        return ""

    def _count(self, failure: str) -> str:
        """Count a call without an answer; returns the loss if there were too many."""
        now = time.monotonic()
        if not self._failures:
            self._since = now
            logger.warning("%s; if that stays so for %g s this node ends", failure, self._timeout)
        self._failures += 1
        # three failures at least: a process that stood still itself has not called often enough
        return failure if self._failures >= 3 and now - self._since >= self._timeout else ""
