"""`wheeled_motion` from one configuration: an RT layer commands what the memory middleware does."""

from contextlib import closing

import numpy as np
import pytest
from support.shared.driving import LAST, LISTED, DrivesInLayer, DrivesInMemory, write_driving
from support.shared.middlewares import STEP, write_layer

from solfer.plugins import PluginState

pytestmark = pytest.mark.soak

LEGS = ("hip_yaw", "hip_pitch", "knee_pitch", "ankle_pitch", "ankle_yaw", "j_wheel")


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
