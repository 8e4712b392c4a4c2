"""Virtual time for nodes in shared memory: that of a bus, on which work is put with `Bus.every`."""

from solfer.middleware.memory import Bus


class BusClock:
    """A clock that stands still until somebody sleeps; then the bus does what is due.

    A node whose work is on the bus, and which therefore never sleeps, puts its `XbotMiddleware.poll` there, too.

    Args:
        bus: The bus.
    """

    def __init__(self, bus: Bus):
        self._bus = bus

    def now(self) -> float:
        """Time [s]."""
        return self._bus.time

    def sleep_until(self, deadline: float) -> None:
        """Let the others work until `deadline` [s]."""
        self._bus.run_until(deadline)
