"""The policy of `examples/policy` keeps CENTAURO's pelvis level, while another plugin moves its hands."""

import importlib
import re
import subprocess
import sys
from contextlib import closing
from types import SimpleNamespace

import numpy as np
import pytest
from support.integration.world import CONFIG, World, perfect

from solfer.components.policy.network import PolicyNetwork
from solfer.plugins import PluginState
from solfer.policy import write_layers
from solfer.simulation import Simulation, SimulationServer

pytest.importorskip("onnxruntime", reason="needs pip install -r requirements-policy.txt")

EXAMPLE = CONFIG.parent / "examples/policy"
WAY = (0.05, 0.05, 0.1)  # [m]


class Slope(World):
    """CENTAURO on the plane that rises by 5 degrees along x, as it is shipped."""

    def offer(self, middleware):
        simulation = Simulation.from_file(perfect(), world=CONFIG / "worlds/slope.yaml")
        return simulation, SimulationServer(simulation, middleware)

    @property
    def tilt(self):
        """Tilt of the pelvis [degrees]."""
        return np.degrees(np.arccos(self.simulation.state.now.rotation("pelvis")[2, 2]))


def hand(world):
    """Return where the left hand is, in axes of the pelvis."""
    now = world.simulation.state.now
    return now.rotation("pelvis").T @ (now.position("arm1_7") - now.position("pelvis"))


def test_legs_level_the_pelvis_while_hands_move():
    """Two plugins command the joints of one controller: the policy the legs, inverse kinematics the arms.

    The legs let the pelvis sway by a degree, and the hand with it, by 2 cm about its target.
    """
    with closing(Slope()) as world:
        hands = world.plugin("manipulation")
        world.run(0.5)
        tilted = world.tilt
        legs = world.plugin("level", EXAMPLE / "level.yaml")
        world.run(1.5)
        start = hand(world)
        assert world.ask("manipulation/reference", task="left", values=WAY, relative=True).success
        world.run(1.5)
        assert legs.life is hands.life is PluginState.RUNNING and not legs.component.fault
        ways = []
        for _ in range(40):
            world.run(0.05)
            ways.append(hand(world) - start)
        assert np.mean(ways, axis=0) == pytest.approx(WAY, abs=0.015)
        assert tilted == pytest.approx(5.0, abs=0.3) and world.tilt < 0.5 * tilted


@pytest.fixture
def level(monkeypatch):
    """Import the example."""
    monkeypatch.syspath_prepend(str(EXAMPLE))
    return importlib.import_module("level")


def test_an_iteration_of_training_runs(level, tmp_path, monkeypatch):
    """It moves the weights, and what it writes is the network of these weights, as the plugin would run it."""
    monkeypatch.setattr(level, "PAIRS", 1)
    weights = level.train(SimpleNamespace(imap=map), 1.0, 1, seed=1)
    assert np.isfinite(weights).all() and np.abs(weights).max() < 5.0
    network = PolicyNetwork(write_layers(tmp_path / "level.onnx", level.layers(weights)))
    network.observations[:] = observed = np.random.default_rng(1).normal(size=4)
    network.run()
    assert network.actions == pytest.approx(level.acting(weights)(observed), abs=1e-5)


@pytest.mark.soak
def test_training_levels_the_pelvis(tmp_path):
    """What ten minutes of training on two processors make of 5 degrees, in episodes that it does not have."""
    command = [sys.executable, str(EXAMPLE / "level.py"), "--output", str(tmp_path / "level.onnx")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=1200, check=False)
    assert done.returncode == 0, done.stderr
    means = [float(mean) for mean in re.findall(r"mean ([\d.]+)", done.stdout)]
    assert len(means) == 4 and means[1] < 0.6 * means[0] and means[3] < 0.6 * means[2], done.stdout
