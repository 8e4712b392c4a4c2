"""Sequences of what clients of an action do, and actionlib's own server, which says what becomes of their goals."""

from dataclasses import dataclass

from solfer.components import Action
from solfer.transport.declared.goals import GoalName

EVENTS = (
    "goal",
    "goal without a stamp",
    "older goal",
    "cancel of the newest goal",
    "cancel of the next goal",
    "cancel of all",
    "cancel up to now",
    "cancel up to an earlier time",
    "lost client",
)


@dataclass(frozen=True)
class TestGoal:
    """actionlib/TestGoal."""

    goal: int = 0


@dataclass(frozen=True)
class TestFeedback:
    """actionlib/TestFeedback."""

    feedback: int = 0


@dataclass(frozen=True)
class TestResult:
    """actionlib/TestResult."""

    result: int = 0


def endless_action(name: str) -> Action:
    """Declare an action whose goals are all taken over, and never end by themselves."""

    def ignore(*_: object) -> None:
        pass

    return Action(name, "actionlib/Test", TestGoal, TestFeedback, TestResult, ignore, ignore, TestFeedback, ignore)


class Clients:
    """Clients of an action, one after the other.

    Args:
        tick: Time between two events [s].
    """

    def __init__(self, tick: float):
        self._tick, self._client, self._count = tick, 1, 0

    def act(self, event: str, now: float) -> tuple[str, GoalName] | None:
        """Return the topic and the name that a client sends; None: it is lost, and another one takes its place."""
        if event == "lost client":
            self._client += 1
            self._count += 1
            return None
        stamps = {"goal": now, "goal without a stamp": 0.0, "older goal": now - 0.5 * self._tick}
        if event in stamps:
            self._count += 1
            return "goal", GoalName(stamps[event], self._id(self._count))
        cancels = {
            "cancel of the newest goal": GoalName(0.0, self._id(self._count)),
            "cancel of the next goal": GoalName(0.0, self._id(self._count + 1)),
            "cancel of all": GoalName(),
            "cancel up to now": GoalName(now),
            "cancel up to an earlier time": GoalName(now - 1.5 * self._tick),
        }
        return "cancel", cancels[event]

    def _id(self, count: int) -> str:
        return f"client_{self._client}-{count}"


def reference_server(name: str):
    """Make actionlib's server, which takes over each goal at once and leaves it when it is cancelled."""
    from actionlib import SimpleActionServer
    from actionlib.msg import TestAction

    server = SimpleActionServer(name, TestAction, auto_start=False)

    def leave() -> None:
        if server.is_active():
            server.set_preempted()

    server.register_goal_callback(server.accept_new_goal)
    server.register_preempt_callback(leave)
    server.start()
    return server


def ros_message(topic: str, name: GoalName):
    """Make what a client publishes on `goal` or `cancel`."""
    import rospy
    from actionlib.msg import TestActionGoal
    from actionlib_msgs.msg import GoalID

    goal_id = GoalID(rospy.Time.from_sec(name.stamp), name.id)
    return goal_id if topic == "cancel" else TestActionGoal(goal_id=goal_id)


def states(entries) -> dict[str, int]:
    """Return the states of goals by their id, of `status_list`."""
    return {entry.goal_id.id: entry.status for entry in entries}
