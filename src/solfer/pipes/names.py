"""Names of a pipe against those of a message: everything from outside is mapped by name."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from solfer.errors import PipeError, UnknownName

REMEMBERED = 8
"""Orders that are kept; senders that change their names in every message do not fill the memory."""


@dataclass(frozen=True)
class Order:
    """Where the names of a pipe stand in a message.

    Attributes:
        source: Places in the message of those names that it brings, in the order of the pipe, shape (m,).
        target: Places of the same names in the pipe, shape (m,); None: it brings all of them.
    """

    source: np.ndarray
    target: np.ndarray | None = None


class NameOrder:
    """Finds the names of a pipe in messages; computed again only when names change.

    A message may lack names, not all of them; what it lacks keeps its value.

    Args:
        wanted: Names of the pipe.
        known: Names that a message may bring besides; None: any.
        what: What bears the names, for errors.

    Attributes:
        unheard: Which of the wanted names no message has brought so far, shape (len(wanted),).
    """

    def __init__(self, wanted: Sequence[str], known: Collection[str] | None = (), what: str = "joint"):
        self._wanted, self._what = tuple(wanted), what
        self._known = None if known is None else tuple(dict.fromkeys((*wanted, *known)))
        self._names: tuple[str, ...] | None = None
        self._order = Order(np.zeros(0, dtype=np.intp))
        self._remembered: dict[tuple[str, ...], Order] = {}
        self.unheard = np.ones(len(self._wanted), dtype=bool)

    def match(self, names: tuple[str, ...]) -> Order:
        """Where the wanted names stand in `names`.

        Raises:
            PipeError: A name stands twice, or none is wanted.
            UnknownName: A name is unknown.
        """
        if names is self._names or names == self._names:
            return self._order
        order = self._remembered.get(names)
        if order is None:
            order = self._find(names)
            if len(self._remembered) == REMEMBERED:
                self._remembered.clear()
            self._remembered[names] = order
        self._names, self._order = names, order
        return order

    def note(self, order: Order) -> bool:
        """A message of this order was taken; whether it brought names for the first time."""
        brought = slice(None) if order.target is None else order.target
        new = bool(self.unheard[brought].any())
        self.unheard[brought] = False
        return new

    def forget(self) -> None:
        """No name has been heard."""
        self.unheard[:] = True

    def absent(self) -> list[str]:
        """The wanted names that no message has brought so far."""
        return [name for name, unheard in zip(self._wanted, self.unheard, strict=True) if unheard]

    def _find(self, names: tuple[str, ...]) -> Order:
        if len(set(names)) < len(names):
            twice = sorted({name for name in names if names.count(name) > 1})
            raise PipeError(f"{self._what}s that stand twice in it: {', '.join(twice)}")
        unknown = [] if self._known is None else [name for name in names if name not in self._known]
        if unknown:
            raise UnknownName(self._what, unknown[0], self._known)
        place = {name: index for index, name in enumerate(names)}
        target = [index for index, name in enumerate(self._wanted) if name in place]
        if not target:
            raise PipeError(f"it names none of the pipe's {len(self._wanted)} {self._what}s",
                            expected=f"some of {', '.join(self._wanted)}")
        source = np.array([place[self._wanted[index]] for index in target], dtype=np.intp)
        return Order(source, None if len(target) == len(self._wanted) else np.array(target, dtype=np.intp))
