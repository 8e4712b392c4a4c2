"""The base class of components (Listing 15 of the paper), and what a plugin does for its flags."""

import inspect
from pathlib import Path

import pytest
from numpy.testing import assert_allclose
from support.unit.cart import URDF

from solfer import Robot
from solfer.components import Component
from solfer.config import load
from solfer.dynamics import BIAS, INERTIA
from solfer.errors import ComponentError
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.plugins import Plugin, PluginParts, PluginState
from solfer.plugins.generation.generator import Generator
from solfer.plugins.outputs.outputs import Outputs
from solfer.plugins.outputs.start_blend import StartBlend
from solfer.transport import Inbox

CONFIGURATION = Path(__file__).parents[3] / "config/centauro.yaml"
RATE = 250.0  # [Hz]

LISTING_15 = {
    "init": [],
    "update": [],
    "send": [],
    "stop": [],
    "close": [],
    "set_rate": ["rate"],
    "start_log": ["logger"],
    "log": ["logger", "time"],
}
"""Methods and their parameters."""


class Probe(Component):
    """Notes its calls, and the positions of the arm's link and the dynamics in each `update`."""

    def __init__(self, robot, tags=None, name=""):
        super().__init__(robot, tags, name)
        self.calls, self.heights = [], []
        self.writes = False

    def init(self):
        self.calls.append("init")

    def update(self):
        self.calls.append("update")
        self.heights.append(self.model.kinematics.position("arm")[2])
        if self.writes:
            self.model.state.position[2] += 1.0

    def send(self):
        self.calls.append("send")

    def stop(self):
        self.calls.append("stop")

    def close(self):
        self.calls.append("close")


@pytest.fixture
def robot():
    return Robot.load(URDF)


@pytest.fixture
def run(robot):
    """Return a function that runs a Probe on the cart for some cycles; each begins with the base 1 m higher."""

    def cycles(count=1, **flags):
        probe = Probe(robot)
        for name, value in flags.items():
            setattr(probe, name, value)
        outputs = Outputs([], StartBlend("probe", [], robot, RATE), robot, 1.0 / RATE)
        plugin = Plugin(PluginParts(probe, robot, [], outputs, Inbox(), RATE, MemoryMiddleware(Bus())))
        for _ in range(count):
            robot.state.position[2] += 1.0
            plugin.cycle()
        return probe, plugin

    return cycles


def test_listing_15_is_the_interface_of_components(robot):
    for name, parameters in LISTING_15.items():
        assert list(inspect.signature(getattr(Component(robot), name)).parameters) == parameters
    component = Component(robot, name="my_component")
    assert component.model is robot and component.name == "my_component"
    assert (component.kinematics, component.dynamics, component.modify) == (True, False, False)


def test_the_interface_without_an_algorithm_does_nothing(robot):
    component, before = Component(robot), robot.command.position.copy()
    component.set_rate(RATE)
    for name in ("init", "reset", "update", "send", "stop", "close"):
        assert getattr(component, name)() is None
    component.start_log(None)
    component.log(None, 0.0)
    assert not component.services() and component.name == "Component"
    assert_allclose(robot.command.position, before)


def test_a_plugin_calls_the_steps_in_their_order(run):
    probe, plugin = run(count=2)
    assert plugin.life is PluginState.RUNNING and plugin.name == "Probe"
    plugin.stop()
    plugin.close()
    assert probe.calls == ["init", "update", "send", "update", "send", "stop", "send", "close"]


def test_the_rate_sets_the_period(robot):
    component = Component(robot)
    component.set_rate(RATE)
    assert component.period == pytest.approx(0.004)


@pytest.mark.parametrize("rate", [0.0, -100.0, float("nan"), float("inf")])
def test_a_rate_has_to_be_positive(robot, rate):
    component = Component(robot, name="mover")
    with pytest.raises(ComponentError, match="'mover' at a rate of"):
        component.set_rate(rate)
    assert component.period == 0.0


def test_kinematics_are_up_to_date_in_each_update(run):
    assert_allclose(run(count=3, kinematics=True)[0].heights, (1.0, 2.0, 3.0))


def test_without_the_flag_kinematics_stay(run):
    assert_allclose(run(count=3, kinematics=False)[0].heights, (1.0, 1.0, 1.0))


@pytest.mark.parametrize("modify", [True, False])
def test_the_next_reader_computes_what_was_changed(run, robot, modify):
    run(writes=True, modify=modify)
    assert robot.state.position[2] == 2.0
    assert_allclose(robot.kinematics.position("arm")[2], 1.0)
    assert robot.update() and not robot.update()
    assert_allclose(robot.kinematics.position("arm")[2], 2.0)


@pytest.mark.parametrize("dynamics, computed", [(True, 3), (False, 0)])
def test_subscribed_dynamics_are_computed_before_each_update(run, robot, dynamics, computed):
    robot.dynamics.subscribe(INERTIA)
    run(count=3, dynamics=dynamics)
    assert robot.dynamics.manager.computed(INERTIA) == computed
    assert robot.dynamics.manager.computed(BIAS) == 0


def test_dynamics_bring_the_kinematics_along(run):
    assert_allclose(run(count=2, kinematics=False, dynamics=True)[0].heights, (1.0, 2.0))


def test_users_of_a_robot_share_its_dynamics(robot):
    assert robot.dynamics is robot.dynamics
    expected = dict.fromkeys(robot.dofs, 0.0) | {"x": 8.0, "ry": -1.0, "shoulder": -1.0}
    assert_allclose(robot.dynamics.inertia[0], list(expected.values()), atol=1e-12)


@pytest.mark.parametrize("module", ["joint_states", "whole_body"])
def test_flags_and_rate_come_from_the_configuration(robot, module):
    class Offering(Generator):
        component = Probe

    configuration = load(CONFIGURATION, module)
    component = Offering(configuration, None).make_component(robot)
    record = configuration.module
    assert (component.name, component.period) == (module, pytest.approx(1.0 / configuration.rate))
    assert (component.kinematics, component.dynamics, component.modify) == (
        record.kinematics,
        record.dynamics,
        record.model_change,
    )
