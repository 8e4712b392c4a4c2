"""Fig. 5 of the paper, its two layers: a plugin outside and a plugin in the RT layer share the robot over the bridge.

Everything is as it is shipped: config/xbot_shared_control.yaml in shared memory, `upper_body` of config/centauro.yaml
outside.
"""

import numpy as np
import pytest
from support.integration.bridged import BridgedWorld
from support.integration.world import CONFIG

from solfer.components.move_joints import MoveJoints
from solfer.config.loading.rt_layer import read_layer
from solfer.plugins import PluginState, Registry, generate
from solfer.realtime.emergency_stop import EmergencyStopLatch
from solfer.realtime.executor import Executor, ExecutorTelemetry

LEGS = "mammal_wide_high"
UPPER = {"torso_yaw": 0.3, "neck_pitch": 0.2}  # [rad]


class Layers:
    """The layer under its executor, the plugin outside, and the robot."""

    def __init__(self, folder):
        registry = Registry()
        layer = read_layer(CONFIG / "xbot_shared_control.yaml", registry.configuration)
        listed = layer.load()
        self.world = BridgedWorld(folder, [each.configuration for each in listed])
        nodes, plugins = [], []
        for each in listed:
            nodes.append(self.world.node(each.plugin))
            generator = registry.find(each.plugin, each.configuration.module.class_)
            plugins.append(generate(each.configuration, nodes[-1], generator))
        bus = self.world.bus
        self.executor = Executor(
            plugins,
            self.world.node("xbot"),
            EmergencyStopLatch(folder),
            polls=[node.poll for node in nodes],
            telemetry=ExecutorTelemetry(nanoseconds=lambda: round(1e9 * bus.time)),
        )
        self.executor.switchboard.commit(self.executor.switchboard.plan(layer.executor.start))
        bus.every(1.0 / self.executor.rate, self.executor.cycle)

    def stages(self):
        """Stages of the plugins of the layer."""
        return [managed.state for managed in self.executor.plugins]

    def ask(self, plugin, request):
        """Ask for a motion from outside, and let it be carried out."""
        reply = self.world.bus.call(f"{plugin}/trajectory", request)
        self.world.run(0.02)
        assert reply.result(0).success, reply.result(0).message
        self.world.run(reply.result(0).duration + 0.5)


@pytest.fixture
def layers(tmp_path):
    layers = Layers(tmp_path)
    yield layers
    layers.world.close()


@pytest.mark.soak
def test_outside_references_are_merged_in_the_layer(layers):
    """Both bodies reach their goals across the bridge; once nothing crosses it any more, the posture is held."""
    world = layers.world
    assert layers.executor.rate == 500.0
    world.run(2.1)
    assert layers.stages() == [PluginState.RUNNING, PluginState.STARTING]  # the upper body has no references yet
    outside = world.outside("upper_body")
    world.run(2.5)
    assert layers.stages() == [PluginState.RUNNING] * 2 and outside.life is PluginState.RUNNING
    layers.ask("upper_body", MoveJoints(joints=tuple(UPPER), positions=tuple(UPPER.values())))
    layers.ask("lower_body", MoveJoints(state=LEGS))
    whole = layers.executor.plugins[1].plugin.robot
    published = [whole.command.position[whole.dof(joint)] for joint in UPPER]
    np.testing.assert_allclose(published, list(UPPER.values()), atol=1e-9)
    reached = [world.simulation.q[whole.dof(joint)] for joint in UPPER]
    np.testing.assert_allclose(reached, list(UPPER.values()), atol=0.02)
    indices, goal = layers.executor.plugins[0].plugin.robot.named_state(LEGS)
    assert np.abs(layers.executor.plugins[0].plugin.robot.state.position[indices] - goal).max() < 0.04
    crossing = world.bridge.crossings["upper_body"]
    assert crossing.passed > 500 and crossing.refused == 0

    world.bridge.cycle = lambda: None  # from now on nothing crosses the border
    before = world.simulation.q.copy()
    world.run(1.0)
    assert layers.stages() == [PluginState.RUNNING] * 2
    joints = [whole.dof(joint) for joint in whole.dofs if not joint.startswith("j_wheel")]
    assert np.abs(world.simulation.q - before)[joints].max() < 5e-3
