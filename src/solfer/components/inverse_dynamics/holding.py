"""Why an inverse dynamics holds the robot instead of following its tasks."""

import logging

from solfer.throttle import Throttle

log = logging.getLogger(__name__)


class Holding:
    """The reason, which is logged.

    Args:
        component: Name of the component, for messages.

    Attributes:
        reason: Why it holds; empty: it does not.
    """

    def __init__(self, component: str):
        self.reason = ""
        self._component = component
        self._throttle = Throttle(log)

    def fail(self, fault: str) -> None:
        """Begin to hold until the next start, since what is measured contradicts the QP."""
        self.reason = fault
        log.error("%s: %s; it holds until it is started again", self._component, fault)

    def wait(self, violated: str) -> None:
        """Begin to hold until the QP has a solution again, which cannot keep what is `violated`."""
        self.reason = f"the QP has no solution: {violated}"
        self._throttle.warning(self.reason, "%s: %s; it holds", self._component, self.reason)
