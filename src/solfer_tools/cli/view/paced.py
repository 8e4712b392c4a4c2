"""A simulation or a recording in memory, at the pace of the clock."""

import time
from collections.abc import Callable

from solfer.middleware.memory import Bus, MemoryMiddleware


class PacedMiddleware(MemoryMiddleware):
    """A node on a bus whose time passes as fast as that of the clock, or more slowly.

    Args:
        bus: The bus.
        name: Name of the node.
        step: Lets a time pass on the bus [s].
    """

    def __init__(self, bus: Bus, name: str, step: Callable[[float], None]):
        super().__init__(bus, name)
        self._step = step
        self._begin = time.monotonic() - bus.time

    def sleep_until(self, deadline: float) -> None:
        """Let the others work until `deadline`, and wait until it has come by the clock."""
        self._step(max(deadline - self.bus.time, 0.0))
        early = self._begin + deadline - time.monotonic()
        if early > 0.0:
            time.sleep(early)
        elif early < -0.2:  # a greater lag is not made up for
            self._begin -= early
