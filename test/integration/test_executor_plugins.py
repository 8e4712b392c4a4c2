"""Plugins under the executor on the simulated CENTAURO and a virtual clock: order, switches, and what happens when
parts fail.
"""

import numpy as np
import pytest
from test_plugin import WHEELS, Saboteur, configuration
from world import CONFIG, STEP, World

from solfer.config import load
from solfer.errors import ClaimRefused, MiddlewareError, UnknownName
from solfer.middleware.memory import MemoryMiddleware
from solfer.middleware.xbot.estop import EmergencyStop
from solfer.middleware.xbot.executor import Executor, Rules
from solfer.middleware.xbot.lifecycle import Stage
from solfer.plugins import Registry, generate

RULES = Rules(blend=0.5)
TARGET = "test_executor_plugins:Saboteur"


class Layer:
    """An executor with plugins on the bus of a world.

    Attributes:
        world: The world.
        executor: The executor, whose cycles are on the bus.
        work: Time that each cycle of a component takes, by name of the plugin [s]; the virtual clock moves by it.
    """

    def __init__(self, world, folder, plugins, rules=RULES):
        self.world, bus = world, world.bus
        self._extra, self._polls = 0, []
        made = [self._made(*plugin) for plugin in plugins]
        self.executor = Executor(made, self.node("xbot"), EmergencyStop(folder), rules=rules, polls=self._polls,
                                 nanoseconds=lambda: round(1e9 * bus.time) + self._extra)
        self.begin()

    def begin(self):
        """Put the cycles on the bus."""
        self.world.bus.every(1.0 / self.executor.rate, self.executor.cycle)

    def node(self, name):
        """A node of the world, in shared memory if that is; there somebody has to look for calls and replies."""
        if not hasattr(self.world, "node"):
            return MemoryMiddleware(self.world.bus, name)
        node = self.world.node(name)
        self._polls.append(node.poll)
        return node

    def _made(self, name, file=CONFIG / "centauro.yaml", target=None):
        settings = load(file, name)
        generator = Registry().find(name, target or settings.module.class_)
        return generate(settings, self.node(name), generator)

    def spend(self, duration):
        """Let time pass in the midst of a cycle [s]."""
        self._extra += round(1e9 * duration)

    def __getitem__(self, name):
        return next(managed for managed in self.executor.plugins if managed.name == name)

    def start(self, name="joint_states", duration=1.0):
        """Start a plugin, and wait until it runs."""
        assert self.world.ask(f"xbotcore/{name}_switch", data=True).success
        self.world.run(duration)
        assert self[name].stage is Stage.RUNNING


@pytest.fixture
def layer(world, tmp_path):
    return Layer(world, tmp_path, [("joint_states",)])


def test_joint_states_moves_as_it_does_without_an_executor(tmp_path):
    traces = []
    for under_executor in (False, True):
        world, trace = World(), []
        if under_executor:
            Layer(world, tmp_path, [("joint_states",)], Rules(blend=0.0)).executor.plugins[0].start()
        else:
            world.plugin("joint_states")
        world.run(0.5)
        assert world.ask(state="mammal_wide_high").success
        world.bus.every(0.01, lambda world=world, trace=trace: trace.append(world.simulation.q.copy()))
        world.run(3.0)
        world.close()
        traces.append(np.array(trace))
    assert np.ptp(traces[0], axis=0).max() > 0.3
    assert np.abs(traces[0] - traces[1]).max() < 1e-9


def test_two_runs_on_the_virtual_clock_are_equal_to_the_bit(tmp_path):
    ends = []
    for run in range(2):
        world = World()
        layer = Layer(world, tmp_path / str(run), [("joint_states",)])
        layer.start()
        world.ask(state="mammal_wide_high")
        world.run(1.0)
        ends.append((world.simulation.q.tobytes(), bytes(layer.executor.board.counts)))
        world.close()
    assert ends[0] == ends[1]


def test_nothing_is_sent_before_the_switch_and_services_answer(layer, world):
    world.run(1.0)
    assert layer["joint_states"].stage is Stage.INITIALIZED
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
    queue = MemoryMiddleware(world.bus, "ear").queue("position_controller/command", "solfer/JointCommand", 2000)
    plugin = layer["joint_states"].plugin
    original = plugin.component.init

    def init():
        original()
        plugin.component._position[:] += 0.3  # a component that wants to be elsewhere at once

    plugin.component.init = init
    assert world.ask("joint_states/switch", data=True).success
    world.run(0.2)
    assert layer["joint_states"].stage is Stage.STARTING
    world.run(1.0)
    assert layer["joint_states"].stage is Stage.RUNNING
    commands = np.array([message.position for message in queue.drain()])
    # 0.3 rad in 0.5 s along the minimum-jerk profile, whose speed is 15/8 of the mean at most
    assert np.abs(np.diff(commands, axis=0)).max() <= 1.01 * 0.3 / 0.5 * 15 / 8 / plugin.rate
    assert np.ptp(commands, axis=0).max() > 0.25
    assert np.ptp(commands, axis=0).max() < 0.31


@pytest.mark.parametrize("step", ["init", "update", "send", "nan", "stop"])
def test_an_exception_aborts_the_plugin_and_the_robot_holds(world, tmp_path, monkeypatch, step):
    monkeypatch.setattr(Saboteur, "step", step)
    queue = MemoryMiddleware(world.bus, "ear").queue("position_controller/command", "solfer/JointCommand", 4000)
    layer = Layer(world, tmp_path, [("test", configuration(tmp_path), TARGET)])
    assert world.ask("test/switch", data=True).success
    world.run(1.0)
    if step == "stop":
        assert layer["test"].stage is Stage.RUNNING and world.ask("test/switch", data=False).success
        world.run(0.02)
    managed = layer["test"]
    assert managed.stage is Stage.ABORTED and managed.aborts == 1
    assert ("torso_yaw" if step == "nan" else f"sabotage in {step}") in managed.reason
    assert set(world.ask("lower_level/list_controllers").claimed_by) == {""}
    commands = np.array([message.position for message in queue.drain()])
    assert np.isfinite(commands).all()
    assert (len(commands) == 0) is (step == "init")
    assert np.abs(np.diff(commands, axis=0)).max(initial=0.0) < 1e-3
    world.run(1.0)
    assert np.abs(world.simulation.v[[world.simulation.kinematics.dofs.index(name) for name in WHEELS]]).max() < 0.05
    assert layer.executor.board.stage(0) is Stage.ABORTED and managed.reason in layer.executor.board.text(0)


def test_an_exception_in_close_is_a_fault_and_keeps_nobody_from_closing(world, tmp_path, monkeypatch):
    monkeypatch.setattr(Saboteur, "step", "close")
    layer = Layer(world, tmp_path, [("test", configuration(tmp_path), TARGET), ("joint_states",)])
    layer.start()
    layer.executor.close()
    assert layer["test"].stage is Stage.FAULT
    assert layer["joint_states"].plugin.life.value == "closed"


def test_a_plugin_that_cannot_hold_is_at_fault_and_does_not_start_again(layer, world, monkeypatch):
    layer.start()

    def broken(stamp):
        raise OSError("no way out")

    monkeypatch.setattr(layer["joint_states"].plugin.outputs, "hold", broken)
    assert world.ask("joint_states/abort").success
    assert layer["joint_states"].stage is Stage.FAULT and "no way out" in layer["joint_states"].reason
    reply = world.ask("joint_states/switch", data=True)
    assert not reply.success and "cannot be started: FAULT" in reply.message


def test_a_switch_is_done_whole_or_not_at_all(world, tmp_path):
    layer = Layer(world, tmp_path, [("joint_states",), ("joint_lower",)])
    layer.start()
    refused = world.ask("xbotcore/joint_lower_switch", data=True)
    assert not refused.success
    assert "'joint_states' and 'joint_lower' both command" in refused.message
    assert layer["joint_lower"].stage is Stage.INITIALIZED and layer["joint_states"].stage is Stage.RUNNING
    wrong = world.ask("xbotcore/switch", start=("joint_lowr",), stop=("joint_states",))
    assert not wrong.success and "did you mean: joint_lower" in wrong.message
    assert layer["joint_states"].stage is Stage.RUNNING
    assert world.ask("xbotcore/switch", start=("joint_lower",), stop=("joint_states",)).success
    world.run(1.0)
    assert layer["joint_states"].stage is Stage.STOPPED and layer["joint_lower"].stage is Stage.RUNNING
    assert "joint_lower" in "".join(world.ask("lower_level/list_controllers").claimed_by)


@pytest.mark.parametrize(("start", "stop", "error"), [
    (("joint_state",), (), UnknownName),
    (("joint_states", "joint_lower"), (), ClaimRefused),
    (("joint_states",), ("joint_states",), MiddlewareError),
    ((), ("joint_lower",), MiddlewareError),
])
def test_a_switch_that_cannot_be_done_is_refused(world, tmp_path, start, stop, error):
    layer = Layer(world, tmp_path, [("joint_states",), ("joint_lower",)])
    with pytest.raises(error):
        layer.executor.switchboard.plan(start, stop)
    assert all(managed.stage is Stage.INITIALIZED for managed in layer.executor.plugins)


def test_a_component_over_its_budget_is_aborted_by_name(layer, world):
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
    assert layer["joint_states"].stage is Stage.RUNNING
    world.run(4 / plugin.rate)
    assert layer["joint_states"].stage is Stage.ABORTED and "budget" in layer["joint_states"].reason
    assert layer.executor.board.life(0)["over budget"] == 35


def test_too_many_overruns_are_a_safe_stop_that_names_the_slowest(layer, world):
    layer.start()
    plugin = layer["joint_states"].plugin
    run = plugin.robot.update
    plugin.component.kinematics = True

    def slow():
        layer.spend(1.5 / plugin.rate)
        run()

    plugin.robot.update = slow
    world.run(18 / plugin.rate)
    assert layer["joint_states"].stage is Stage.RUNNING
    world.run(4 / plugin.rate)
    reason = layer["joint_states"].reason
    assert layer["joint_states"].stage is Stage.ABORTED and "safe stop" in reason and "'joint_states' with" in reason


def test_an_emergency_stop_is_obeyed_within_a_cycle_and_stays_until_it_is_cleared_at_rest(layer, world, tmp_path):
    layer.start()
    assert not world.ask("xbotcore/estop_clear").success
    EmergencyStop(tmp_path).trip("a hand on the button")  # as another process would
    world.run(1.0 / layer.executor.rate + STEP)
    assert layer["joint_states"].stage is Stage.ABORTED
    assert "a hand on the button" in layer["joint_states"].reason
    refused = world.ask("joint_states/switch", data=True)
    assert not refused.success and "a hand on the button" in refused.message
    assert world.ask("xbotcore/estop_clear").success
    world.run(0.5)
    assert layer["joint_states"].stage is Stage.ABORTED  # nothing starts by itself
    layer.start()


def test_lost_feedback_is_told_and_the_plugin_runs_again_when_it_is_back(layer, world):
    layer.start()
    world.heard = False
    world.run(0.5)
    assert layer["joint_states"].stage is Stage.STARTING and "link_side_online" in layer["joint_states"].reason
    world.heard = True
    world.run(1.5)
    assert layer["joint_states"].stage is Stage.RUNNING
