"""Several plugins in one loop, on the virtual clock of the memory middleware."""

import logging

import pytest
from support.plugins.several import PERIOD, Several
from support.unit.joint_pipes import RATE, dofs, make_robot, published

from solfer.components import Component
from solfer.errors import ClaimRefused, ComponentError, MiddlewareError, UnknownName
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.pipes import PipeContext, factory
from solfer.plugins import Plugin, PluginParts, PluginSet, PluginState
from solfer.plugins.life.budget import BudgetRules
from solfer.plugins.outputs.outputs import Outputs
from solfer.plugins.outputs.start_blend import StartBlend
from solfer.plugins.timing.loop import PluginLoop
from solfer.transport import Inbox
from solfer.transport.lower_level import Answer

FAILURES = ("init", "update", "send")
GAP = 1e-3  # [rad]


class Bent:
    """A plugin that moves the arm of a cart GAP away, and what it sends there.

    Args:
        blend: Shortest time in which its commands blend in, as its configuration says [s].
    """

    def __init__(self, blend):
        self._middleware, robot = MemoryMiddleware(Bus(), "cart"), make_robot()
        tags = {"name": "arm", "type": "impedance", "sink": "/command", "interface": {"position": True}}
        pipe = factory.controller(
            published(**tags, dofs=dofs(mapping="ACTUATED")), PipeContext(robot, self._middleware, {}, RATE)
        )
        outputs = Outputs([(pipe, None)], StartBlend("cart", [pipe], robot, RATE, blend), robot, 1.0 / RATE)
        self._plugin = Plugin(PluginParts(Component(robot), robot, (), outputs, Inbox(), RATE, self._middleware))
        robot.command.position[robot.dofs.index("shoulder")] = GAP
        self._place = pipe.message.names.index("shoulder")
        self._sent = MemoryMiddleware(self._middleware.bus, "ear").queue("arm/command", "solfer/JointCommand", 10000)

    def run(self, duration, **settings):
        """Run its loop, a `PluginSet` with these settings, for so long [s]; return the positions sent [rad]."""
        self._middleware.bus.every(duration, self._end)
        PluginLoop(PluginSet([self._plugin], **settings), self._middleware).run()
        return [float(message.position[self._place]) for message in self._sent.drain()]

    def _end(self):
        self._middleware.bus.ended = self._middleware.bus.time > 0.0


@pytest.mark.parametrize("first", [0, 1, 2])
@pytest.mark.parametrize("step", FAILURES)
def test_one_that_fails_lets_the_others_go_on(first, step):
    several = Several()
    several.components[first].fail_in(step, 20 if step != "init" else 0)
    several.run(100)
    assert [managed.state is PluginState.ABORTED for managed in several.set.plugins] == [
        index == first for index in range(3)
    ]
    others = [component for index, component in enumerate(several.components) if index != first]
    assert [component.updates for component in others] == [100, 100]
    assert f"fails in {step}" in several.set.plugins[first].reason and several.set.failure is None


def test_the_order_is_that_of_the_list():
    several = Several()
    several.run(3)
    assert several.order == ["one", "two", "three"] * 3


def test_the_process_ends_with_the_first_failure():
    several = Several()
    for component, cycle in zip(several.components, (30, 10, 20), strict=True):
        component.fail_in("update", cycle)
    with pytest.raises(ComponentError, match="plugins 'one', 'two', 'three' failed.*two fails in update") as caught:
        several.run(100)
    assert caught.value.exit_code == 1 and several.bus.time < 40 * PERIOD
    assert all(plugin.life is PluginState.CLOSED for plugin in several.plugins)


def test_an_abort_by_request_ends_no_process():
    several = Several(names=("one", "two"))
    several.components[0].fail_in("update", 10)
    several.at(20, "two/abort")
    several.run(50)
    assert [managed.state for managed in several.set.plugins] == [PluginState.ABORTED] * 2
    assert several.set.cycles == 50


def test_services_switch_as_in_the_rt_layer():
    several = Several(names=("one", "two"))
    several.at(10, "one/switch", data=False)
    several.at(30, "shared/switch", start=("one",), stop=("two",))
    several.at(40, "two/state")
    several.at(41, "shared/get_plugin_list")
    several.run(50)
    said = ["", "", "STOPPED", "one: RUNNING\ntwo: STOPPED"]
    assert several.answers == [Answer(message=text) for text in said]
    assert [component.updates for component in several.components] == [29, 30]  # it waits until the other is at rest
    assert [component.inits for component in several.components] == [2, 1]


def test_a_failed_plugin_starts_again_by_service():
    several = Several(names=("one", "two"))
    several.components[0].fail_in("update", 10)
    several.at(20, "one/switch", data=True)
    several.run(50)
    assert several.set.failure is several.set.plugins[0].failure is None
    assert [component.updates for component in several.components] == [10 + 30, 50]
    assert several.components[0].inits == 2 and several.set.plugins[0].starts == 2


def test_a_refused_switch_changes_nothing():
    several = Several(names=("one", "two"))
    several.at(10, "shared/switch", start=("two",), stop=("one",))
    several.at(11, "shared/switch", stop=("tow",))
    several.run(20)
    assert [answer.success for answer in several.answers] == [False, False]
    assert "'two' cannot be started: RUNNING" in several.answers[0].message and "two" in several.answers[1].message
    assert [component.updates for component in several.components] == [20, 20]


def test_two_that_want_one_joint_start_nothing():
    several = Several(names=("one", "two", "three"), commanding={"one": "wheel", "three": "wheel"})
    with pytest.raises(ClaimRefused, match="'one' and 'three' both command the velocity of joint 'wheel'"):
        several.run(10)
    assert several.order == [] and all(plugin.life is PluginState.CLOSED for plugin in several.plugins)


def test_a_component_over_its_budget_is_aborted(caplog):
    several = Several(budget=BudgetRules(share=0.5, overruns=3, grace=5))
    several.components[1].lasts = 0.6 * PERIOD
    with caplog.at_level(logging.ERROR):
        several.run(50)
    slow = several.set.plugins[1]
    assert slow.state is PluginState.ABORTED and slow.reason in caplog.text
    assert slow.reason == "its component took 3.000 ms, and more than its budget of 2.500 ms too often"
    assert several.components[1].updates == 5 + 3 and several.components[0].updates == 50


@pytest.mark.parametrize(("cycle", "reaches"), [(0.4, 50), (0.6, 8)])
def test_a_budget_is_a_share_of_the_period(cycle, reaches):
    several = Several(names=("one", "two"), budget=BudgetRules(share=0.5, overruns=3, grace=5))
    several.components[0].lasts = cycle * PERIOD
    several.run(50)
    assert several.components[0].updates == reaches


def test_health_names_the_one_that_failed():
    several = Several(names=("one", "two"))
    several.components[0].fail_in("update", 10)
    several.run(30)
    one, two = several.bus.reports["one"], several.bus.reports["two"]
    assert one.level == 2 and one.summary.startswith("ABORTED: RuntimeError: one fails in update")
    assert (two.level, two.summary) == (0, "running")


def test_one_that_cannot_stop_lets_the_others_close():
    several = Several()
    several.components[0].fail_in("stop", 0)
    with pytest.raises(ComponentError, match="one fails in stop"):
        several.run(10)
    assert [managed.state for managed in several.set.plugins] == [PluginState.ABORTED, *[PluginState.CLOSED] * 2]
    assert all(plugin.life is PluginState.CLOSED for plugin in several.plugins)


def test_a_single_plugin_needs_no_services():
    several = Several(names=("one",))
    several.run(10)
    with pytest.raises(UnknownName, match="one/state"):
        several.ask("one/state")


@pytest.mark.parametrize(("names", "rates", "said"), [
    ((), (), "a loop without plugins"),
    (("one", "one"), (200.0, 200.0), "the plugin 'one' is listed 2 times"),
    (("one", "two"), (200.0, 100.0), "'two' at 100 Hz in a loop of 200 Hz"),
])  # fmt: skip
def test_a_set_that_makes_no_sense_is_refused(names, rates, said):
    plugins = Several(names=("one", "two")).plugins[: len(names)]
    for plugin, name, rate in zip(plugins, names, rates, strict=True):
        plugin.component.name, plugin.rate = name, rate
    with pytest.raises(MiddlewareError, match=said):
        PluginSet(plugins)


def test_a_plugin_and_its_node_need_two_names():
    with pytest.raises(MiddlewareError, match="'shared' is a plugin and the node that runs it"):
        Several(names=("shared", "two")).run(1)


def test_an_unknown_plugin_is_named_with_its_neighbours():
    with pytest.raises(UnknownName, match="one"):
        Several().set.switchboard.plan(start=["on"])


def test_each_keeps_the_blend_of_its_configuration():
    several = Several(names=("one", "two"))
    for plugin, shortest in zip(several.plugins, (0.25, 0.75), strict=True):
        plugin.blend_in(shortest)
    assert [each.plugin.outputs.blend.shortest for each in PluginSet(several.plugins).plugins] == [0.25, 0.75]
    assert [each.plugin.outputs.blend.shortest for each in PluginSet(several.plugins, blend=2.0).plugins] == [2.0, 2.0]


@pytest.mark.parametrize("ends", ["fails", "stops"])
def test_what_requires_another_stops_with_it(ends, caplog):
    """A failure or a stop of `one` stops `three`, with the reason, and the unrelated plugin misses no update."""
    several = Several(requires={"three": ["one"]})
    if ends == "fails":
        several.components[0].fail_in("update", 20)
    else:
        several.at(20, "one/switch", data=False)
    seen = []  # before the end closes all
    several.bus.every(40 * PERIOD, lambda: seen.append([(each.state, each.reason) for each in several.set.plugins]))
    several.run(60)
    states, reasons = zip(*seen[-1], strict=True)
    assert list(states) == [
        PluginState.ABORTED if ends == "fails" else PluginState.STOPPED,
        PluginState.RUNNING,
        PluginState.STOPPED,
    ]
    assert reasons[2].startswith("it requires 'one', which is ")
    assert several.components[1].updates == 60
    assert any(line.startswith("three stops: it requires 'one', which is ") for line in caplog.messages)


@pytest.mark.parametrize(
    ("settings", "lasts"), [({}, 0.3), ({"blend": 0.0}, PERIOD), ({"blend": 0.1}, 0.1), ({"blend": 0.7}, 0.7)]
)
def test_commands_blend_in_as_configured(settings, lasts):
    sent = Bent(blend=0.3).run(1.0, **settings)
    count = round(lasts / PERIOD)
    assert max(sent[:count]) < GAP and set(sent[count:]) == {GAP}


def test_an_abort_of_all_has_one_reason():
    several, failure = Several(), ValueError("smoke")
    several.set.start()
    several.set.abort("for a reason", failure)
    for managed in several.set.plugins:
        assert (managed.state, managed.reason, managed.failure) == (PluginState.ABORTED, "for a reason", failure)
