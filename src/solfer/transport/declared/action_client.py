"""A client of an action, on any middleware."""

import itertools
import secrets
from typing import Any

from solfer.transport.declared.fields import message_of, value_of
from solfer.transport.declared.goals import GOAL_ID, STATUS, GoalName, GoalStatus, StatusList, envelopes, interface_of
from solfer.transport.middleware import Middleware


class Goal:
    """A goal that was sent.

    Args:
        name: Its name.

    Attributes:
        name: Its name.
        status: Its state.
        text: One sentence about it.
        feedback: The newest feedback, None before the first.
        result: The result, None as long as it has not ended, and if it was lost.
        known: Whether the owner of the action has confirmed the goal.
    """

    def __init__(self, name: GoalName):
        self.name = name
        self.status = GoalStatus.PENDING
        self.text = ""
        self.feedback: Any = None
        self.known = False
        self.result: Any = None


class ActionClient:
    """Sends goals and receives what becomes of them, in `poll`.

    Args:
        middleware: Carries the topics.
        name: Full name of the action, such as 'joint_states/follow_joint_trajectory'.
        interface: `package/Type` of the action.
        goal: Dataclass of a goal.
        feedback: Dataclass of the feedback.
        result: Dataclass of the result.

    Attributes:
        goals: Those that have not ended, by the id of their name.
    """

    def __init__(self, middleware: Middleware, name: str, interface: str, goal: type, feedback: type, *, result: type):
        self._types = envelopes(goal, feedback, result)
        # a client that is started again has the same name, and its clock may begin again
        self._sender = f"{middleware.name}-{secrets.token_hex(4)}"
        self._now = middleware.stamp_time
        self._count = itertools.count(1)
        parts = {part: interface_of(interface, part) for part in ("goal", "feedback", "result")}
        self._interface = parts["goal"]
        self._goals = middleware.writer(f"{name}/goal", parts["goal"])
        self._cancels = middleware.writer(f"{name}/cancel", GOAL_ID)
        self._feedback = middleware.declared_queue(f"{name}/feedback", parts["feedback"])
        self._statuses = middleware.declared_queue(f"{name}/status", STATUS)
        self._results = middleware.declared_queue(f"{name}/result", parts["result"])
        self.goals: dict[str, Goal] = {}

    def send(self, goal: Any) -> Goal:
        """Send a goal; its client has to `poll`."""
        now = self._now()
        sent = Goal(GoalName(now, f"{self._sender}-{next(self._count)}"))
        self.goals[sent.name.id] = sent
        self._goals.write(message_of(self._interface, self._types.goal(sent.name, goal)))
        return sent

    def cancel(self, goal: Goal | None = None) -> None:
        """Request to cancel a goal; None: all goals of all clients."""
        self._cancels.write(message_of(GOAL_ID, GoalName() if goal is None else GoalName(0.0, goal.name.id)))

    def poll(self) -> None:
        """Receive feedback, results and states. Does not block.

        A goal that its owner has known and does not know any more, since it was ended and started again, is LOST.
        """
        for message in self._feedback.drain():
            news = value_of(self._types.feedback, message)
            goal = self.goals.get(news.status.goal_id.id)
            if goal is not None:
                goal.status = GoalStatus(news.status.status)
                goal.feedback = news.feedback
        for message in self._results.drain():
            news = value_of(self._types.result, message)
            goal = self.goals.pop(news.status.goal_id.id, None)
            if goal is not None:
                goal.status = GoalStatus(news.status.status)
                goal.text = news.status.text
                goal.result = news.result
        for message in self._statuses.drain():
            listed = {entry.goal_id.id for entry in value_of(StatusList, message).status_list}
            for name, goal in list(self.goals.items()):
                if goal.known and name not in listed:
                    goal.status = GoalStatus.LOST
                    goal.text = "the owner of the action has ended"
                    del self.goals[name]
                goal.known = name in listed
