"""Trains a network by an evolution strategy: CENTAURO keeps its pelvis level on a slope, by hips and knees of its legs.

    pip install ".[policy]"
    ./run exec python examples/policy/level.py --minutes 10    # writes level.onnx beside this file
    ./run exec python examples/policy/level.py --minutes 0     # only compares it with no network

The world does not move: each episode begins on a plane that rises by 5 degrees, in a direction that is drawn, and the
pelvis is pushed by up to 100 N meanwhile. The network observes gravity and angular velocity in the axes of the pelvis.
The reward is the negative tilt. Seeds of the comparison are not those of training, and its plane rises by 3 degrees as
well. Figures are mean and largest tilt [degrees] from 1.2 s after the start on, without and with the network.
"""

import argparse
import tempfile
import time
from collections.abc import Callable
from functools import cache
from multiprocessing import get_context
from multiprocessing.pool import Pool
from pathlib import Path

import numpy as np

from solfer.components.policy.network import PolicyNetwork
from solfer.policy import Environment, write_layers
from solfer.simulation.robot_body.placement import StartPlacement

HERE = Path(__file__).parent
CORNERS = (1, 1), (1, -1), (-1, 1), (-1, -1)
"""Where the legs stand: signs of x and y."""

BENDS = -1, 1, 1, -1
"""Signs of the joints with which they bend."""

HIDDEN = 4
"""Hidden numbers of each leg."""

PAIRS, NOISE, RATE = 6, 0.2, 0.5
"""Pairs of networks in an iteration, how far they are from the present one, and how far that moves."""

Weights = np.ndarray


def reward(environment: Environment) -> tuple[float, bool]:
    """Return the negative tilt [degrees], and whether the robot has fallen."""
    return -float(np.degrees(environment.tilt)), environment.tilt > 0.6


def begin(environment: Environment) -> None:
    """Draw where the robot looks, and a push."""
    random = environment.random
    simulation = environment.simulation
    simulation.reset(placement=StartPlacement(yaw=random.uniform(-np.pi, np.pi)), seed=int(random.integers(2**31)))
    force = *random.uniform(-100.0, 100.0, 2), 0.0
    simulation.pushes.add("pelvis", force, (0.0, 0.0, 0.0), duration=4.0)


@cache
def environment(degrees: float) -> Environment:
    """Make the environment on a slope, once for a process."""
    with tempfile.TemporaryDirectory() as folder:
        world = Path(folder) / "slope.yaml"
        world.write_text(f"ground: {{slope: {np.radians(degrees)}}}\n")
        return Environment(HERE / "level.yaml", "level", "centauro", reward, begin=begin, duration=2.5, world=world)


def layers(weights: Weights) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return weights and offsets of both layers: each leg has the same small network, mirrored to its corner."""
    inner, inner_offset, outer, outer_offset = np.split(weights, np.cumsum((4 * HIDDEN, HIDDEN, 2 * HIDDEN)))
    first = np.zeros((4, 4 * HIDDEN))
    second = np.zeros((4 * HIDDEN, 8))
    offset = np.zeros(8)
    for leg, (along, aside) in enumerate(CORNERS):
        own = slice(leg * HIDDEN, (leg + 1) * HIDDEN)
        # gravity x and y, angular velocity x and y; a turn about x tilts sideways
        first[:, own] = np.array((along, aside, aside, along))[:, None] * inner.reshape(4, HIDDEN)
        second[own, leg::4] = BENDS[leg] * outer.reshape(HIDDEN, 2)
        offset[leg::4] = BENDS[leg] * outer_offset
    return [(first, np.tile(inner_offset, 4)), (second, offset)]


def acting(network: Weights | Path | None) -> Callable[[np.ndarray], np.ndarray]:
    """Return what maps observations to actions: weights, a file as the plugin runs it, or nothing."""
    if network is None:
        return lambda observed: np.zeros(8)
    if isinstance(network, Path):
        ran = PolicyNetwork(network)

        def act(observed: np.ndarray) -> np.ndarray:
            ran.observations[:] = observed
            ran.run()
            return ran.actions

        return act
    (first, first_offset), (second, second_offset) = layers(network)
    return lambda observed: np.tanh(observed @ first + first_offset) @ second + second_offset


def tilts(job: tuple[Weights | Path | None, float, int]) -> np.ndarray:
    """Return the tilt [degrees] in each step of an episode from 1.2 s on, shape (n,)."""
    network, degrees, seed = job
    act = acting(network)
    robot = environment(degrees)
    observed, _ = robot.reset(seed=seed)
    found = []
    ended = False
    while not ended:
        observed, earned, fell, is_over, _ = robot.step(act(observed))
        found.append(-earned)
        ended = fell or is_over
    return np.full(1, 90.0) if fell else np.array(found[60:])


def train(pool: Pool, minutes: float, iterations: int, seed: int) -> Weights:
    """Return the weights that an evolution strategy finds: ranks of mirrored pairs, each pair in the same episode."""
    random = np.random.default_rng(seed)
    weights = 0.3 * random.normal(size=7 * HIDDEN + 2)
    begun = time.monotonic()
    for iteration in range(iterations):
        if time.monotonic() - begun > 60.0 * minutes:
            break
        steps = random.normal(size=(PAIRS, len(weights)))
        jobs = [
            (weights + sign * NOISE * step, 5.0, int(episode))
            for step, episode in zip(steps, random.integers(10**6, 10**9, PAIRS), strict=True)
            for sign in (1.0, -1.0)
        ]
        costs = np.array([each.mean() for each in pool.imap(tilts, jobs)])
        gains = np.diff(costs.reshape(-1, 2)).ravel()  # how much better the first of a pair is
        gains /= np.abs(gains).max() + 1e-9
        weights = weights + RATE * gains @ steps / PAIRS
        print(f"{iteration:4d} {time.monotonic() - begun:6.0f} s: {np.median(costs):.2f} degrees", flush=True)
    return weights


def compare(pool: Pool, file: Path, episodes: int) -> None:
    """Print tilts without and with the network, in episodes that training does not have."""
    for degrees in (5.0, 3.0):
        for name, each in (("without", None), ("with", file)):
            found = np.concatenate(pool.map(tilts, [(each, degrees, seed) for seed in range(episodes)]))
            print(f"{degrees:.0f} degrees, {name}: mean {found.mean():.2f}, largest {found.max():.2f}")


def main() -> None:
    """Train, write the network, and compare."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=10.0, help="longest time of training")
    parser.add_argument("--iterations", type=int, default=10**6, help="most iterations of training")
    parser.add_argument("--episodes", type=int, default=10, help="episodes of the comparison")
    parser.add_argument("--seed", type=int, default=0, help="seed of training")
    parser.add_argument("--output", type=Path, default=HERE / "level.onnx", help="file of the network")
    options = parser.parse_args()
    with get_context("spawn").Pool(2) as pool:
        if options.minutes > 0.0:
            weights = train(pool, options.minutes, options.iterations, options.seed)
            write_layers(options.output, layers(weights))
        compare(pool, options.output, options.episodes)


if __name__ == "__main__":
    main()
