"""What a component publishes after its cycles."""

import sys
from collections.abc import Callable


class _Publication:
    """A topic or an action, and when it is due.

    Args:
        publish: Publishes it.
        cycles: Cycles from one time to the next.
        left: Cycles until the first one.
    """

    def __init__(self, publish: Callable[[], None], cycles: int, left: int):
        self.publish = publish
        self.cycles = cycles
        self.left = left
        self.is_due = False


class Publications:
    """Publishes what a component declares; what has a rate is spread over cycles, so that none carries all of it.

    Attributes:
        left: Cycles until something is due. Its loop counts it down by one after each cycle of the component, and calls
            `run` at zero: a call in each cycle would cost more.
    """

    def __init__(self) -> None:
        self.left = self._waited = sys.maxsize
        self._all: list[_Publication] = []

    def add(self, publish: Callable[[], None], cycles: int = 1) -> None:
        """Add something that is published every so many `cycles`."""
        rare = sum(each.cycles > 1 for each in self._all)
        left = min(cycles, 1 + rare)
        self._all.append(_Publication(publish, cycles, left))
        self.left = self._waited = min(self._waited, left)

    def run(self) -> None:
        """Publish what is due after `left` cycles."""
        soonest = sys.maxsize
        for each in self._all:
            each.left -= self._waited
            each.is_due = not each.left
            if each.is_due:
                each.left = each.cycles
            soonest = min(soonest, each.left)
        self.left = self._waited = soonest  # before anything is published: where that fails, the next cycle goes on
        for each in self._all:
            if each.is_due:
                each.publish()
