"""Subscriptions to elements of a model, and their versions (section 1.2 of the paper)."""

from collections.abc import Callable, Hashable, Iterable, Mapping

from solfer.errors import ModelError, UnknownName
from solfer.model.observation import End, observed

Calls = Mapping[str, int] | Iterable[str] | str
"""How often each element is used in a cycle; names alone stand for one use each."""


class _Element:
    """An element: its computation, the stamp of its inputs, and its counts."""

    def __init__(self, compute: Callable[[], None], stamp: Callable[[], Hashable]):
        self.compute = compute
        self.stamp = stamp
        self.used: Hashable = None
        self.subscribed = self.left = self.computed = 0

    def refresh(self) -> None:
        """Compute it, since its inputs have changed."""
        self.compute()
        self.computed += 1
        # an element that fails stays stale; a computation may itself notice writes that the stamp does not show
        self.used = self.stamp()


class UpdateManager:
    """Computes what is subscribed at `update`, and everything else at its first use, each at most once for a state.

    The call counter decides what is computed at `update`, the stamp of an element whether it is stale:

    | element                                  | at `update`         | at `use`            |
    |------------------------------------------|---------------------|---------------------|
    | never subscribed                         | not computed        | computed if stale   |
    | subscribed, state unchanged              | kept                | kept                |
    | subscribed, state changed                | computed            | computed if stale   |
    | calls left in the counter, state the same | kept               | kept                |
    """

    def __init__(self) -> None:
        self._elements: dict[str, _Element] = {}
        self._required: tuple[_Element, ...] = ()

    def add(self, name: str, compute: Callable[[], None], stamp: Callable[[], Hashable]) -> None:
        """Add an element.

        Args:
            name: Its name.
            compute: Computes it.
            stamp: Returns a value that changes when the inputs of the computation have changed.

        Raises:
            ModelError: There is an element of that name.
        """
        if name in self._elements:
            raise ModelError(f"there is an element '{name}' already", expected="a new name")
        self._elements[name] = _Element(compute, stamp)

    def subscribe(self, calls: Calls) -> None:
        """Announce how often each element is going to be used in a cycle, in addition to earlier subscriptions.

        Raises:
            UnknownName: There is no such element.
            ModelError: A count is not a whole number above zero.
        """
        for element, count in self._counted(calls):
            element.subscribed += count
        self._choose()

    def unsubscribe(self, calls: Calls) -> None:
        """Withdraw calls that were subscribed.

        Raises:
            UnknownName: There is no such element.
            ModelError: More calls are withdrawn than were subscribed.
        """
        counts = _as_counts(calls)
        counted = self._counted(counts)
        for (element, count), name in zip(counted, counts, strict=True):
            if count > element.subscribed:
                raise ModelError(
                    f"{count} calls of '{name}' are withdrawn, {element.subscribed} were subscribed",
                    expected="at most as many as were subscribed",
                )
        for element, count in counted:
            element.subscribed -= count
        self._choose()

    def update(self) -> None:
        """Compute what is subscribed and stale, and fill the call counters."""
        for element in self._required:
            if element.stamp() != element.used:
                element.refresh()
            element.left = element.subscribed

    def use(self, name: str) -> None:
        """Count one use of an element, which is up to date afterwards, subscribed or not."""
        element = self._elements[name]
        if element.stamp() != element.used:
            element.refresh()
        if element.left:
            element.left -= 1

    def refresh(self, name: str) -> None:
        """Bring an element up to date that another one is computed of, without counting a use."""
        element = self._elements[name]
        if element.stamp() != element.used:
            element.refresh()

    def calls_left(self, name: str) -> int:
        """Return how many of the subscribed uses of an element are still to come since the last `update`."""
        return self._element(name).left

    def computed(self, name: str) -> int:
        """Return how often an element was really computed."""
        return self._element(name).computed

    def computations(self) -> dict[str, int]:
        """Count how often each element was really computed."""
        return {name: element.computed for name, element in self._elements.items()}

    def observe(self, listener: Callable[[str], None]) -> list[End]:
        """Call `listener` with an element's name after each computation, until the returned functions are called."""
        return [
            observed(element, "compute", lambda _, name=name: listener(name))
            for name, element in self._elements.items()
        ]

    def _element(self, name: str) -> _Element:
        if name not in self._elements:
            raise UnknownName("element of the dynamics", name, self._elements)
        return self._elements[name]

    def _counted(self, calls: Calls) -> list[tuple[_Element, int]]:
        counted = [(name, self._element(name), count) for name, count in _as_counts(calls).items()]
        for name, _, count in counted:
            if not isinstance(count, int) or isinstance(count, bool) or count < 1:
                raise ModelError(f"'{name}' is called {count!r} times", expected="a whole number above zero")
        return [(element, count) for _, element, count in counted]

    def _choose(self) -> None:
        self._required = tuple(element for element in self._elements.values() if element.subscribed)


def _as_counts(calls: Calls) -> dict[str, int]:
    if isinstance(calls, str):
        return {calls: 1}
    if isinstance(calls, Mapping):
        return dict(calls)
    counts: dict[str, int] = {}
    for name in calls:
        counts[name] = counts.get(name, 0) + 1
    return counts
