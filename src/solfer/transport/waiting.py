"""Waiting with a bound that a request to end interrupts."""

import time
from collections.abc import Callable

CHECK_PERIOD = 0.02
"""Time between two checks [s]."""


class ShutdownRequested(Exception):
    """The node has to end while it waited. Not an error to collect or to report."""


def wait_for(
    condition: Callable[[], object], timeout: float, running: Callable[[], bool], step: float = CHECK_PERIOD
) -> bool:
    """Wait until `condition` holds; returns False if it does not within `timeout` [s].

    Raises:
        ShutdownRequested: The node has to end.
    """
    end = time.monotonic() + timeout
    while not condition():
        if not running():
            raise ShutdownRequested("ended while it waited")
        if time.monotonic() >= end:
            return False
        time.sleep(step)
    return True
