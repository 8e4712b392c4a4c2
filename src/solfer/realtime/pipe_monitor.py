"""Checks plugins' pipes, and their other ends, beside the loop of a real-time layer."""

import threading
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import chain
from typing import Protocol

from solfer.transport.health import Health
from solfer.transport.middleware import HealthReport, Middleware

Reports = Iterable[tuple[str, HealthReport]]


class PeerSearch(Protocol):
    """Looks for the peers of a plugin; see `solfer.plugins.peers.Peers`.

    Attributes:
        done: Whether there is nothing left to look for.
    """

    @property
    def done(self) -> bool:
        """See above."""

    def look(self) -> None:
        """Look once."""

    def warning(self) -> str:
        """Return what is wrong, in one line; empty: nothing."""


class PipeMonitor:
    """A thread that looks for peers, reports missing ones as `<plugin> pipes`, and the health of each pipe.

    Args:
        peers: Looks for the peers of each plugin, by the plugin's name.
        middleware: Publishes the health reports; no other thread uses it.
        pipes: Yields the names and the health of the pipes, for each plugin.
    """

    PERIOD = 1.0
    """Time between two checks [s]."""

    def __init__(self, peers: Mapping[str, PeerSearch], middleware: Middleware, pipes: Sequence[Callable[[], Reports]]):
        self._peers = dict(peers)
        self._middleware = middleware
        self._pipes = pipes
        self._published = dict.fromkeys(peers, "")
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the thread."""
        self._end.set()
        self._thread.join()

    def _run(self) -> None:
        while not self._end.wait(self.PERIOD):
            for name, peers in self._peers.items():
                if not peers.done:
                    peers.look()
                    self._report(name, peers.warning())
            for part, report in chain.from_iterable(pipes() for pipes in self._pipes):
                self._middleware.report(part, report.level, report.summary, report.values)
                if self._end.wait(0.002):  # the loop needs the interpreter between two reports
                    return

    def _report(self, name: str, warning: str) -> None:
        if warning != self._published[name]:
            self._published[name] = warning
            level = Health.WARNING if warning else Health.GOOD
            self._middleware.report(f"{name} pipes", level, warning or "running", {})
