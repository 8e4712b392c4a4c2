"""Listing 17 as printed, which the shipped configuration contains: its five plugins drive CENTAURO and move a hand."""

from contextlib import closing

import numpy as np
import pytest
from support.integration.world import CONFIG, World
from support.paper.full_control import Driven, Figure5Layer

from solfer.config import load_shared
from solfer.middleware.memory import MemoryMiddleware
from solfer.plugins import PluginSet, PluginState, Registry, generate_shared
from solfer.transport.messages import FieldsMessage

LISTED = ["upper_body_ik", "odometry", "ground_forces", "gravity_compensation", "wheeled_motion"]
DURATION, SPEED, LIFT = 5.0, 0.1, 0.1
"""Time of driving [s], its speed [m/s], and the way of a hand upwards [m]."""


class Listed(Driven, World):
    """As a node does it."""

    def __init__(self, _folder):
        super().__init__()
        self.run(0.5)
        registry = Registry()
        shared = load_shared(CONFIG / "centauro.yaml", "shared", default=registry.configuration)
        members = generate_shared(shared.plugins, lambda each: MemoryMiddleware(self.bus, each.module.name), registry)
        together = PluginSet(members.plugins, polls=[members.sharing.turns.next], requires=members.requires)
        together.start()
        self.bus.every(1.0 / together.rate, lambda: together.cycle())
        self.plugins = {managed.name: managed.plugin for managed in together.plugins}


class ListedLayer(Figure5Layer):
    """As a real-time layer does it."""

    def __init__(self, folder):
        layer = folder / "layer.yaml"
        layer.write_text(
            f"XBotRTPlugins: {{plugins: [shared]}}\nmwoibn: {{config_file: {{file: {CONFIG / 'centauro.yaml'}}}}}\n"
            "executor: {start: [shared]}\n"
        )
        super().__init__(folder, layer)
        for plugin in self.plugins.values():
            self.offers(plugin)


@pytest.mark.daily(1)
@pytest.mark.parametrize("kind", [Listed, ListedLayer], ids=["node", "layer"])
def test_listing_17_drives_and_moves_a_hand(kind, tmp_path):
    """The way, the footprint and the hand are measured in the simulation, on Robots of the whole body and the legs."""
    with closing(kind(tmp_path)) as world:
        world.run(2.5)
        assert list(world.plugins) == LISTED
        assert len({id(plugin.robot) for plugin in world.plugins.values()}) > 1
        begin, footprint = world.simulation.state.now.position("pelvis").copy(), world.footprint()
        hand = world.hands()["left"]
        navigation = MemoryMiddleware(world.bus, "navigation")
        state = navigation.writer("wheeled_motion/wheels_state", "solfer/WheelsState")
        assert world.ask("upper_body_ik/ub_reference", z=LIFT).success
        for _ in range(round(DURATION / 0.02)):
            state.write(FieldsMessage({"x": SPEED, "y": 0.0, "z": 0.0, "rz": 0.0, "cs": (), "cm": ()}))
            world.run(0.02)
        way = world.simulation.state.now.position("pelvis") - begin
        assert way[0] == pytest.approx(SPEED * DURATION, rel=0.05) and abs(way[1]) < 0.01
        np.testing.assert_allclose(world.footprint(), footprint, atol=0.02)
        np.testing.assert_allclose(world.hands()["left"] - hand, [0.0, 0.0, LIFT], atol=0.02)
        assert {plugin.life for plugin in world.plugins.values()} == {PluginState.RUNNING}
