"""Messages that wait for the loop, queued by sender in bounded memory."""

import itertools
import threading
from collections import deque
from collections.abc import Container
from typing import Generic, TypeVar

Item = TypeVar("Item")

SENDERS = 64
"""Most senders with messages waiting at the same time; messages of further senders are dropped."""


class Backlog(Generic[Item]):
    """Queues messages from any thread; no sender crowds out another one.

    Args:
        size: Messages of one sender that may wait; beyond that the oldest is dropped.

    Attributes:
        dropped: Messages that were lost.
        waiting: What waits, by sender and with its number; true while anything does.
    """

    def __init__(self, size: int):
        self._size = size
        self.dropped = 0
        self.waiting: dict[str, deque[tuple[int, Item]]] = {}
        self._numbers = itertools.count()
        self._lock = threading.Lock()
        self._first: Container[str] = ()

    def put(self, sender: str, item: Item) -> None:
        """Queue a message."""
        with self._lock:
            waiting = self.waiting.get(sender)
            if waiting is None:
                if len(self.waiting) >= SENDERS and sender not in self._first:
                    self.dropped += 1
                    return
                waiting = self.waiting[sender] = deque(maxlen=self._size)
            self.dropped += len(waiting) == self._size
            waiting.append((next(self._numbers), item))

    def drain(self) -> list[Item]:
        """Return all messages, in the order of their arrival."""
        if not self.waiting:
            return []
        with self._lock:
            entries = sorted(itertools.chain.from_iterable(self.waiting.values()), key=lambda entry: entry[0])
            self.waiting.clear()
        return [item for _, item in entries]

    def take(self, first: Container[str], most: int, others: int) -> list[Item]:
        """Return some messages, those of each sender in the order of their arrival; the others go on waiting.

        Args:
            first: Senders that come first and always find room; the container may change later on.
            most: Most messages of these senders.
            others: Most messages of all other senders.
        """
        self._first = first
        if not self.waiting:
            return []
        with self._lock:
            if len(self.waiting) == 1:  # as it is nearly always
                ((sender, waiting),) = self.waiting.items()
                if len(waiting) <= (most if sender in first else others):
                    self.waiting.clear()
                    return [item for _, item in waiting]
            known = [sender for sender in self.waiting if sender in first]
            unknown = [sender for sender in self.waiting if sender not in first]
            return self._round_robin(known, most) + self._round_robin(unknown, others)

    def _round_robin(self, senders: list[str], most: int) -> list[Item]:
        """Return at most `most` messages of `senders`; one that was served goes to the back."""
        taken: list[Item] = []
        waiting_senders = deque(senders)
        while waiting_senders and len(taken) < most:
            sender = waiting_senders.popleft()
            waiting = self.waiting.pop(sender)
            taken.append(waiting.popleft()[1])
            if waiting:
                self.waiting[sender] = waiting
                waiting_senders.append(sender)
        return taken
