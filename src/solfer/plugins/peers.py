"""Checks the other ends of a plugin's pipes: without that, a wrong topic would go unnoticed."""

import logging
import math
from collections.abc import Sequence
from concurrent.futures import Future

from solfer.errors import SolferError
from solfer.pipes import CommandPipe, FeedbackPipe
from solfer.transport import Middleware
from solfer.transport.topics import Topics

logger = logging.getLogger(__name__)


class Peer:
    """The publisher or subscriber at the other end of a pipe.

    Args:
        pipe: The pipe.
        where: Where the configuration names its topic; empty: nowhere.
        needed: Whether the plugin cannot work without it.

    Attributes:
        fault: What is wrong with the topic, in one line; empty: nothing, as far as is known.
        warned: Time of the last warning [s].
        found: Whether the peer is there, or was.
    """

    def __init__(self, pipe: FeedbackPipe | CommandPipe, where: str, needed: bool):
        self._pipe = pipe
        self._where = where
        self.needed = needed
        self._receives = isinstance(pipe, FeedbackPipe)
        self._end = pipe.reader if self._receives else pipe.writer
        self.fault = ""
        self.warned = -math.inf
        self.found = not self._end.carries

    @property
    def is_output(self) -> bool:
        """Whether the plugin publishes to the peer."""
        return not self._receives

    @property
    def missing(self) -> bool:
        """Whether the peer was not found yet."""
        if self._end.arrival > -math.inf if self._receives else self._end.is_received:
            self.found = True
        return not self.found

    @property
    def is_dispensable(self) -> bool:
        """Whether the plugin works without it, and has warned about it."""
        return not self.needed and self.warned > -math.inf

    def update(self, topics: Topics) -> None:
        """Find out what is wrong, if anything is."""
        look = topics.missing_publisher if self._receives else topics.missing_subscriber
        missing = look(self._end.topic, self._end.carries)
        self.fault = ""
        self.found = missing is None
        if missing is not None:
            kind = "feedback" if self._receives else "controller"
            place = ", ".join(filter(None, (f"{kind} '{self._pipe.name}'", self._where)))
            self.fault = f"{missing.what} ({place}){missing.hint}"


class Peers:
    """Warns when a pipe has no peer, or a peer with another type of message.

    A needed peer is warned about again and again, and in the plugin's health; any other once. It stops looking when all
    peers are there, and those that are not needed were warned about; but not while no node receives any output, which
    replies to requests say.

    Args:
        plugin: Name of the plugin, for messages.
        peers: The peers to look for.
        middleware: Knows the topics of other nodes; its clock.
    """

    def __init__(self, plugin: str, peers: Sequence[Peer], middleware: Middleware):
        self._plugin = plugin
        self._peers = tuple(peers)
        self._middleware = middleware
        self._begin = middleware.now()
        self._next = -math.inf
        self._has_called = False
        self._trouble = ""
        self._outputs = tuple(peer for peer in peers if peer.is_output)
        self._unsaid = ""

    def note_request(self, name: str) -> str:
        """Return that no node receives what the plugin publishes, as far as is known; empty: one does.

        Args:
            name: The request that the plugin carries out; `look` logs it.
        """
        if not self._is_unreceived or not all(peer.fault for peer in self._outputs):
            return ""
        what = f"no node receives what it publishes: {'; '.join(peer.fault for peer in self._outputs)}"
        self._unsaid = f"carries out '{name}', but {what}"
        return what

    def look(self) -> None:
        """Request the topics of other nodes, if that is due; to be called about once a second. Does not block."""
        if self._unsaid:
            logger.warning("%s %s", self._plugin, self._unsaid)
            self._unsaid = ""
        now = self._middleware.now()
        if self._has_called or now < self._next:
            return
        self._next = now + 1.0
        missing = [peer for peer in self._peers if peer.missing]
        if not self._is_unreceived and all(peer.is_dispensable for peer in missing):
            self._next = math.inf
        elif now >= self._begin + 1.0:
            self._has_called = True
            self._middleware.topics().add_done_callback(lambda answer: self._receive(answer, missing, now))

    @property
    def done(self) -> bool:
        """Whether every peer was found, or needs no further warning."""
        return self._next == math.inf and not self._unsaid

    @property
    def _is_unreceived(self) -> bool:
        """Whether there are outputs, none of which has been found to be received."""
        return bool(self._outputs) and all(peer.missing for peer in self._outputs)

    def warning(self) -> str:
        """Return what is wrong with the needed peers, for the plugin's health; empty: nothing is known."""
        faults = [peer.fault for peer in self._peers if peer.needed and peer.fault and peer.missing]
        return "; ".join(faults) or (self._trouble if any(peer.needed and peer.missing for peer in self._peers) else "")

    def _receive(self, answer: "Future[Topics]", missing: Sequence[Peer], now: float) -> None:
        try:
            topics = answer.result()
        except SolferError as error:
            self._trouble = error.line  # not the fault of any peer
            return
        else:
            self._trouble = ""
            for peer in missing:
                self._update(peer, topics, now)
        finally:
            self._has_called = False

    def _update(self, peer: Peer, topics: Topics, now: float) -> None:
        before = peer.fault
        peer.update(topics)
        patience = 1.0 if peer.needed else 5.0  # [s]; others than those that it needs may start together with it
        if not peer.fault and peer.warned > -math.inf:
            peer.warned = -math.inf
            logger.info("%s: resolved: %s", self._plugin, before)
        elif peer.fault and now >= self._begin + patience and not peer.is_dispensable:
            if peer.fault != before or now >= peer.warned + 10.0:  # again, while nothing changes
                peer.warned = now
                logger.warning("%s: %s", self._plugin, peer.fault)
