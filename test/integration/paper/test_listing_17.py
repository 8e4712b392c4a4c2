"""Listing 17 as printed: its five plugins, configured as in Fig. 5, drive CENTAURO as a node and as a layer."""

from contextlib import closing

import numpy as np
import pytest
import yaml
from support.integration.world import CONFIG, World
from support.paper.full_control import Driven, Layer

from solfer.config import load_shared
from solfer.middleware.memory import MemoryMiddleware
from solfer.plugins import PluginSet, PluginState, Registry
from solfer.plugins.shared import generate_shared
from solfer.transport.messages import FieldsMessage

RENAMED = {
    "upper_body_ik": "hands",
    "odometry": "odometry",
    "ground_forces": "ground_forces",
    "gravity_compensation": "full_compensation",
    "wheeled_motion": "locomotion",
}
"""Configurations of Fig. 5 by the names that Listing 17 has for them; their classes are those of its plugins."""


def write(folder, repository):
    """Write the main configuration and a layer of its shared plugin; return both."""
    tree = yaml.safe_load((CONFIG / "centauro.yaml").read_text())
    listing = yaml.safe_load((repository / "test/data/config/listing_17.yaml").read_text())
    modules = tree["mwoibn"]["modules"]
    chosen = {name: {k: v for k, v in modules[old].items() if k != "class"} for name, old in RENAMED.items()}
    tree["mwoibn"]["modules"] = chosen | listing
    main, layer = folder / "main.yaml", folder / "layer.yaml"
    for name in ("support", "robots"):
        (folder / name).symlink_to(CONFIG / name)
    main.write_text(yaml.safe_dump(tree, sort_keys=False))
    layer.write_text(
        "XBotRTPlugins: {plugins: [shared]}\nmwoibn: {config_file: {file: main.yaml}}\nexecutor: {start: [shared]}\n"
    )
    return main, layer


class Listed(Driven, World):
    """As a node does it."""

    def __init__(self, folder, files):
        super().__init__()
        self.run(0.5)
        registry = Registry()
        shared = load_shared(files[0], "shared", default=registry.configuration)
        members = generate_shared(shared.plugins, lambda each: MemoryMiddleware(self.bus, each.module.name), registry)
        together = PluginSet(members.plugins, polls=[members.sharing.turns.next], requires=members.requires)
        together.start()
        self.bus.every(1.0 / together.rate, lambda: together.cycle())
        self.plugins = {managed.name: managed.plugin for managed in together.plugins}


class ListedLayer(Layer):
    """As a real-time layer does it."""

    def __init__(self, folder, files):
        super().__init__(folder, files[1])


@pytest.mark.soak
@pytest.mark.parametrize("kind", [Listed, ListedLayer], ids=["node", "layer"])
def test_listing_17_drives(kind, tmp_path, repository):
    with closing(kind(tmp_path, write(tmp_path, repository))) as world:
        world.run(2.5)
        assert list(world.plugins) == list(RENAMED)
        begin, footprint = world.simulation.state.now.position("pelvis").copy(), world.footprint()
        state = MemoryMiddleware(world.bus, "navigation").writer("wheeled_motion/wheels_state", "solfer/WheelsState")
        for _ in range(100):
            state.write(FieldsMessage({"x": 0.1, "y": 0.0, "z": 0.0, "rz": 0.0, "cs": (), "cm": ()}))
            world.run(0.02)
        way = world.simulation.state.now.position("pelvis") - begin
        assert way[0] == pytest.approx(0.1 * 2.0, abs=0.05) and abs(way[1]) < 0.01
        np.testing.assert_allclose(world.footprint(), footprint, atol=0.02)
        assert {plugin.life for plugin in world.plugins.values()} == {PluginState.RUNNING}
