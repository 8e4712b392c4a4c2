"""Waiting with a bound that a request to end interrupts."""

import time
from collections.abc import Callable

STEP = 0.02
"""Time between two looks [s]."""


class Ended(Exception):
    """Somebody asked the node to end while it waited. Not an error that anybody should collect or report."""


def wait_for(condition: Callable[[], bool], timeout: float, running: Callable[[], bool], step: float = STEP) -> bool:
    """Wait until `condition` holds; False if it does not within `timeout` [s].

    Raises:
        Ended: The node was asked to end.
    """
    end = time.monotonic() + timeout
    while not condition():
        if not running():
            raise Ended("ended while it waited")
        if time.monotonic() >= end:
            return False
        time.sleep(step)
    return True
