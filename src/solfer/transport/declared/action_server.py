"""Actions that components declare, on the five topics of actionlib's protocol."""

import logging
from dataclasses import replace
from typing import Any

from solfer.errors import SolferError, described
from solfer.interfaces.declaration import Action, Outcome, full_name
from solfer.throttle import Throttle
from solfer.transport.declared.action_topics import ActionTopics
from solfer.transport.declared.fields import value_of
from solfer.transport.declared.goals import GoalName, GoalStatus, StatusEntry
from solfer.transport.endpoints import Queue
from solfer.transport.middleware import Middleware

logger = logging.getLogger(__name__)


class ActionServer:
    """One goal of an action after the other; its states are those that actionlib's SimpleActionServer gives.

    A goal without a stamp has that of its arrival. One with a stamp that is not after the newest cancel's, or is before
    that of the goal that was taken over last, is recalled.

    Args:
        owner: Name of the component.
        action: The declaration.
        middleware: Carries its topics.

    Attributes:
        active: The goal that is in progress; None: there is none.

    Raises:
        SolferError: A dataclass does not fit the interface.
    """

    def __init__(self, owner: str, action: Action, middleware: Middleware):
        self._action = action
        self._now = middleware.now
        self._throttle = Throttle(logger)
        self._stamp_time = middleware.stamp_time
        self._name = full_name(owner, action.name)
        self._topics = ActionTopics(self._name, action, middleware)
        self.active: GoalName | None = None
        self._past: dict[str, StatusEntry] = {}
        self._next_status = self._next_feedback = self._before = -float("inf")
        self._last_cancel = self._last_taken = 0.0
        self._count = 0

    @property
    def queues(self) -> tuple[Queue, ...]:
        """Where goals and cancels wait."""
        return self._topics.goals, self._topics.cancels

    def receive(self, refusal: str) -> None:
        """Carry out the requests of clients, between two cycles; a `refusal` aborts the goal and rejects others."""
        now = self._now()
        stamp = self._stamp_time()
        if stamp < self._before:
            # simulated time went back: stamps of before are of another time
            self._last_cancel = self._last_taken = 0.0
        self._before = stamp
        if refusal and self.active is not None:
            self._end(self.active, GoalStatus.ABORTED, refusal)
        # a goal and its cancel may have come together: the goal is first
        for message in self._topics.goals.drain():
            self._take(message, refusal)
        for message in self._topics.cancels.drain():
            self._cancel(message)
        if now >= self._next_status:
            self._publish_status()

    def publish(self) -> None:
        """Publish feedback, the result of a goal that has ended in this cycle, and the status when that is due."""
        now = self._now()
        if now >= self._next_status:
            self._publish_status()
        if self.active is None:
            return
        outcome = self._action.outcome()
        if outcome is not None:
            state = GoalStatus.SUCCEEDED if outcome.success else GoalStatus.ABORTED
            self._end(self.active, state, outcome.text, result=outcome.result)
        elif now >= self._next_feedback:
            self._next_feedback = now + 1.0 / self._action.rate
            entry = StatusEntry(self.active, GoalStatus.ACTIVE)
            self._topics.publish_feedback(entry, self._action.report())

    def _take(self, message: Any, refusal: str) -> None:
        """Take over a goal, or reject it."""
        try:
            received = value_of(self._topics.goal, message)
        except SolferError as error:
            self._throttle.warning(message.sender, "%s: a goal of %s is refused: %s", self._name, message.sender, error)
            return
        name = self._named(received.goal_id)
        known = self._past.get(name.id)
        if known is not None or (self.active is not None and self.active.id == name.id):
            if known is not None and known.status == GoalStatus.RECALLING:
                self._end(known.goal_id, GoalStatus.RECALLED, "cancelled before it came")
            return
        if 0.0 < received.goal_id.stamp <= self._last_cancel:
            self._end(name, GoalStatus.RECALLED, "a cancel has a later stamp")
            return
        if name.stamp < self._last_taken:
            self._end(name, GoalStatus.RECALLED, "another goal with a later stamp has come before")
            return
        if refusal:
            self._end(name, GoalStatus.REJECTED, refusal)
            return
        try:
            refused = self._action.begin(received.goal)
        except SolferError as error:
            refused = Outcome(self._action.result(), False, described(error, lines=True))
        if refused is not None:
            self._end(name, GoalStatus.REJECTED, refused.text, result=refused.result)
            return
        if self.active is not None:
            self._end(self.active, GoalStatus.PREEMPTED, "another goal has taken over")
        self.active = name
        self._next_feedback = -float("inf")
        self._last_taken = name.stamp
        self._publish_status()

    def _cancel(self, message: Any) -> None:
        """Cancel the goals that a request means: one by name, all up to a time, or, with neither of them, all."""
        try:
            meant = value_of(GoalName, message)
        except SolferError as error:
            self._throttle.warning(message.sender, "%s: a cancel is refused: %s", self._name, error)
            return
        active = self.active
        every = not meant.id and not meant.stamp
        known = meant.id in self._past or (active is not None and active.id == meant.id)
        if active is not None and (every or active.id == meant.id or 0.0 < meant.stamp >= active.stamp):
            self._action.cancel()
            self._end(active, GoalStatus.PREEMPTED, "cancelled")
        if meant.id and not known:
            self._remember(StatusEntry(meant, int(GoalStatus.RECALLING)))
        self._last_cancel = max(self._last_cancel, meant.stamp)

    def _named(self, name: GoalName) -> GoalName:
        """Give a goal the id and the stamp that its client has left out."""
        now = self._stamp_time()
        if not name.id:
            self._count += 1
            name = replace(name, id=f"{self._name}-{self._count}-{now:.6f}")
        return name if name.stamp else replace(name, stamp=now)

    def _remember(self, entry: StatusEntry) -> None:
        """Let a goal that is not in progress be in the status, as the newest one; the oldest is forgotten."""
        self._past.pop(entry.goal_id.id, None)
        self._past[entry.goal_id.id] = entry
        if len(self._past) > 20:
            del self._past[next(iter(self._past))]

    def _end(self, name: GoalName, state: GoalStatus, text: str, result: Any = None) -> None:
        """Publish how a goal has ended."""
        if self.active is not None and self.active.id == name.id:
            self.active = None
        entry = StatusEntry(name, int(state), text)
        self._remember(entry)
        self._topics.publish_result(entry, self._action.result() if result is None else result)
        self._publish_status()

    def _publish_status(self) -> None:
        """Publish the states of the goals."""
        self._next_status = self._now() + 0.2  # without news; clients take a server for dead that is silent longer
        in_progress = () if self.active is None else (StatusEntry(self.active, int(GoalStatus.ACTIVE)),)
        self._topics.publish_status((*self._past.values(), *in_progress))
