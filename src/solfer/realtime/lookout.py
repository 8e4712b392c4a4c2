"""Checks the other ends of plugins' pipes beside the loop of a real-time layer."""

import threading
from collections.abc import Mapping
from typing import Protocol

from solfer.transport.health import Health
from solfer.transport.middleware import Middleware

PERIOD = 1.0
"""Time between two looks [s]."""


class Looking(Protocol):
    """Looks for the peers of a plugin; see `solfer.plugins.peers.Peers`.

    Attributes:
        done: Whether there is nothing left to look for.
    """

    @property
    def done(self) -> bool:
        """See above."""

    def look(self) -> None:
        """Look once."""

    def complaint(self) -> str:
        """Return what is wrong, in one line; empty: nothing."""


class Lookout:
    """A thread that looks until all peers are found, and reports missing ones as `<plugin> pipes`.

    Args:
        peers: Looks for the peers of each plugin, by the plugin's name.
        middleware: Publishes the health reports; no other thread uses it.
    """

    def __init__(self, peers: Mapping[str, Looking], middleware: Middleware):
        self._peers, self._middleware = dict(peers), middleware
        self._published = dict.fromkeys(peers, "")
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the thread."""
        self._end.set()
        self._thread.join()

    def _run(self) -> None:
        while not self._end.wait(PERIOD) and not all(peers.done for peers in self._peers.values()):
            for name, peers in self._peers.items():
                peers.look()
                self._report(name, peers.complaint())

    def _report(self, name: str, complaint: str) -> None:
        if complaint != self._published[name]:
            self._published[name] = complaint
            level = Health.WARNING if complaint else Health.GOOD
            self._middleware.report(f"{name} pipes", level, complaint or "running", {})
