"""Maps the names of a message to those of a pipe: everything from outside is mapped by name."""

import logging
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field

import numpy as np

from solfer.errors import PipeError, UnknownName, Unrelated, nearest

logger = logging.getLogger(__name__)

ORDER_MEMORY = 8
"""Most orders that are cached; senders that change their names in every message do not fill the memory."""


@dataclass(frozen=True)
class Order:
    """Indices of a pipe's names in a message.

    Attributes:
        source: Indices in the message of the pipe's names, as far as it contains them, in the order of the pipe,
            shape (m,).
        target: Indices of the same names in the pipe, shape (m,); None: the message contains all of them.
        places: The same indices, also where the message contains all of them, shape (m,).
    """

    source: np.ndarray
    target: np.ndarray | None = None
    places: np.ndarray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Find the places."""
        object.__setattr__(self, "places", np.arange(len(self.source)) if self.target is None else self.target)


class NameOrder:
    """Finds the names of a pipe in messages; computed again only when the names change.

    A message may lack some names, but not all of them; the missing ones keep their values.

    Args:
        pipe_names: Names of the pipe.
        known: Other names that a message may contain; None: any.
        what: What the names denote, for errors.
        ignores: Whether unknown names are ignored, with one warning each; not those that are like a name of the pipe
            which the message lacks: they are misspelt.

    Attributes:
        matched: Names of the newest message; None before the first.
        order: What `match` has returned for them.
        not_received: Flags of the names that no message has contained so far, shape (len(pipe_names),).
    """

    def __init__(
        self, pipe_names: Sequence[str], known: Collection[str] | None = (), what: str = "joint", ignores: bool = False
    ):
        self._pipe_names = tuple(pipe_names)
        self._what = what
        self._ignores = ignores
        self._ignored: set[str] = set()
        self._known = None if known is None else tuple(dict.fromkeys((*pipe_names, *known)))
        self.matched: tuple[str, ...] | None = None
        self.order = Order(np.zeros(0, dtype=np.intp))
        self._remembered: dict[tuple[str, ...], Order] = {}
        self.not_received = np.ones(len(self._pipe_names), dtype=bool)

    def match(self, names: tuple[str, ...]) -> Order:
        """Find the names of the pipe in `names`.

        Raises:
            PipeError: A name occurs twice.
            Unrelated: None is of the pipe.
            UnknownName: A name is unknown.
        """
        if names is self.matched or names == self.matched:
            return self.order
        order = self._remembered.get(names)
        if order is None:
            order = self._find(names)
            if len(self._remembered) == ORDER_MEMORY:
                self._remembered.clear()
            self._remembered[names] = order
        if not len(order.source):
            raise Unrelated(
                f"it has none of the pipe's {len(self._pipe_names)} {self._what}s",
                expected=f"some of {', '.join(self._pipe_names)}",
            )
        self.matched = names
        self.order = order
        return order

    def require_all(self, names: tuple[str, ...]) -> None:
        """Check that `names` contain all those of the pipe.

        Raises:
            PipeError: A name of the pipe is missing, or one occurs twice.
            UnknownName: A name is unknown.
        """
        order = self._find(names)
        if order.target is not None:
            missing = [name for name in self._pipe_names if name not in names]
            raise PipeError(
                f"it lacks the {self._what}s {', '.join(missing)}", expected=f"all of {', '.join(self._pipe_names)}"
            )

    def note(self, order: Order) -> bool:
        """Mark the names of an accepted message as received; return whether any of them is new."""
        received = slice(None) if order.target is None else order.target
        new = bool(self.not_received[received].any())
        self.not_received[received] = False
        return new

    def forget(self) -> None:
        """Mark all names as not received."""
        self.not_received[:] = True

    def absent(self) -> list[str]:
        """List the names that no message has contained so far."""
        return self.names(self.not_received)

    def names(self, flags: np.ndarray) -> list[str]:
        """List the pipe's names at which `flags` are true, shape (len(pipe_names),)."""
        return [name for name, is_one in zip(self._pipe_names, flags, strict=True) if is_one]

    def _warn(self, unknown: Sequence[str]) -> None:
        """Name those that are ignored for the first time."""
        new = [name for name in unknown if name not in self._ignored]
        most = 100  # most names that are warned of
        if new and len(self._ignored) < most:
            self._ignored.update(new)
            logger.warning("the robot has no %s %s: ignored in messages", self._what, ", ".join(map(repr, new)))

    def _find(self, names: tuple[str, ...]) -> Order:
        if len(set(names)) < len(names):
            twice = sorted({name for name in names if names.count(name) > 1})
            raise PipeError(f"it has {self._what}s twice: {', '.join(twice)}", expected="each name once")
        unknown = [] if self._known is None else [name for name in names if name not in self._known]
        missing = [name for name in self._pipe_names if name not in names]
        for name in unknown:
            # likeness of two names from which on one of them is taken for the other one, misspelt
            likeness = 0.75
            if not self._ignores or nearest(name, missing, likeness=likeness):
                raise UnknownName(self._what, name, self._known)
        self._warn(unknown)
        place = {name: index for index, name in enumerate(names)}
        target = [index for index, name in enumerate(self._pipe_names) if name in place]
        source = np.array([place[self._pipe_names[index]] for index in target], dtype=np.intp)
        return Order(source, None if len(target) == len(self._pipe_names) else np.array(target, dtype=np.intp))
