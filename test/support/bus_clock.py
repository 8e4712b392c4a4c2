"""Virtual time for nodes in shared memory: that of a bus, on which work is scheduled with `Bus.every`."""

from solfer.middleware.memory import Bus


class BusClock:
    """A clock that stands still until a node sleeps; then the bus does what is due.

    A node with its work on the bus never sleeps, so it schedules its `XbotMiddleware.poll` there, too.

    Args:
        bus: The bus.
    """

    def __init__(self, bus: Bus):
        self._bus = bus

    def now(self) -> float:
        """Return the time [s]."""
        return self._bus.time

    def sleep_until(self, deadline: float) -> None:
        """Let the other nodes work until `deadline` [s]."""
        self._bus.run_until(deadline)
