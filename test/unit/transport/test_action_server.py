"""Goals of a declared action, in memory and in shared memory: feedback, results, cancelling, preemption, refusal."""

import importlib

import pytest
from support.unit.declarations import CountGoal, CountingNode, counting_client
from support.unit.wires import MemoryWire, XbotWire

from solfer.transport.declared import GoalStatus


@pytest.mark.needs("ros")
def test_states_of_goals_are_those_of_actionlib():
    states = importlib.import_module("actionlib_msgs.msg").GoalStatus
    assert {state.name: state.value for state in GoalStatus} == {
        name: value for name, value in vars(states).items() if name.isupper()
    }


class CountingScene:
    """A node with an action, and a client."""

    def __init__(self, wire):
        self.wire = wire
        self.node = CountingNode(wire.middleware)
        self.start_client()

    def start_client(self):
        """Start the client, for the second time after its end."""
        self.outside = self.wire.node("client")
        self.client = counting_client(self.outside)

    def send(self, target):
        """Send a goal."""
        return self.client.send(CountGoal(target))

    def cycles(self, count=1):
        """Cycles of the node, each with a look of the client behind it."""
        for _ in range(count):
            self.wire.pass_time(0.01)
            self.node.cycle()
            self.client.poll()


@pytest.fixture(params=[MemoryWire, XbotWire], ids=["memory", "shared_memory"])
def scene(request):
    wire = request.param()
    yield CountingScene(wire)
    wire.close()


def test_a_goal_succeeds_with_feedback(scene):
    goal = scene.send(20)
    scene.cycles(10)
    assert goal.status is GoalStatus.ACTIVE and 0 < goal.feedback.count < 11 and goal.result is None
    scene.cycles(15)
    assert goal.status is GoalStatus.SUCCEEDED and goal.result.count == 20 and goal.text == "counted to 20"


def test_a_client_that_is_started_again_gets_its_goal(scene):
    scene.client._now = lambda: 0.0
    scene.send(5)
    scene.cycles(10)
    scene.outside.close()
    scene.start_client()
    scene.client._now = lambda: 0.0  # both in the first moments of their clocks
    goal = scene.send(7)
    scene.cycles(10)
    assert goal.status is GoalStatus.SUCCEEDED and goal.result.count == 7


def test_a_component_gives_up_a_goal(scene):
    goal = scene.send(13)
    scene.cycles(15)
    assert goal.status is GoalStatus.ABORTED and goal.result.count == 13


def test_a_new_goal_preempts_the_old_one(scene):
    first = scene.send(1000)
    scene.cycles(3)
    second = scene.send(5)
    scene.cycles(8)
    assert first.status is GoalStatus.PREEMPTED and first.result.count == -1
    assert second.status is GoalStatus.SUCCEEDED and scene.node.counter.cancels == 0


def test_a_refused_goal_leaves_the_present_one(scene):
    first = scene.send(10)
    scene.cycles(3)
    second = scene.send(-1)
    scene.cycles(10)
    assert second.status is GoalStatus.REJECTED and "not negative" in second.text
    assert first.status is GoalStatus.SUCCEEDED and first.result.count == 10


def test_a_cancel_ends_its_goal_only(scene):
    first = scene.send(1000)
    scene.cycles(3)
    second = scene.send(1000)
    scene.cycles(3)
    scene.client.cancel(first)  # which has ended already
    scene.cycles(3)
    assert scene.node.counter.cancels == 0 and second.status is GoalStatus.ACTIVE
    scene.client.cancel(second)
    scene.cycles(2)
    assert scene.node.counter.cancels == 1 and second.status is GoalStatus.PREEMPTED and second.text == "cancelled"


def test_everything_is_cancelled_without_a_name(scene):
    goal = scene.send(1000)
    scene.cycles(3)
    scene.client.cancel()
    scene.cycles(2)
    assert goal.status is GoalStatus.PREEMPTED


def test_a_cancel_may_come_before_its_goal(scene):
    goal = scene.send(1000)
    scene.client.cancel(goal)
    scene.cycles(2)
    assert goal.status is GoalStatus.PREEMPTED and scene.node.counter.cancels == 1


def test_a_plugin_that_does_not_work_rejects_goals(scene):
    first = scene.send(1000)
    scene.cycles(3)
    scene.node.inbox.refusal = "plugin 'abacus' waits for a feedback"
    scene.cycles(1)
    assert first.status is GoalStatus.ABORTED and first.text == scene.node.inbox.refusal
    second = scene.send(5)
    scene.cycles(1)
    assert second.status is GoalStatus.REJECTED and second.text == scene.node.inbox.refusal
    scene.node.inbox.refusal = ""
    third = scene.send(2)
    scene.cycles(4)
    assert third.status is GoalStatus.SUCCEEDED


def test_two_clients_have_goals_of_their_own(scene):
    other = counting_client(scene.wire.node("other"))
    first = scene.send(1000)
    scene.cycles(2)
    second = other.send(CountGoal(3))
    scene.cycles(6)
    other.poll()
    assert first.status is GoalStatus.PREEMPTED and second.status is GoalStatus.SUCCEEDED


def test_a_goal_is_lost_with_its_node(scene):
    goal = scene.send(1000)
    scene.cycles(5)
    scene.wire.middleware.close()
    scene.node = CountingNode(scene.wire.node("after"))
    scene.cycles(30)
    assert goal.status is GoalStatus.LOST and goal.result is None and not scene.client.goals
    again = scene.send(2)
    scene.cycles(5)
    assert again.status is GoalStatus.SUCCEEDED
