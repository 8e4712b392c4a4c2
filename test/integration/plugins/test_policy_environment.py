"""What trains a policy and what runs it are one definition: `Environment` beside the plugin, on CENTAURO."""

from contextlib import closing
from functools import partial

import numpy as np
import pytest
from support.integration.world import CONFIG, World, perfect
from support.plugins.policies import POLICY, draw, file_of, legs, made

from solfer.errors import ComponentError
from solfer.policy import Environments
from solfer.simulation import Rates, Simulation, SimulationServer

pytest.importorskip("onnxruntime", reason="needs pip install -r requirements-policy.txt")

FIELDS = "position", "effort", "stiffness", "damping"
TORQUES = {"file": str(CONFIG / "support/torques.yaml")}
GAINS = {"gains": {"stiffness": 2000.0, "damping": 50.0}, "secondary_file": TORQUES}


class PromptWorld(World):
    """A World whose sensors measure and publish in each millisecond, and whose plugin cycles behind each fifth step.

    On the bus, rounding of times decides which of the two comes first.
    """

    steps = 0

    def step(self, plugin):
        """Let a millisecond pass."""
        self.steps += 1
        self.bus.run_until(0.001 * self.steps + 0.0005)
        if self.steps % 5 == 0:
            plugin.cycle()

    def offer(self, middleware):
        simulation = Simulation.from_file(perfect())
        return simulation, SimulationServer(simulation, middleware, Rates(joints=1000.0, base=1000.0, imu=1000.0))


@pytest.mark.parametrize("springs", ["lower_level", pytest.param("plugin", marks=pytest.mark.soak)])
def test_observations_and_targets_are_the_plugins(tmp_path, springs, monkeypatch):
    """The environment's robot is where that of the plugin is, in each millisecond: then all numbers are the same."""
    weights = np.random.default_rng(1).normal(scale=0.01, size=(9 + 3 * len(legs()), len(legs())))
    file = file_of(tmp_path, weights, action={"scale": 0.25, "springs": springs}, **GAINS)
    monkeypatch.setattr("solfer.policy.environment.read_bundle", lambda path: perfect())
    with closing(PromptWorld()) as world, closing(made(file)) as environment:
        plugin = world.plugin("test", file, POLICY)
        world.asleep.add("test")
        run = plugin.component.network.run
        ran = []
        plugin.component.network.run = lambda: (run(), ran.append(world.steps))
        while not ran or ran[-1] < 1500:
            world.step(plugin)
        ran.clear()
        simulation = environment.simulation

        def follow():
            simulation.q[:] = world.simulation.q
            simulation.v[:] = world.simulation.v
            simulation.state.now.expire()

        def step():
            world.step(plugin)
            follow()

        simulation.reset = lambda seed: (type(simulation).reset(simulation, seed=seed), follow())
        simulation.step = step
        environment.reset(seed=1)
        ours = environment.component
        theirs = plugin.component
        largest = np.zeros(6)
        moved = 0.0
        pulled = [each.lower_level.controller("position_controller") for each in (simulation, world.simulation)]
        for _ in range(25):
            target = theirs._target.copy()
            environment.step(theirs.network.actions)
            assert len(ran) == ours.steps
            pairs = [
                (ours._observations._result, theirs._observations._result),
                (ours._target, target),
                *(
                    [getattr(each, field) for each in pulled]
                    for field in ("position", "effort", "stiffness", "damping")
                ),
            ]
            moved = max(moved, np.abs(target - ours.contract.default).max())
            largest = np.maximum(largest, [np.abs(one - other).max() for one, other in pairs])
        assert largest.max() < 1e-12 and moved > 1e-3, (largest, moved)


def episode(environment, seed, count=3):
    """Return observations and rewards of some steps with actions that are drawn."""
    random = np.random.default_rng(seed)
    observed, _ = environment.reset(seed=seed)
    found = [observed]
    for _ in range(count):
        observed, reward, terminated, truncated, info = environment.step(random.uniform(-0.1, 0.1, len(legs())))
        assert not terminated and not info
        found.append(np.append(observed, reward))
    assert truncated
    return np.concatenate(found)


def test_a_seed_draws_an_episode(tmp_path):
    """Equal seeds give equal numbers to the last bit, with noise and all that is drawn."""
    file = file_of(tmp_path)
    make = partial(made, file, begin=draw, duration=0.06)
    (tmp_path / "network.onnx").unlink()  # it need not be there yet
    with closing(make()) as environment:
        first = episode(environment, 1)
        assert environment.observation_space.shape == (len(environment.component.network.observations),)
        assert not np.array_equal(episode(environment, 2), first)
        assert np.array_equal(episode(environment, 1), first)
        assert environment.simulation.body.mass() == pytest.approx(0.9 * 116.07, rel=0.01)


@pytest.mark.soak
def test_processes_draw_the_same_episodes(tmp_path):
    """Each has a seed of its own; what it draws and steps is what one process would."""
    make = partial(made, file_of(tmp_path), begin=draw, duration=0.06)
    with closing(Environments(make, 1)) as environments:
        observed, _ = environments.reset(seed=3)
        seed = int(np.random.SeedSequence(3).generate_state(1)[0])
        with closing(make()) as environment:
            assert np.array_equal(observed[0], environment.reset(seed=seed)[0])
            rests = np.zeros(len(legs()))
            for _ in range(3):
                own = environment.step(rests)
                observed, rewards, _, truncated, infos = environments.step(rests[None])
                assert rewards[0] == own[1]
            assert truncated[0] and np.array_equal(infos[0]["final_observation"], own[0])
            assert np.array_equal(observed[0], environment.reset()[0])


def test_sensors_without_errors_measure_the_truth(tmp_path, monkeypatch):
    """What an IMU that is mounted elsewhere says of the base, and encoders of the joints."""
    monkeypatch.setattr("solfer.policy.environment.read_bundle", lambda path: perfect())
    with closing(made(file_of(tmp_path))) as environment:
        environment.reset(seed=1)
        environment.velocity[:] = 0.1
        environment.simulation.pushes.add("pelvis", (300.0, 200.0, 0.0), (50.0, 50.0, 50.0), 0.5)
        for _ in range(5):
            environment.step(np.zeros(len(legs())))
        bench = environment._bench
        bench.measure()
        state = environment.robot.state
        truth = np.concatenate((state.position, state.velocity))
        bench._senses = True
        state.position[:] = state.velocity[:] = 0.0
        bench.measure()
        assert np.abs(truth[:6]).max() > 1e-3 and np.abs(state.velocity[3:6]).max() > 1e-3
        assert np.concatenate((state.position, state.velocity)) == pytest.approx(truth, abs=1e-9)


def test_a_fault_ends_an_episode(tmp_path):
    with closing(made(file_of(tmp_path))) as environment:
        environment.reset(seed=1)
        _, _, terminated, _, info = environment.step(np.full(len(legs()), np.nan))
        assert terminated and "is not finite" in info["fault"]
    with closing(made(file_of(tmp_path, default=legs() | {"torso_yaw": 1.0}))) as environment:
        with pytest.raises(ComponentError, match="'torso_yaw' is -1.0"):
            environment.reset()
