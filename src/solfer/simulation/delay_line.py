"""Messages that arrive later than they were sent."""

import math
from collections import deque
from typing import Generic, TypeVar

from solfer.errors import SimulationError
from solfer.simulation.physics import STEP

Item = TypeVar("Item")


class DelayLine(Generic[Item]):
    """Delays items by a number of cycles; they keep their order."""

    def __init__(self, delay: int):
        self._delay = delay
        self._items: deque[tuple[int, Item]] = deque()

    def put(self, cycle: int, item: Item) -> None:
        """Put an item in."""
        self._items.append((cycle + self._delay, item))

    def due(self, cycle: int) -> list[Item]:
        """Remove and return the items that are due in this cycle."""
        due = []
        while self.next <= cycle:
            due.append(self._items.popleft()[1])
        return due

    @property
    def next(self) -> float:
        """Cycle in which the next item is due; infinity without any."""
        return self._items[0][0] if self._items else math.inf


def steps_of(delay: float, where: str) -> int:
    """Return a delay [s] in steps of the simulation.

    Raises:
        SimulationError: It is not a whole number of them; with its place `where`.
    """
    steps = round(delay / STEP)
    if abs(steps * STEP - delay) > 1e-9:
        raise SimulationError(f"a delay of {delay:g} s", where=where, expected=f"a multiple of {STEP:g} s")
    return steps
