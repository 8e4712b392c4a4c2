"""What several tests of declarations share: a component with an action that counts, and its client."""

from dataclasses import dataclass

from solfer.components import Action, Outcome
from solfer.errors import ComponentError
from solfer.transport import Inbox
from solfer.transport.declared import ActionClient
from solfer.transport.declared.binding import bind

COUNT = "test_msgs/Count"


@dataclass(frozen=True)
class CountGoal:
    """How far to count."""

    target: int = 0


@dataclass(frozen=True)
class CountFeedback:
    """Where the count is."""

    count: int = 0


@dataclass(frozen=True)
class CountResult:
    """Where the count ended."""

    count: int = -1


@dataclass(frozen=True)
class Vector:
    """Three numbers."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


@dataclass(frozen=True)
class Twist:
    """geometry_msgs/Twist."""

    linear: Vector = Vector()
    angular: Vector = Vector()


@dataclass(frozen=True)
class Header:
    """std_msgs/Header."""

    stamp: float = 0.0
    frame_id: str = ""


@dataclass(frozen=True)
class TwistStamped:
    """geometry_msgs/TwistStamped."""

    header: Header = Header()
    twist: Twist = Twist()


class Counter:
    """Counts one a cycle; a goal below zero is refused, one of 13 fails."""

    def __init__(self):
        self.target = self.count = self.cancels = 0

    def begin(self, goal):
        if goal.target < 0:
            raise ComponentError(f"target {goal.target}", expected="one that is not negative")
        self.target, self.count = goal.target, 0

    def outcome(self):
        if self.count < self.target:
            return None
        return Outcome(CountResult(self.count), self.target != 13, f"counted to {self.count}")

    def cancel(self):
        self.cancels += 1
        self.target = 0

    def action(self):
        return Action(
            "count",
            COUNT,
            CountGoal,
            CountFeedback,
            CountResult,
            self.begin,
            self.outcome,
            lambda: CountFeedback(self.count),
            self.cancel,
        )


class CountingNode:
    """A loop around a `Counter`.

    Args:
        middleware: Its node.
    """

    def __init__(self, middleware):
        self.counter, self.inbox = Counter(), Inbox()
        self._publications = bind("abacus", (self.counter.action(),), middleware, self.inbox, rate=100.0)

    def cycle(self):
        """One cycle, as a plugin has it."""
        self.inbox.apply()
        if not self.inbox.refusal:
            self.counter.count += 1
            self._publications.run()


def named(declared, name):
    """Return the declaration of a topic, a service or an action that has a name."""
    return next(each for each in declared if each.name == name)


def counting_client(middleware, name="abacus/count"):
    """Make a client of the node's action."""
    return ActionClient(middleware, name, COUNT, CountGoal, CountFeedback, result=CountResult)
