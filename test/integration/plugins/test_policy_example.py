"""The policy of `examples/policy` keeps CENTAURO's pelvis level, while another plugin moves its hands."""

import sys
from contextlib import closing

import numpy as np
import pytest
from support.integration.world import CONFIG, World, perfect

from solfer.plugins import PluginState
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
    """Two plugins command the joints of one controller: the policy the legs, inverse kinematics the arms."""
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
        assert hand(world) - start == pytest.approx(WAY, abs=0.01)
        assert tilted == pytest.approx(5.0, abs=0.3) and world.tilt < 0.5 * tilted


@pytest.mark.slow
def test_an_iteration_of_training_is_an_improvement(tmp_path, capfd):
    """A network of one iteration is a file that the plugin could run, and figures are printed."""
    import subprocess

    command = [sys.executable, str(EXAMPLE / "level.py"), "--iterations", "1", "--episodes", "1"]
    done = subprocess.run(
        [*command, "--output", str(tmp_path / "level.onnx")], capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "5 degrees, with:" in done.stdout and (tmp_path / "level.onnx").stat().st_size > 500
