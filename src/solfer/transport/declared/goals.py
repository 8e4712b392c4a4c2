"""Messages of an action, as actionlib has them: wiki.ros.org/actionlib/DetailedDescription.

An action is five topics below its name: `goal` and `cancel` to its owner, `status`, `feedback` and `result` from it.
"""

import enum
from dataclasses import dataclass, field, make_dataclass
from typing import Any

GOAL_ID = "actionlib_msgs/GoalID"
STATUS = "actionlib_msgs/GoalStatusArray"


class GoalStatus(enum.IntEnum):
    """State of a goal; numbers of actionlib_msgs/GoalStatus."""

    PENDING = 0
    ACTIVE = 1
    PREEMPTED = 2
    SUCCEEDED = 3
    ABORTED = 4
    REJECTED = 5
    PREEMPTING = 6
    RECALLING = 7
    RECALLED = 8
    LOST = 9

    @property
    def ended(self) -> bool:
        """Whether nothing more happens to the goal."""
        open_ = (GoalStatus.PENDING, GoalStatus.ACTIVE, GoalStatus.PREEMPTING, GoalStatus.RECALLING)
        return self not in open_


@dataclass(frozen=True)
class GoalName:
    """A goal, by the name that its client has given it; `stamp`: when it was sent [s]."""

    stamp: float = 0.0
    id: str = ""


@dataclass(frozen=True)
class StatusEntry:
    """State of one goal."""

    goal_id: GoalName = field(default_factory=GoalName)
    status: int = 0
    text: str = ""


@dataclass(frozen=True)
class StatusList:
    """States of the goals that are in progress, and of those that ended lately."""

    status_list: tuple[StatusEntry, ...] = ()


@dataclass(frozen=True)
class Envelopes:
    """The dataclasses of the messages of an action, around those of its goal, feedback and result."""

    goal: type
    feedback: type
    result: type


def envelopes(goal: type, feedback: type, result: type) -> Envelopes:
    """Make the dataclasses of an action's messages."""

    def answer(name: str, content: type) -> type:
        return make_dataclass(f"Action{name.title()}", [("status", StatusEntry), (name, content)], frozen=True)

    sent: Any = make_dataclass("ActionGoal", [("goal_id", GoalName), ("goal", goal)], frozen=True)
    return Envelopes(sent, answer("feedback", feedback), answer("result", result))


def interface_of(action: str, part: str) -> str:
    """Return the interface of the `goal`, `feedback` or `result` of an action `package/Type`."""
    return f"{action}Action{part.title()}"
