"""Counts refused commands by sender, with the newest reasons."""

from collections import Counter

from solfer.errors import ClaimRefused, CommandRefused, Suspended

SENDERS = 64
"""Most senders that are counted by name."""


class Refusals(Counter[str]):
    """Number of refused commands of each sender, in bounded memory."""

    def __init__(self) -> None:
        super().__init__()
        self._news: dict[str, CommandRefused] = {}

    def note(self, sender: str, error: CommandRefused) -> None:
        """Count a command of `sender` that was refused because of `error`."""
        name = sender if sender in self or len(self) < SENDERS else "others"
        self[name] += 1
        self._news[name] = error

    def publish(self, owner: str, reason: CommandRefused) -> None:
        """Add a `reason` to the news of `owner` without a refused command."""
        self._news[owner] = reason

    def news(self) -> dict[str, CommandRefused]:
        """Return the newest refusal of each sender since the last call."""
        news = self._news
        if news:
            self._news = {}
        return news


def concerns_claim(error: CommandRefused) -> bool:
    """Return whether a command was refused because its sender has no valid claim, and not because it is wrong."""
    return isinstance(error, ClaimRefused | Suspended)
