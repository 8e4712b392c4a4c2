"""The five topics of an action, at its server."""

from typing import Any

from solfer.interfaces.declaration import Action
from solfer.transport.declared.fields import message_of
from solfer.transport.declared.goals import GOAL_ID, STATUS, StatusEntry, StatusList, envelopes, interface_of
from solfer.transport.middleware import Middleware


class ActionTopics:
    """Receives goals and cancels, and publishes status, feedback and results.

    Args:
        name: Full name of the action.
        action: The declaration.
        middleware: Carries the topics.

    Attributes:
        goal: Type of the message of a goal.
        goals: Where goals wait.
        cancels: Where cancels wait.

    Raises:
        SolferError: A dataclass does not fit the interface.
    """

    def __init__(self, name: str, action: Action, middleware: Middleware):
        types = envelopes(action.goal, action.feedback, action.result)
        goal, feedback, result = (interface_of(action.interface, part) for part in ("goal", "feedback", "result"))
        for interface, message in ((goal, types.goal), (feedback, types.feedback), (result, types.result)):
            middleware.require_fields(interface, message)
        self.goal = types.goal
        self.goals = middleware.declared_queue(f"{name}/goal", goal)
        self.cancels = middleware.declared_queue(f"{name}/cancel", GOAL_ID)
        self._types = types
        self._interfaces = feedback, result
        self._status = middleware.writer(f"{name}/status", STATUS)
        self._feedback = middleware.writer(f"{name}/feedback", feedback)
        self._result = middleware.writer(f"{name}/result", result)

    def publish_status(self, entries: tuple[StatusEntry, ...]) -> None:
        """Publish the states of goals."""
        self._status.write(message_of(STATUS, StatusList(entries)))

    def publish_feedback(self, entry: StatusEntry, feedback: Any) -> None:
        """Publish the feedback of a goal."""
        self._feedback.write(message_of(self._interfaces[0], self._types.feedback(entry, feedback)))

    def publish_result(self, entry: StatusEntry, result: Any) -> None:
        """Publish the result of a goal."""
        self._result.write(message_of(self._interfaces[1], self._types.result(entry, result)))
