"""The share of the period that a component may use."""

from dataclasses import dataclass


@dataclass(frozen=True)
class BudgetRules:
    """How long components may take.

    Attributes:
        share: Share of the period that a component may use.
        overruns: Unforgiven overruns of it at which the component is stopped.
        grace: First cycles of each start of a plugin in which overruns do not count.
    """

    share: float = 0.5
    overruns: int = 20
    grace: int = 100


class LeakyCounter:
    """Counts events that should not happen often: each good turn forgives one bad one.

    Args:
        limit: Count at which it is too often.

    Attributes:
        count: Bad turns that are not forgiven.
        total: All bad turns.
    """

    def __init__(self, limit: int):
        self.limit = limit
        self.count = 0
        self.total = 0

    def add(self, bad: bool) -> bool:
        """Count a turn; return whether bad ones are too often now."""
        if bad:
            self.count += 1
            self.total += 1
        elif self.count:
            self.count -= 1
        return self.count >= self.limit

    def reset(self) -> None:
        """Forgive everything."""
        self.count = 0


class Budget:
    """The budget of one plugin.

    Args:
        rules: How long its component may take.
        period: Period of the loop [ns].

    Attributes:
        limit: Longest time of the component in a cycle [ns].
        overruns: Cycles in which it took longer.
    """

    def __init__(self, rules: BudgetRules, period: int):
        self.limit = int(rules.share * period)
        self._grace = rules.grace
        self.overruns = LeakyCounter(rules.overruns)
        self._begin = 0

    def restart(self, cycle: int) -> None:
        """Begin again with a start of the plugin in this cycle of the loop."""
        self._begin = cycle
        self.overruns.reset()

    def exceeded(self, took: int, cycle: int) -> bool:
        """Count a cycle, in which the component took so long [ns]; return whether it is too slow too often."""
        if cycle < self._begin + self._grace:
            return False
        often = self.overruns.add(took > self.limit)
        if often:
            self.overruns.reset()
        return often

    def explanation(self, took: int) -> str:
        """Report why a plugin, whose component took so long [ns], is aborted."""
        return (
            f"its component took {1e-6 * took:.3f} ms, and more than its budget of {1e-6 * self.limit:.3f} ms too often"
        )
