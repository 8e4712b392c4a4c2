"""The original's plugin of Listing 17 beside `ground_forces` in a shared plugin: it balances the ground's forces."""

import re
from contextlib import closing

import numpy as np
import pytest
from support.integration.world import CONFIG, ROBOT, World

from solfer import Robot
from solfer.config import load_shared
from solfer.middleware.memory import MemoryMiddleware
from solfer.plugins import PluginSet, PluginState, Registry, generate_shared
from solfer_tools.scene import LiveScene


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
        pressed = component.shaping.measure.balance()
        assert pressed is component.model.center_of_pressure.value
        # at rest it is below the centre of mass of the whole robot, which the locomotion does not know
        world.simulation.kinematics.update(world.simulation.q)
        now = world.simulation.state.now
        place = component.model.kinematics.position("pelvis")[:2]
        seen = now.rotation("pelvis").T @ (world.simulation.kinematics.center_of_mass - now.position("pelvis"))
        np.testing.assert_allclose(pressed[:2] - place, seen[:2], atol=0.03)


def test_a_scene_shows_what_margins_leave(file):
    """Each edge of a polygon with sides along x and y has its margin: front, right, left, rear."""
    margins = "    locomotion:\n      margins: [0.1, 0.15, 0.2, 0.12]\n"
    file.write_text(re.sub(r"    locomotion: +#.*\n", margins, file.read_text()))
    robot = Robot.load(ROBOT / "centauro.urdf", ROBOT / "centauro.srdf", contacts=ROBOT / "contacts.yaml")
    with closing(Shaped(file)) as world:
        scene = LiveScene(robot, MemoryMiddleware(world.bus, "scene"))
        world.run(1.5)
        scene.update()  # finds the topics
        world.run(0.1)
        state = scene.update()
    left, right, rear = (state.measured[f"wheel_{wheel}"].position for wheel in (1, 2, 3))
    expected = (left[0] - 0.1, right[1] + 0.15, left[1] - 0.2, rear[0] + 0.12)
    inner = state.inner
    found = (inner[:, 0].max(), inner[:, 1].min(), inner[:, 1].max(), inner[:, 0].min())
    np.testing.assert_allclose(found, expected, atol=1e-3)
