"""What trains a policy and what runs it are one definition: `Environment` beside the plugin, on CENTAURO."""

from contextlib import closing
from functools import partial

import numpy as np
import pytest
from support.integration.world import CONFIG, ROBOT, World, perfect
from support.plugins.policies import POLICY, file_of, legs

from solfer.policy import Environment, Environments
from solfer.simulation import Rates, Simulation, SimulationServer

pytest.importorskip("onnxruntime", reason="needs pip install -r requirements-policy.txt")

TORQUES = {"file": str(CONFIG / "support/torques.yaml")}
GAINS = {"gains": {"stiffness": 2000.0, "damping": 50.0}, "secondary_file": TORQUES}


class PromptWorld(World):
    """A World whose sensors measure and publish in each millisecond, as an environment measures."""

    def offer(self, middleware):
        simulation = Simulation.from_file(perfect())
        return simulation, SimulationServer(simulation, middleware, Rates(joints=1000.0, base=1000.0, imu=1000.0))


def upright(environment):
    """Return how upright the base is."""
    return float(np.cos(environment.tilt)), environment.tilt > 0.5


def draw(environment):
    """Draw masses, friction, a push and a velocity."""
    random = environment.random
    environment.scale_masses(float(random.choice((0.9, 1.1))))
    environment.simulation.set_friction("ground", random.uniform(0.5, 1.0))
    environment.simulation.pushes.add("pelvis", random.uniform(-300.0, 300.0, 3), np.zeros(3), 0.5)
    environment.velocity[:] = random.uniform(-0.1, 0.1, 3)


def made(file, **options):
    return Environment(file, "test", ROBOT / "robot.yaml", upright, **options)


@pytest.mark.parametrize("springs", ["lower_level", "plugin"])
def test_observations_and_targets_are_the_plugins(tmp_path, springs, monkeypatch):
    """The environment's robot is where that of the plugin is, in each millisecond: then all numbers are the same."""
    weights = np.random.default_rng(1).normal(scale=0.01, size=(9 + 3 * len(legs()), len(legs())))
    file = file_of(tmp_path, weights, action={"scale": 0.25, "springs": springs}, **GAINS)
    monkeypatch.setattr("solfer.policy.environment.read_bundle", lambda path: perfect())
    with closing(PromptWorld()) as world, closing(made(file)) as environment:
        plugin = world.plugin("test", file, POLICY)
        world.run(3.0)
        run = plugin.component.network.run
        ran = []
        plugin.component.network.run = lambda: (run(), ran.append(world.bus.time))
        while not ran:
            world.run(0.001)
        simulation = environment.simulation

        def follow():
            simulation.q[:] = world.simulation.q
            simulation.v[:] = world.simulation.v
            simulation.state.now.expire()

        def step():
            world.run(0.001)
            follow()

        simulation.reset = lambda seed: (type(simulation).reset(simulation, seed=seed), follow())
        simulation.step = step
        environment.reset(seed=1)
        ours = environment.component
        theirs = plugin.component
        largest = np.zeros(6)
        moved = 0.0
        pulled = [each.lower_level.controller("position_controller") for each in (simulation, world.simulation)]
        for _ in range(50):
            target = theirs._target.copy()
            environment.step(theirs.network.actions)
            assert len(ran) == ours.steps + 1
            pairs = [
                (ours._observations._result, theirs._observations._result),
                (ours._target, target),
                *([getattr(each, field) for each in pulled] for field in ("position", "effort", "stiffness", "damping")),
            ]
            moved = max(moved, np.abs(target - ours.contract.default).max())
            largest = np.maximum(largest, [np.abs(one - other).max() for one, other in pairs])
        assert largest.max() < 1e-12 and moved > 1e-3, (largest, moved)
