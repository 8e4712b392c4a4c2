"""Actions that components declare, as actions of ROS 2."""

import dataclasses
import logging
import queue
from collections import deque
from typing import Any, NamedTuple

from rclpy.action import ActionServer, CancelResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node

from solfer.errors import ComponentError, SolferError, described
from solfer.interfaces.declaration import Action, full_name
from solfer.middleware.ros2.codecs import filled, interface
from solfer.middleware.ros2.codecs import plain as fields_of
from solfer.transport.declared.fields import made, plain
from solfer.transport.declared.goals import GoalStatus
from solfer.transport.endpoints import Queue
from solfer.transport.middleware import Middleware

logger = logging.getLogger(__name__)


class _End(NamedTuple):
    """How a goal has ended."""

    status: GoalStatus
    result: Any
    text: str


class _Goal:
    """A goal: `news` are feedbacks and its end, which a thread of the executor sends, so that the cycle need not."""

    def __init__(self, handle: "ServerGoalHandle[Any, Any, Any]"):
        self.handle = handle
        self.news: queue.SimpleQueue[Any] = queue.SimpleQueue()


class _Goals(Queue):
    """Goals that wait for the next cycle; `waits` is true, since a cancel may wait, too."""

    def __init__(self, topic: str):
        self.topic = topic
        self._goals: deque[_Goal] = deque()

    def put(self, goal: _Goal) -> None:
        """Let a goal wait."""
        self._goals.append(goal)

    def drain(self) -> list[_Goal]:
        """See `Queue.drain`."""
        return [self._goals.popleft() for _ in range(len(self._goals))]


class Ros2Action:
    """One goal after the other; a new one that the component takes over aborts the present one.

    Every goal is accepted, and carried out between two cycles. One that is refused there is aborted: ROS 2 has no text
    of a rejection, but the result may have one.

    Args:
        owner: Name of the component.
        action: The declaration.
        node: The node that offers it.
        middleware: Its clock.

    Attributes:
        active: The goal that is in progress; None: there is none.

    Raises:
        SolferError: A dataclass does not fit the interface, or there is no such action.
    """

    TEXTS = ("error_string", "message")
    """Fields of a result that say why a goal has not succeeded."""

    def __init__(self, owner: str, action: Action, node: Node, middleware: Middleware):
        self._action = action
        self._now = middleware.now
        self._name = full_name(owner, action.name)
        self._type = interface(action.interface, "action")
        for ours, theirs in (("goal", "Goal"), ("feedback", "Feedback"), ("result", "Result")):
            fields = {field.name for field in dataclasses.fields(getattr(action, ours))}
            present = getattr(self._type, theirs).get_fields_and_field_types()
            if not fields <= set(present):
                raise ComponentError(
                    f"the {ours} of action {self._name} has fields {', '.join(sorted(fields))}",
                    expected=f"some of {action.interface}: {', '.join(present)}",
                )
        self._goals = _Goals(self._name)
        self._next_feedback = -float("inf")
        self.active: _Goal | None = None
        self._server = ActionServer(
            node,
            self._type,
            self._name,
            self._carry_out,
            callback_group=ReentrantCallbackGroup(),
            cancel_callback=lambda _: CancelResponse.ACCEPT,
        )

    @property
    def queues(self) -> tuple[Queue, ...]:
        """Where goals wait."""
        return (self._goals,)

    def receive(self, refusal: str) -> None:
        """Carry out the requests of clients, between two cycles; a `refusal` aborts the goal and all others."""
        active = self.active
        if active is not None and refusal:
            self._end(active, GoalStatus.ABORTED, refusal)
        elif active is not None and active.handle.is_cancel_requested:
            self._action.cancel()
            self._end(active, GoalStatus.PREEMPTED, "cancelled")
        for goal in self._goals.drain():
            if goal.handle.is_cancel_requested:
                self._end(goal, GoalStatus.PREEMPTED, "cancelled before it began")
            elif refusal:
                self._end(goal, GoalStatus.ABORTED, refusal)
            else:
                self._begin(goal)

    def publish(self) -> None:
        """Send feedback, or the result of a goal that has ended in this cycle."""
        active = self.active
        if active is None:
            return
        outcome = self._action.outcome()
        if outcome is not None:
            status = GoalStatus.SUCCEEDED if outcome.success else GoalStatus.ABORTED
            self._end(active, status, outcome.text, result=outcome.result)
        elif (now := self._now()) >= self._next_feedback:
            self._next_feedback = now + 1.0 / self._action.rate
            active.news.put(self._action.report())

    def close(self) -> None:
        """Abort what is in progress; the action ends with its node."""
        self.receive("the node ends")

    def _begin(self, goal: _Goal) -> None:
        result, text = None, ""
        try:
            refused = self._action.begin(made(self._action.goal, fields_of(goal.handle.request)))
            if refused is not None:
                result, text = refused.result, refused.text
        except SolferError as error:
            text = described(error, lines=True)
        if text:
            self._end(goal, GoalStatus.ABORTED, text, result=result)
            return
        if self.active is not None:
            self._end(self.active, GoalStatus.ABORTED, "another goal has taken over")
        self.active = goal
        self._next_feedback = -float("inf")

    def _end(self, goal: _Goal, status: GoalStatus, text: str, result: Any = None) -> None:
        if self.active is goal:
            self.active = None
        if result is None:
            result = self._action.result()
        goal.news.put(_End(status, result, text))

    def _carry_out(self, handle: "ServerGoalHandle[Any, Any, Any]") -> Any:
        """Send what becomes of a goal, in a thread of the executor."""
        goal = _Goal(handle)
        self._goals.put(goal)
        while not isinstance(news := goal.news.get(), _End):
            handle.publish_feedback(filled(self._type.Feedback, plain(news)))
        {GoalStatus.SUCCEEDED: handle.succeed, GoalStatus.PREEMPTED: handle.canceled}.get(news.status, handle.abort)()
        if news.status is not GoalStatus.SUCCEEDED:
            logger.info("%s: a goal has not succeeded: %s", self._name, news.text)
        result = filled(self._type.Result, plain(news.result))
        for name in self.TEXTS:
            if news.status is not GoalStatus.SUCCEEDED and not getattr(result, name, "-"):
                setattr(result, name, news.text)
        return result
