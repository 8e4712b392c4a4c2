"""The original's plugin of Listing 17 beside `ground_forces` in a shared plugin: it balances the ground's forces."""

import re
from contextlib import closing

import numpy as np
import pytest
from support.integration.world import CONFIG, World

from solfer.config import load_shared
from solfer.middleware.memory import MemoryMiddleware
from solfer.plugins import PluginSet, PluginState, Registry
from solfer.plugins.shared import generate_shared


class Shaped(World):
    """Fig. 5 with `NwheelsZMPII` for the locomotion."""

    def __init__(self, file):
        super().__init__()
        self.run(1.0)
        registry = Registry()
        shared = load_shared(file, "full_control", default=registry.configuration)
        members = generate_shared(shared.plugins, lambda each: MemoryMiddleware(self.bus, each.module.name), registry)
        together = PluginSet(members.plugins, polls=[members.sharing.turns.next], requires=members.requires)
        together.start()
        self.bus.every(1.0 / together.rate, lambda: together.cycle())
        self.plugins = {managed.name: managed.plugin for managed in together.plugins}


@pytest.fixture
def file(tmp_path):
    text = (CONFIG / "centauro.yaml").read_text().replace("wheeled_motion::locomotion", "NwheelsZMPII::locomotion")
    text = text.replace("      class: solfer.components.wheeled_motion:WheeledMotion\n", "")
    path = tmp_path / "main.yaml"
    path.write_text(re.sub(r"file: (support|robots)/", rf"file: {CONFIG}/\1/", text))
    return path


def test_it_balances_the_pressure_of_the_ground(file):
    """At rest the centre of pressure lies below the whole robot's centre of mass, which the simulator knows."""
    with closing(Shaped(file)) as world:
        queue = MemoryMiddleware(world.bus, "listener").queue(
            "locomotion/support_margins", "solfer/SupportMargins", 100
        )
        world.run(2.0)
        locomotion = world.plugins["locomotion"]
        assert locomotion.life is PluginState.RUNNING
        message = queue.drain()[-1]
        assert len(message.fields["names"]) == 8 and not message.fields["infeasible"]
        component = locomotion.component
        pressed = component._balance()
        assert pressed is component.model.center_of_pressure.value
        # at rest it is below the centre of mass of the whole robot, which the locomotion does not know
        world.simulation.kinematics.update(world.simulation.q)
        now = world.simulation.state.now
        place = component.model.kinematics.position("pelvis")[:2]
        seen = now.rotation("pelvis").T @ (world.simulation.kinematics.center_of_mass - now.position("pelvis"))
        np.testing.assert_allclose(pressed[:2] - place, seen[:2], atol=0.03)
