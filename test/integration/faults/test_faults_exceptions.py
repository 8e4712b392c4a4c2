"""Components that raise what is meant to end a program, or what cannot even be described; on a virtual clock."""

import numpy as np
import pytest
import yaml
from support.integration.fault_layer import AT_ONCE, LARGEST_STEP, PLUGIN, FaultLayer, moving
from support.plugins.plugin import configuration

from solfer.components.joint_states import JointStates
from solfer.config import load
from solfer.errors import ComponentError
from solfer.interfaces.declaration import Service
from solfer.middleware.memory import MemoryMiddleware
from solfer.plugins import PluginState, Registry, generate, run
from solfer.telemetry.statistics import LoopCount
from solfer.transport.lower_level import Answer
from solfer.transport.middleware import TRIGGER, NoFields

OTHER = "other"
"""A plugin of the same layer that commands nothing."""


class Mute(BaseException):
    """An exception without a description."""

    def __str__(self):
        raise KeyboardInterrupt


MUTE = "Mute, whose text cannot be made: KeyboardInterrupt"
SAID = {Mute: MUTE, **{fault: f"{fault.__name__}: 0" for fault in (SystemExit, KeyboardInterrupt, GeneratorExit)}}
CASES = [
    *((step, Mute) for step in ("init", "update", "send", "reset", "stop", "close", "handler", "prepare")),
    ("update", SystemExit),
    ("update", KeyboardInterrupt),
    ("send", GeneratorExit),
    ("handler", SystemExit),
]
"""A step, and what is raised in it."""


class Fallible(JointStates):
    """Raises `fault` in one step of its life, or in one part of a service."""

    step, fault = "", SystemExit

    def _do(self, step):
        if step == self.step:
            raise self.fault(0)

    def init(self):
        self._do("init")
        super().init()

    def update(self):
        self._do("update")
        super().update()

    def send(self):
        self._do("send")
        super().send()

    def reset(self):
        self._do("reset")

    def stop(self):
        self._do("stop")
        super().stop()

    def close(self):
        self._do("close")

    def services(self):
        return (Service("fail", TRIGGER, NoFields, Answer, self._handle, prepare=self._prepare),)

    def _prepare(self, request):
        self._do("prepare")
        return request

    def _handle(self, request):
        self._do("handler")
        return Answer()


@pytest.fixture
def layer(shared, tmp_path):
    """Run a layer with a plugin that moves the robot, and another one."""
    file = moving(tmp_path)
    root = yaml.safe_load(file.read_text())
    root["mwoibn"]["modules"][OTHER] = root["mwoibn"]["modules"][PLUGIN] | {"mode": "idle"}
    file.write_text(yaml.safe_dump(root))
    made = FaultLayer(shared, tmp_path, [(PLUGIN, file, f"{__name__}:Fallible"), (OTHER, file)])
    made.begin_with(OTHER)
    return made


def provoke(layer, step):
    """Let a step of the component's life come; the reply where it is one to a request."""
    world, statistics = layer.world, layer.executor.switchboard
    if step == "stop":
        statistics.commit(statistics.plan(stop=[PLUGIN]))
    elif step == "close":
        layer.executor.close()
    elif step == "reset":
        world.simulation.reset()
    elif step in ("handler", "prepare"):
        asker = layer.node("asker")
        reply = asker.request(f"{PLUGIN}/fail", TRIGGER, NoFields(), Answer, 1.0)
        world.run(0.3)
        asker.poll()
        return reply.result(0)
    world.run(0.3)
    return None


@pytest.mark.daily(2)
@pytest.mark.parametrize(("step", "fault"), CASES)
def test_whatever_a_component_raises_ends_its_plugin_alone(layer, step, fault):
    """SystemExit and the like, in any step, abort one plugin: its joints come to rest, the other plugin runs on."""
    managed, component = layer[PLUGIN], layer[PLUGIN].plugin.component
    component.step, component.fault = (step if step == "init" else ""), fault
    layer.begin_with(until=PluginState.ABORTED if step == "init" else PluginState.RUNNING)
    moment = 0.0 if step == "init" else layer.move()
    component.step = step
    cycles = layer.executor.statistics.counts[LoopCount.CYCLES]
    reply = provoke(layer, step)
    assert (
        managed.state is (PluginState.FAULT if step == "close" else PluginState.ABORTED)
        and SAID[fault] in managed.reason
    )
    assert reply is None or (not reply.success and SAID[fault] in reply.message)
    if step == "close":
        assert layer[OTHER].plugin.life is PluginState.CLOSED
    else:
        assert (
            layer[OTHER].state is PluginState.RUNNING
            and layer.executor.statistics.counts[LoopCount.CYCLES] > cycles + 50
        )
    layer.world.run(0.3)
    simulation = layer.world.simulation
    assert not simulation.lower_level.claims.owners() and np.abs(simulation.v[layer.wheels]).max() < 0.05
    if step in ("update", "send", "stop", "close"):
        assert layer.cycles_until_rest(moment) <= AT_ONCE and layer.largest_step(moment) <= LARGEST_STEP


@pytest.mark.daily(2)
@pytest.mark.parametrize(
    ("step", "fault"),
    [
        ("update", Mute),
        ("update", KeyboardInterrupt),
        ("close", SystemExit),
        ("handler", SystemExit),
        ("prepare", Mute),
        ("stop", SystemExit),
    ],
)
def test_a_plugin_alone_ends_and_names_its_component(world, tmp_path, monkeypatch, step, fault):
    """Without an executor the error carries the component's own text, and the wheels are commanded to zero."""
    monkeypatch.setattr(Fallible, "step", step)
    monkeypatch.setattr(Fallible, "fault", fault)
    plugin = generate(
        load(configuration(tmp_path), "test"),
        MemoryMiddleware(world.bus, "test"),
        Registry().find("test", f"{__name__}:Fallible"),
    )
    replies, asked = [], step in ("handler", "prepare")
    world.bus.every(1.0, lambda: asked and replies.append(world.bus.call("test/fail")), start=0.5)
    world.bus.every(1.0, lambda: setattr(world.bus, "ended", not asked), start=0.6)
    with pytest.raises(ComponentError, match="'test' failed, the robot holds") as caught:
        run(plugin, MemoryMiddleware(world.bus, "test"))
    assert caught.value.exit_code == 1 and SAID[fault] in str(caught.value) and plugin.life is PluginState.CLOSED
    assert not asked or isinstance(replies[0].exception(0), fault)
    assert not world.simulation.lower_level.controllers["velocity_controller"].velocity.any()


@pytest.mark.daily(1)
@pytest.mark.parametrize(("method", "what"), [("__init__", "be made"), ("services", "list its services")])
def test_a_component_that_cannot_be_made_is_named(world, tmp_path, monkeypatch, method, what):
    def leave(*_):
        raise SystemExit(0)

    monkeypatch.setattr(Fallible, method, leave)
    with pytest.raises(ComponentError, match=rf"Fallible of 'test' cannot {what}: SystemExit: 0") as caught:
        world.plugin("test", configuration(tmp_path), f"{__name__}:Fallible")
    assert caught.value.exit_code == 2 and "configuration.yaml:" in caught.value.where
