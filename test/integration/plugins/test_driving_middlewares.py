"""`wheeled_motion` from one configuration: an RT layer commands what the memory middleware does."""

from contextlib import closing

import numpy as np
import pytest
import yaml
from support.integration.world import CONFIG
from support.shared.figure_5 import tree, write
from support.shared.middlewares import BEGIN, BLEND, STEP, InLayer, InMemory, write_layer

from solfer.components.wheeled_motion import WheeledMotion
from solfer.components.wheeled_motion.targets import WheelsSupport
from solfer.interfaces.geometry import Twist, Vector
from solfer.plugins import PluginState

pytestmark = pytest.mark.soak

LISTED = ("odometry", "driver")
"""The plugins, in the order of their cycles."""

PLAN = (
    (60, (0.15, 0.0, 0.0), 0.0),
    (240, (0.1, 0.1, 0.2), -0.02),
    (500, (0.0, -0.1, -0.3), 0.02),
    (760, (0.0, 0.0, 0.0), 0.0),
)
"""From a cycle on: velocity of the base and rate of its heading [m/s, rad/s], and speed of the vertices to the sides
[m/s]."""

FILTERS = {
    "filter": {"cut_off_frequency": 200, "damping": 1.0, "unit": "rad/s"},
    "velocity": {"cut_off_frequency": 200, "damping": 4.0, "unit": "rad/s"},
}
"""Of the odometry, the same in every layer."""

EVERY = 10
"""Cycles between two messages."""

LAST = 4600
"""Last step of the simulation that is compared."""

LEGS = ("hip_yaw", "hip_pitch", "knee_pitch", "ankle_pitch", "ankle_yaw", "j_wheel")


class PlannedDrive(WheeledMotion):
    """The component, which gets the messages of PLAN by itself: in the same cycles on every middleware."""

    def init(self):
        super().init()
        self._cycles = 0

    def update(self):
        self._cycles += 1
        now = [part for part in PLAN if part[0] <= self._cycles]
        if now and self._cycles % EVERY == 0:
            _, (x, y, turn), wider = now[-1]
            self.drive.receive(Twist(Vector(x, y), Vector(z=turn)))
            self.targets.receive(WheelsSupport(velocity=(0.0, wider, 0.0, 0.0, -wider, 0.0) * 2))
        super().update()


def write_driving(folder):
    """Write the configuration of all middlewares, and return the file."""
    shipped = tree()["mwoibn"]["modules"]["wheeled_motion"]
    legs = {"secondary_file": {"file": str(CONFIG / "support" / "lower_body.yaml")}}
    driver = shipped | legs | {"class": f"{__name__}:PlannedDrive", "blend": BLEND}
    part = yaml.safe_load((CONFIG / "support" / "odometry.yaml").read_text())
    part["mwoibn"].setdefault("modules", {})["odometry"] = FILTERS
    secondary = folder / "odometry.yaml"
    secondary.write_text(yaml.safe_dump(part))
    return write(
        folder,
        driver=driver,
        odometry={"blend": BLEND, "secondary_file": {"file": str(secondary)}},
        shared={"plugins": ["odometry3::odometry", "driver"]},
    )


class Drives:
    """What both worlds have."""

    listed = LISTED

    def drive(self):
        """Let the plan be carried out."""
        self.bus.run_until(BEGIN + (LAST + 0.25) * STEP)


class DrivesInMemory(Drives, InMemory):
    """On a bus, the plugins of a file."""


class DrivesInLayer(Drives, InLayer):
    """In shared memory, under the executor of a layer's file."""


@pytest.fixture(scope="module")
def worlds(tmp_path_factory):
    folder = tmp_path_factory.mktemp("driving")
    file = write_driving(folder)
    with (
        closing(DrivesInMemory(file)) as memory,
        closing(DrivesInLayer(write_layer(file, memory.set.rate), folder)) as layer,
    ):
        for world in (memory, layer):
            world.drive()
        yield memory, layer


def test_layer_commands_what_memory_commands(worlds):
    memory, layer = worlds
    assert layer.names == memory.names and len(layer.sent) == len(memory.sent) >= LAST * STEP * memory.set.rate - 1
    np.testing.assert_allclose(layer.sent, memory.sent, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(layer.simulation.q, memory.simulation.q, rtol=0.0, atol=1e-9)


def test_the_plan_drives_all_joints(worlds):
    memory, _ = worlds
    assert [(each.name, each.state) for each in memory.set.plugins] == [(n, PluginState.RUNNING) for n in LISTED]
    moved = dict(zip(memory.names, np.ptp(memory.sent, axis=0), strict=True))
    legs = [name for name in moved if name[0] == "driver" and name[3].startswith(LEGS)]
    commanded = [moved[name] for name in legs if name[2] == ("velocity" if "wheel" in name[3] else "position")]
    assert len(commanded) == 24 and min(commanded) > 0.01
    x, y, _, _, _, heading = memory.simulation.q[:6]
    assert np.hypot(x, y) > 0.1 and abs(heading) > 0.05
