"""A simulation that begins anew under the RT layer: no burst, no step, and a start from what is measured."""

import numpy as np
import pytest
from support.integration.fault_layer import FaultLayer
from support.integration.world import STEP
from support.integration.xbot_world import XbotWorld

from solfer.plugins import PluginState
from solfer.realtime.executor import ExecutorRules
from solfer.simulation.server.services import ResetRequest
from solfer.transport.lower_level import Answer

PLUGIN, STATE = "joint_states", "mammal_wide_straight"
SETTLE, SILENCE = 0.1, 0.3
"""Bounds of the time in which nothing is commanded after a new beginning [s]."""

SAG = 0.05
"""How far springs have given way to the weight when the robot is measured [rad]."""


@pytest.fixture
def layer(tmp_path):
    world = XbotWorld(tmp_path)
    made = FaultLayer(world, tmp_path, [(PLUGIN,)], ExecutorRules(blend=0.5))
    made.begin_with(PLUGIN)
    yield made
    world.close()


class Ear:
    """Receives what a layer's plugin commands, and sees which stages it comes to.

    Attributes:
        stages: Stages that were reached.
        times: When each command was given [s].
        positions: Its positions [rad].
    """

    def __init__(self, layer):
        self.stages, self.times, self.positions = [], [], []
        self._run = layer.world.run
        self._queue = layer.node("ear").queue("position_controller/command", "solfer/JointCommand", 64)
        changed = layer[PLUGIN].changed

        def note(managed):
            self.stages.append(managed.state)
            changed(managed)

        layer[PLUGIN].changed = note

    def run(self, duration):
        """Let that time pass [s]."""
        for _ in range(round(duration / 0.01)):
            self._run(0.01)
            for message in self._queue.drain():
                self.times.append(message.stamp)
                self.positions.append(message.position)


def check_new_beginning(layer, ear, moment):
    """No command for a while; then one in each cycle, from where the robot is measured and without a step."""
    assert [stage for stage, before in zip(ear.stages, [None, *ear.stages], strict=False) if stage is not before] == [
        PluginState.STARTING,
        PluginState.RUNNING,
    ]
    times, positions = np.array(ear.times), np.array(ear.positions)
    later = times > moment + 1.0 / layer.executor.rate  # the cycle in which the plugin receives of it is the last one
    times, positions = times[later], positions[later]
    assert SETTLE <= times[0] - moment <= SILENCE
    np.testing.assert_allclose(np.diff(times), 1.0 / layer.executor.rate)
    assert np.abs(np.diff(positions, axis=0)).max() < 1e-6  # the motion of before is forgotten
    dofs = layer.world.simulation.lower_level.controllers["position_controller"].dofs
    assert np.abs(positions[-1] - layer.world.simulation.q[dofs]).max() < SAG
    assert not layer.turning()


def test_a_reset_is_one_event_for_plugins(layer):
    layer.move(PLUGIN)
    ear, asker = Ear(layer), layer.node("asker")
    ear.run(0.05)
    assert ear.times and not ear.stages
    answer = asker.request("simulator/reset", "solfer/ResetSimulation", ResetRequest(state=STATE), Answer, 5.0)
    while not answer.done():
        layer.world.run(STEP)
        asker.poll()
    assert answer.result().success
    moment = layer.world.bus.time
    ear.run(1.5)
    check_new_beginning(layer, ear, moment)
    layer.move(PLUGIN)  # it obeys as before


@pytest.mark.soak
def test_time_going_back_is_one_event(layer):
    layer.move(PLUGIN)
    ear = Ear(layer)
    ear.run(0.05)
    layer.node("another_simulator").publish_time(0.0)
    moment = layer.world.bus.time
    ear.run(1.5)
    check_new_beginning(layer, ear, moment)
    layer.move(PLUGIN)
