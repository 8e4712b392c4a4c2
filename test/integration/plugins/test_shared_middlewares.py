"""The shared plugin of Fig. 5 from one configuration: an RT layer sends what the memory middleware does."""

from contextlib import closing

import numpy as np
import pytest
from support.shared.middlewares import BLEND, LISTED, InLayer, InMemory, requests, write_layer, write_listed

from solfer.plugins import PluginState

FREE = ("neck_velodyne",)
"""Joints that nobody asks to move: the sensor's."""


@pytest.fixture(scope="module")
def worlds(tmp_path_factory):
    folder = tmp_path_factory.mktemp("shared")
    file = write_listed(folder)
    with closing(InMemory(file)) as memory, closing(InLayer(write_layer(file, memory.set.rate), folder)) as layer:
        motions = requests(memory.positions())
        for world in (memory, layer):
            world.move(motions)
        yield memory, layer


def test_layer_sends_what_memory_sends(worlds):
    memory, layer = worlds
    assert layer.names == memory.names and len(layer.sent) == len(memory.sent) > 200
    np.testing.assert_allclose(layer.sent, memory.sent, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(layer.simulation.q, memory.simulation.q, rtol=0.0, atol=1e-9)


def test_layer_runs_the_listed_in_order(worlds):
    for world in worlds:
        assert [(each.name, each.state) for each in world.set.plugins] == [(n, PluginState.RUNNING) for n in LISTED]


def test_every_commanded_joint_moves(worlds):
    memory, _ = worlds
    moved = np.ptp(memory.sent[round(BLEND * memory.set.rate) :], axis=0)
    commanded = {
        name[3]: distance
        for name, distance in zip(memory.names, moved, strict=True)
        if name[:3] == ("compensation", "position_controller", "position") and name[3] not in FREE
    }
    assert len(commanded) == 37 and min(commanded.values()) > 0.1
