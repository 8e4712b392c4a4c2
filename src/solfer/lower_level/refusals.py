"""Whose commands were refused, how often, and why."""

from collections import Counter

from solfer.errors import ClaimRefused, CommandRefused, Suspended

SENDERS = 64
"""Senders whose refused commands are counted one by one."""

OTHERS = "others"


class Refusals(Counter[str]):
    """Number of refused commands of each sender, in bounded memory."""

    def __init__(self) -> None:
        super().__init__()
        self._news: dict[str, CommandRefused] = {}

    def note(self, sender: str, error: CommandRefused) -> None:
        """Count a command of `sender`, which was refused because of `error`."""
        name = sender if sender in self or len(self) < SENDERS else OTHERS
        self[name] += 1
        self._news[name] = error

    def news(self) -> dict[str, CommandRefused]:
        """The newest refusal of each sender since the last call."""
        news = self._news
        if news:
            self._news = {}
        return news


def concerns_claim(error: CommandRefused) -> bool:
    """Whether a command was refused because its sender has no claim that holds, and not because it is wrong."""
    return isinstance(error, ClaimRefused | Suspended)
