"""Plugins under the executor on the simulated CENTAURO and a virtual clock: order, switches, faults."""

import numpy as np
import pytest
from support.plugins.plugin import Saboteur, configuration
from support.realtime.executor_plugins import Layer

from solfer.errors import ClaimRefused, MiddlewareError, UnknownName
from solfer.middleware.memory import MemoryMiddleware
from solfer.plugins import PluginState
from solfer.telemetry.statistics import PluginCount

TARGET = "support.plugins.plugin:Saboteur"


@pytest.fixture
def layer(world, tmp_path):
    return Layer(world, tmp_path, [("joint_states",)])


def test_nothing_is_sent_before_the_switch(layer, world):
    world.run(1.0)
    assert layer["joint_states"].state is PluginState.INITIALIZED
    assert set(world.ask("lower_level/list_controllers").claimed_by) == {""}
    assert world.ask("joint_states/state").message == "INITIALIZED"
    layer.start()
    assert world.ask("joint_states/state").message == "RUNNING"
    assert world.ask(state="mammal_wide_high").success
    assert world.ask("joint_states/switch", data=False).success
    world.run(0.05)
    assert world.ask("xbotcore/get_plugin_list").message == "joint_states: STOPPED"
    assert set(world.ask("lower_level/list_controllers").claimed_by) == {""}
    layer.start()
    assert world.ask(state="mammal_wide_high").success


def test_a_start_blends_in_from_the_measured_state(layer, world):
    """A component that starts 0.3 rad off must not make joints jump: commands keep to a minimum-jerk profile."""
    queue = MemoryMiddleware(world.bus, "ear").queue("position_controller/command", "solfer/JointCommand", 2000)
    plugin = layer["joint_states"].plugin
    original = plugin.component.init

    def init():
        original()
        plugin.component._position[:] += 0.3  # a component that commands a jump

    plugin.component.init = init
    assert world.ask("joint_states/switch", data=True).success
    world.run(0.2)
    assert layer["joint_states"].state is PluginState.STARTING
    world.run(1.0)
    assert layer["joint_states"].state is PluginState.RUNNING
    commands = np.array([message.position for message in queue.drain()])
    # 0.3 rad in 0.5 s along the minimum-jerk profile; its speed is 15/8 of the mean at most
    assert np.abs(np.diff(commands, axis=0)).max() <= 1.01 * 0.3 / 0.5 * 15 / 8 / plugin.rate
    assert np.ptp(commands, axis=0).max() > 0.25
    assert np.ptp(commands, axis=0).max() < 0.31


def test_an_exception_in_close_lets_others_close(world, tmp_path, monkeypatch):
    monkeypatch.setattr(Saboteur, "step", "close")
    layer = Layer(world, tmp_path, [("test", configuration(tmp_path), TARGET), ("joint_states",)])
    layer.start()
    layer.executor.close()
    assert layer["test"].state is PluginState.FAULT
    assert layer["joint_states"].plugin.life is PluginState.CLOSED


def test_a_plugin_that_cannot_hold_stays_faulty(layer, world, monkeypatch):
    layer.start()

    def broken(stamp):
        raise OSError("no way out")

    monkeypatch.setattr(layer["joint_states"].plugin.outputs, "hold", broken)
    assert world.ask("joint_states/abort").success
    assert layer["joint_states"].state is PluginState.FAULT and "no way out" in layer["joint_states"].reason
    reply = world.ask("joint_states/switch", data=True)
    assert not reply.success and "cannot be started: FAULT" in reply.message


def test_a_switch_is_done_whole_or_not(world, tmp_path):
    layer = Layer(world, tmp_path, [("joint_states",), ("joint_lower",)])
    layer.start()
    refused = world.ask("xbotcore/joint_lower_switch", data=True)
    assert not refused.success
    assert "'joint_states' and 'joint_lower' both command" in refused.message
    assert layer["joint_lower"].state is PluginState.INITIALIZED and layer["joint_states"].state is PluginState.RUNNING
    wrong = world.ask("xbotcore/switch", start=("joint_lowr",), stop=("joint_states",))
    assert not wrong.success and "did you mean: joint_lower" in wrong.message
    assert layer["joint_states"].state is PluginState.RUNNING
    assert world.ask("xbotcore/switch", start=("joint_lower",), stop=("joint_states",)).success
    world.run(1.0)
    assert layer["joint_states"].state is PluginState.STOPPED and layer["joint_lower"].state is PluginState.RUNNING
    assert "joint_lower" in "".join(world.ask("lower_level/list_controllers").claimed_by)


@pytest.mark.parametrize(
    ("start", "stop", "error"),
    [
        (("joint_state",), (), UnknownName),
        (("joint_states", "joint_lower"), (), ClaimRefused),
        (("joint_states",), ("joint_states",), MiddlewareError),
        ((), ("joint_lower",), MiddlewareError),
    ],
)
def test_a_switch_that_cannot_be_done_is_refused(world, tmp_path, start, stop, error):
    layer = Layer(world, tmp_path, [("joint_states",), ("joint_lower",)])
    with pytest.raises(error):
        layer.executor.switchboard.plan(start, stop)
    assert all(managed.state is PluginState.INITIALIZED for managed in layer.executor.plugins)


def test_a_component_over_its_budget_is_aborted(layer, world):
    """A burst of slow cycles is forgiven, a lasting one is not; the count of both stays in the statistics."""
    layer.start()
    plugin = layer["joint_states"].plugin
    update = plugin.component.update

    def slow():
        layer.spend(0.6 / plugin.rate)
        update()

    plugin.component.update = slow
    world.run(15 / plugin.rate)
    plugin.component.update = update
    world.run(30 / plugin.rate)  # forgiven
    plugin.component.update = slow
    world.run(18 / plugin.rate)
    assert layer["joint_states"].state is PluginState.RUNNING
    world.run(4 / plugin.rate)
    assert layer["joint_states"].state is PluginState.ABORTED and "budget" in layer["joint_states"].reason
    assert layer.executor.statistics.life(0)[PluginCount.OVER_BUDGET] == 35


def test_too_many_overruns_stop_and_name_the_slowest(layer, world):
    """The loop is late because of the robot's update: the safe stop must name the plugin that cost the time."""
    layer.start()
    plugin = layer["joint_states"].plugin
    run = plugin.robot.update
    plugin.component.kinematics = True

    def slow():
        layer.spend(2.6 / plugin.rate)
        run()

    plugin.robot.update = slow
    world.run(18 / plugin.rate)
    assert layer["joint_states"].state is PluginState.RUNNING
    world.run(4 / plugin.rate)
    reason = layer["joint_states"].reason
    assert (
        layer["joint_states"].state is PluginState.ABORTED and "safe stop" in reason and "'joint_states' with" in reason
    )
